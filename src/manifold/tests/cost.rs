//! What a step costs. A measurement, not a test: run it alone, with `--ignored --nocapture`.

use super::*;
use std::hint::black_box;
use std::time::Instant;

#[test]
#[ignore = "a measurement"]
fn nanoseconds_per_step_of_a_two_interface_walk() {
    let ball = [Solid::ball(DVec3::ZERO, 1.0, 1.5)];
    let mut random = Random::new(71);
    let settings = WalkSettings::default();
    let walks: Vec<_> = (0..10_000)
        .filter_map(|_| {
            let (a, b) = (random.disk(1.0, -3.0), random.disk(1.0, 3.0));
            let end = End::Point(b - a);
            Some((a, end, seed(&Local { solids: &ball, a }, end).ok().filter(|s| s.vertices().len() == 2)?))
        })
        .collect();
    for _ in 0..5 {
        let start = Instant::now();
        let mut steps = 0;
        for (a, end, seed) in &walks {
            let result = walk(&Local { solids: &ball, a: *a }, None, *end, seed, None, &settings);
            steps += black_box(result).map_or_else(|r| r.iterations, |c| c.iterations);
        }
        let each = start.elapsed().as_nanos() as f64;
        let count = walks.len() as f64;
        eprintln!(
            "{:.0} ns per step, {:.0} ns per walk, {:.2} steps",
            each / steps as f64,
            each / count,
            steps as f64 / count
        );
    }
}
