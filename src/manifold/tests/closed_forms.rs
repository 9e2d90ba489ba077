//! Geometry terms that are known in closed form.

use super::*;

/// `J` through a stack of planes perpendicular to z, by ray differentials along the exact path from
/// angle `theta` in the first medium: `layers` are index and thickness. Receiver facing the ray.
pub(super) fn stack(layers: &[(f64, f64)], theta: f64) -> f64 {
    let d = DVec3::new(theta.sin(), 0.0, theta.cos());
    let mut ray = RayDifferential::leaving(d);
    for pair in layers.windows(2) {
        let t = pair[0].1 / ray.direction().z;
        ray.transfer(t, DVec3::Z);
        assert!(ray.refract(&Differential::FLAT, pair[0].0, pair[1].0));
    }
    1.0 / ray.area(layers[layers.len() - 1].1 / ray.direction().z)
}

/// `Gt = cos_0/(S1 S2)` of planes parallel to the stack.
pub(super) fn stack_closed(layers: &[(f64, f64)], theta: f64) -> f64 {
    let (n_0, c_0) = (layers[0].0, theta.cos());
    let (mut s_1, mut s_2) = (0.0, 0.0);
    for &(n, h) in layers {
        // As 1 - (n_0/n)^2 + (n_0 c_0/n)^2: near total reflection the plain form loses the digits.
        let c = if n == n_0 { c_0 } else { ((n - n_0) * (n + n_0) / (n * n) + (n_0 * c_0 / n).powi(2)).sqrt() };
        s_1 += h * n_0 / (n * c);
        s_2 += h * n_0 * c_0 / (n * c.powi(3));
    }
    c_0 / (s_1 * s_2)
}

/// `cos_a cos_b J` from the walk, for receivers perpendicular to z.
fn gt(chain: &Chain) -> f64 {
    (chain.first.z * chain.last.z).abs() / chain.inverse_jacobian
}

#[test]
fn slab() {
    let layers = [(1.0, 1.0), (1.5, 0.4), (1.0, 2.3)];
    for (theta, expected) in [(0.0, 0.07860948554458905), (0.3, 0.06597287143803987), (1.0, 0.007270235324537531)] {
        let cos = f64::cos(theta);
        assert!(error(stack(&layers, theta) * cos * cos, expected) < 1e-13);
        assert!(error(stack_closed(&layers, theta), expected) < 1e-13);
        // And by the walk, from the offset that belongs to the angle.
        let inside = (cos.powi(2) + 1.25).sqrt() / 1.5;
        let offset = theta.sin() * (3.3 / cos + 0.4 / (1.5 * inside));
        let solids = [Solid::plane(1.0, 1.0, 1.5), Solid::plane(1.4, 1.5, 1.0)];
        let chain = connect(&solids, DVec3::ZERO, DVec3::new(offset, 0.0, 3.7), &EXACT).unwrap();
        assert!(error(gt(&chain), expected) < 1e-10, "{theta}: {}", error(gt(&chain), expected));
        assert!((chain.vertices()[0].p.x - theta.tan()).abs() < 1e-13);
        assert!(error(chain.kappa, 1.0) < 1e-14);
    }
}

#[test]
fn glass_to_air() {
    let layers = [(1.5, 1.0), (1.0, 2.0)];
    let planar = stack(&layers, 0.5) * (0.5f64.cos() * (1.0 - (1.5 * 0.5f64.sin()).powi(2)).sqrt());
    assert!(error(planar, 0.0175848709) < 3e-9, "{planar}");
    assert!(error(planar, stack_closed(&layers, 0.5)) < 1e-13);
}

#[test]
fn one_spherical_interface_on_the_axis() {
    // s_1 = 2 before the vertex of a sphere of radius 1, s_2 = 3 behind it, inside glass without end.
    let solid = [Solid::ball(DVec3::Z * 3.0, 1.0, 1.5)];
    let local = Local { solids: &solid, a: DVec3::ZERO };
    let (_, at) = local.meet(0, &Probe { origin: DVec3::ZERO, direction: DVec3::Z, source: None, hint: None }).unwrap();
    let mut seed = Seed::default();
    seed.push(Crossing { interface: 0, inward: true, n_i: 1.0, n_o: 1.5 }, &at).unwrap();
    let chain = walk(&local, None, End::Point(DVec3::Z * 5.0), &seed, None, &EXACT).unwrap();
    assert!(error(gt(&chain), 0.25) < 1e-14);
    assert!(error(1.0 / chain.reverse_inverse_jacobian(), 1.0 / 9.0) < 1e-14);
    assert!(error(chain.transmittance, 0.96) < 1e-14);
}

#[test]
fn ball_on_the_axis() {
    let ball = [Solid::ball(DVec3::ZERO, 1.0, 1.5)];
    for (s_1, s_2, expected) in [(4.0, 3.0, 9.0 / 169.0), (2.0, 0.5, 4.0 / 9.0), (10.0, 0.3, 0.130643054144288)] {
        let chain = connect(&ball, DVec3::Z * -(1.0 + s_1), DVec3::Z * (1.0 + s_2), &EXACT).unwrap();
        assert!(error(gt(&chain), expected) < 1e-13, "{}", gt(&chain));
        assert!(error(chain.transmittance, 0.96 * 0.96) < 1e-14);
    }
}

/// A directional light through a ball: `J_dir = 1/D^2` of the ray transfer matrix.
#[test]
fn a_direction_through_a_ball_on_the_axis() {
    for (n, s) in [(1.5, 4.0), (1.33, 2.0), (2.0, 0.7)] {
        // Rows of the matrix on (height, angle): travel, refract in, travel 2R, refract out.
        let power = n - 1.0;
        let step = |(y, u): (f64, f64)| {
            let inside = (y, (u - power * y) / n);
            let far = inside.0 + 2.0 * inside.1;
            (far, n * inside.1 - power * far)
        };
        let d = step((s, 1.0)).1;
        let ball = [Solid::ball(DVec3::ZERO, 1.0, n)];
        let chain = reach(&ball, DVec3::Z * -(1.0 + s), End::Direction(DVec3::Z), &EXACT).unwrap();
        assert!(error(1.0 / chain.inverse_jacobian, 1.0 / (d * d)) < 1e-12);
        assert!(chain.lengths()[2].is_infinite() && chain.last == DVec3::NEG_Z);
    }
}

#[test]
fn transmittance_is_that_of_the_surface_scattering() {
    let mut random = Random::new(21);
    for _ in 0..10_000 {
        let (n_i, n_o) = (random.within(1.0, 2.0), random.within(1.0, 2.0));
        let cos = random.within(0.05, 1.0);
        let d = DVec3::new((1.0 - cos * cos).sqrt(), 0.0, -cos);
        let t = Passage::new(&Differential::FLAT, d, d, n_i, n_o).transmittance();
        let f = crate::scatter::fresnel::dielectric(n_i as f32, n_o as f32, cos as f32) as f64;
        // f32 loses half its digits near the critical angle.
        assert!((t + f - 1.0).abs() < 3e-3, "{n_i} {n_o} {cos}: {t} {f}");
        let far = ((n_i / n_o).powi(2) * (1.0 - cos * cos) - 1.0).abs() > 1e-2;
        assert!(!far || (t + f - 1.0).abs() < 2e-5, "{n_i} {n_o} {cos}: {t} {f}");
    }
}
