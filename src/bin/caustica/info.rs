//! `caustica info`.

use crate::args::Info;
use crate::{Failure, console, scene, units};
use caustica::io::gltf::Loaded;
use caustica::math::Rgb;
use caustica::scene::CommitOptions;
use caustica::scene::description::{
    Camera, Description, Environment, Geometry, LightKind, Material, Projection, Scattering,
};
use caustica::transport::limits::limits;
use glam::{DVec2, DVec3};
use std::fmt::Write;

pub(crate) fn run(args: &Info) -> Result<(), Failure> {
    let loaded = scene::load(&args.scene)?;
    let mut text = format!("{}\n", args.scene.display());
    describe(&mut text, &loaded)?;
    // What the file says is worth seeing even where the scene cannot be rendered.
    let world = scene::commit(&args.scene, &loaded.description, CommitOptions::default());
    let of_world = world.iter().flat_map(|world| &world.warnings).map(ToString::to_string);
    let warnings: Vec<_> = loaded.warnings.iter().cloned().chain(of_world).collect();
    list(&mut text, "warnings", warnings.len())?;
    for warning in warnings {
        writeln!(text, "    {warning}")?;
    }
    if let Ok(world) = &world {
        let limits = limits(world);
        if !limits.is_empty() {
            writeln!(text, "  what it cannot find")?;
        }
        for limit in limits {
            writeln!(text, "    {limit}")?;
        }
        writeln!(text, "  hash         {:016x}", world.hash())?;
    }
    console::print(&text)?;
    world.map(drop)
}

/// Names are printed quoted and escaped: they come from the file.
fn describe(out: &mut String, Loaded { description: d, aspects, .. }: &Loaded) -> Result<(), Failure> {
    let vertices: usize = d.meshes.iter().map(|mesh| mesh.positions.len()).sum();
    let triangles: usize = d.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
    list(out, "meshes", d.meshes.len())?;
    writeln!(out, "    {vertices} vertices, {triangles} triangles")?;

    let (mut drawn, mut spheres) = (0, 0);
    for instance in &d.instances {
        match instance.geometry {
            Geometry::Mesh(index) => drawn += d.meshes.get(index).map_or(0, |mesh| mesh.triangles.len()),
            Geometry::Sphere { .. } => spheres += 1,
        }
    }
    list(out, "instances", d.instances.len())?;
    writeln!(out, "    {drawn} triangles, {}", units::count(spheres, "sphere", "spheres"))?;
    if let Some((low, high)) = d.bounds() {
        writeln!(out, "  bounds       {} to {} m", vector(low), vector(high))?;
    }

    list(out, "materials", d.materials.len())?;
    for (i, material) in d.materials.iter().enumerate() {
        writeln!(out, "    {i} {:?}: {}", material.name, surface(material))?;
    }

    let emitters = d.instances.iter().filter(|instance| emits(d, instance.material));
    list(out, "emitters", emitters.clone().count())?;
    for instance in emitters {
        writeln!(out, "    {:?}: {} W/(m² sr)", instance.name, rgb(d.materials[instance.material].emission))?;
    }
    list(out, "lights", d.lights.len())?;
    for (i, light) in d.lights.iter().enumerate() {
        writeln!(out, "    {i} {:?}: {}", light.name, kind(&light.kind))?;
    }
    let Environment { radiance, image, .. } = &d.environment;
    if *radiance != Rgb::ZERO {
        let image = image.as_ref().map(|image| image.size());
        let image = image.map_or(String::new(), |(width, height)| format!(" times an image of {width}x{height}"));
        writeln!(out, "  environment  {} W/(m² sr){image}", rgb(*radiance))?;
    }

    list(out, "cameras", d.cameras.len())?;
    for (i, (camera, aspect)) in d.cameras.iter().zip(aspects).enumerate() {
        let shape = aspect.map_or(String::new(), |aspect| format!(", {aspect:.4} times as wide as high"));
        writeln!(out, "    {i} {:?}: {}{shape}", camera.name, view(camera))?;
    }
    Ok(())
}

fn list(out: &mut String, what: &str, n: usize) -> std::fmt::Result {
    writeln!(out, "  {what:<12} {n}")
}

fn emits(d: &Description, material: usize) -> bool {
    d.materials.get(material).is_some_and(|m| m.emission != Rgb::ZERO)
}

fn surface(material: &Material) -> String {
    let disperses = material.scattering.disperses();
    let abbe = |abbe: f32| if abbe != 0.0 && disperses { format!(", Abbe number {abbe:.1}") } else { String::new() };
    let glass = |name: &str, ior: f32, roughness: f32| match roughness {
        0.0 => format!("smooth {name}, ior {ior}"),
        r => format!("rough {name}, ior {ior}, roughness {r}"),
    };
    match material.scattering {
        Scattering::Diffuse { reflectance } => format!("diffuse {}", rgb(reflectance)),
        Scattering::Dielectric { inside, outside, roughness, .. } => {
            let text = glass("dielectric", inside.ior, roughness);
            let text = text + &abbe(inside.abbe);
            let text = if outside.ior == 1.0 { text } else { format!("{text} in ior {}", outside.ior) };
            let text = text + &abbe(outside.abbe);
            if inside.absorption == Rgb::ZERO { text } else { text + ", absorbing" }
        }
        Scattering::ThinDielectric { ior, roughness, .. } => glass("thin dielectric", ior, roughness),
        Scattering::Conductor { reflectance, roughness } => {
            format!("conductor {}, roughness {roughness}", rgb(reflectance))
        }
        Scattering::MetallicRoughness(m) => {
            let base = rgb(m.base_color);
            let text = format!("base colour {base}, metallic {}, roughness {}", m.metallic, m.roughness);
            if m.transmission == 0.0 {
                return text;
            }
            let body = match (m.solid, m.absorption == Rgb::ZERO) {
                (false, _) => "thin",
                (true, true) => "solid",
                (true, false) => "absorbing solid",
            };
            format!("{text}, {body}, transmission {}, ior {}{}", m.transmission, m.ior, abbe(m.abbe))
        }
    }
}

fn kind(light: &LightKind) -> String {
    match *light {
        LightKind::Point { position, intensity } => format!("point at {}, {} W/sr", vector(position), rgb(intensity)),
        LightKind::Spot { position, intensity, outer, .. } => {
            let half = outer.to_degrees();
            format!("spot at {}, half-angle {half:.1}°, {} W/sr", vector(position), rgb(intensity))
        }
        LightKind::Directional { direction, irradiance } => {
            format!("directional along {}, {} W/m²", vector(direction), rgb(irradiance))
        }
    }
}

fn view(camera: &Camera) -> String {
    let projection = match camera.projection {
        Projection::Perspective { yfov } => format!("perspective, {:.1}° high", yfov.to_degrees()),
        Projection::Orthographic { ymag } => format!("orthographic, {} m high", 2.0 * ymag),
    };
    let lens = camera
        .lens
        .map_or(String::new(), |lens| format!(", lens of radius {} m in focus at {} m", lens.radius, lens.focus));
    let shift = if camera.shift == DVec2::ZERO {
        String::new()
    } else {
        format!(", moved by {}, {}", camera.shift.x, camera.shift.y)
    };
    let m = camera.transform;
    let along = -m.matrix3.z_axis.normalize_or_zero();
    format!("{projection}{lens}{shift}, at {}, looks along {}", vector(m.translation), vector(along))
}

fn vector(v: DVec3) -> String {
    // Adding zero turns -0 into 0.
    let [x, y, z] = v.to_array().map(|c| (c * 1e4).round() / 1e4 + 0.0);
    format!("({x}, {y}, {z})")
}

fn rgb(c: Rgb) -> String {
    format!("({}, {}, {})", c.x, c.y, c.z)
}
