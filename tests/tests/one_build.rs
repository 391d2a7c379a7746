//! The commands of the README compile each third-party crate once: whichever package they select,
//! Cargo enables the same features. The crate `build-features` sees to that.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// Programs, as `cargo run` builds them, and every package, as `cargo test` does.
const PROGRAMS: [&str; 5] = ["sim-node", "sim-c", "recorder", "viewer-bridge", "integration-tests"];
const PACKAGES: [&str; 14] = [
    "sim-c",
    "sim-types",
    "sim-host",
    "sim-messages",
    "sim-cli",
    "sim-contract",
    "sim-scene",
    "sim-solver",
    "sim-lessons",
    "sim-node",
    "recorder",
    "recording",
    "viewer-bridge",
    "integration-tests",
];

/// The packages that `cargo demo` builds, and what `cargo demo --bodies` adds.
const DEMO: [&str; 4] = ["sim-node", "recorder", "viewer-bridge", "integration-tests"];

/// Third-party crates of a selection, each with its version and features. A crate that is used by
/// build scripts as well appears twice if its features differ there.
#[allow(clippy::disallowed_methods, reason = "Cargo alone resolves features")]
fn crates(selection: &[&str], edges: &str) -> BTreeSet<String> {
    let output = Command::new(option_env!("CARGO").unwrap_or("cargo"))
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap())
        .args(["tree", "--locked", "--prefix", "none"])
        .args(["--edges", edges, "--format", "{p} [{f}]"])
        .args(selection)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let lines = text.lines().map(|line| line.replace(" (proc-macro)", "").replace(" (*)", ""));
    // Members of the workspace show their path.
    lines.filter(|line| !line.contains('/')).collect()
}

#[test]
fn every_selection_of_packages_enables_the_same_features() {
    let everything = crates(&["--workspace"], "normal,build,dev");
    let programs = PROGRAMS.map(|package| ("normal,build", vec![package]));
    let packages = PACKAGES.map(|package| ("normal,build,dev", vec![package]));
    let demos = [("normal,build", DEMO[..3].to_vec()), ("normal,build,dev", DEMO.to_vec())];
    for (edges, packages) in programs.into_iter().chain(packages).chain(demos) {
        let arguments = packages.iter().flat_map(|package| ["--package", *package]);
        let selected = crates(&arguments.collect::<Vec<_>>(), edges);
        let others: Vec<_> = selected.difference(&everything).collect();
        assert!(
            others.is_empty(),
            "{packages:?} ({edges}) enable other features than --workspace with its tests; \
             add those of --workspace to .cargo/build-features/Cargo.toml: {others:#?}"
        );
    }
}
