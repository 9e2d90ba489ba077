//! `caustica pixel`: the paths behind the value of one pixel.

use crate::args::Pixel;
use crate::console::{self, Console};
use crate::scene::Opened;
use crate::{Failure, scene, units, walks};
use caustica::camera::{Endpoint, Region};
use caustica::integrator::{Contribution, Observer};
use caustica::manifold::MAX_CHAIN;
use caustica::math::Rgb;
use caustica::render::Settings;
use caustica::render::pixel::Probe;
use caustica::scatter::Bsdf;
use caustica::scene::description::Description;
use caustica::scene::{CommitOptions, World};
use caustica::transport::Vertex;
use caustica::transport::vertex::{EdgeRecord, on_path};
use glam::{DVec3, Vec3};

pub(crate) fn run(args: &Pixel) -> Result<(), Failure> {
    args.picture.check_used(args.integrator);
    let commit = CommitOptions { backend: args.picture.backend(), ..CommitOptions::default() };
    let Opened { description, aspects, world } =
        scene::open(&args.scene, commit, Some(&args.picture), Console { quiet: false })?;
    let settings = Settings {
        integrator: args.integrator.into(),
        samples: args.spp,
        ..args.picture.settings(&description.cameras, &aspects)?
    };
    let mut probe = Probe::new(&world, &settings)?;
    let kinds = (0..world.shapes.len() as u32).map(|shape| kind(probe.tracer().factors(shape))).collect();
    let mut paths = Paths {
        names: Names { world: &world, description: &description, kinds },
        eye: probe.camera(args.x, args.y, settings.first_sample).endpoint(),
        region: settings.region(),
        sample: 0,
        text: String::new(),
        brightest: args.brightest.map(|n| (n, Vec::new())),
    };

    let (mut sum, mut left_out) = (DVec3::ZERO, 0);
    // Their sum is below 2^32, or there were no probe.
    for index in settings.first_sample..settings.first_sample + args.spp {
        paths.sample = index;
        paths.eye = probe.camera(args.x, args.y, index).endpoint();
        let sample = probe.trace(args.x, args.y, index, &mut paths)?;
        if sample.radiance.is_finite() {
            sum += sample.radiance.as_dvec3();
        } else {
            left_out += 1;
        }
        if paths.brightest.is_none() {
            paths.text += &format!("sample {index}  sum {}", short(sample.radiance));
            if !sample.splats.is_empty() {
                let splats = sample.splats.iter().map(|splat| splat.value).sum();
                let count = units::count(sample.splats.len(), "path", "paths");
                paths.text += &format!("  light image {} in {count}", short(splats));
            }
            paths.text += "\n\n";
        }
        console::print(&std::mem::take(&mut paths.text))?;
    }
    for (_, text) in paths.brightest.into_iter().flat_map(|(_, found)| found) {
        console::print(&(text + "\n"))?;
    }

    let mean = (sum / f64::from(args.spp)).to_array().map(|x| format!("{x:.7e}")).join(", ");
    let count = units::count(args.spp as usize, "sample", "samples");
    let mut text = format!("mean ({mean}) of {count}, without the light image\n");
    if left_out > 0 {
        text += &format!("{} NaN or infinite, left out\n", units::count(left_out, "sample", "samples"));
    }
    let (counts, rays) = probe.walks();
    if counts.total() > 0 {
        text += &(walks::lines(counts, rays).join("\n") + "\n");
    }
    console::print(&text)
}

/// Writes down the paths of samples.
struct Paths<'a> {
    names: Names<'a>,
    eye: Endpoint,
    region: Region,
    sample: u32,
    text: String,
    /// How many, and those so far, by what they add.
    brightest: Option<(usize, Vec<(f32, String)>)>,
}

impl Observer for Paths<'_> {
    fn observe(&mut self, c: &Contribution) {
        let text = self.path(c);
        let Some((most, found)) = &mut self.brightest else {
            self.text += &text;
            return;
        };
        let added = c.weighted.max_element();
        let rank = found.partition_point(|(other, _)| other.total_cmp(&added).is_ge());
        found.insert(rank, (added, text));
        found.truncate(*most);
    }
}

impl Paths<'_> {
    fn path(&self, c: &Contribution) -> String {
        let names = &self.names;
        let mut text = format!(
            "sample {}  s {:>2}  t {:>2}  value {}  weight {:10.4e}  adds {}",
            self.sample,
            c.s,
            c.t,
            short(c.value),
            c.weight,
            short(c.weighted)
        );
        if c.t == 1 {
            let Region { x, y, width, .. } = self.region;
            text += &format!("  to pixel ({}, {})", x + c.pixel % width, y + c.pixel / width);
        }
        if c.is_caustic() {
            text += "  caustic";
        }
        let mut line = |line: String| {
            text += "\n    ";
            text += line.trim_end();
        };
        line(names.end("camera", &self.eye, String::new()));
        for vertex in on_path(c.camera) {
            names.sampled(&vertex.edge, false).map(&mut line);
            line(names.vertex(vertex));
        }
        if let Some(chain) = c.chain {
            line(names.chain("walked", chain.len, "refracts", &chain.shapes, false));
        }
        for vertex in on_path(c.light).rev() {
            line(names.vertex(vertex));
            names.sampled(&vertex.edge, true).map(&mut line);
        }
        if let Some(hit) = c.hit {
            names.sampled(&hit.edge, false).map(&mut line);
        }
        line(names.end("light", &c.start.at, names.light(c.start.light)));
        text + "\n"
    }
}

/// What the file calls the things of a world. Names are printed quoted and escaped.
struct Names<'a> {
    world: &'a World,
    description: &'a Description,
    /// How each shape scatters.
    kinds: Vec<&'static str>,
}

fn kind(bsdf: &Bsdf) -> &'static str {
    match (bsdf.is_diffuse(), bsdf.has_delta()) {
        (true, _) => "diffuse",
        (false, false) => "glossy",
        (false, true) => "glossy, partly specular",
    }
}

impl Names<'_> {
    fn shape(&self, shape: u32) -> String {
        format!("{shape} {:?}", self.description.instances[shape as usize].name)
    }

    fn light(&self, light: u32) -> String {
        let lights = &self.world.lights;
        if lights.environment() == Some(light) {
            return "environment".to_owned();
        }
        // Shapes come first, then the others that emit.
        let shapes = (0..self.world.shapes.len() as u32).filter_map(|shape| Some((shape, lights.of_shape(shape)?)));
        if let Some((shape, _)) = shapes.clone().find(|(_, of)| *of == light) {
            return self.shape(shape);
        }
        let others = self.description.lights.iter().filter(|other| other.kind.emits());
        let found = others.zip(shapes.count() as u32..).find(|(_, index)| *index == light);
        found.map_or_else(String::new, |(found, _)| format!("{:?}", found.name))
    }

    fn end(&self, what: &str, at: &Endpoint, name: String) -> String {
        match at {
            Endpoint::Infinite(direction) => format!("{what:<8} toward {}  {name}", position(direction.as_dvec3())),
            _ => format!("{what:<8} {}  {name}", self.position(at.position())),
        }
    }

    /// In the space of the file.
    fn position(&self, p: Vec3) -> String {
        position(p.as_dvec3() + self.world.origin)
    }

    fn vertex(&self, v: &Vertex) -> String {
        let kind = self.kinds[v.at.shape as usize];
        let material = &self.description.materials[self.world.shape_material[v.at.shape as usize] as usize].name;
        let shape = self.shape(v.at.shape);
        format!("{:<8} {}  {shape}, material {material:?}, {kind}", "surface", self.position(v.at.p))
    }

    /// The chain of an edge, if it has one; `reversed` if the edge was sampled from the light.
    fn sampled(&self, edge: &EdgeRecord, reversed: bool) -> Option<String> {
        let how = if edge.technique > 0.0 { "sampled, a walk finds it too" } else { "sampled, no walk finds it" };
        let what = if edge.refracted { "refracts" } else { "specular" };
        (edge.chain > 0).then(|| self.chain(how, edge.chain as usize, what, &edge.shapes, reversed))
    }

    fn chain(&self, how: &str, len: usize, what: &str, shapes: &[u32; MAX_CHAIN], reversed: bool) -> String {
        let mut names: Vec<_> = shapes.iter().take(len).map(|&shape| self.shape(shape)).collect();
        if len > MAX_CHAIN {
            names.push("...".to_owned());
        }
        if reversed {
            names.reverse();
        }
        format!("{:<8} {len} x {what} ({how}): {}", "chain", names.join(", "))
    }
}

fn position(p: DVec3) -> String {
    // Adding zero turns -0 into 0.
    let [x, y, z] = p.to_array().map(|x| (x * 1e6).round() / 1e6 + 0.0);
    format!("({x:>10.6}, {y:>10.6}, {z:>10.6})")
}

fn short(c: Rgb) -> String {
    format!("({:10.4e}, {:10.4e}, {:10.4e})", c.x, c.y, c.z)
}
