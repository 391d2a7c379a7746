//! The structure of the repository: which crate may know which, and who names which library.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use cargo_metadata::MetadataCommand;

#[path = "tidy/module_graph.rs"]
mod module_graph;

/// The allowed arrows: crate -> workspace crates and restricted libraries that it may name.
const ARROWS: [(&str, &[&str]); 8] = [
    ("sim-types", &[]),
    ("sim-solver", &["sim-types"]),
    ("sim-contract", &["iceoryx2", "sim-types"]),
    ("sim-lessons", &["sim-solver"]),
    ("sim-node", &["sim-contract", "sim-lessons", "sim-solver"]),
    ("recorder", &["mcap", "sim-contract", "sim-solver"]),
    ("viewer-bridge", &["foxglove", "recorder", "sim-contract"]),
    ("integration-tests", &["recorder", "sim-contract", "viewer-bridge"]),
];

/// Crates in which files still use each other in a circle. The list only shrinks.
const CRATES_WITH_CIRCLES: [&str; 4] = ["recorder", "sim-contract", "sim-solver", "viewer-bridge"];

/// Longest source file: more than one concept hides in a longer one.
const LINES_MAX: usize = 500;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

#[test]
fn dependencies_between_crates_are_those_of_the_architecture() {
    let manifest = root().join("Cargo.toml");
    let metadata = MetadataCommand::new().manifest_path(manifest).no_deps().exec().unwrap();
    let watched: BTreeSet<&str> = ARROWS
        .iter()
        .flat_map(|(name, arrows)| [*name].into_iter().chain(arrows.iter().copied()))
        .collect();
    let mut found = BTreeMap::new();
    for package in &metadata.packages {
        // Of every kind: a test that names another crate's library ties it to it just as well.
        let names = package.dependencies.iter().map(|one| one.name.as_str());
        let names = names.filter(|name| watched.contains(name));
        found.insert(package.name.as_str(), names.collect::<BTreeSet<_>>());
    }
    let allowed: BTreeMap<_, BTreeSet<_>> =
        ARROWS.iter().map(|(name, arrows)| (*name, arrows.iter().copied().collect())).collect();
    assert_eq!(found, allowed);
}

#[test]
fn no_source_file_hides_several_concepts() {
    let mut folders: Vec<_> = ["sim-node", "recorder", "viewer-bridge", "tests"]
        .iter()
        .map(|folder| root().join(folder))
        .collect();
    let mut count = 0;
    while let Some(folder) = folders.pop() {
        for entry in folder.read_dir().unwrap().map(|entry| entry.unwrap().path()) {
            if entry.is_dir() {
                folders.push(entry);
            } else if entry.extension().is_some_and(|extension| extension == "rs") {
                let lines = std::fs::read_to_string(&entry).unwrap().lines().count();
                assert!(lines <= LINES_MAX, "{} has {lines} lines", entry.display());
                count += 1;
            }
        }
    }
    assert!(count > 30, "only {count} source files found");
}

#[test]
fn files_within_a_crate_form_no_circle() {
    let manifest = root().join("Cargo.toml");
    let metadata = MetadataCommand::new().manifest_path(manifest).no_deps().exec().unwrap();
    let mut left = Vec::new();
    for package in &metadata.packages {
        let src = package.manifest_path.parent().unwrap().join("src");
        let circles = module_graph::circles(src.as_std_path());
        let is_allowed = CRATES_WITH_CIRCLES.contains(&package.name.as_str());
        assert!(
            circles.is_empty() || is_allowed,
            "files of {} use each other in a circle; move what they share into a file below them: \
             {circles:?}",
            package.name
        );
        if !circles.is_empty() {
            left.push(package.name.to_string());
        }
    }
    left.sort();
    assert_eq!(left, CRATES_WITH_CIRCLES, "take the crates without circles off the list");
}
