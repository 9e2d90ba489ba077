//! What manifold walks did, in words.

use caustica::transport::walk_count::{REASONS, WalkCount};

/// All but their time.
pub(crate) fn lines(walks: &WalkCount, rays: u64) -> Vec<String> {
    let percent = |part: u64, whole: u64| part as f64 / whole.max(1) as f64 * 100.0;
    let classes = |counts: &[u64]| {
        let Some(last) = counts.iter().rposition(|&n| n > 0) else { return "none".to_owned() };
        let class = |(k, n): (usize, &u64)| format!("{}+: {:.0} %", 1 << k, percent(*n, walks.total()));
        counts[..=last].iter().enumerate().map(class).collect::<Vec<_>>().join(", ")
    };
    let mut lines = vec![
        format!(
            "{} manifold walks to connect ({} spared), {:.0} % of them found a chain; {} to check sampled chains, \
             {:.0} % confirmed",
            walks.connections,
            walks.spared,
            percent(walks.connected, walks.connections),
            walks.checks,
            percent(walks.confirmed, walks.checks),
        ),
        format!(
            "{:.1} iterations a walk, {:.2} rays an iteration; converged after {}; given up after {}",
            walks.iterations as f64 / walks.total().max(1) as f64,
            rays as f64 / walks.iterations.max(1) as f64,
            classes(&walks.steps[0]),
            classes(&walks.steps[1])
        ),
    ];
    if walks.retried > 0 {
        let rescued = percent(walks.rescued, walks.retried);
        lines.push(format!("{} times from other starts, too: {rescued:.0} % found a chain", walks.retried));
    }
    if walks.searches > 0 {
        let found = percent(walks.discovered, walks.searches);
        let each = walks.search_walks as f64 / walks.searches as f64;
        lines.push(format!("{} searches for one more: {found:.1} % found one; {each:.1} walks each", walks.searches));
    }
    let reasons = REASONS.iter().zip(walks.rejected).filter(|(_, n)| *n > 0);
    let mut rejected: Vec<String> =
        reasons.map(|(reason, n)| format!("{reason} {:.0} %", percent(n, walks.total()))).collect();
    if walks.occluded > 0 {
        rejected.push(format!("something in the way {:.0} %", percent(walks.occluded, walks.total())));
    }
    if !rejected.is_empty() {
        lines.push(format!("walks without a chain: {}", rejected.join(", ")));
    }
    lines
}
