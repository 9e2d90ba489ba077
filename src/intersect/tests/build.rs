//! Building, and queries on small scenes with known answers.

use super::*;
use crate::geometry::Sphere;
use crate::intersect::{BackendError, Hit, check_count};

fn quad(z: f32) -> Shape {
    let positions = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, z)).to_vec();
    Shape::Mesh(Mesh { positions, normals: vec![], triangles: vec![[0, 1, 2], [0, 2, 3]] }.into())
}

/// Whether a hit is at these numbers. The last place is Embree's estimate of a reciprocal, in which processors differ.
fn is_at(hit: &Hit, t: f32, u: f32, v: f32) -> bool {
    [(hit.t, t), (hit.u, u), (hit.v, v)].iter().all(|(x, truth)| (x - truth).abs() <= 1e-6 * truth.abs())
}

#[test]
fn hits_name_shape_primitive_and_place() {
    let sphere = Shape::Sphere(Sphere { center: Vec3::new(5.0, 0.0, 0.0), radius: 1.0 });
    for b in backends(&[quad(0.0), Shape::Mesh(Default::default()), sphere, quad(2.0)]) {
        let name = b.describe();
        let hit = b.closest(&half_line(Vec3::new(0.5, -0.25, 4.0), Vec3::new(0.0, 0.0, -2.0))).unwrap();
        assert_eq!((hit.shape, hit.primitive), (3, 0), "{name}");
        // (x, y) = (-1, -1) + u (2, 0) + v (2, 2)
        assert!(is_at(&hit, 1.0, 0.375, 0.375), "{hit:?}, {name}");
        let hit = b.closest(&half_line(Vec3::new(5.0, 0.0, 9.0), Vec3::NEG_Z)).unwrap();
        assert_eq!((hit.shape, hit.primitive, hit.t, hit.u, hit.v), (2, 0, 8.0, 0.0, 0.0), "{name}");
        let hit = b.closest(&half_line(Vec3::new(5.0, 0.0, 0.0), Vec3::new(0.0, 0.5, 0.0))).unwrap();
        assert_eq!((hit.shape, hit.t), (2, 2.0), "from inside, {name}");
        assert!(b.closest(&half_line(Vec3::new(3.0, 0.0, 9.0), Vec3::NEG_Z)).is_none(), "{name}");
        assert!(b.memory() > 0, "{name}");
    }
}

#[test]
fn segments_end_where_they_say() {
    let sphere = Shape::Sphere(Sphere { center: Vec3::new(5.0, 0.0, -1.0), radius: 1.0 });
    for b in backends(&[quad(0.0), sphere]) {
        for x in [0.25, 5.0] {
            for (t_max, expected) in [(0.5, true), (0.50001, true), (0.49999, false), (0.0, false)] {
                let ray = Ray { origin: Vec3::new(x, 0.0, 1.0), direction: Vec3::new(0.0, 0.0, -2.0), t_max };
                let says = (b.closest(&ray).is_some(), b.occluded(&ray));
                assert_eq!(says, (expected, expected), "x = {x}, t_max = {t_max}, {}", b.describe());
            }
            let behind = half_line(Vec3::new(x, 0.0, 1.0), Vec3::Z);
            assert!(b.closest(&behind).is_none() && !b.occluded(&behind));
        }
    }
}

#[test]
fn an_empty_scene_is_never_hit() {
    for shapes in [vec![], vec![Shape::Mesh(Default::default())]] {
        for b in backends(&shapes) {
            let ray = half_line(Vec3::ZERO, Vec3::X);
            assert!(b.closest(&ray).is_none() && !b.occluded(&ray), "{}", b.describe());
        }
    }
}

#[test]
fn what_no_backend_can_hold_is_refused_by_name() {
    let with = |index: u32, y: f32| {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::new(0.0, y, 0.0)];
        vec![
            quad(0.0),
            Shape::Mesh(Mesh { positions, normals: vec![], triangles: vec![[0, 1, 2], [0, 1, index]] }.into()),
        ]
    };
    let sphere = |radius: f32| vec![Shape::Sphere(Sphere { center: Vec3::ZERO, radius })];
    let cases = [
        (with(3, 1.0), "shape 1, triangle 1"),
        (with(2, f32::NAN), "shape 1, vertex 2"),
        (with(2, 2e18), "shape 1, vertex 2"),
        (sphere(0.0), "shape 0: sphere"),
        (sphere(f32::NAN), "shape 0: sphere"),
    ];
    for (shapes, words) in cases {
        for backend in [Backend::Embree, Backend::Obvhs] {
            match build(backend, &shapes, Build::Static, 1) {
                Err(BackendError::Missing(name)) => assert!(name == "embree" && !cfg!(feature = "embree")),
                Err(e) => assert!(e.to_string().contains(words), "{e}"),
                Ok(_) => panic!("{backend:?} took {words}"),
            }
        }
    }
    assert!(check_count([1 << 29, 1 << 29].into_iter()).is_ok());
    let error = check_count([1 << 30, u64::MAX].into_iter()).unwrap_err().to_string();
    assert!(error.contains("at most 1073741824"), "{error}");
}

#[test]
fn identical_and_flat_primitives_build_and_the_first_of_them_is_hit() {
    // No split separates them: the tree must stay shallow enough and lose none.
    let one = [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 0.0)];
    let count = 3000;
    let mesh = Mesh { positions: one.to_vec(), normals: vec![], triangles: vec![[0, 1, 2]; count] };
    for b in backends(&[Shape::Mesh(mesh.into())]) {
        let hit = b.closest(&half_line(Vec3::new(0.0, 0.0, 1.0), Vec3::NEG_Z)).unwrap();
        assert!(is_at(&hit, 1.0, 0.25, 0.5) && (hit.primitive as usize) < count, "{hit:?}, {}", b.describe());
        if b.describe().starts_with("obvhs") {
            assert_eq!(hit.primitive, 0);
        }
    }
}

#[test]
fn hits_do_not_depend_on_the_number_of_build_threads() {
    let shapes = [Shape::Mesh(soup(&mut Random::new(5), 20_000, 0.03, 1.0, Vec3::ZERO).into())];
    let backend = Backend::default();
    let [one, two] = [1, 2].map(|threads| build(backend, &shapes, Build::Static, threads).unwrap());
    let mut random = Random::new(6);
    for _ in 0..20_000 {
        let ray = half_line(random.cube() * 3.0, random.direction());
        assert_eq!(one.closest(&ray), two.closest(&ray));
    }
}

/// The mesh that stays is the same to Embree, and no worse for it: also behind a sphere that was elsewhere, and when the first
/// ray tracer is gone.
#[test]
#[cfg(feature = "embree")]
fn an_editable_build_keeps_what_stays() {
    let mut random = Random::new(8);
    let stays = Shape::Mesh(soup(&mut random, 20_000, 0.05, 1.0, Vec3::ZERO).into());
    let sphere = |y: f32| Shape::Sphere(Sphere { center: Vec3::Y * y, radius: 0.4 });
    let (before, after) = ([stays.clone(), sphere(-0.2), quad(0.0)], [quad(0.5), stays, sphere(0.3)]);
    let rays: Vec<Ray> = (0..20_000).map(|_| half_line(random.cube() * 3.0, random.direction())).collect();
    let hits = |with: &dyn Intersector| rays.iter().map(|ray| with.closest(ray)).collect::<Vec<_>>();

    let first = build(Backend::Embree, &before, Build::Editable, 2).unwrap();
    let (answers, bytes) = (hits(&*first), first.memory());
    let second = first.rebuilt(&after, 2).expect("a second").unwrap();
    // Of the shapes alone, not of both ray tracers.
    assert!(second.memory() < bytes + bytes / 4 && second.memory() > bytes / 2, "{} {bytes}", second.memory());
    assert!(hits(&*first) == answers);
    drop(first);
    let fresh = build(Backend::Embree, &after, Build::Editable, 2).unwrap();
    let found = hits(&*second);
    assert!(found == hits(&*fresh));
    let plain = hits(&*build(Backend::Embree, &after, Build::Static, 2).unwrap());
    let shape = |hit: &Option<Hit>| hit.map(|hit| hit.shape);
    assert!(found.iter().zip(&plain).all(|(a, b)| shape(a) == shape(b)));
    let of = |shape: u32| found.iter().flatten().filter(|hit| hit.shape == shape).count();
    assert!([0, 1, 2].iter().all(|&shape| of(shape) > 20), "{:?}", [of(0), of(1), of(2)]);
    assert!(build(Backend::Obvhs, &after, Build::Editable, 1).unwrap().rebuilt(&before, 1).is_none());
}
