//! The constraint's derivatives against central differences.

use super::*;
use crate::manifold::constraint::{Block, Constraint, Form, Joint};

/// A surface point that can be moved along its tangents.
#[derive(Clone, Copy)]
enum Movable {
    Ball(Ball, Differential),
    Facet(Facet, Differential, [f64; 2]),
}

impl Movable {
    fn at(&self) -> Differential {
        match self {
            Movable::Ball(_, at) | Movable::Facet(_, at, _) => *at,
        }
    }

    /// The surface after a step along tangent `k`; the first tangent, to which the equations refer,
    /// stays what it was.
    fn moved(&self, k: usize, h: f64) -> Differential {
        let at = self.at();
        let new = match self {
            Movable::Ball(ball, _) => ball.at((at.p + [at.p_u, at.p_v][k] * h - ball.center).normalize()),
            Movable::Facet(facet, _, [u, v]) => {
                // In barycentrics, which keep their digits on slivers: p_u = e1/|e1|, e2 = x p_u + y p_v.
                let (e1, e2) = (facet.corners[1] - facet.corners[0], facet.corners[2] - facet.corners[0]);
                let (x, y) = (e2.dot(at.p_u), e2.dot(at.p_v));
                let (du, dv) = if k == 0 { (h, 0.0) } else { (-h * x / y, h / y) };
                facet.at(u + du / e1.length(), v + dv).unwrap()
            }
        };
        Differential { p_u: at.p_u, p_v: at.p_v, ..new }
    }
}

fn value(x: [DVec3; 3], own: &Differential, n: [f64; 2], form: Form) -> [f64; 2] {
    with(x, own, n, form, |c| c.value())
}

fn with<T>(x: [DVec3; 3], own: &Differential, n: [f64; 2], form: Form, read: impl Fn(&Constraint) -> T) -> T {
    let (i, o) = (x[0] - x[1], x[2] - x[1]);
    let joint = Joint {
        at: own,
        w_i: i.normalize(),
        inverse_r_i: 1.0 / i.length(),
        w_o: o.normalize(),
        inverse_r_o: 1.0 / o.length(),
        n_i: n[0],
        n_o: n[1],
    };
    read(&Constraint::new(joint, form))
}

/// Largest difference between the derivatives and their central differences of step `h`, over the
/// largest entry.
fn deviation(points: [Movable; 3], n: [f64; 2], form: Form, h: f64) -> f64 {
    let at = points.map(|m| m.at());
    let x = at.map(|d| d.p);
    let tangents = |d: &Differential| [d.p_u, d.p_v];
    let analytic: [Block; 3] =
        with(x, &at[1], n, form, |c| [c.previous(tangents(&at[0])), c.own(), c.next(tangents(&at[2]))]);
    let mut worst = 0.0f64;
    for (j, block) in analytic.iter().enumerate() {
        let largest = block.as_flattened().iter().fold(0.0f64, |m, b| m.max(b.abs()));
        for k in [0, 1] {
            let shifted = |sign: f64| {
                let new = points[j].moved(k, sign * h);
                let mut moved = x;
                moved[j] = new.p;
                let own = if j == 1 { new } else { at[1] };
                value(moved, &own, n, form)
            };
            let (plus, minus) = (shifted(1.0), shifted(-1.0));
            for r in [0, 1] {
                let difference = (plus[r] - minus[r]) / (2.0 * h);
                worst = worst.max((difference - block[r][k]).abs() / largest);
            }
        }
    }
    worst
}

fn random_facet(random: &mut Random, near: DVec3, squeeze: f64) -> Movable {
    let corners = loop {
        let [p, q, r] = [random.cube(1.0), random.cube(1.0), random.cube(1.0)];
        let m = (q - p).cross(r - p);
        if m.length() > 0.5 {
            let along = (q - p) * (r - p).dot(q - p) / (q - p).length_squared();
            break [p, q, p + along + (r - p - along) * squeeze];
        }
    };
    let ng = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
    let normals = Some([0; 3].map(|_| (ng + random.cube(0.5)).normalize()));
    let facet = Facet { corners: corners.map(|p| p + near), normals, primitive: 0 };
    let (u, v) = (random.within(0.2, 0.4), random.within(0.2, 0.4));
    Movable::Facet(facet, facet.at(u, v).unwrap(), [u, v])
}

fn random_ball(random: &mut Random, near: DVec3) -> Movable {
    let ball = Ball { center: near + random.cube(0.5), radius: random.within(0.5, 1.5) };
    Movable::Ball(ball, ball.at(random.direction()))
}

#[test]
fn derivatives_are_those_of_central_differences_on_triangles_and_spheres() {
    let mut random = Random::new(1);
    let mut worst = 0.0f64;
    for round in 0..600 {
        let centers = [DVec3::new(0.0, 0.0, -4.0), DVec3::ZERO, DVec3::new(0.0, 1.0, 4.0)];
        let points = centers
            .map(|c| if round % 2 == 0 { random_facet(&mut random, c, 1.0) } else { random_ball(&mut random, c) });
        let n = [random.within(1.0, 1.3), random.within(1.4, 2.0)];
        for form in [Form::Unnormalised, Form::HalfVector] {
            worst = worst.max(deviation(points, n, form, 1e-5));
        }
    }
    assert!(worst < 1e-6, "{worst}");
}

/// A triangle 1e6 times longer than high: its normal turns 1e6 times faster across.
#[test]
fn derivatives_hold_on_slivers() {
    let mut random = Random::new(2);
    let mut worst = 0.0f64;
    for _ in 0..100 {
        let points = [DVec3::NEG_Z * 4.0, DVec3::ZERO, DVec3::Z * 4.0]
            .map(|c| random_facet(&mut random, c, if c == DVec3::ZERO { 1e-6 } else { 1.0 }));
        // The tangents run along and across the first edge: things vary over its length and the height.
        for form in [Form::Unnormalised, Form::HalfVector] {
            let at = points.map(|m| m.at());
            let x = at.map(|d| d.p);
            let own = with(x, &at[1], [1.0, 1.5], form, |c| c.own());
            let largest = own.as_flattened().iter().fold(0.0f64, |m, b| m.max(b.abs()));
            for k in [0, 1] {
                let h = [1e-5, 1e-11][k];
                let shifted = |s: f64| {
                    let new = points[1].moved(k, s * h);
                    value([x[0], new.p, x[2]], &new, [1.0, 1.5], form)
                };
                let (plus, minus) = (shifted(1.0), shifted(-1.0));
                for r in [0, 1] {
                    worst = worst.max(((plus[r] - minus[r]) / (2.0 * h) - own[r][k]).abs() / largest);
                }
            }
        }
    }
    assert!(worst < 1e-6, "{worst}");
}

#[test]
fn the_unnormalised_form_is_the_gradient_of_the_optical_path_length() {
    // Then its derivative is a Hessian, and the equations of neighbours are symmetric.
    let mut random = Random::new(3);
    for _ in 0..200 {
        let flat = |r: &mut Random, c: DVec3| {
            let Movable::Facet(f, at, _) = random_facet(r, c, 1.0) else { unreachable!() };
            let bare = Facet { normals: None, ..f };
            (bare, Differential { ns: at.ng, n_u: DVec3::ZERO, n_v: DVec3::ZERO, ..at })
        };
        let [(_, x0), (_, x1), (_, x2), (_, x3)] =
            [-4.0, -1.0, 1.0, 4.0].map(|z| flat(&mut random, DVec3::new(0.0, 0.0, 2.0 * z)));
        let form = Form::Unnormalised;
        let (first, second) = ([x0.p, x1.p, x2.p], [x1.p, x2.p, x3.p]);
        let c = with(first, &x1, [1.0, 1.5], form, |c| c.next([x2.p_u, x2.p_v]));
        let a = with(second, &x2, [1.5, 1.2], form, |c| c.previous([x1.p_u, x1.p_v]));
        let b = with(first, &x1, [1.0, 1.5], form, |c| c.own());
        assert!((b[0][1] - b[1][0]).abs() < 1e-14);
        for (r, k) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            assert!((a[r][k] - c[k][r]).abs() < 1e-14, "{a:?} {c:?}");
        }
    }
}
