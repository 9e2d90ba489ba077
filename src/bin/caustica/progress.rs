//! How far a render is: a bar on a terminal, nothing elsewhere.

use crate::units;
use caustica::render::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Mutex;

/// Takes the reports of one render.
pub(crate) struct Meter {
    bar: Option<ProgressBar>,
    last: Mutex<Option<Progress>>,
}

/// Steps of the bar.
const STEPS: u64 = 1000;

impl Meter {
    /// A bar if standard error is a terminal and `quiet` is not asked for.
    pub(crate) fn new(quiet: bool) -> Meter {
        let bar = (!quiet && std::io::stderr().is_terminal()).then(|| {
            // No template can be refused: this one is a constant.
            let style = ProgressStyle::with_template("{bar:24} {msg}").unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr()).with_style(style)
        });
        Meter { bar, last: Mutex::new(None) }
    }

    /// Called from the render's workers.
    pub(crate) fn report(&self, progress: Progress) {
        if let Some(bar) = &self.bar {
            bar.set_message(line(&progress));
            bar.set_position((f64::from(progress.fraction) * STEPS as f64) as u64);
        }
        *self.last.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = Some(progress);
    }

    /// Removes the bar; the last report.
    pub(crate) fn finish(self) -> Option<Progress> {
        if let Some(bar) = self.bar {
            bar.finish_and_clear();
        }
        self.last.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

/// Percent, speed, time to go, noise.
fn line(p: &Progress) -> String {
    let elapsed = p.elapsed.as_secs_f64();
    let fraction = f64::from(p.fraction);
    // Rounded down: 100 is for what is done.
    let mut text = format!("{:3.0} %", (fraction * 100.0).floor());
    if elapsed > 0.0 {
        text += &format!("  {}rays/s", spaced(units::si(p.rays as f64 / elapsed)));
    }
    // Before a hundredth is done the estimate would only jump about.
    if fraction >= 0.01 {
        text += &format!("  ETA {}", units::time(elapsed * (1.0 - fraction) / fraction));
    }
    match noise(p.noise) {
        Some(noise) => text + "  " + &noise,
        None => text,
    }
}

/// `noise 1.2 %`, once there is an estimate.
pub(crate) fn noise(relative: f32) -> Option<String> {
    relative.is_finite().then(|| format!("noise {:.2} %", relative * 100.0))
}

/// `12.3 M` to `12.3 M`, `120` to `120 `: before a unit.
pub(crate) fn spaced(number: String) -> String {
    if number.ends_with(char::is_alphabetic) { number } else { number + " " }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn progress(fraction: f32, noise: f32) -> Progress {
        Progress { fraction, samples: 4, rays: 24_000_000, elapsed: Duration::from_secs(2), noise }
    }

    #[test]
    fn a_line_has_percent_speed_time_and_noise() {
        assert_eq!(line(&progress(0.25, 0.0213)), " 25 %  12.0 Mrays/s  ETA 6.00 s  noise 2.13 %");
    }

    #[test]
    fn what_is_not_known_is_not_said() {
        assert_eq!(line(&progress(0.0, f32::NAN)), "  0 %  12.0 Mrays/s");
        let start = Progress { elapsed: Duration::ZERO, ..progress(0.0, f32::NAN) };
        assert_eq!(line(&start), "  0 %");
        assert!(line(&progress(0.999, 0.01)).starts_with(" 99 %"));
    }
}
