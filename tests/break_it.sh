#!/bin/sh
# Tests the tests: breaks the renderer in one place after another and demands that a test notices.
#
#   tests/break_it.sh              every mutation below, the named tests of each
#   tests/break_it.sh NAME...      some of them
#   tests/break_it.sh --all NAME...  all oracles on each, and which tests fail (for docs/testing.md)
#   tests/break_it.sh --list       their names
#   tests/break_it.sh --table      their names and tests, as docs/testing.md has them
#   tests/break_it.sh --check      only that each mutation still applies
#
# Takes a minute or two for each; not part of the normal test run. Works on the tree it stands in,
# which must be clean, and leaves it clean.
exec python3 - "$0" "$@" <<'PYTHON'
import os, pathlib, re, signal, subprocess, sys

# What incremental builds had kept of the code before once hid a change from the tests.
os.environ["CARGO_INCREMENTAL"] = "0"

script, arguments = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2:]
ROOT = script.parent.parent
ORACLES = ["weights", "caustic", "ball", "options", "agreement", "closed_forms", "furnace", "references", "extremes"]

# Name: file, exact text (once in the file), its replacement, tests that must fail as (target, filter); the
# target "lib" has the unit tests.
MUTATIONS = {}


def mutation(name, file, old, new, *tests):
    assert name not in MUTATIONS and tests
    MUTATIONS[name] = (file, old, new, tests)


# Cosines.
mutation("connect: cosine at the camera vertex", "src/transport/connect.rs",
         "let geometry = a.cos_s(w) * cos_b as f32 * b.incident_adjoint();",
         "let geometry = cos_b as f32 * b.incident_adjoint();",
         ("agreement", "techniques_on_diffuse"))
mutation("connect: cosine at the light vertex", "src/transport/connect.rs",
         "let geometry = a.cos_s(w) * cos_b as f32 * b.incident_adjoint();",
         "let geometry = a.cos_s(w) * (1.0 / d2) as f32 * b.incident_adjoint();",
         ("agreement", "techniques_on_diffuse"))
mutation("next event: cosine at the vertex, BDPT", "src/transport/connect.rs",
         "let mut value = a.beta * scattering.f * a.cos_s(light.wi) * light.incident * self",
         "let mut value = a.beta * scattering.f * light.incident * self",
         ("closed_forms", "point_light"))
mutation("next event: cosine at the vertex, path tracer", "src/integrator/path.rs",
         "scattering.f * at.ns.dot(light.wi).abs() * light.incident",
         "scattering.f * light.incident",
         ("closed_forms", "point_light"))
mutation("next event: cosine at the light", "src/emitter/mod.rs",
         "let incident = scale(emitted, link.geometry.abs() / densities.direct);",
         "let away = match &at { Endpoint::Surface(s) => s.ng.as_dvec3().dot(link.direction).abs(), _ => 1.0 };\n"
         "        let incident = scale(emitted, link.geometry.abs() / away / densities.direct);",
         ("closed_forms", "unequal_lights"))
mutation("to camera: cosine", "src/transport/connect.rs",
         "let mut value = b.beta * scattering.f * (forward as f32 * b.incident_adjoint()) *",
         "let mut value = b.beta * scattering.f * (seen.density as f32 * b.incident_adjoint()) *",
         ("agreement", "techniques_on_diffuse"))
mutation("emission: cosine", "src/emitter/mod.rs",
         "let beta = scale(emitted, cos / (position * direction_density));",
         "let beta = scale(emitted, 1.0 / (position * direction_density)) * cos.signum() as f32;",
         ("agreement", "techniques_on_diffuse"))

# Densities.
mutation("weights: reverse density at a vertex", "src/transport/weight.rs",
         "self.alpha + self.gamma * reverse_density",
         "self.alpha + self.gamma * reverse_density.signum()",
         ("weights", ""), ("agreement", "integrators_on_glossy"))
mutation("walk: reverse density", "src/transport/edge.rs",
         "edge.remainder = vertex.partial.at(value.pdf_reverse as f64);",
         "edge.remainder = vertex.partial.at(value.pdf as f64);",
         ("weights", ""))
mutation("connect: reverse density at the camera vertex", "src/transport/connect.rs",
         "a.partial.at(at_a.pdf_reverse as f64)", "a.partial.at(at_a.pdf as f64)", ("weights", ""))
mutation("connect: reverse density at the light vertex", "src/transport/connect.rs",
         "b.partial.at(at_b.pdf_reverse as f64)", "b.partial.at(at_b.pdf as f64)", ("weights", ""))
mutation("next event: reverse density", "src/transport/connect.rs",
         "let remainder = a.partial.at(scattering.pdf_reverse as f64);",
         "let remainder = a.partial.at(scattering.pdf as f64);",
         ("weights", ""))
mutation("to camera: reverse density", "src/transport/connect.rs",
         "forward * b.partial.at(scattering.pdf_reverse as f64)", "forward * b.partial.at(scattering.pdf as f64)",
         ("weights", ""))
mutation("Lambert: reverse density", "src/scatter/lambert.rs",
         "pdf_reverse: warp::cosine_hemisphere_pdf_w(cos_o)", "pdf_reverse: warp::cosine_hemisphere_pdf_w(cos_i)",
         ("weights", ""))
mutation("rough metal: reverse density", "src/scatter/ggx.rs",
         "pdf_reverse: 0.5 * d * v_i, cos_h", "pdf_reverse: 0.5 * d * v_o, cos_h", ("weights", ""))
mutation("rough glass: reverse density", "src/scatter/rough_dielectric.rs",
         "pdf_reverse: 2.0 * v_2 * common * n_1 * n_1", "pdf_reverse: 2.0 * v_2 * common * n_2 * n_2",
         ("weights", ""))
mutation("path tracer: density of hitting the light", "src/integrator/path.rs",
         "let hit_density = if d.hittable { scattering.pdf as f64 * to_light } else { 0.0 };",
         "let hit_density = if d.hittable { scattering.pdf_reverse as f64 * to_light } else { 0.0 };",
         ("agreement", "integrators_on_glossy"))

# Squared index ratios.
mutation("smooth glass: eta squared", "src/scatter/smooth_dielectric.rs",
         "TransportMode::Radiance => ratio * ratio,", "TransportMode::Radiance => 1.0,",
         ("furnace", "radiance_within_a_medium"), ("agreement", "integrators_with_everything_but"))
mutation("rough glass: eta squared", "src/scatter/rough_dielectric.rs",
         "TransportMode::Radiance => n_1,", "TransportMode::Radiance => n_2,",
         ("agreement", "techniques_through_rough"))
mutation("chain: squared indices in the étendue ratio", "src/transport/edge.rs",
         "record.etendue_ratio = start * kappa * self.cos / (here * end.cos);",
         "record.etendue_ratio = self.kappa * self.cos / end.cos;",
         ("agreement", "integrators_with_everything_but"))

# Sample counts.
mutation("t = 1: sample count in the weight", "src/transport/connect.rs",
         "weight::connection(number, 0.0, light_side)", "weight::connection(2.0, 0.0, light_side)",
         ("weights", ""), ("agreement", "integrators_on_glossy"))
mutation("next event: factor of the light image", "src/transport/connect.rs",
         " * weight::light_image(a.first);", ";", ("weights", ""), ("agreement", "integrators_on_glossy"))
mutation("hit: factor of the light image", "src/transport/subpath.rs",
         "light_image(self.camera_vertices[index].first && record.sure)", "light_image(self.camera_vertices[index].first)",
         ("weights", ""))
mutation("t = 1: direct light by the number of vertices", "src/transport/connect.rs",
         "weight::light_image(vertex.first && vertex.edge.sure)", "weight::light_image(j == 0 && vertex.edge.sure)",
         ("weights", ""))
mutation("no check: factor of the light image", "src/transport/edge.rs",
         "let smooth = |shape: &u32| self.factors(*shape).walked_refraction().is_some_and(|r| r.alpha == 0.0);",
         "let smooth = |_: &u32| true;", ("weights", ""))
mutation("few steps: density of the camera across a chain", "src/transport/edge.rs",
         "self.leave(edge, walk, departure, None, at.position());\n        if exact {",
         "if exact {\n            self.leave(edge, walk, departure, None, at.position());", ("weights", ""))
mutation("forecast: factor of the light image", "src/render/moments.rs",
         "(1.0 - camera_only) / image;", "(1.0 - camera_only);", ("lib", "brought_back"))
mutation("t = 1: samples per pass", "src/render/film.rs",
         "((*c + *l) * scale)", "((*c + *l * 0.9) * scale)", ("agreement", "integrators_on_glossy"))
mutation("t = 1: importance of the film", "src/camera/mod.rs",
         "1.0 / (self.film_area * cos.powi(3) * f64::from(distance).powi(2))",
         "1.1 / (self.film_area * cos.powi(3) * f64::from(distance).powi(2))",
         ("agreement", "techniques_on_diffuse"))
mutation("weights: sample count of connections", "src/transport/edge.rs",
         "if edge.chain == 0 { (1.0, true) } else { (0.0, false) };",
         "if edge.chain == 0 { (2.0, true) } else { (0.0, false) };", ("weights", ""), ("agreement", "integrators_on_glossy"))

# Shading normals.
mutation("connection: adjoint factor of the incident side", "src/transport/vertex.rs",
         "self.at.ns.dot(self.wo).abs() / self.at.ng.dot(self.wo).abs()", "1.0",
         ("agreement", "techniques_with_shading_normals"))
mutation("walk: adjoint factor", "src/transport/subpath.rs",
         "                walk.beta *= adjoint;\n", "", ("agreement", "techniques_with_shading_normals"))
mutation("chain: adjoint factor in the étendue ratio", "src/transport/subpath.rs",
         "TransportMode::Radiance => edge.kappa *= f64::from(bent),", "TransportMode::Radiance => {}",
         ("agreement", "integrators_through_glass_with_shading_normals"))

# Absorption.
mutation("connection: absorption", "src/transport/connect.rs",
         "value *= world.transmittance(a.medium_toward(world, w), d2.sqrt() as f32);", "",
         ("agreement", "techniques_within_an_absorbing"))
mutation("next event: absorption", "src/transport/connect.rs",
         "value *= world.transmittance(a.medium_toward(world, light.wi), length);", "let _ = length;",
         ("closed_forms", "absorption"))
mutation("to camera: absorption", "src/transport/connect.rs",
         "value *= world.transmittance(medium, (seen.target - b.at.p).length());", "let _ = medium;",
         ("agreement", "techniques_within_an_absorbing"))
mutation("walk: absorption", "src/transport/subpath.rs",
         "walk.beta *= world.transmittance(walk.medium, length);", "let _ = length;",
         ("agreement", "techniques_within_an_absorbing"))
mutation("connection: medium on the wrong side", "src/scene/media.rs",
         "if at.ng.dot(direction) < 0.0 { self.inside } else { self.outside }",
         "if at.ng.dot(direction) > 0.0 { self.inside } else { self.outside }",
         ("agreement", "integrators_with_absorbing_glass"))
mutation("light in a medium: start of the light path", "src/transport/subpath.rs",
         "let medium = self.world.medium_of_light(sample.light, &sample.at, back);",
         "let medium = self.world.medium_of_light(sample.light, &sample.at, back) * 0;",
         ("agreement", "techniques_within_an_absorbing"))

mutation("search: a cancel does not end it", "src/transport/search.rs",
         "stopped() || look()", "(stopped() && false) || look()", ("waves", "a_cancel_ends"))
mutation("lights: triangles chosen by one number of 23 bits", "src/emitter/area.rs",
         " + f64::from(u.y) / f64::from(1 << 23)", "", ("lib", "each_of_millions"))
mutation("lights: light from infinity by all its flux", "src/emitter/choose.rs",
         "if finite > 0.0 && infinite > finite { finite / infinite } else { 1.0 }", "1.0", ("lib", "light_from_infinity"))
mutation("light in several media: taken to be in one", "src/scene/media.rs",
         "if media.all(|other| other == first) {", "if media.all(|other| other == first) || true {",
         ("agreement", "light_across_a_boundary"))

mutation("lens: its film in the middle", "src/camera/mod.rs",
         "(self.middle.as_dvec2() - at / lens.focus).as_vec2()", "self.middle",
         ("lens", "a_small_patch"))
mutation("lens: seen by another point of it", "src/integrator/bdpt.rs",
         "tracer.to_camera(&camera, j);", "tracer.to_camera(&view.camera, j);",
         ("lens", "a_small_patch"))
mutation("hash: numbers by FNV's product", "src/math/hash.rs",
         "self.0 = mix(self.0 ^ x).wrapping_add(1);", "self.step(x); self.0 ^= self.0 >> 32;", ("lib", "faces_of_a_box"))
mutation("Embree: what was elsewhere is kept", "src/scene/fingerprint.rs",
         'let _ = write!(h, "{sphere}{:?}", i.transform);', 'let _ = write!(h, "{sphere}");',
         ("job", "a_commit_shares"), ("job", "an_editable_commit"))
mutation("dispersion: no colour of chains", "src/transport/connect.rs",
         "chain.shapes[..chain.len].iter().any(|&shape| self.disperses(shape))", "false",
         ("spectrum", "each_band"))
mutation("dispersion: no colour of hits", "src/transport/subpath.rs",
         "value: white * self.color(walk.dispersed),", "value: white,",
         ("spectrum", "a_wedge"))
mutation("dispersion: the colour of both subpaths", "src/transport/connect.rs",
         "self.color(a.dispersed || self.chain_disperses(chain));",
         "self.color(a.dispersed) * self.color(self.chain_disperses(chain));", ("caustic", "dispersive_ball"))
mutation("dispersion: the geometry term of the yellow line", "src/transport/edge.rs",
         "edge.densities(self.media, self.options", "edge.densities(&self.world.media, self.options",
         ("spectrum", "each_band"))
mutation("dispersion: blue is bent least", "src/math/spectrum.rs",
         "inverse_square(wavelength) - inverse_square(D)", "inverse_square(D) - inverse_square(wavelength)",
         ("spectrum", "a_wedge"), ("lib", "the_index_of_a_glass"))
mutation("camera: the film of a region as large as the frame", "src/camera/mod.rs",
         "4.0 * half_width * half_height * share,", "4.0 * half_width * half_height * share.max(1.0),",
         ("caustic", "a_region"), ("lib", "a_region_is_a_smaller_film"))
mutation("camera: random numbers by the pixels of a region", "src/integrator/bdpt.rs",
         "y * self.columns + x", "y * self.region.width + x", ("job", "a_region_traced"))
mutation("render: another first sample draws the same", "src/render/job.rs",
         "settings.first_sample + tile.pass)", "tile.pass)", ("job", "successive_samples"))
mutation("camera: a film in several media taken to be in one", "src/render/samples.rs",
         "camera.is_point() || !world.requirements.media || ", "true || ",
         ("agreement", "parallel"), ("lens", "two_media"))
mutation("progress: due as soon as a slow callback ends", "src/render/job.rs",
         "last.0 = Instant::now();", "last.0 = start;", ("job", "slow_callback"))
mutation("progress: due at once after the first call", "src/render/job.rs",
         "Mutex::new((Instant::now(), 0.0f32))", "Mutex::new((start, 0.0f32))", ("job", "slow_callback"))
mutation("commit: shapes of before, whatever there is now", "src/scene/world.rs",
         "world.shape_hashes == hash.shapes", "!world.shape_hashes.is_empty()", ("job", "a_commit_shares"))

# What one path may add.
mutation("limit: what is left out is not told", "src/integrator/mod.rs",
         "[kept, light - kept]", "[kept, Rgb::ZERO]", ("job", "clamped_light"))
mutation("limit: lamps that the camera sees are cut, BDPT", "src/integrator/bdpt.rs",
         "hit.weight as f32, hit.scattered)", "hit.weight as f32, true)", ("job", "clamped_light"))
mutation("limit: lamps that the camera sees are cut, path tracer", "src/integrator/path.rs",
         "to_area;\n                    pdf_a / (pdf_a + densities.direct)\n                });\n                out.add(beta * emitted * weight as f32 * share(caustic) * tracer.color(dispersed), seen);",
         "to_area;\n                    pdf_a / (pdf_a + densities.direct)\n                });\n                out.add(beta * emitted * weight as f32 * share(caustic) * tracer.color(dispersed), true);",
         ("job", "clamped_light"))
mutation("limit: lamps behind frosted glass are not cut", "src/transport/subpath.rs",
         "sample.connectable || sample.microfacet.is_some();", "sample.connectable;", ("job", "lamps_that_are_seen"))
mutation("limit: lamps behind all glass are cut", "src/transport/subpath.rs",
         "sample.connectable || sample.microfacet.is_some();", "true;", ("job", "lamps_that_are_seen"))
mutation("forecast: a longer look weighs less", "src/render/moments.rs",
         "block[0] /= number)", "block[0] /= number.powi(0))", ("lib", "groups_weigh_the_same"))
mutation("limit: images per technique without it", "src/integrator/mod.rs",
         "Contribution { weighted, cut, ..self }", "Contribution { cut, weighted: weighted + cut, ..self }",
         ("job", "clamped_light"))
mutation("limit: caustics alone, told of all", "src/render/job.rs",
         "        if caustic {\n            self.caustics.cut += c.cut;", "        {\n            self.caustics.cut += c.cut;",
         ("job", "clamped_light"))

# Features.
mutation("features: colour as radiance in a medium", "src/integrator/feature.rs",
         "(end / start).powi(2)", "(end / start).powi(0)", ("features", "in_water"))
mutation("features: past what is in part a mirror", "src/integrator/feature.rs",
         " && hit.segments <= until", "", ("features", "see_the_same"))
mutation("features: what glass shows without its colour", "src/integrator/feature.rs",
         "vertex.beta * albedo * ", "albedo * ", ("features", "behind_a_pane"))
mutation("features: normals of the surface's own side", "src/integrator/feature.rs",
         "if normal.dot(wo) < 0.0 { -normal }", "if normal.dot(wo) < -2.0 { -normal }", ("features", "its_side"))
mutation("features: lamps are not seen", "src/integrator/feature.rs",
         "hit.vertices == 0 && ", "hit.vertices == 9 && ", ("features", "its_side"))
mutation("features: a lobe's colour without its share", "src/scatter/mixture.rs",
         "e.lobe.color() * e.share", "e.lobe.color()", ("features", "its_side"))

# Rounding.
mutation("hit: barycentrics in f32", "src/geometry/mesh.rs",
         "let close = (u", "let close = u.is_nan() && (u", ("extremes", "large_triangles"))
mutation("hit: a level floor as uncertain as a sloping one", "src/geometry/mesh.rs",
         "nearby.min(per_length * longest_edge)", "(per_length * longest_edge).max(0.0 * nearby)",
         ("extremes", "large_triangles"))
mutation("segment: direction from the ends across any gap", "src/transport/subpath.rs",
         "if bend < STRAIGHT { d }", "if bend < STRAIGHT || bend > 0.0 { d }", ("extremes", "large_triangles"))
mutation("walk: ends that coincide", "src/transport/subpath.rs",
         "if !(d2 > 0.0) {", "if d2.is_nan() {", ("extremes", "in_the_plane"))
mutation("rays: a surface through a point", "src/geometry/ray.rs",
         "t_max: 1.0 - 4.0 * ROUNDOFF", "t_max: 1.0", ("extremes", "in_the_plane"))
mutation("Embree: a surface through the origin", "src/intersect/embree/query.rs",
         "tnear: f32::MIN_POSITIVE,", "tnear: 0.0,", ("extremes", "in_the_plane"))
mutation("commit: media around lights of the commit before", "src/scene/media.rs",
         "&& (0..self.shapes.len() as u32).all(same_shape)", "&& (0..0).all(same_shape)", ("job", "media_around_lights"))
mutation("fingerprint: lengths of a mesh's lists", "src/scene/fingerprint.rs",
         "h.bytes(&(length as u64).to_le_bytes());", "let _ = length;", ("lib", "meshes_of_the_same_bytes"))

# Lights.
mutation("D / R_m at the start of the light path", "src/transport/weight.rs",
         "technique: technique * direct / position,", "technique,", ("weights", "sphere_light"),
         ("agreement", "integrators_with_sphere_lights"))
mutation("D / R_m where a camera path hits the light", "src/transport/weight.rs",
         "finite_share(1.0, direct * partial.alpha + position * direction * partial.gamma)",
         "finite_share(1.0, position * partial.alpha + position * direction * partial.gamma)",
         ("weights", "sphere_light"), ("agreement", "integrators_with_sphere_lights"))
mutation("choice of a light: probability", "src/emitter/choose.rs",
         "self.emission.probability(light as usize).into()",
         "{ let _ = light; 1.0 / self.emission.len() as f64 }",
         ("closed_forms", "unequal_lights"))
mutation("choice of a light: left out of emission", "src/emitter/mod.rs",
         "(choice * l.position_density(at), ", "(choice.signum() * l.position_density(at), ",
         ("agreement", "techniques_on_diffuse"))
mutation("choice of a light for a receiver: probability", "src/emitter/choose.rs",
         "reception.probability(receiver, light, emission)", "(emission + 0.0 * reception.finite)",
         ("agreement", "integrators_with_sphere_lights"))
mutation("choice of a light for a receiver: share of the emission's", "src/emitter/choose.rs",
         "EMISSION_SHARE * emission + (1.0 - EMISSION_SHARE) * reception.", "0.0 * emission + reception.",
         ("lib", "light_for_a_receiver"))
mutation("choice of a light for a receiver: the other node of a pair", "src/emitter/tree.rs",
         "if i == first { share } else { 1.0 - share }", "if i != first { share } else { 1.0 - share }",
         ("lib", "two_lights"))
mutation("spot light: falloff", "src/emitter/mod.rs",
         "let emitted = light.emitted(shapes, &at, -wi);", "let emitted = light.emitted(shapes, &at, -wi) * 1.01;",
         ("closed_forms", "spot_light"))

# Lengths and roulette.
mutation("longest light path", "src/transport/subpath.rs",
         "max_segments: self.max_depth - 1,", "max_segments: self.max_depth - 2,",
         ("agreement", "techniques_on_diffuse"))
mutation("longest connection", "src/integrator/bdpt.rs",
         "if segments + light_segments + 1 > tracer.max_depth {", "if segments + light_segments + 1 >= tracer.max_depth {",
         ("furnace", "depth_limit"))
mutation("roulette: division, BDPT", "src/transport/subpath.rs",
         "                    walk.beta /= survival;\n", "", ("agreement", "integrators_with_smooth_glass"))
mutation("roulette: division, path tracer", "src/integrator/path.rs",
         "                beta /= survival;\n", "", ("agreement", "integrators_with_smooth_glass"))

# Caustic connections.
mutation("caustic: check cut to 3 iterations", "src/transport/caustic.rs",
         "_ => (walk, SAME_CHAIN),",
         "_ => (WalkSettings { max_iterations: 3, ..walk }, SAME_CHAIN),",
         ("caustic", "ball"))
mutation("caustic: no check", "src/transport/caustic.rs",
         "let like = |edge: &CausticEdge| edge.leaves_like(first, last, close);",
         "let like = |edge: &CausticEdge| close < 0.0 && edge.leaves_like(first, last, close);",
         ("caustic", "ball"))
mutation("caustic: check without regard to rounding", "src/transport/caustic.rs",
         "like(known) || (rounded && exact().is_some_and(|edge| edge.is(known)))", "like(known)", ("extremes", "rim"))
mutation("starts: the check knows the straight line's walk alone", "src/transport/caustic.rs",
         "let known = self.chain(a, b, &seen, &settings);",
         "let known = self.solve(a, b, &seen, None, &settings).ok();",
         ("ball", "manifold"))
mutation("starts: the way back by the indices of the way there", "src/manifold/seed.rs",
         "back = refract(back, vertex.ns, crossing.n_o, crossing.n_i)?;",
         "back = refract(back, vertex.ns, crossing.n_i, crossing.n_o)?;",
         ("lib", "the_way_back_is_exact"))
mutation("search: facets are no reason for one", "src/transport/search.rs",
         "body.curved || (facets && body.facets > 0)", "body.curved",
         ("waves", "roof"))
mutation("search: chains through facets presumed as of curved glass", "src/transport/search.rs",
         "probability * share * (1.0", "probability * share.max(1.0) * (1.0", ("waves", "cut_stone"))
mutation("medium: asked with a ray along the axis of a model", "src/scene/media.rs",
         "(axis + u * x + v * y).normalize()", "(axis + (u * x + v * y) * 0.0).normalize()", ("extremes", "below_a_pole"))
mutation("lights: chosen more finely than random numbers are", "src/emitter/choose.rs",
         "(sum * STEPS).round() - before", "sum * STEPS - before", ("lib", "each_of_many_lights"))
mutation("search: the known chain counted again", "src/transport/search.rs",
         "look().filter(|edge| known.is_none_or(|known| !known.is(edge)))",
         "look()",
         ("waves", "a_point_light"))
mutation("search: found at the first look counts as certain", "src/transport/caustic.rs",
         "attempt: walks as f32 / probability,",
         "attempt: 1.0 / probability,",
         ("waves", "a_point_light"))
mutation("search: what is presumed, left out of sampled chains", "src/transport/edge.rs",
         "found.presumed * found.weight_inverse_jacobian / cos_b(edge, end)",
         "found.weight_inverse_jacobian / cos_b(edge, end)",
         ("waves", "a_lamp"))
mutation("caustic: straight-line geometry in the contribution", "src/transport/caustic.rs",
         "inverse_jacobian: chain.inverse_jacobian,",
         "inverse_jacobian: chain.lengths().iter().sum::<f64>().powi(2),",
         ("caustic", "ball"))
mutation("caustic: eta squared", "src/transport/caustic.rs",
         "(n_a / n_b).powi(2)", "(n_a / n_b).powi(0)",
         ("caustic", "light_in_a_glass_ball"))
mutation("caustic: depth cap", "src/transport/connect.rs",
         "Sight::Refracted(mut seen) if segments + seen.segments() <= self.max_depth => {",
         "Sight::Refracted(mut seen) if segments <= self.max_depth => {",
         ("caustic", "the_depth_cap"))
mutation("caustic: chain counted in the camera's own technique", "src/transport/edge.rs",
         "Departure::Camera => None,", "Departure::Camera => Some(Endpoint::Point(edge.origin)),",
         ("caustic", "camera_in_glass"))
mutation("caustic: the paper's base case, the camera's technique counted behind glass", "src/transport/edge.rs",
         "let (mut technique, mut sure) = if edge.chain == 0 {",
         "let camera = matches!(edge.departure, Departure::Camera);\n"
         "        let (mut technique, mut sure) = if edge.chain == 0 || camera {",
         ("weights", "area_light"))
mutation("caustic: roulette without its division", "src/transport/roulette.rs",
         "return attempt(1.0 / probability);", "return attempt(1.0);",
         ("options", "roulette_changes_nothing"))
mutation("caustic: opaque surfaces on the straight line stop the walk", "src/transport/sight.rs",
         "const MOST_OPAQUE: u32 = 8;", "const MOST_OPAQUE: u32 = 0;",
         ("caustic", "passes_beside"))
mutation("forecast: all light counts, not caustics alone", "src/render/moments.rs",
         "if path.light != Light::Caustic {", "if false {", ("lib", "other_light_is_no_part"))
mutation("forecast: not relative to what is around", "src/render/moments.rs",
         "all.add_scaled(m, 1.0 / square);", "all.add_scaled(m, 1.0);",
         ("lib", "a_bright_path_counts"))
mutation("roulette: light that the camera sees is part of the mean radiance", "src/render/moments.rs",
         "if !(added > 0.0 && added.is_finite()) || (c.camera.is_empty() && c.light.is_empty()) {",
         "if !(added > 0.0 && added.is_finite()) {",
         ("options", "connections_are_made"))

# Number of light subpaths.
mutation("light subpaths: their number in the weights of connections", "src/transport/connect.rs",
         "weight::connection(self.light_subpaths, camera_side, light_side)",
         "weight::connection(1.0, camera_side, light_side)", ("weights", "area_light"))
mutation("light subpaths: their number in the weights of what is not connected", "src/transport/edge.rs",
         "technique * count", "technique", ("weights", "area_light"))
mutation("light subpaths: their throughput", "src/transport/subpath.rs",
         "beta: sample.beta / self.light_subpaths as f32", "beta: sample.beta",
         ("options", "number_of_light_subpaths_changes"))
mutation("light subpaths: as many in each sample", "src/integrator/bdpt.rs",
         "(tracer.light_subpaths + f64::from(light_numbers.next_1d())) as u32", "tracer.light_subpaths.ceil() as u32",
         ("options", "number_of_light_subpaths_changes"))
mutation("sampler: one scrambling for four dimensions", "src/math/sampler.rs",
         "Int4::from(halves)", "Int4::from([halves[0]; 4])", ("lib", "the_numbers_of_one_sample"))
mutation("sampler: all samples the same point", "src/math/sampler.rs",
         "index: sample % POINTS", "index: 0", ("lib", "samples_of_a_pixel"))
mutation("noise: the last pass against all others", "src/render/film.rs",
         "        if self.passes.is_power_of_two() {", "        {", ("lib", "the_noise_estimate_knows"))
mutation("noise: of the passes since alone", "src/render/film.rs",
         "(squares / n * first * since).sqrt() / passes", "(squares / n * since).sqrt() / passes.sqrt()",
         ("lib", "the_noise_estimate_knows"))
mutation("light subpaths: forecast as if all paths needed one", "src/render/moments.rs",
         "path.camera_only + number * (1.0 - path.camera_only)", "number", ("options", "as_many_light_subpaths"))
mutation("forecast: searches as if nothing else found it", "src/render/moments.rs",
         "let others = added / attempts * weight", "let others = added * weight", ("lib", "what_is_left_out"))
mutation("forecast: the others have all the weight beside searches", "src/render/moments.rs",
         "* weight * (2.0 - weight * path.weight);", ";", ("lib", "what_is_left_out"))
mutation("search: no noise of its own in the forecast", "src/render/moments.rs",
         "- added * weight * weight / seldom", "", ("lib", "what_is_left_out"))
mutation("start: the straight line's triangles come first", "src/manifold/walk.rs",
         "end, seed, d, None, path)", "end, seed, d, Some(seed.vertices()), path)", ("lib", "a_start_goes_through"))
mutation("search: a sky counts as a lamp that cannot be hit", "src/emitter/mod.rs",
         "Endpoint::Infinite(direction) => self.suns.contains(direction),", "Endpoint::Infinite(_) => true,",
         ("waves", "a_sky_beside"))
mutation("search: never to lamps", "src/render/pilot.rs",
         "pilot.search = if saved", "pilot.search = if false && saved", ("options", "searches_are_made"))

# Aim.
mutation("forecast: walks that will not be made, charged to aim", "src/render/pilot.rs",
         "let unconnected = decides && [", "let unconnected = false && [",
         ("options", "light_is_aimed"))
mutation("aim: density of light leaving a surface, in the weights", "src/transport/aim.rs",
         "TransportMode::Radiance => e.pdf_reverse = mix(share, e.pdf_reverse, vertex.toward),",
         "TransportMode::Radiance => {}", ("weights", "area_light"))
mutation("aim: weight of what was drawn at a surface", "src/transport/aim.rs",
         "weight: sample.weight * plain, pdf,", "pdf,", ("options", "aim_changes"))
mutation("aim: density of emission", "src/emitter/light.rs",
         "(1.0 - share) * plain + share * targets.density(from, &reach, total, direction)", "plain",
         ("lib", "aimed_light_carries"))
mutation("aim: light from infinity, several spheres in one direction", "src/geometry/targets.rs",
         "self.met(scene).filter(|t| meets(t, through, direction)).count() as f64 / total",
         "f64::from(u8::from(self.met(scene).any(|t| meets(t, through, direction)))) / total",
         ("lib", "aimed"))
mutation("aim: light from infinity, density by the receiver's ray", "src/transport/connect.rs",
         "(chain.last, chain.exit), a.at.p);", "(chain.last, a.at.p), a.at.p);",
         ("weights", "delta_lights"))
mutation("aim: light from infinity, share of plain emission", "src/emitter/light.rs",
         "return (1.0 - share) * plain + share * targets.density_parallel",
         "return plain + share * targets.density_parallel",
         ("options", "aim_of_light_from_infinity"), ("lib", "aimed_light_carries"))
mutation("image environment: density by pixels instead of between them", "src/emitter/map.rs",
         "probability * here / (mean * solid_angle)", "probability * here / (here * solid_angle)",
         ("lib", "emitter::tests::environment"))
mutation("image environment: rows all alike", "src/emitter/map.rs",
         "rows.push(sum.dot(LUMINANCE));", "rows.push(sum.dot(LUMINANCE).signum());",
         ("lib", "emitter::tests::environment"))
mutation("image environment: rows of equal angle have equal area", "src/emitter/map.rs",
         "(0.5 * PI * (row as f64 - 0.5) / height as f64).sin().powi(2)", "(row as f64 - 0.5) / height as f64",
         ("lib", "emitter::tests::environment"))
mutation("image environment: mirrored", "src/emitter/map.rs",
         "(0.5 - d.x.atan2(d.z) / (2.0 * PI))", "(0.5 + d.x.atan2(d.z) / (2.0 * PI))",
         ("references", "sky_path"), ("lib", "the_centre_of_a_pixel"))
mutation("image environment: turned the other way", "src/emitter/infinite.rs",
         "self.radiance * map.radiance(rotation.transpose() * to_light)",
         "self.radiance * map.radiance(*rotation * to_light)",
         ("references", "sky_path"), ("lib", "a_rotation_turns"))
mutation("forecast: rare connections count as often as they are rare", "src/render/moments.rs",
         "more(0.0).min(added * MOST_SELDOM)", "more(0.0)",
         ("options", "connections_are_made"))
mutation("forecast: connections by typical groups alone", "src/render/pilot.rs",
         "let moments = samples.iter().flat_map(|s| &s.moments);",
         "let mut moments: Vec<_> = samples.iter().flat_map(|s| &s.moments).collect();\n"
         "    moments.sort_by(|a, b| a.unconnected.total_cmp(&b.unconnected));\n"
         "    moments.truncate(moments.len() * TYPICAL / GROUPS as usize);\n    let moments = moments.into_iter();",
         ("options", "connections_are_made"))
mutation("aim: at surfaces that transmit, too", "src/scatter/mod.rs",
         "lobe.connectable() && !lobe.transmits()", "lobe.connectable()", ("weights", "area_light"))
mutation("aim: directions that rounding puts outside", "src/geometry/targets.rs",
         "within(direction.as_dvec3().normalize(), to, sin2).then_some(direction)", "Some(direction)",
         ("lib", "small_and_far"))
mutation("aim: several spheres in one direction", "src/geometry/targets.rs",
         "sum += sin2 / (2.0 * PI * one_minus_cos(sin2));", "sum = sin2 / (2.0 * PI * one_minus_cos(sin2));",
         ("lib", "directions_follow"))
mutation("rough chain: Jacobian of the wrong measure", "src/manifold/rough.rs",
         "value: density[0] * v_o * n_o.abs()", "value: density[0] / nh * v_o * n_o.abs()",
         ("caustic", "rough_mesh"))
mutation("rough chain: masking", "src/manifold/rough.rs",
         "value: density[0] * v_o * n_o.abs()", "value: density[0]",
         ("lib", "walked_refraction_is_the_evaluated"))
mutation("rough chain: microfacets that do not turn with the surface", "src/manifold/rough.rs",
         "n_u: derivative(at.n_u),", "n_u: DVec3::ZERO,",
         ("lib", "a_microfacet_turns"))
mutation("rough chain: density of the microfacet", "src/scatter/rough_dielectric.rs",
         "density: [2.0 * v_1 * cos_1 / normal.z,", "density: [2.0 * v_1 * cos_1,",
         ("lib", "walked_refraction_is_the_evaluated"))
mutation("rough chain: walked in spite of delta lights", "src/scene/world.rs",
         ".filter(|_| !delta_lights)", ".filter(|_| true)",
         ("caustic", "rough_glass_is_evaluated"))
mutation("rough chain: order of the microfacets from the light", "src/transport/edge.rs",
         "microfacets.reverse();", "",
         ("caustic", "rough_mesh"))

# Textures.
mutation("texture: green and blue change places", "src/scene/textured.rs",
         "m.roughness = (m.roughness * value.y)",
         "m.roughness = (m.roughness * value.z)",
         ("textures", "roughness_and_metal"))
mutation("texture: the color of glass is left out of walks", "src/transport/caustic.rs",
         "let refraction = self.bsdf(at, &mut None).walked_refraction().ok_or(None)?;",
         "let refraction = self.factors(at.shape).walked_refraction().ok_or(None)?;",
         ("caustic", "textures_and_stained_glass"))
mutation("texture: of another point", "src/geometry/mesh.rs",
         "let u = inside(d.cross(e2).dot(m) * scale, 1.0);",
         "let u = inside(e1.cross(d).dot(m) * scale, 1.0);",
         ("textures", "colors"))
mutation("texture: half a texel off", "src/texture/map.rs",
         "let (x, y) = (x - 0.5, y - 0.5);",
         "let (x, y) = (x, y);",
         ("lib", "rows_run_from_the_top"))
mutation("texture: a lamp without its image", "src/emitter/light.rs",
         "mesh(shapes, l.shape).map_or(Rgb::ZERO, |m| glow.at(m, s)) * radiance(&l.emission)",
         "mesh(shapes, l.shape).map_or(Rgb::ZERO, |_| Rgb::splat(glow.map.at(glam::Vec2::ZERO).x)) * radiance(&l.emission)",
         ("textures", "emission"))
mutation("texture: a lamp that chance finds dark is none", "src/emitter/glow.rs",
         "(sum / f64::from(self.points)).max(least)",
         "(sum / f64::from(self.points)).max(least * 0.0)",
         ("textures", "a_lamp_is_not_lost"))
mutation("normal map: down is up", "src/scene/textured.rs",
         "let up = up * -1f32.copysign(up.dot(down));",
         "let up = up * 1f32.copysign(up.dot(down));",
         ("textures", "normals"))
mutation("normal map: mirrored images are not", "src/geometry/mesh.rs",
         "let sign = d1.perp_dot(d2).signum();",
         "let sign = 1.0;",
         ("textures", "normals"))
mutation("texture: connections see the factors", "src/scene/textured.rs",
         "if material.textures.scatter() { bsdf.varying() } else { bsdf }",
         "bsdf",
         ("agreement", "integrators_with_textures"))


def apply(name):
    file, old, new, _ = MUTATIONS[name]
    path = ROOT / file
    text = path.read_text()
    if text.count(old) != 1:
        sys.exit(f"{name}: found {text.count(old)} times in {file}, not once: {old!r}")
    return path, text, text.replace(old, new)


def failing(target, filter):
    """Names of the failing tests. A mutant that does not compile, and a filter without tests, are errors."""
    of = ["--lib"] if target == "lib" else ["--test", target]
    build = subprocess.run(["cargo", "test", "--quiet", "--no-run", *of], cwd=ROOT, capture_output=True, text=True)
    if build.returncode != 0:
        raise RuntimeError(build.stderr)
    run = subprocess.run(["cargo", "test", *of, filter], cwd=ROOT, capture_output=True, text=True)
    failed = re.findall(r"^    (\S+)$", run.stdout.split("\nfailures:\n")[-1], re.M) if run.returncode else []
    if run.returncode and not failed:
        raise RuntimeError(run.stdout + run.stderr)
    if not failed and not re.search(r"[1-9]\d* passed", run.stdout):
        raise RuntimeError(f"no test of {target} matches '{filter}'")
    return sorted(set(failed))


def main():
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that a kill, too, restores the file
    if arguments == ["--list"]:
        return print("\n".join(MUTATIONS))
    for name in MUTATIONS:
        apply(name)
    if arguments == ["--table"]:
        print("| change | noticed by |\n|---|---|")
        for name, (_, _, _, tests) in MUTATIONS.items():
            print(f"| {name} | {', '.join(f'`{target}` {filter}'.strip() for target, filter in tests)} |")
        return
    if arguments == ["--check"]:
        return print(f"{len(MUTATIONS)} mutations apply")
    if subprocess.run(["git", "status", "--porcelain", "--untracked-files=no"], cwd=ROOT, check=True,
                      capture_output=True, text=True).stdout.strip():
        sys.exit("the tree has changes: commit or stash them first")
    everything = "--all" in arguments
    names = [a for a in arguments if a != "--all"] or list(MUTATIONS)
    for name in names:
        if name not in MUTATIONS:
            sys.exit(f"no mutation is called '{name}'; --list shows them")
    unnoticed = []
    for name in names:
        path, before, after = apply(name)
        tests = [(oracle, "") for oracle in ORACLES] if everything else MUTATIONS[name][3]
        try:
            path.write_text(after)
            found = [(target, filter, failing(target, filter)) for target, filter in tests]
        finally:
            path.write_text(before)
        missing = [f"{target} {filter}".strip() for target, filter, failed in found if not failed]
        text = "; ".join(f"{target}: {', '.join(failed)}" for target, _, failed in found if failed)
        print(f"{name}: {text or 'NOTHING FAILS'}", flush=True)
        if missing and (not everything or len(missing) == len(tests)):
            unnoticed.append(f"{name} ({', '.join(missing)})")
    if unnoticed:
        sys.exit("not noticed as it should be: " + ", ".join(unnoticed))


main()
PYTHON
