//! The programs under test, built with the profile of the test itself.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// A built program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Program {
    /// The simulation.
    SimNode,
    /// The recorder.
    Recorder,
    /// The server of the page.
    ViewerBridge,
    /// A reader that takes samples and never gives them back.
    StubbornReader,
    /// The contract's example that prints snapshots.
    Watch,
    /// The contract's example that drags a particle.
    Drag,
    /// The Python of `.venv`, which `.ci/run` makes.
    Python,
    /// The Node of this machine, for scripts whose packages `.ci/run` installs in `tests/node`.
    Node,
}

impl Program {
    /// Its path; builds all programs if this process has not done so yet.
    pub fn path(self) -> PathBuf {
        match self {
            Self::SimNode => built().join("sim-node"),
            Self::Recorder => built().join("recorder"),
            Self::ViewerBridge => built().join("viewer-bridge"),
            Self::StubbornReader => built().join("stubborn-reader"),
            Self::Watch => built().join("examples/watch"),
            Self::Drag => built().join("examples/drag"),
            // Out of the search path.
            Self::Node => PathBuf::from("node"),
            Self::Python => Path::new(env!("CARGO_MANIFEST_DIR")).join("../.venv/bin/python3"),
        }
    }
}

/// The folder with the programs of this test's profile.
fn built() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(build)
}

#[allow(clippy::disallowed_methods, reason = "the harness starts processes")]
fn build() -> PathBuf {
    // target/PROFILE/deps/test-hash, or target/PROFILE/program.
    let this = std::env::current_exe().expect("a path of this program");
    let folder = this.ancestors().skip(1).find(|folder| !folder.ends_with("deps"));
    let folder = folder.expect("a target folder").to_owned();
    let profile = match folder.file_name().and_then(|name| name.to_str()) {
        None | Some("debug") => "dev",
        Some(name) => name,
    };
    let target = folder.parent().expect("a target folder");
    let status = Command::new(option_env!("CARGO").unwrap_or("cargo"))
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
        .args(["build", "--quiet", "--workspace", "--bins", "--examples", "--profile", profile])
        .arg("--target-dir")
        .arg(target)
        .status();
    assert!(status.is_ok_and(|status| status.success()), "the programs do not build");
    folder
}
