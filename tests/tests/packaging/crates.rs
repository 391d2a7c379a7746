//! A package contains all its sources and every file that they include, and the changelog has a section of its version.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use cargo_metadata::{MetadataCommand, Package};

const CHANGELOG: &str = include_str!("../../../CHANGELOG.md");

/// Returns the packages that `cargo package` can give to a registry.
fn packages() -> Vec<Package> {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("../Cargo.toml");
    let metadata = MetadataCommand::new().manifest_path(manifest).no_deps().exec().unwrap();
    let is_published = |package: &Package| package.publish.as_ref().is_none_or(|to| !to.is_empty());
    metadata.packages.into_iter().filter(is_published).collect()
}

/// Returns the files that Cargo packages, relative to the folder of the package.
#[allow(clippy::disallowed_methods, reason = "Cargo alone knows what it packages")]
fn packaged_files(package: &Package) -> BTreeSet<PathBuf> {
    let output = Command::new(option_env!("CARGO").unwrap_or("cargo"))
        .args(["package", "--list", "--allow-dirty", "--manifest-path"])
        .arg(&package.manifest_path)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap().lines().map(PathBuf::from).collect()
}

/// Returns the Rust files of a package.
fn sources(package: &Path) -> Vec<PathBuf> {
    let mut folders = ["src", "tests", "examples", "benches"].map(|one| package.join(one)).to_vec();
    let mut sources = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in folder.read_dir().into_iter().flatten().map(|entry| entry.unwrap().path()) {
            if entry.is_dir() {
                folders.push(entry);
            } else if entry.extension().is_some_and(|one| one == "rs") {
                sources.push(entry);
            }
        }
    }
    sources
}

/// Returns the paths that a source file includes, relative to its folder.
fn includes(text: &str) -> Vec<&str> {
    let calls = ["include_str!(\"", "include_bytes!(\""];
    let after = calls.iter().flat_map(|call| text.split(call).skip(1));
    after.map(|rest| rest.split_once('"').unwrap().0).collect()
}

/// Follows a relative path by its words, without links.
fn join(folder: &Path, path: &str) -> PathBuf {
    let mut joined = folder.to_owned();
    for part in path.split('/') {
        if part == ".." {
            joined.pop();
        } else {
            joined.push(part);
        }
    }
    joined
}

#[test]
fn a_package_contains_its_sources_and_the_files_that_they_include() {
    let mut count = 0;
    for package in packages() {
        let folder = package.manifest_path.parent().unwrap().as_std_path();
        let packaged = packaged_files(&package);
        for source in sources(folder) {
            let text = fs::read_to_string(&source).unwrap();
            let parent = source.parent().unwrap();
            let included = includes(&text).into_iter().map(|path| join(parent, path));
            for file in included.chain([source.clone()]) {
                let is_packaged =
                    file.strip_prefix(folder).is_ok_and(|file| packaged.contains(file));
                let (file, source) = (file.display(), source.display());
                assert!(is_packaged, "{}: no {file} (from {source})", package.name);
                count += 1;
            }
        }
    }
    assert!(count > 500, "found only {count} files");
}

#[test]
fn every_package_has_its_licences_and_a_section_of_the_changelog() {
    for package in packages() {
        let folder = package.manifest_path.parent().unwrap();
        for licence in ["LICENSE-APACHE", "LICENSE-MIT"] {
            assert!(folder.join(licence).is_file(), "{}: no {licence}", package.name);
        }
        let section = format!("\n## {} (", package.version);
        assert!(CHANGELOG.contains(&section), "{}: CHANGELOG.md lacks {section}", package.name);
    }
}
