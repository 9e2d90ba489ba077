//! Error against time of all integrators on the scenes.

mod measure;

use measure::{Budget, Method, Reference, Subject};
use std::path::Path;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let number = |name: &str, default: f64| {
        let at = args.iter().position(|a| a == name);
        at.and_then(|i| args.get(i + 1)).and_then(|v| v.parse().ok()).unwrap_or(default)
    };
    let (seconds, reference_seconds) = (number("--seconds", 5.0), number("--reference-seconds", 60.0));
    let side = number("--side", 256.0) as u32;
    let threads = number("--threads", 2.0) as usize;
    let scenes: Vec<&String> = args.iter().take_while(|a| !a.starts_with("--")).collect();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for scene in scenes {
        let subject = Subject::open(&folder.join(format!("{scene}.glb")), side, threads);
        let all = Method::all();
        let reference = Reference::new(&subject, &all[5], reference_seconds);
        println!(
            "{scene}: region {:.1} %, reference noise {:.1e} / {:.1e}",
            100.0 * reference.coverage(),
            reference.noise[0],
            reference.noise[1]
        );
        for method in &all {
            let output = subject.render(method, Budget::Seconds(seconds), 1, false);
            let [inside, outside] = reference.errors(&output.image);
            println!(
                "  {:6} {:6} spp {:6.1} s  inside {:.2e}  outside {:.2e}  ratio {:.2}  bias {:+.2} %",
                method.name,
                output.statistics.samples,
                output.statistics.render_seconds,
                inside,
                outside,
                inside / outside,
                100.0 * reference.bias(&output.image)
            );
        }
    }
}
