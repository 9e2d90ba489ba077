//! Where walks start, beside the straight segment.

use super::super::refraction::refract;
use super::super::seed::{search, starts};
use super::*;
use glam::DVec2;

#[test]
fn the_way_back_is_exact_before_flat_interfaces() {
    // From water through glass to the air, and light from afar.
    let solids = [Solid::plane(1.0, 1.33, 1.5), Solid::plane(1.2, 1.5, 1.0)];
    let local = Local { solids: &solids, a: DVec3::ZERO };
    for tilt in [0.0, 0.3, 1.0, 1.4, 1.55] {
        let d = DVec3::new(f64::sin(tilt), 0.0, f64::cos(tilt));
        let end = End::Direction(d);
        let [half, back] = starts(&seed(&local, end).unwrap(), end).unwrap();
        let in_glass = refract(back, DVec3::Z, 1.33, 1.5).unwrap();
        let in_air = refract(in_glass, DVec3::Z, 1.5, 1.0).unwrap();
        assert!(in_air.distance(d) < 1e-7, "{tilt}: {in_air}");
        assert!(half.dot(d) - half.dot(back) < 1e-12 && half.is_normalized(), "{tilt}: half-way, {half}");
    }
}

#[test]
fn there_is_none_if_the_way_back_is_totally_reflected() {
    // From the air into water, steeper within it than any ray from the air.
    let solids = [Solid::plane(1.0, 1.0, 1.33)];
    let local = Local { solids: &solids, a: DVec3::ZERO };
    let end = End::Point(DVec3::new(3.0, 0.0, 2.0));
    assert!(starts(&seed(&local, end).unwrap(), end).is_none());
    let end = End::Point(DVec3::new(0.3, 0.0, 2.0));
    assert!(starts(&seed(&local, end).unwrap(), end).is_some());
}

/// Of a pane beside the straight line and one across it behind, a start toward the first goes through that.
#[test]
fn a_start_goes_through_what_comes_first() {
    let facet = |primitive: u32, corners: [[f64; 3]; 3], up: bool| {
        let [p, q, r] = corners.map(DVec3::from);
        let corners = if up { [p, q, r] } else { [q, p, r] };
        Facet { corners, normals: None, primitive }
    };
    let across = |y: f64| [[-9.0, y, -9.0], [-9.0, y, 9.0], [30.0, y, 0.0]];
    // The straight line passes 0.0044 beside the lower side, and 0.015 beside the upper.
    let lower = [[0.0, 1.0, -1.0], [0.0, 1.0, 1.0], [2.0, 1.0, 0.0]];
    let upper = [[0.03, 1.1, -1.0], [0.03, 1.1, 1.0], [0.08, 1.1, 0.0]];
    let panes =
        vec![facet(0, across(2.0), false), facet(1, across(2.1), true), facet(2, lower, false), facet(3, upper, true)];
    let solids = [Solid { surface: Surface::Soup(panes), front: 1.0, back: 1.5 }];
    let a = DVec3::new(-1.0, 0.0, 0.0);
    let d = DVec3::new(1.005, 1.0, 0.0).normalize();
    let inside = refract(d, DVec3::NEG_Y, 1.0, 1.5).unwrap();
    let end = End::Point(d / d.y + inside * (0.1 / inside.y) + d * (3.9 / d.y));
    let local = Local { solids: &solids, a };
    let seed = seed(&local, end).unwrap();
    let through = |vertices: &[Differential]| vertices.iter().map(|v| v.primitive).collect::<Vec<_>>();
    assert_eq!(through(seed.vertices()), [0, 1]);
    let chain = walk(&local, None, end, &seed, Some(d), &TIGHT).unwrap();
    assert_eq!(through(chain.vertices()), [2, 3]);
}

#[test]
fn searches_look_near_first_and_everywhere() {
    let mut random = Random::new(3);
    let mut counts = [0; 3];
    for _ in 0..10_000 {
        let axis = random.direction();
        let d = search(axis, DVec2::new(random.within(0.0, 1.0), random.within(0.0, 1.0)));
        assert!((d.length() - 1.0).abs() < 1e-12);
        let angle = d.angle_between(axis);
        assert!(angle > 0.0199);
        counts[usize::from(angle > 0.25) + usize::from(angle > 1.5)] += 1;
    }
    // A tenth of them look beyond, by equal logarithms from 0.02 to pi: half of these beyond 0.25 radians.
    let expected = |angle: f64| 1000.0 * (std::f64::consts::PI / angle).ln() / (std::f64::consts::PI / 0.02).ln();
    for (found, expected) in [(counts[1] + counts[2], expected(0.25)), (counts[2], expected(1.5))] {
        // Within 4.5 standard deviations.
        assert!((f64::from(found) - expected).abs() < 4.5 * expected.sqrt(), "{counts:?}");
    }
}
