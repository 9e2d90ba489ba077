//! The modules use each other only along the arrows of the design: what is left may use what is right.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What each module may use, beside itself.
fn allowed() -> BTreeMap<&'static str, Vec<&'static str>> {
    BTreeMap::from([
        ("math", vec![]),
        ("pool", vec![]),
        ("text", vec![]),
        ("texture", vec!["math"]),
        ("geometry", vec!["math", "intersect"]),
        ("intersect", vec!["math", "geometry"]),
        ("manifold", vec!["math", "geometry"]),
        ("scatter", vec!["math", "geometry", "scene"]),
        ("camera", vec!["math", "geometry", "scene"]),
        ("emitter", vec!["math", "geometry", "scene", "camera", "texture"]),
        ("scene", vec!["math", "geometry", "intersect", "scatter", "emitter", "camera", "pool", "text", "texture"]),
        ("transport", vec!["math", "geometry", "scene", "scatter", "emitter", "camera", "manifold"]),
        ("integrator", vec!["math", "geometry", "scene", "scatter", "camera", "transport"]),
        ("render", vec!["math", "pool", "camera", "scene", "transport", "integrator"]),
        ("io", vec!["math", "scene", "render", "text"]),
        ("capi", vec!["math", "geometry", "pool", "scene", "render", "io", "intersect", "transport"]),
    ])
}

/// Finer rules: a whole module would be too much. (module, what it uses of another, the only paths).
const ONLY: [(&str, &str, &[&str]); 6] = [
    // A hit is plain data that the surface code reads; the backends are not known there.
    ("geometry", "intersect", &["Hit"]),
    // Descriptions are data: the right-hand modules compile them, and know nothing of the world.
    ("scatter", "scene", &["description"]),
    ("camera", "scene", &["description"]),
    ("emitter", "scene", &["description"]),
    ("io", "scene", &["description"]),
    // Settings of a render are data, too.
    ("capi", "transport", &["options", "roulette", "limits"]),
];

fn sources(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, into);
        } else if path.extension().is_some_and(|e| e == "rs") {
            into.push(path);
        }
    }
}

/// Paths below `crate::` that a line names, `{a, b}` taken apart at the first level.
fn used(line: &str) -> Vec<String> {
    line.split("crate::")
        .skip(1)
        .flat_map(|rest| match rest.strip_prefix('{') {
            Some(list) => list.split('}').next().unwrap_or("").split(',').map(|s| s.trim().to_owned()).collect(),
            None => vec![
                rest.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':')).next().unwrap_or("").to_owned(),
            ],
        })
        .collect()
}

#[test]
fn arrows_point_one_way() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let allowed = allowed();
    let mut files = Vec::new();
    sources(&src, &mut files);
    assert!(files.len() > 40);
    let mut wrong = Vec::new();
    for file in files {
        let relative = file.strip_prefix(&src).expect("below src").to_string_lossy().into_owned();
        let module = relative.split(['/', '.']).next().unwrap_or("");
        if module == "lib" || module == "bin" || relative.contains("test") {
            continue;
        }
        let Some(right) = allowed.get(module) else {
            wrong.push(format!("{relative}: module `{module}` has no place in the design"));
            continue;
        };
        let text = std::fs::read_to_string(&file).expect("a source file");
        // Unit tests may reach further.
        let text = text.split("#[cfg(test)]\nmod").next().unwrap_or("");
        for line in text.lines().filter(|l| !l.trim_start().starts_with("//")) {
            for path in used(line) {
                let mut parts = path.split("::");
                let target = parts.next().unwrap_or("");
                if target == module || !allowed.contains_key(target) {
                    continue;
                }
                let item = parts.next().unwrap_or("");
                let rule = ONLY.iter().find(|r| r.0 == module && r.1 == target);
                // An inner list, `crate::scene::{…}`, shows its items to the eye only.
                let fine = item.is_empty() || rule.is_none_or(|r| r.2.contains(&item));
                if !right.contains(&target) || !fine {
                    wrong.push(format!("{relative}: uses {path}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn foreign_names_stay_in_their_folders() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&src, &mut files);
    for (name, home) in [
        ("rtcNewDevice", "intersect/embree"),
        ("gltf::json", "io/gltf"),
        ("libloading::", "io/image"),
        ("obvhs::ploc", "intersect/wide.rs"),
    ] {
        let mut found = 0;
        for file in &files {
            if std::fs::read_to_string(file).expect("a source file").contains(name) {
                let path = file.strip_prefix(&src).expect("below src").to_string_lossy();
                assert!(path.starts_with(home), "{name} in {path}");
                found += 1;
            }
        }
        assert!(found > 0, "{name} is nowhere: the test looks for the wrong thing");
    }
}
