//! What the README says of the repository is true.

use std::fs;
use std::path::Path;

const README: &str = include_str!("../README.md");
const ROOT: &str = env!("CARGO_MANIFEST_DIR");

#[test]
fn its_c_program_is_the_tested_one() {
    let program = fs::read_to_string(Path::new(ROOT).join("tests/c/minimal.c")).expect("the program");
    assert!(README.contains(&format!("```c\n{program}```\n")), "README.md and tests/c/minimal.c differ");
}

#[test]
fn its_map_names_every_folder_and_no_other() {
    let named = |path: &str| README.contains(&format!("| `{path}` |"));
    for parent in ["src", ""] {
        for entry in fs::read_dir(Path::new(ROOT).join(parent)).expect("a folder") {
            let entry = entry.expect("an entry");
            let path = Path::new(parent).join(entry.file_name()).to_str().expect("UTF-8").to_owned();
            // Hidden ones and what a build leaves are no part of the source.
            let other = path.starts_with('.') || ["src", "src/bin", "target", "out"].contains(&&*path);
            assert!(!entry.path().is_dir() || other || named(&path), "the map lacks `{path}`");
        }
    }
    for row in README.lines().filter_map(|line| line.strip_prefix("| `")) {
        let path = row.split('`').next().expect("a name");
        assert!(Path::new(ROOT).join(path).is_dir(), "no folder `{path}`");
    }
}

#[test]
fn its_links_lead_somewhere() {
    let mut links = 0;
    for target in README.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
        if target.starts_with('#') || target.starts_with("http") {
            continue;
        }
        links += 1;
        assert!(Path::new(ROOT).join(target).exists(), "no file {target}");
    }
    assert!(links > 10, "only {links} links found");
}
