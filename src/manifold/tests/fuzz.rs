//! A million random pairs in random scenes: the walk ends, and what it returns is a path.

use super::*;

/// Everything a result must be, whatever the scene.
fn check(result: &Result<Chain, Rejected>, end: End, settings: &WalkSettings) -> bool {
    let chain = match result {
        Ok(chain) => chain,
        Err(rejected) => {
            assert!(rejected.iterations <= settings.max_iterations);
            return false;
        }
    };
    assert!(chain.iterations <= settings.max_iterations && chain.residual <= settings.tolerance);
    assert!(chain.inverse_jacobian >= 0.0 && chain.inverse_jacobian.is_finite());
    assert!(chain.reverse_inverse_jacobian().is_finite() && chain.kappa > 0.0);
    assert!(chain.transmittance > 0.0 && chain.transmittance <= 1.0);
    let mut from = DVec3::ZERO;
    let mut d = chain.first;
    for ((at, crossing), &t) in chain.vertices().iter().zip(chain.crossings()).zip(chain.lengths()) {
        // Each vertex lies where the ray leads, and refracts it by Snell's law.
        assert!((from + d * t).distance(at.p) < 1e-7 * (1.0 + at.p.length()));
        assert!((d.dot(at.ng) < 0.0) == crossing.inward);
        d = refraction::refract(d, at.ns, crossing.n_i, crossing.n_o).expect("no total reflection");
        from = at.p;
    }
    let last = match end {
        End::Point(b) => (b - from).normalize(),
        End::Direction(l) => l,
    };
    // The residual bounds the sines' difference; the angle itself grows as its root at grazing.
    d.distance(last) < 1e-3 && chain.last.distance(-last) < 1e-12 || panic!("{chain:?}")
}

#[test]
fn balls() {
    let mut random = Random::new(61);
    let settings = WalkSettings::default();
    let mut solved = 0;
    for round in 0..700_000u32 {
        let n = random.within(1.05, 2.4);
        let mut solids = vec![Solid::ball(random.cube(0.5), random.within(0.5, 1.5), n)];
        if round % 4 == 0 {
            let inner = Solid::ball(DVec3::ZERO, 0.4, 1.0);
            solids.push(Solid { front: n, back: random.within(1.0, 2.0), ..inner });
        }
        let a = random.cube(2.0);
        let end = if round % 3 == 0 { End::Direction(random.direction()) } else { End::Point(random.cube(2.0) - a) };
        solved += check(&reach(&solids, a, end, &settings), end, &settings) as u32;
    }
    assert!(solved > 60_000, "{solved}");
}

/// Nothing fits anything: open triangles in all directions with normals far from their own.
#[test]
fn triangle_soup() {
    let mut random = Random::new(62);
    let settings = WalkSettings::default();
    let mut solved = 0;
    for _ in 0..3_000 {
        let soup = |r: &mut Random| {
            let facet = |primitive: u32, r: &mut Random| {
                let at = r.cube(1.0);
                let corners = [0; 3].map(|_| at + r.cube(1.5));
                let ng = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or(DVec3::Z);
                let strength = r.within(0.0, 0.8);
                let normals = [0; 3].map(|_| (ng + r.cube(strength)).normalize_or(ng));
                Facet { corners, normals: (primitive < 2).then_some(normals), primitive }
            };
            let facets = (0..4).map(|i| facet(i, r)).collect();
            Solid { surface: Surface::Soup(facets), front: 1.0, back: 1.0 }
        };
        let mut solids = [soup(&mut random), soup(&mut random)];
        for _ in 0..100 {
            // Media that fit along this ray only: of equal index on both sides they would not refract.
            let a = random.cube(2.0);
            let b = random.cube(2.0);
            solids[0].back = random.within(1.0, 2.0);
            solids[1].back = solids[0].back;
            let end = End::Point(b - a);
            solved += check(&reach(&solids, a, end, &settings), end, &settings) as u32;
        }
    }
    assert!(solved > 10_000, "{solved}");
}
