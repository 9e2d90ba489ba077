//! Where digits are lost: grazing angles, total reflection, thin shells, equal media, foci, scale,
//! distance from the origin.

use super::closed_forms::{stack, stack_closed};
use super::*;
use crate::geometry::Sphere;
use crate::manifold::constraint::Form;
use glam::Vec3;
use std::f64::consts::FRAC_PI_2;

#[test]
fn grazing_slab() {
    let layers = [(1.0, 1.0), (1.5, 0.4), (1.0, 2.3)];
    let gt = |theta: f64| stack(&layers, theta) * theta.cos().powi(2);
    assert!(error(gt(1.5), 2.28151065e-6) < 1e-8);
    assert!(error(gt(1.5), stack_closed(&layers, 1.5)) < 1e-12);
    assert!(error(gt(FRAC_PI_2 - 1e-4), stack_closed(&layers, FRAC_PI_2 - 1e-4)) < 1e-7);
}

#[test]
fn almost_total_reflection() {
    let layers = [(1.5, 1.0), (1.0, 2.0)];
    let theta = (1.0 / 1.5f64).asin() - 1e-6;
    let cos_b = ((1.5 * theta.cos()).powi(2) - 1.25).sqrt();
    let gt = stack(&layers, theta) * theta.cos() * cos_b;
    assert!(error(gt, 5.55184e-13) < 1e-5, "{gt}");
    assert!(error(gt, stack_closed(&layers, theta)) < 1e-11, "{}", error(gt, stack_closed(&layers, theta)));
}

#[test]
fn thin_shell() {
    let layers = [(1.0, 1.0), (1.5, 1e-10), (1.0, 2.3)];
    for theta in [0.0, 0.3, 1.0] {
        assert!(error(stack(&layers, theta) * f64::cos(theta).powi(2), stack_closed(&layers, theta)) < 1e-15 * 8.0);
    }
    // The walk, too: directions do not come from differences of positions.
    let solids = [Solid::plane(1.0, 1.0, 1.5), Solid::plane(1.0 + 1e-10, 1.5, 1.0)];
    let b = DVec3::new(0.5, 0.3, 3.3);
    let chain = connect(&solids, DVec3::ZERO, b, &WalkSettings::default()).unwrap();
    let straight = b.length_squared();
    assert!(error(chain.inverse_jacobian, straight) < 1e-9 && chain.iterations <= 3);
}

#[test]
fn nearly_equal_media() {
    let ball = [Solid::ball(DVec3::ZERO, 1.0, 1.0 + 1e-6)];
    // On the axis B = s_1 + s_2 + 2 - 2 (n-1)/n (s_1 + 1)(s_2 + 1).
    let (s_1, s_2) = (4.0, 3.0);
    let chain = connect(&ball, DVec3::Z * -(1.0 + s_1), DVec3::Z * (1.0 + s_2), &EXACT).unwrap();
    let excess = (s_1 + s_2 + 2.0).powi(2) / chain.inverse_jacobian - 1.0;
    assert!(error(excess, 4.0 * (s_1 + 1.0) * (s_2 + 1.0) / 9.0 * 1e-6) < 2e-5, "{excess}");
    let mut random = Random::new(51);
    for _ in 0..200 {
        let (a, b) = (random.disk(0.5, -3.0), random.disk(0.5, 4.0));
        let chain = connect(&ball, a, b, &WalkSettings::default()).unwrap();
        let excess = (b - a).length_squared() / chain.inverse_jacobian - 1.0;
        assert!(excess.abs() < 3e-5 && chain.iterations <= 3, "{excess} {}", chain.iterations);
    }
}

#[test]
fn equal_media_are_no_obstacle() {
    let ball = [Solid::ball(DVec3::ZERO, 1.0, 1.0)];
    let (a, b) = (DVec3::new(0.3, 0.0, -3.0), DVec3::new(0.0, 0.4, 4.0));
    let chain = connect(&ball, a, b, &WalkSettings::default()).unwrap();
    assert_eq!((chain.iterations, chain.transmittance), (0, 1.0));
    assert!(error(chain.inverse_jacobian, (b - a).length_squared()) < 1e-13);
}

/// An index-matched ball around a glass one: its half vector vanishes, its normalised one does not exist.
#[test]
fn equal_media_within_a_chain() {
    let glass = Solid::ball(DVec3::ZERO, 1.0, 1.5);
    let matched = Solid::ball(DVec3::Z * 0.2, 1.4, 1.0);
    let (a, b) = (DVec3::new(0.3, 0.0, -3.0), DVec3::new(0.0, 0.4, 4.0));
    let bare = connect(std::slice::from_ref(&glass), a, b, &EXACT).unwrap();
    let wrapped = connect(&[glass, matched], a, b, &EXACT).unwrap();
    assert!(wrapped.vertices().len() == 4 && wrapped.first.distance(bare.first) < 1e-13);
    assert!(error(wrapped.inverse_jacobian, bare.inverse_jacobian) < 1e-12);
    assert!(error(wrapped.transmittance, bare.transmittance) < 1e-14);
}

#[test]
fn inner_focal_point() {
    // The image of a through the first interface lies on the second: a leading block vanishes.
    let ball = [Solid::ball(DVec3::ZERO, 1.0, 2.4)];
    let chain = connect(&ball, DVec3::Z * -6.0, DVec3::Z * 2.3, &EXACT).unwrap();
    assert!(error(1.0 / chain.inverse_jacobian, 0.0164365548980934) < 1e-13);
    assert!(error(block_form::jacobian(&chain, |_, _| Form::HalfVector), 0.0164365548980934) < 1e-9);
}

#[test]
fn a_focus_is_a_clean_zero() {
    // s_1 = 4: B = 0 at s_2 = 8/7.
    let ball = [Solid::ball(DVec3::ZERO, 1.0, 1.5)];
    let chain = connect(&ball, DVec3::Z * -5.0, DVec3::Z * (1.0 + 8.0 / 7.0), &EXACT).unwrap();
    assert!((0.0..1e-28).contains(&chain.inverse_jacobian), "{}", chain.inverse_jacobian);
    // Weighted contribution: C0 J/(1 + k J) in the form C0/(1/J + k).
    assert!((3.0 / (chain.inverse_jacobian + 2.0) - 1.5f64).abs() < 1e-15);
}

#[test]
fn a_fold_grows_as_the_inverse_square_root() {
    // One plane, from glass to air: the caustic of refraction. J sqrt(d) is constant at a fold; the ball
    // with a off the axis has one, found here by the direction whose differential area vanishes.
    let ball = Ball { center: DVec3::ZERO, radius: 1.0 };
    let a = DVec3::Z * -5.0;
    let trace = |p: f64| {
        let d = DVec3::new(p, 0.0, 1.0).normalize();
        let mut ray = RayDifferential::leaving(d);
        let (t, at) = ball.meet(a, d, false).unwrap();
        ray.transfer(t, at.ng);
        assert!(ray.refract(&at, 1.0, 1.5));
        let (t, at) = ball.meet(at.p, ray.direction(), true).unwrap();
        ray.transfer(t, at.ng);
        assert!(ray.refract(&at, 1.5, 1.0));
        (at.p, ray)
    };
    // In the plane z = 1.5, outside the focus: the landing point x(p) has a minimum or maximum.
    let land = |p: f64| {
        let (x, ray) = trace(p);
        let t = (1.5 - x.z) / ray.direction().z;
        ((x + ray.direction() * t).x, ray.area(t) / ray.direction().z.abs())
    };
    let (mut lo, mut hi) = (0.02, 0.18);
    for _ in 0..200 {
        let (x, y) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
        if land(x).0.abs() > land(y).0.abs() { hi = y } else { lo = x }
    }
    let (fold, edge) = (0.5 * (lo + hi), land(0.5 * (lo + hi)).0);
    let products = [3e-3, 1e-3, 3e-4].map(|h| {
        let (x, area) = land(fold + h);
        (x - edge).abs().sqrt() / area
    });
    for p in products {
        assert!(error(p, products[2]) < 0.05, "{products:?}");
    }
}

#[test]
fn a_ring_caustic_ends_without_nan() {
    // a and b on the axis of a ball and conjugate for rays of one cone: a circle of solutions.
    let ball = [Solid::ball(DVec3::ZERO, 1.0, 1.5)];
    let local = Local { solids: &ball, a: DVec3::Z * -5.0 };
    let d = DVec3::new(0.12, 0.0, 1.0).normalize();
    let (_, x_1) = local.meet(0, &Probe { origin: DVec3::ZERO, direction: d, source: None, hint: None }).unwrap();
    let inside = crate::manifold::refraction::refract(d, x_1.ns, 1.0, 1.5).unwrap();
    let source = Some(Source { interface: 0, primitive: 0 });
    let (_, x_2) = local.meet(0, &Probe { origin: x_1.p, direction: inside, source, hint: None }).unwrap();
    let out = crate::manifold::refraction::refract(inside, x_2.ns, 1.5, 1.0).unwrap();
    let b = x_2.p + out * (-x_2.p.x / out.x);
    assert!(b.x.abs() < 1e-12 && b.z > x_2.p.z);
    let mut random = Random::new(52);
    let (mut on_ring, mut other) = (0, 0);
    for _ in 0..500 {
        let shaken = |at: &Differential, r: &mut Random| {
            let n = (at.p - DVec3::Z * 5.0 + r.cube(0.02)).normalize();
            Ball { center: DVec3::Z * 5.0, radius: 1.0 }.at(n)
        };
        let mut seed = Seed::default();
        seed.push(Crossing { interface: 0, inward: true, n_i: 1.0, n_o: 1.5 }, &shaken(&x_1, &mut random)).unwrap();
        seed.push(Crossing { interface: 0, inward: false, n_i: 1.5, n_o: 1.0 }, &shaken(&x_2, &mut random)).unwrap();
        match walk(&local, None, End::Point(b), &seed, None, &WalkSettings::default()) {
            Ok(chain) => {
                assert!(chain.inverse_jacobian.is_finite() && chain.residual <= 1e-8);
                let lean = chain.first.truncate().length();
                on_ring += ((lean - d.x).abs() < 1e-6 && chain.inverse_jacobian < 1e-5) as u32;
            }
            Err(_) => other += 1,
        }
    }
    assert!(on_ring > 100, "{on_ring} on the ring, {other} without result");
}

#[test]
fn scale_changes_nothing() {
    let mut random = Random::new(53);
    for round in 0..200 {
        let (solids, a, b) = if round % 2 == 0 {
            (vec![Solid::ball(DVec3::ZERO, 1.0, 1.5)], random.disk(1.0, -1.6), random.disk(1.0, 5.0))
        } else {
            (bent_slab(&mut random, [1.0, 1.5, 1.2]), random.disk(0.8, -0.5), random.disk(0.8, 3.0))
        };
        let settings = WalkSettings::default();
        let reference = connect(&solids, a, b, &settings);
        for by in [1e-6, 1e-3, 1e3, 1e6] {
            let scaled: Vec<_> = solids.iter().map(|s| s.scaled(by)).collect();
            match (&reference, connect(&scaled, a * by, b * by, &settings)) {
                (Ok(x), Ok(y)) => {
                    assert_eq!(x.iterations, y.iterations);
                    // Rounding of the scaled data moves the root by an ulp, the differential area by as
                    // much of its largest term. Slow walks end with what residual there is.
                    let size = (b - a).length_squared();
                    let rest = x.residual + y.residual;
                    let e = (y.inverse_jacobian / (by * by) - x.inverse_jacobian).abs();
                    assert!(e < (1e-12 + rest) * size.max(x.inverse_jacobian), "{by}: {e}, residuals {rest}");
                }
                (Err(x), Err(y)) => assert_eq!(x.reason, y.reason),
                (x, y) => panic!("{by}: {x:?} {y:?}"),
            }
        }
    }
}

#[test]
fn far_from_the_origin_the_local_frame_keeps_every_bit() {
    // Offsets on the grid of f32 at 1e5, so that the scenes are the same.
    let grid = |v: DVec3| (v * 64.0).round() / 64.0;
    let at = Vec3::splat(1e5);
    let mut random = Random::new(54);
    let settings = WalkSettings::default();
    for _ in 0..200 {
        let (a, b) = (grid(random.disk(1.0, -1.6)), grid(random.disk(1.0, 5.0)));
        let solve = |shift: Vec3| {
            let origin = shift.as_dvec3() + a;
            let ball = Sphere { center: shift, radius: 1.0 }.local(origin);
            let solids = [Solid { surface: Surface::Ball(ball), front: 1.0, back: 1.5 }];
            let far_end = (b.as_vec3() + shift).as_dvec3() - origin;
            reach(&solids, DVec3::ZERO, End::Point(far_end), &settings)
        };
        assert_eq!(format!("{:?}", solve(Vec3::ZERO)), format!("{:?}", solve(at)));
    }
}

#[test]
fn an_end_almost_on_the_glass() {
    // s_1 = 1e-6 R before the ball, on the axis.
    let ball = [Solid::ball(DVec3::ZERO, 1.0, 1.5)];
    let (s_1, s_2) = (1e-6, 3.0);
    let chain = connect(&ball, DVec3::Z * -(1.0 + s_1), DVec3::Z * (1.0 + s_2), &EXACT).unwrap();
    let b = s_1 + s_2 + 2.0 - 2.0 * 0.5 / 1.5 * (s_1 + 1.0) * (s_2 + 1.0);
    assert!(error(1.0 / chain.inverse_jacobian, 1.0 / (b * b)) < 1e-10);
}

#[test]
fn an_end_on_the_glass_itself_skips_its_source() {
    // a on the front of the ball, looking through: only the far side is refracted at.
    let ball = [Solid::ball(DVec3::ZERO, 1.0, 1.5)];
    let local = Local { solids: &ball, a: DVec3::NEG_Z };
    let source = Some(Source { interface: 0, primitive: 0 });
    let end = End::Point(DVec3::new(0.2, 0.0, 4.0));
    let d = DVec3::new(0.2, 0.0, 4.0).normalize();
    let (_, at) = local.meet(0, &Probe { origin: DVec3::ZERO, direction: d, source, hint: None }).unwrap();
    let mut seed = Seed::default();
    seed.push(Crossing { interface: 0, inward: false, n_i: 1.5, n_o: 1.0 }, &at).unwrap();
    let chain = walk(&local, source, end, &seed, None, &WalkSettings::default()).unwrap();
    assert!(chain.vertices().len() == 1 && (chain.lengths()[0] - 2.0).abs() < 0.1);
    assert_eq!(chain.end_indices(), (1.5, 1.0));
}

#[test]
fn degenerate_triangles_are_refused() {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::new(0.5, 1e-13, 0.0)];
    assert!(Facet { corners, normals: None, primitive: 0 }.at(0.3, 0.3).is_none());
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let opposite = Some([DVec3::X, DVec3::NEG_X, DVec3::Z]);
    assert!(Facet { corners, normals: opposite, primitive: 0 }.at(0.5, 0.0).is_none());
}

#[test]
fn seeds_refuse_long_chains_and_media_that_do_not_fit() {
    let at = Differential::FLAT;
    let crossing = |n_i: f64, n_o: f64| Crossing { interface: 0, inward: true, n_i, n_o };
    let mut seed = Seed::default();
    for _ in 0..MAX_CHAIN / 2 {
        seed.push(crossing(1.0, 1.5), &at).unwrap();
        assert_eq!(seed.push(crossing(1.0, 1.5), &at), Err(Rejection::Media));
        seed.push(crossing(1.5, 1.0), &at).unwrap();
    }
    assert_eq!(seed.push(crossing(1.0, 1.5), &at), Err(Rejection::TooLong));
    let nothing =
        walk(&Local { solids: &[], a: DVec3::ZERO }, None, End::Point(DVec3::Z), &Seed::default(), None, &EXACT);
    assert_eq!(nothing.unwrap_err().reason, Rejection::Empty);
}
