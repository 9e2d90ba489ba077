//! The weight of every path that the bidirectional path tracer really samples, against the definition:
//! all densities of all techniques evaluated again from the vertices alone.
//!
//! The definition's shares of a path are a function of its vertices and sum to one. If whichever
//! technique made the path carries its share, the techniques' weights of that path sum to one.

mod common;

use caustica::camera::{Camera, Endpoint, Region};
use caustica::emitter::Lights;
use caustica::geometry::ray::segment;
use caustica::geometry::{Aim, Ray, Reach};
use caustica::integrator::bdpt::{self, View};
use caustica::integrator::{Contribution, Observer, Sample};
use caustica::math::{Rgb, Sampler, Stream};
use caustica::scatter::{Bsdf, TransportMode};
use caustica::scene::World;
use caustica::scene::description::*;
use caustica::transport::aim::{Aimed, glass};
use caustica::transport::options::{self, CausticOptions, GeometryTerm, MOST_SEEDS};
use caustica::transport::roulette::Roulette;
use caustica::transport::vertex::{EdgeRecord, on_path};
use caustica::transport::{Tracer, Vertex};
use common::{Builder, icosphere, scenes};
use glam::{DAffine3, DVec2, DVec3, Vec2, Vec3};

/// A compressed path, camera end first, without the camera and the light vertex themselves.
struct FullPath<'a> {
    world: &'a World,
    /// As the tracer sees them.
    bsdfs: &'a [Bsdf],
    lights: &'a Lights,
    aim: Option<&'a Aim>,
    light_subpaths: f64,
    camera: &'a Camera,
    vertices: Vec<&'a Vertex>,
    /// Macro-edge i leads from z_i to z_{i+1}; the direction into it at z_i, and at z_{i+1}.
    edges: Vec<(EdgeRecord, Vec3, Vec3)>,
    light: &'a caustica::transport::LightVertex,
}

impl FullPath<'_> {
    fn new<'a>(check: &Check<'a>, c: &Contribution<'a>) -> FullPath<'a> {
        let Check { world, bsdfs, lights, aim, light_subpaths, camera, .. } = *check;
        let camera_side = on_path(c.camera).count();
        let vertices: Vec<&Vertex> = on_path(c.camera).chain(on_path(c.light).rev()).collect();
        let mut edges: Vec<(EdgeRecord, Vec3, Vec3)> = Vec::new();
        for z in on_path(c.camera) {
            edges.push((z.edge, z.edge.departure, z.wo));
        }
        let point = |i: usize| vertices.get(i).map(|v| v.at.p);
        let light_point = match &c.start.at {
            Endpoint::Surface(at) => Some(at.p),
            Endpoint::Point(p) => Some(*p),
            Endpoint::Infinite(_) => None,
        };
        // The edge that the technique joined, if any, has no chain.
        match c.hit {
            Some(hit) => edges.push((
                hit.edge,
                hit.edge.departure,
                if hit.edge.chain > 0 { hit.direction } else { -hit.edge.departure },
            )),
            None => {
                let i = camera_side;
                let to = if i < vertices.len() { point(i) } else { light_point };
                let w = match (i.checked_sub(1).and_then(point), to) {
                    (Some(p), Some(q)) => segment(p, q).0,
                    (Some(_), None) => match c.start.at {
                        Endpoint::Infinite(w) => w,
                        _ => unreachable!(),
                    },
                    // From the camera: its own direction is not needed.
                    (None, Some(q)) => camera.connect(q).map_or(Vec3::ZERO, |seen| -seen.wi),
                    (None, None) => unreachable!(),
                };
                edges.push(match c.chain {
                    None => (EdgeRecord { sure: true, ..EdgeRecord::default() }, w, -w),
                    Some(chain) => {
                        // The camera's cosine is 1, as that of a light at a point or at infinity.
                        let cos_a = i.checked_sub(1).map_or(1.0, |k| vertices[k].cos_g(chain.first).into());
                        let cos_b = match (vertices.get(i), &c.start.at) {
                            (Some(b), _) => b.cos_g(chain.last).into(),
                            (None, Endpoint::Surface(y)) => y.ng.dot(chain.last).abs().into(),
                            (None, _) => 1.0,
                        };
                        let record = EdgeRecord {
                            chain: chain.len as u32,
                            chain_probability: chain.probability,
                            etendue_ratio: chain.etendue_ratio(cos_a, cos_b),
                            technique: chain.presumed * chain.weight_inverse_jacobian / cos_b,
                            sure: chain.smooth && chain.presumed == 1.0,
                            departure: chain.first,
                            shapes: chain.shapes,
                            ..EdgeRecord::default()
                        };
                        (record, chain.first, chain.last)
                    }
                });
            }
        }
        for y in on_path(c.light).rev() {
            edges.push((y.edge, y.wo, y.edge.departure));
        }
        // No chain with an interface that is rough is found again for sure.
        for (record, ..) in edges.iter().filter(|(record, ..)| record.sure) {
            let bsdf = |shape: &u32| &bsdfs[world.shape_material[*shape as usize] as usize];
            let mut crossed = record.shapes.iter().take(record.chain as usize).map(bsdf);
            assert!(crossed.all(|bsdf| bsdf.walked_refraction().is_some_and(|r| r.alpha == 0.0)), "{record:?}");
        }
        FullPath { world, bsdfs, lights, aim, light_subpaths, camera, vertices, edges, light: c.start }
    }

    /// Densities of both directions at z_i (1 <= i < m): of leaving toward z_{i+1}, toward z_{i-1}.
    fn turns(&self, i: usize) -> (f64, f64) {
        let v = self.vertices[i - 1];
        let (to_camera, to_light) = (self.edges[i - 1].2, self.edges[i].1);
        let plain = &self.bsdfs[self.world.shape_material[v.at.shape as usize] as usize];
        let walked = !std::ptr::eq(self.bsdfs, &self.world.bsdfs[..]);
        let e = self.world.bsdf(plain, &v.at, walked, None, &mut None).evaluate(
            &v.at,
            to_camera,
            to_light,
            TransportMode::Radiance,
        );
        // In f32 like the scattering's own densities.
        let mut toward_camera = e.pdf_reverse;
        // Of the light subpaths that arrive, a share goes to the glass, if there is any before the surface.
        if let Some(aim) = self.aim.filter(|aim| aim.share(v.at.shape) > 0.0) {
            let reach = Reach::above(if v.at.ng.dot(to_light) > 0.0 { v.at.ng } else { -v.at.ng });
            let total = aim.targets().total(v.at.p, &reach);
            if total > 0.0 {
                let share = aim.share(v.at.shape);
                let aimed = aim.targets().density(v.at.p, &reach, total, to_camera);
                toward_camera = (1.0 - share) * toward_camera + share * aimed as f32;
            }
        }
        (e.pdf.into(), toward_camera.into())
    }

    /// All shares, by the definition P_i = a_i prod F prod R, in logarithms.
    fn shares(&self) -> Vec<f64> {
        let m = self.edges.len();
        let cos = |i: usize, w: Vec3| self.vertices[i - 1].at.ng.dot(w).abs() as f64;
        let light_cos = |w: Vec3| match &self.light.at {
            Endpoint::Surface(at) => at.ng.dot(w).abs() as f64,
            _ => 1.0,
        };
        let receiver = if m >= 2 { self.vertices[m - 2].at.p } else { Vec3::ZERO };
        let lights = self.lights;
        let shapes = &self.world.shapes;
        let ray = (self.edges[m - 1].2, self.light.through);
        let light = lights.densities(shapes, self.light.light, &self.light.at, ray, receiver);
        // Geometry of edge i: factors from a density at z_i to one at z_{i+1}, and back.
        let geometry = |i: usize| -> (f64, f64) {
            let (record, from_camera, from_light) = &self.edges[i];
            if record.chain > 0 {
                let [toward_light, toward_camera] = record.chain_probability;
                return (toward_light, toward_camera * record.etendue_ratio);
            }
            let cos_here = if i == 0 { 1.0 } else { cos(i, *from_camera) };
            let cos_next = if i + 1 == m { light_cos(*from_light) } else { cos(i + 1, *from_light) };
            let end = if i + 1 < m {
                Some(self.vertices[i].at.p)
            } else {
                match &self.light.at {
                    Endpoint::Surface(at) => Some(at.p),
                    Endpoint::Point(p) => Some(*p),
                    Endpoint::Infinite(_) => None,
                }
            };
            match end {
                None => (1.0, cos_here),
                Some(_) if i == 0 => (cos_next, 0.0),
                Some(q) => {
                    let d2 = segment(self.vertices[i - 1].at.p, q).1;
                    (cos_next / d2, cos_here / d2)
                }
            }
        };
        let forward = |i: usize| -> f64 {
            let density = if i == 1 {
                match self.edges[0].0.chain {
                    0 => self.camera.connect(self.vertices[0].at.p).map_or(1.0, |s| s.density),
                    _ => self.camera.density(self.edges[0].1, 1.0),
                }
            } else {
                self.turns(i - 1).0
            };
            density * geometry(i - 1).0
        };
        let reverse = |i: usize| -> f64 {
            match i {
                i if i == m => light.position,
                i if i == m - 1 => light.direction * geometry(i).1,
                i => self.turns(i + 1).1 * geometry(i).1,
            }
        };
        if m == 1 {
            return vec![0.0, 1.0];
        }
        // Direct light that next-event estimation finds for sure counts less in the light image.
        let image = if m == 2 && self.edges[1].0.sure { 0.1 } else { 1.0 };
        let log_p: Vec<f64> = (0..=m)
            .map(|i| {
                let technique = match i {
                    i if i == m => f64::from(u8::from(light.hittable)),
                    i if self.edges[i].0.chain == 0 => 1.0,
                    // In units of 1/J; the other densities leave J out.
                    i => self.edges[i].0.technique,
                };
                if technique == 0.0 {
                    return f64::NEG_INFINITY;
                }
                let camera_part: f64 = (1..=i).map(|j| forward(j).ln()).sum();
                let light_part: f64 =
                    (i + 1..=m).map(|j| if i == m - 1 && j == m { light.direct.ln() } else { reverse(j).ln() }).sum();
                let number = if i < m - 1 { self.light_subpaths } else { 1.0 } * if i == 0 { image } else { 1.0 };
                number.ln() + technique.ln() + camera_part + light_part
            })
            .collect();
        let largest = log_p.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = log_p.iter().map(|l| (l - largest).exp()).sum();
        log_p.iter().map(|l| (l - largest).exp() / sum).collect()
    }
}

/// Compares every observed weight with the definition.
struct Check<'a> {
    world: &'a World,
    bsdfs: &'a [Bsdf],
    lights: &'a Lights,
    aim: Option<&'a Aim>,
    light_subpaths: f64,
    camera: &'a Camera,
    paths: usize,
    with_chain: usize,
    with_walk: usize,
    by_technique: std::collections::BTreeMap<(u32, u32), usize>,
    worst: f64,
    worst_at: String,
}

impl Observer for Check<'_> {
    fn observe(&mut self, c: &Contribution) {
        let path = FullPath::new(self, c);
        // Densities of parallel light are asked for on the ray that leaves the light, and not behind glass.
        if let (Endpoint::Infinite(_), true) = (&path.light.at, path.edges.len() > 1) {
            let to_light = -path.edges[path.edges.len() - 1].2;
            let origin = path.light.through + to_light * 1e-3;
            let ray = Ray { origin, direction: to_light, t_max: f32::INFINITY };
            assert!(!self.world.intersector.occluded(&ray), "s = {}, t = {}", c.s, c.t);
        }
        let technique = on_path(c.camera).count() + usize::from(c.hit.is_some());
        let shares = path.shares();
        let sum: f64 = shares.iter().sum();
        // Without light subpath: by next-event estimation or by running into the light.
        let camera_only: f64 = shares.iter().rev().take(2).sum();
        let errors = [c.weight - shares[technique], sum - 1.0, c.camera_only - camera_only];
        let error = errors.iter().map(|e| if e.is_nan() { f64::INFINITY } else { e.abs() }).fold(0.0, f64::max);
        self.paths += 1;
        self.with_chain += usize::from(path.edges.iter().any(|e| e.0.chain > 0));
        self.with_walk += usize::from(path.edges.iter().any(|e| e.0.chain > 0 && e.0.technique > 0.0));
        *self.by_technique.entry((c.s, c.t)).or_default() += 1;
        if !(error <= self.worst) {
            self.worst = error;
            let (own, share) = (c.weight, shares[technique]);
            self.worst_at = format!(
                "s = {}, t = {}: weight {own} but share {share}; s <= 1 {} but {camera_only}",
                c.s, c.t, c.camera_only
            );
        }
    }
}

fn check(name: &str, builder: &Builder) {
    check_with(name, builder, None);
    let options = CausticOptions::default();
    check_with(&format!("{name}, caustic connections"), builder, Some(options));
    let options = CausticOptions { aim: Some(0.4), ..options };
    check_with(&format!("{name}, caustic connections, aimed"), builder, Some(options));
    for number in [0.4, 1.5] {
        let options = CausticOptions { light_subpaths: Some(number), ..options };
        check_with(&format!("{name}, {number} light subpaths a sample"), builder, Some(options));
    }
}

/// Without caustic connections if there are no options for them.
fn check_with(name: &str, builder: &Builder, caustics: Option<CausticOptions>) {
    let world = builder.commit();
    // A part of the frame, which is the general case.
    let region = Region { x: 2, y: 1, width: 24, height: 20 };
    let camera = Camera::new(&world.cameras[0], 28, 22, region);
    let medium = world.medium_at(camera.generate(Vec2::new(14.0, 11.0)).0);
    // One point of the lens, if there is one: all techniques of a sample have the same.
    let camera = camera.sample(&mut Sampler::new(0, 0, 0, Stream::Camera)).into_owned();
    let view = View { camera: camera.clone(), medium: Some(medium), columns: 28, region };
    let mut tracer = Tracer::new(&world, 9);
    let connects = caustics.is_some() && world.requirements.caustics;
    if connects {
        tracer.connect_through_glass();
    }
    tracer.options = caustics.unwrap_or_default();
    if let Some(share) = tracer.options.aim {
        tracer.aim_at(&Aimed::new(&world, &glass(&world), |_| share));
    }
    tracer.light_subpaths = tracer.options.light_subpaths.map_or(1.0, f64::from);
    let light_subpaths = tracer.light_subpaths;
    let (lights, aim) = (tracer.lights.clone(), tracer.aim.clone());
    tracer.camera_caustics =
        connects && world.requirements.delta_lights && matches!(camera.endpoint(), Endpoint::Point(_));
    let walked = world.walked.as_ref().filter(|_| connects);
    let mut check = Check {
        world: &world,
        bsdfs: walked.map_or(&world.bsdfs, |w| &w.bsdfs),
        lights: &lights,
        aim: aim.as_ref(),
        light_subpaths,
        camera: &camera,
        paths: 0,
        with_chain: 0,
        with_walk: 0,
        by_technique: Default::default(),
        worst: 0.0,
        worst_at: String::new(),
    };
    let mut out = Sample::default();
    for index in 0..12 {
        for pixel in 0..24 * 20 {
            bdpt::sample(&mut tracer, &view, 11, pixel, index, &mut out, &mut check);
        }
    }
    eprintln!(
        "{name}: {} paths, {} with chains, {} of them walked, {} techniques, worst {:.1e} ({})",
        check.paths,
        check.with_chain,
        check.with_walk,
        check.by_technique.len(),
        check.worst,
        check.worst_at
    );
    assert!(check.paths > 5_000, "{name}: only {} paths", check.paths);
    assert!(check.worst < 1e-9, "{name}: {}", check.worst_at);
}

/// A room with some objects; the lights come from the caller.
fn room(lights: impl Fn(&mut Builder), with_glass: bool, projection: Projection) -> Builder {
    let mut b = Builder::default();
    let white = b.diffuse(0.7);
    b.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, white);
    b.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 3.0, white);
    let shiny = b.material(Scattering::MetallicRoughness(MetallicRoughness {
        base_color: Rgb::new(0.8, 0.5, 0.3),
        metallic: 0.3,
        roughness: 0.5,
        ..MetallicRoughness::default()
    }));
    b.mesh(common::icosphere(0.5, 1, true), shiny, glam::DAffine3::from_translation(DVec3::new(-0.8, 0.5, 0.0)));
    if with_glass {
        let glass = b.glass(1.5, 0.0);
        b.sphere(DVec3::new(0.7, 0.6, 0.2), 0.5, glass);
        b.mesh(common::icosphere(0.4, 2, true), glass, glam::DAffine3::from_translation(DVec3::new(0.0, 0.4, 0.9)));
        let frosted = b.glass(1.4, 0.5);
        b.sphere(DVec3::new(-0.3, 1.3, -0.6), 0.4, frosted);
        // Light that refracts smoothly here goes past vertices that are no part of its path.
        let milky = b.material(Scattering::MetallicRoughness(MetallicRoughness {
            base_color: Rgb::splat(0.8),
            metallic: 0.0,
            roughness: 0.0,
            specular: 0.0,
            transmission: 0.5,
            solid: true,
            ..MetallicRoughness::default()
        }));
        b.sphere(DVec3::new(-1.1, 0.4, 1.0), 0.3, milky);
        let sheet = b.material(Scattering::ThinDielectric { ior: 1.5, roughness: 0.4, tint: Rgb::ONE });
        b.quad(Vec3::new(-1.6, 0.2, 1.0), Vec3::X * 0.8, Vec3::Y * 1.2, sheet);
        let walked = b.walked_glass(1.4, 0.4);
        b.mesh(icosphere(0.3, 2, true), walked, DAffine3::from_translation(DVec3::new(0.9, 1.4, 0.9)));
        let inner = b.walked_glass(1.5, 0.3);
        b.sphere(DVec3::new(-0.6, 0.7, 1.2), 0.25, inner);
    }
    lights(&mut b);
    b.camera(DVec3::new(0.3, 1.4, 4.0), DVec3::new(0.0, 0.7, 0.0), projection);
    b
}

const PERSPECTIVE: Projection = Projection::Perspective { yfov: 0.7 };

#[test]
fn area_light() {
    let lights = |b: &mut Builder| {
        let lamp = b.lamp(5.0);
        b.quad(Vec3::new(-0.5, 2.8, -0.5), Vec3::X, Vec3::Z, lamp);
    };
    check("area light", &room(lights, false, PERSPECTIVE));
    check("area light, glass", &room(lights, true, PERSPECTIVE));
    check("area light, glass, orthographic", &room(lights, true, Projection::Orthographic { ymag: 1.3 }));
}

#[test]
fn sphere_light() {
    let lights = |b: &mut Builder| {
        let lamp = b.lamp(5.0);
        b.sphere(DVec3::new(0.0, 2.3, 0.5), 0.2, lamp);
    };
    check("sphere light", &room(lights, true, PERSPECTIVE));
}

#[test]
fn delta_lights() {
    let intensity = Rgb::splat(3.0);
    let point = LightKind::Point { position: DVec3::new(0.5, 2.5, 1.0), intensity };
    let spot = LightKind::Spot {
        position: DVec3::new(-0.5, 2.5, 1.0),
        direction: DVec3::new(0.2, -1.0, -0.4),
        intensity,
        inner: 0.3,
        outer: 0.7,
    };
    let sun = LightKind::Directional { direction: DVec3::new(0.3, -1.0, -0.5), irradiance: intensity };
    for (name, kind) in [("point", point), ("spot", spot), ("directional", sun)] {
        check(name, &room(|b| b.light(kind), true, PERSPECTIVE));
    }
    check("three delta lights", &room(|b| [point, spot, sun].into_iter().for_each(|k| b.light(k)), true, PERSPECTIVE));
}

/// Away from the middle of a lens, whose film is moved.
#[test]
fn a_lens() {
    let lights = |b: &mut Builder| {
        b.light(LightKind::Point { position: DVec3::new(0.2, 1.6, -0.3), intensity: Rgb::splat(2.0) });
    };
    let mut b = room(lights, true, PERSPECTIVE);
    b.0.cameras[0].lens = Some(Lens { radius: 0.3, focus: 2.0 });
    b.0.cameras[0].shift = DVec2::new(0.1, -0.2);
    check("lens", &b);
}

#[test]
fn environment_and_area_light() {
    let lights = |b: &mut Builder| {
        let lamp = b.lamp(5.0);
        b.quad(Vec3::new(-0.5, 2.8, -0.5), Vec3::X, Vec3::Z, lamp);
        b.0.environment = Rgb::splat(0.5).into();
    };
    check("environment and area light", &room(lights, true, PERSPECTIVE));
    check("environment, orthographic", &room(lights, true, Projection::Orthographic { ymag: 1.3 }));
}

#[test]
fn image_of_the_sky_and_area_light() {
    let lights = |b: &mut Builder| {
        let lamp = b.lamp(5.0);
        b.quad(Vec3::new(-0.5, 2.8, -0.5), Vec3::X, Vec3::Z, lamp);
        b.0.environment = scenes::sky();
    };
    check("image of the sky and area light", &room(lights, true, PERSPECTIVE));
}

#[test]
fn textures() {
    let mut b = room(scenes::textures, true, PERSPECTIVE);
    scenes::stained_glass(&mut b);
    check("textures", &b);
}

#[test]
fn caustic_options() {
    // Whatever is chosen, a weight remains a function of the path.
    let lamp = |b: &mut Builder| {
        let lamp = b.lamp(5.0);
        b.quad(Vec3::new(-0.5, 2.8, -0.5), Vec3::X, Vec3::Z, lamp);
    };
    let point = |b: &mut Builder| {
        b.light(LightKind::Point { position: DVec3::new(0.5, 2.5, 1.0), intensity: Rgb::splat(3.0) });
    };
    let default = CausticOptions::default();
    let direct = CausticOptions { geometry_term: GeometryTerm::Direct, ..default };
    for (name, room) in [("area light", room(lamp, true, PERSPECTIVE)), ("point light", room(point, true, PERSPECTIVE))]
    {
        for (what, options) in [
            ("direct term", direct),
            ("direct term, all starts", CausticOptions { seeds: Some(MOST_SEEDS), ..direct }),
            ("one start", CausticOptions { seeds: Some(1), ..default }),
            ("all starts", CausticOptions { seeds: Some(MOST_SEEDS), ..default }),
            ("searches", CausticOptions { search: Some(1.0), ..default }),
            ("direct term, searches", CausticOptions { search: Some(0.3), ..direct }),
            ("no searches", CausticOptions { search: Some(0.0), ..default }),
            ("direct term, few steps", CausticOptions { check: options::Check::Few, ..direct }),
            ("direct term, no check", CausticOptions { check: options::Check::Off, ..direct }),
            ("no roulette", CausticOptions { roulette: Roulette::Off, ..default }),
            ("roulette by lengths", CausticOptions { roulette: Roulette::Lengths, ..default }),
        ] {
            check_with(&format!("{name}, {what}"), &room, Some(options));
        }
    }
}
