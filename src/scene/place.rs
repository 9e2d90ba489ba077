//! The shapes of a scene in world space: instances flattened. What is made of what does not matter here, so that scenes
//! that differ in that alone share them.

use super::description::{Description, Geometry, Instance, Material, Medium, MeshDescription};
use super::{SceneError, Warning};
use crate::geometry::{Enclosure, Mesh, Shape, Sphere};
use crate::intersect::MAX_COORDINATE;
use crate::text::shown;
use glam::{DMat3, Vec3};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// The shapes of all instances, of `meshes`; those of equal hashes are one mesh, with those in `kept`, too.
pub(super) fn place(
    d: &Description,
    meshes: &[Arc<MeshDescription>],
    hashes: &[u64],
    kept: impl Iterator<Item = (u64, Shape)>,
) -> Result<Vec<Shape>, SceneError> {
    let mut known: HashMap<u64, Shape> = kept.collect();
    let mut shapes = reserve(d.instances.len())?;
    for (index, (instance, hash)) in d.instances.iter().zip(hashes).enumerate() {
        // What is no such thing has another hash but for chance.
        if let Some(shape) = known.get(hash).filter(|shape| is_alike(shape, instance.geometry, meshes)) {
            shapes.push(shape.clone());
            continue;
        }
        shapes.push(match instance.geometry {
            Geometry::Sphere { radius } => {
                let placed = place_sphere(instance, radius);
                check_sphere(index, instance, &placed)?;
                Shape::Sphere(placed)
            }
            Geometry::Mesh(mesh) => {
                let placed = place_mesh(instance, &meshes[mesh])?;
                check_mesh(index, instance, &placed)?;
                let shape = Shape::Mesh(placed.into());
                known.insert(*hash, shape.clone());
                shape
            }
        });
    }
    Ok(shapes)
}

/// Whether it may be that.
fn is_alike(shape: &Shape, geometry: Geometry, meshes: &[Arc<MeshDescription>]) -> bool {
    match (shape, geometry) {
        (Shape::Mesh(placed), Geometry::Mesh(mesh)) => {
            let mesh = &meshes[mesh];
            (placed.positions.len(), placed.normals.len(), placed.triangles.len())
                == (mesh.positions.len(), mesh.normals.len(), mesh.triangles.len())
        }
        (Shape::Sphere(_), Geometry::Sphere { .. }) => true,
        _ => false,
    }
}

/// Things worth telling of the shapes; once for each mesh. `media` of each material: inside and outside, if it refracts.
pub(super) fn warnings(
    d: &Description,
    shapes: &[Shape],
    media: impl Fn(usize) -> Option<(Medium, Medium)>,
) -> Vec<Warning> {
    let (mut warnings, mut seen, mut seen_with) = (Vec::new(), HashSet::new(), HashSet::new());
    for (index, (instance, shape)) in d.instances.iter().zip(shapes).enumerate() {
        let mut warn = |what: &str| warnings.push(Warning::of(index, &instance.name, what));
        let Material { name, scattering, .. } = &d.materials[instance.material];
        if let (Geometry::Mesh(of), Shape::Mesh(mesh)) = (instance.geometry, shape)
            && seen.insert(of)
        {
            let flat = (0..mesh.triangles.len() as u32).filter(|&t| mesh.area(t) == 0.0).count();
            if flat > 0 {
                warn(&format!("{flat} triangles without area are never hit"));
            }
            if mesh.triangles.is_empty() {
                warn("it has no triangles");
            }
        }
        let (media, thin) = (media(instance.material), scattering.is_thin_by_default());
        let of = if let Geometry::Mesh(of) = instance.geometry { Some(of) } else { None };
        if media.is_none() && !thin || !seen_with.insert((of, instance.material)) {
            continue;
        }
        let (enclosure, sealed) = match shape {
            Shape::Mesh(mesh) => (mesh.enclosure(), mesh.is_sealed()),
            Shape::Sphere(_) => (Enclosure::Outward, true),
        };
        if enclosure == Enclosure::Inward && media.is_some() {
            warn(
                "closed glass whose triangles face inward has its glass around it, which is right for a hollow within other \
                 glass only",
            );
        }
        let absorbs = |(inside, outside): (Medium, Medium)| inside.absorption != outside.absorption;
        if !sealed && media.is_some_and(absorbs) {
            warn(
                "its medium absorbs and is not closed: light that gets in or out beside the surface is absorbed where it \
                 should not be, or not at all",
            );
        }
        if enclosure.is_body() && sealed && thin {
            warn(&format!(
                "it is closed, but its material '{}' transmits as a thin wall does: straight on, without caustics, unless it is \
                 made solid (in glTF: by a thickness above 0)",
                shown(name)
            ));
        }
    }
    warnings
}

fn place_sphere(instance: &Instance, radius: f64) -> Sphere {
    let t = &instance.transform;
    Sphere { center: t.translation.as_vec3(), radius: (radius * t.matrix3.x_axis.length()) as f32 }
}

fn place_mesh(instance: &Instance, mesh: &MeshDescription) -> Result<Mesh, SceneError> {
    let t = &instance.transform;
    let mut positions = reserve(mesh.positions.len())?;
    positions.extend(mesh.positions.iter().map(|&p| t.transform_point3(Vec3::from(p).as_dvec3()).as_vec3()));
    // Normals go with the inverse transpose; its sign is that of the front side (see below).
    let normal_matrix: DMat3 = t.matrix3.inverse().transpose();
    let mut normals = reserve(mesh.normals.len())?;
    normals.extend(
        mesh.normals.iter().map(|&n| (normal_matrix * Vec3::from(n).as_dvec3().normalize()).normalize().as_vec3()),
    );
    let mut triangles = reserve(mesh.triangles.len())?;
    // A mirroring transform turns the winding round; swapping two vertices keeps the front in front.
    let mirrored = t.matrix3.determinant() < 0.0;
    triangles.extend(mesh.triangles.iter().map(|&[a, b, c]| if mirrored { [a, c, b] } else { [a, b, c] }));
    Ok(Mesh { positions, normals, triangles })
}

/// What only the placed sphere can show: its size, and that it is of one.
fn check_sphere(index: usize, instance: &Instance, sphere: &Sphere) -> Result<(), SceneError> {
    let Sphere { center, radius } = *sphere;
    let small = |p: Vec3| p.abs().max_element() <= MAX_COORDINATE;
    if radius > 0.0 && small(Vec3::splat(radius)) && small(center) {
        return Ok(());
    }
    Err(SceneError::Invalid {
        kind: "instance",
        index,
        name: instance.name.clone(),
        field: "transform".to_owned(),
        value: format!("one to {center} with a radius of {radius}"),
        expected: "coordinates and a radius below 1e18 were expected, the radius above 0".to_owned(),
    })
}

/// What only the placed mesh can show: overflow of the transform.
fn check_mesh(index: usize, instance: &Instance, mesh: &Mesh) -> Result<(), SceneError> {
    let large = |(_, p): &(usize, &Vec3)| !(p.abs().max_element() <= MAX_COORDINATE);
    let Some((i, p)) = mesh.positions.iter().enumerate().find(large) else { return Ok(()) };
    Err(SceneError::Invalid {
        kind: "instance",
        index,
        name: instance.name.clone(),
        field: "transform".to_owned(),
        value: format!("one of position {i} to {p}"),
        expected: "coordinates below 1e18 were expected".to_owned(),
    })
}

/// Around the box around all shapes.
pub(super) fn bounding_sphere(shapes: &[Shape]) -> (Vec3, f32) {
    let (lo, hi) = shapes.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), s| {
        let (a, b) = s.bounds();
        (lo.min(a), hi.max(b))
    });
    if lo.x > hi.x {
        return (Vec3::ZERO, 1.0);
    }
    let center = lo * 0.5 + hi * 0.5;
    // A little larger, so that the emission disk of a distant light lies outside in spite of rounding.
    (center, ((hi - center).length() * 1.001).max(f32::MIN_POSITIVE))
}

/// A vector with room for `n`, or an error instead of an abort.
pub(super) fn reserve<T>(n: usize) -> Result<Vec<T>, SceneError> {
    let mut v = Vec::new();
    match v.try_reserve_exact(n) {
        Ok(()) => Ok(v),
        Err(_) => Err(SceneError::OutOfMemory(format!("no memory for {n} elements of {} bytes", size_of::<T>()))),
    }
}
