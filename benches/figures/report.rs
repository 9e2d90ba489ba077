//! The pieces under `target/figures`, and the document that is made of them.

use crate::measure::CAUSTIC_SHARE;
use crate::{Options, SCENES, SEED};
use caustica::io::image::{self, Metadata, WriteOptions};
use caustica::render::Image;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The columns of the main table.
pub(crate) const COLUMNS: [&str; 14] = [
    "scene",
    "region",
    "noise",
    "check",
    "path",
    "light",
    "bdpt",
    "mnee",
    "paper",
    "ours",
    "bdpt/ours",
    "mnee/ours",
    "in/out bdpt",
    "in/out ours",
];

/// Where results go, and what made them.
pub(crate) struct Report {
    pieces: PathBuf,
    docs: PathBuf,
    provenance: String,
}

/// Three digits; nothing where there is no value.
pub(crate) fn number(value: f64) -> String {
    match value {
        v if !v.is_finite() => "–".to_owned(),
        0.0 => "0".to_owned(),
        v if !(1e-3..1e4).contains(&v.abs()) => format!("{v:.1e}"),
        v if v.abs() < 1.0 => format!("{v:.*}", (2 - v.abs().log10().floor() as i32) as usize),
        v if v.abs() < 10.0 => format!("{v:.2}"),
        v if v.abs() < 100.0 => format!("{v:.1}"),
        v => format!("{v:.0}"),
    }
}

impl Report {
    pub(crate) fn new(options: &Options) -> Report {
        let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("the target directory");
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
        let Options { seconds, reference_seconds, side, threads, .. } = options;
        let provenance = format!(
            "commit {}, seed {SEED}, {}, {threads} threads, {side} x {side} pixels, {seconds} s (references \
             {reference_seconds} s) times the scene's factor",
            commit(),
            cpu()
        );
        let report = Report { pieces: target.join("figures"), docs, provenance };
        for folder in [&report.pieces, &report.docs.join("results")] {
            std::fs::create_dir_all(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        }
        report.recover();
        report
    }

    /// Takes the pieces that are not there from the document: a new checkout has nothing else, and must not lose what
    /// it does not make again.
    fn recover(&self) {
        let document = std::fs::read_to_string(self.docs.join("results.md")).unwrap_or_default();
        for (file, text) in pieces(&document) {
            let path = self.pieces.join(file);
            if !path.exists() {
                save(&path, &text);
            }
        }
    }

    /// Machine, commit, seed and budgets of this run.
    pub(crate) fn provenance(&self) -> &str {
        &self.provenance
    }

    pub(crate) fn picture(&self, scene: &str, picture: &Image) {
        let path = self.docs.join("results").join(format!("{scene}.jpg"));
        image::write(&path, picture, &Metadata::default(), &WriteOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    }

    pub(crate) fn plot(&self, scene: &str, svg: &str) {
        save(&self.docs.join("results").join(format!("{scene}.svg")), svg);
    }

    /// A scene's row of the main table and its section.
    pub(crate) fn scene(&self, scene: &str, row: &str, body: &str) {
        save(&self.pieces.join(format!("{scene}.md")), &format!("{}\n{row}\n{body}", self.provenance));
    }

    /// A scene's table of options.
    pub(crate) fn knobs(&self, scene: &str, body: &str) {
        save(&self.pieces.join(format!("{scene}.options.md")), &format!("{}\n{body}", self.provenance));
    }

    /// Writes the document from all pieces there are.
    pub(crate) fn assemble(&self) {
        let (mut rows, mut sections, mut tables) = (String::new(), String::new(), String::new());
        let mut made_by: Vec<(String, Vec<String>)> = Vec::new();
        let mut remember = |provenance: &str, what: String| match made_by.iter_mut().find(|(p, _)| p == provenance) {
            Some((_, list)) => list.push(what),
            None => made_by.push((provenance.to_owned(), vec![what])),
        };
        let piece = |name: String| std::fs::read_to_string(self.pieces.join(name)).ok();
        for scene in SCENES {
            let name = scene.name;
            let text = piece(format!("{name}.md"));
            if let Some((provenance, rest)) = text.as_deref().and_then(|t| t.split_once('\n'))
                && let Some((row, body)) = rest.split_once('\n')
            {
                remember(provenance, name.to_owned());
                _ = writeln!(rows, "{row}");
                _ = writeln!(sections, "### {name}\n\n{}\n", body.trim_end());
            }
            let text = piece(format!("{name}.options.md"));
            if let Some((provenance, body)) = text.as_deref().and_then(|t| t.split_once('\n')) {
                remember(provenance, format!("options on {name}"));
                _ = writeln!(tables, "### Options: {name}\n\n{}\n", body.trim_end());
            }
        }
        let mut text = introduction();
        for (provenance, what) in made_by {
            _ = writeln!(text, "- {provenance}: {}", what.join(", "));
        }
        if !rows.is_empty() {
            let rule = "--:|".repeat(COLUMNS.len() - 1);
            _ = write!(text, "\n## All scenes\n\n| {} |\n|---|{rule}\n{rows}\n", COLUMNS.join(" | "));
            text += LEGEND;
            _ = write!(text, "\n## Each scene\n\n{COLUMNS_OF_A_SCENE}\n{sections}");
        }
        if !tables.is_empty() {
            _ = write!(text, "## Speed and accuracy of the options\n\n{COLUMNS_OF_OPTIONS}\n{tables}");
        }
        save(&self.docs.join("results.md"), &format!("{}\n", text.trim_end()));
    }
}

/// The pieces of a document that [`Report::assemble`] wrote: names and texts.
fn pieces(document: &str) -> Vec<(String, String)> {
    let (mut made_by, mut rows) = (BTreeMap::new(), BTreeMap::new());
    let mut sections: Vec<(&str, String)> = Vec::new();
    let mut within = false;
    for line in document.lines() {
        if let Some(heading) = line.strip_prefix("### ") {
            sections.push((heading, String::new()));
            within = true;
        } else if line.starts_with("## ") {
            within = false;
        } else if let Some((_, body)) = sections.last_mut().filter(|_| within) {
            _ = writeln!(body, "{line}");
        } else if let Some((provenance, what)) = line.strip_prefix("- ").and_then(|l| l.rsplit_once(": ")) {
            made_by.extend(what.split(", ").map(|what| (what, provenance)));
        } else if let Some((name, _)) = line.strip_prefix("| [").and_then(|l| l.split_once(']')) {
            rows.insert(name, line);
        }
    }
    let piece = |(heading, body): (&str, String)| {
        let body = body.trim();
        Some(match heading.strip_prefix("Options: ") {
            Some(name) => {
                let provenance = made_by.get(&*format!("options on {name}"))?;
                (format!("{name}.options.md"), format!("{provenance}\n{body}\n"))
            }
            None => {
                let (provenance, row) = (made_by.get(heading)?, rows.get(heading)?);
                (format!("{heading}.md"), format!("{provenance}\n{row}\n{body}\n"))
            }
        })
    };
    sections.into_iter().filter_map(piece).collect()
}

fn introduction() -> String {
    format!(
        "# Results

Made by `make figures`; every number below is that program's.

Six methods render twenty-two scenes of `scenes/`: a path tracer (`path`), a light tracer (`light`), bidirectional path tracing
without (`bdpt`) and with caustic connections, with the options of the paper (`paper`) and with the default ones (`ours`),
and path tracing with manifold next-event estimation (`mnee`). `ours` makes caustic connections, walks from other starts, aims light subpaths
at glass and has fewer of them where a forecast says that it pays. The reference has two halves, long renders with other seeds that make
connections in any case. The error is relMSE: the squared difference over the squared reference plus 1 % of the squared
mean of the reference, averaged without the worst 0.1 % of the pixels; the square is the product of the differences
from the two halves, so that the reference's noise is no part of it on average (what is trimmed may be; and where the
noise is not well below the errors, these are not to be trusted). \"–\": left out of long runs. What aim alone brings is
seen where `ours` made no connections, and in the tables of options. The caustic region
has the pixels where, averaged over 5 x 5 pixels, at least {:.0} % of the radiance has crossed glass smoothly before the
vertex that the camera sees; glass between that vertex and the camera does not count. Each scene has a factor on its times.

",
        100.0 * CAUSTIC_SHARE
    )
}

const LEGEND: &str = "\
Equal time; the methods' columns are relMSE inside the region (of the whole picture where there is none).

- region: share of the pixels in the caustic region; noise: relMSE of the reference.
- check: the mean in the region of independent renders by integrators without walks, less the reference's, with its
  standard error over 8 renders, the reference's own left out. Only where these find all paths; of few and bright ones
  such a mean is more often too low than too high.
- bdpt/ours, mnee/ours: ratios of relMSE x time, since a render ends with the pass that is running at its time.
- in/out: at equal samples, relMSE inside the region over relMSE outside.
";

const COLUMNS_OF_A_SCENE: &str = "\
inside, outside: relMSE in the caustic region and of the other pixels, at equal time and at equal samples; bias: the mean
in the region of the one equal-time render, noise included, over the reference's, less 1; time per sample: relative to
bdpt. Each point of a plot is a render of its own.
";

const COLUMNS_OF_OPTIONS: &str = "\
One option at a time differs from the default; equal samples. relMSE and time are means of 4 renders, the bias of the
region's mean has its standard error from them (without the reference's own); efficiency is 1 / (relMSE x time), relative
to the default.
";

fn save(path: &Path, text: &str) {
    std::fs::write(path, text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
}

/// The commit, and whether what the numbers depend on has changes since.
fn commit() -> String {
    let git = |arguments: &[&str]| Command::new("git").args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).output();
    let head = git(&["rev-parse", "--short", "HEAD"]).map(|o| String::from_utf8_lossy(&o.stdout).trim().to_owned());
    let clean = git(&["diff", "--quiet", "HEAD", "--", "src", "benches", "scenes", "Cargo.toml", "Cargo.lock"])
        .is_ok_and(|o| o.status.success());
    let head = head.ok().filter(|h| !h.is_empty()).unwrap_or_else(|| "unknown".to_owned());
    head + if clean { "" } else { " with changes" }
}

fn cpu() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|l| l.strip_prefix("model name"));
    model.map_or_else(|| "unknown CPU".to_owned(), |m| m.trim_start_matches([' ', '\t', ':']).to_owned())
}
