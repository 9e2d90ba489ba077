//! relMSE over time as SVG: one panel inside the caustic region and one outside, both axes logarithmic.

use std::fmt::Write;

/// A method's name, and its errors inside and outside the region by seconds.
pub(crate) type Curve = (&'static str, Vec<(f64, [f64; 2])>);

/// A panel, without its labels.
const WIDTH: f64 = 300.0;
const HEIGHT: f64 = 240.0;

/// Room for labels on the left, between panels, above, below, and for the legend.
const LEFT: f64 = 62.0;
const BETWEEN: f64 = 24.0;
const TOP: f64 = 28.0;
const BOTTOM: f64 = 46.0;
const LEGEND: f64 = 84.0;

/// Of Okabe and Ito: told apart by the colour-blind, too; ours stands out.
fn colour(method: &str) -> &'static str {
    match method {
        "path" => "#999999",
        "light" => "#e69f00",
        "bdpt" => "#0072b2",
        "mnee" => "#009e73",
        "paper" => "#cc79a7",
        _ => "#d00000",
    }
}

/// A logarithmic axis over all values.
struct Axis {
    low: f64,
    high: f64,
}

impl Axis {
    fn over(values: impl Iterator<Item = f64>) -> Axis {
        let logs = values.filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10);
        let (low, high) = logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
        let margin = (0.05 * (high - low)).max(0.05);
        Axis { low: low - margin, high: high + margin }
    }

    /// Where a value is, in `[0, 1]`.
    fn at(&self, value: f64) -> f64 {
        (value.log10() - self.low) / (self.high - self.low)
    }

    /// 1, 2 and 5 of each decade; 1 alone where that would be too many.
    fn ticks(&self) -> Vec<f64> {
        let steps: &[f64] = if self.high - self.low > 2.5 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let decades = self.low.floor() as i32..=self.high.ceil() as i32;
        let all = decades.flat_map(|d| steps.iter().map(move |s| format!("{s}e{d}").parse().expect("a number")));
        all.filter(|t| (0.0..=1.0).contains(&self.at(*t))).collect()
    }
}

/// The document of one scene.
pub(crate) fn plot(curves: &[Curve]) -> String {
    let points = || curves.iter().flat_map(|(_, points)| points);
    let panels = ["inside the caustic region", "outside"].into_iter().enumerate();
    let mut panels: Vec<_> = panels.filter(|(k, _)| points().any(|(_, e)| e[*k] > 0.0)).collect();
    if let [(_, title)] = &mut panels[..] {
        *title = "the whole picture";
    }
    let x = Axis::over(points().map(|(t, _)| *t));
    let y = Axis::over(points().flat_map(|(_, e)| *e));
    let end = LEFT + panels.len() as f64 * (WIDTH + BETWEEN);
    let (width, height) = (end + LEGEND, TOP + HEIGHT + BOTTOM);

    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    let mut text = |x: f64, y: f64, anchor: &str, text: &str| {
        _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>");
    };
    let left = |i: usize| LEFT + i as f64 * (WIDTH + BETWEEN);
    let across = |i: usize, t: f64| left(i) + WIDTH * x.at(t);
    let down = |e: f64| TOP + HEIGHT * (1.0 - y.at(e));
    for (i, (_, title)) in panels.iter().enumerate() {
        text(left(i) + WIDTH / 2.0, TOP - 10.0, "middle", title);
        text(left(i) + WIDTH / 2.0, height - 8.0, "middle", "seconds");
        for t in x.ticks() {
            text(across(i, t), TOP + HEIGHT + 16.0, "middle", &t.to_string());
        }
    }
    for e in y.ticks() {
        text(LEFT - 6.0, down(e) + 4.0, "end", &if e < 1e-3 { format!("{e:e}") } else { e.to_string() });
    }
    text(LEFT - 6.0, TOP - 10.0, "end", "relMSE");
    for (k, (name, _)) in curves.iter().enumerate() {
        text(end + 18.0, TOP + 16.0 + 18.0 * k as f64, "start", name);
    }

    let mut line = |from: (f64, f64), to: (f64, f64), style: &str| {
        let ((x1, y1), (x2, y2)) = (from, to);
        _ = writeln!(svg, "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" {style}/>");
    };
    for i in 0..panels.len() {
        for t in x.ticks() {
            line((across(i, t), TOP), (across(i, t), TOP + HEIGHT), "stroke=\"#dddddd\"");
        }
        for e in y.ticks() {
            line((left(i), down(e)), (left(i) + WIDTH, down(e)), "stroke=\"#dddddd\"");
        }
    }
    for (k, (name, _)) in curves.iter().enumerate() {
        let colour = colour(name);
        let y = TOP + 12.0 + 18.0 * k as f64;
        line((end - 6.0, y), (end + 12.0, y), &format!("stroke=\"{colour}\" stroke-width=\"2.5\""));
    }
    for (i, (part, _)) in panels.iter().enumerate() {
        _ = writeln!(
            svg,
            "<rect x=\"{}\" y=\"{TOP}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"none\" stroke=\"#666666\"/>",
            left(i)
        );
        for (name, points) in curves {
            let colour = colour(name);
            let place = |(t, e): &(f64, [f64; 2])| (across(i, *t), down(e[*part]));
            let places: Vec<_> = points.iter().filter(|(_, e)| e[*part] > 0.0).map(place).collect();
            let list: Vec<String> = places.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
            _ = writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
                list.join(" ")
            );
            for (x, y) in places {
                _ = writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{colour}\"/>");
            }
        }
    }
    svg + "</svg>\n"
}
