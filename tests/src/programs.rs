//! The programs under test, built with the profile of the test.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use anyhow::Context;

/// A built program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Program {
    /// The simulation.
    SimNode,
    /// The recorder.
    Recorder,
    /// The server of the page.
    ViewerBridge,
    /// A reader that borrows samples and never returns them.
    StubbornReader,
    /// A client that grabs particles and never releases them.
    Grabber,
    /// A member of the lockstep that goes on with the next node.
    Member,
    /// A reader of snapshots that goes on with the next node.
    Follower,
    /// A client that gives states back to the node, again and again.
    Restorer,
    /// A process without the contract's client that writes random bytes into two services.
    ForeignWriter,
    /// The demo that `cargo demo` runs.
    Demo,
    /// The contract's example that prints snapshots.
    Watch,
    /// The contract's example that grabs and moves a particle.
    Grab,
    /// The contract's example that controls a pendulum in lockstep.
    Hold,
    /// The example with rigid bodies of another engine.
    Bodies,
    /// The example in C, compiled by its test and linked with the shared library.
    PullCorner,
    /// The same, linked with the static library.
    PullCornerStatic,
    /// The example in C++, compiled by its test.
    HoldInCpp,
    /// The Python interpreter of `.venv`, which `.ci/run` creates.
    Python,
    /// Node.js from the search path, for scripts whose packages `.ci/run` installs in `tests/node`.
    Node,
    /// The shell, for completion scripts.
    Bash,
    /// The formatter of man pages, from the search path.
    Groff,
    /// The program that checks units of systemd, from the search path.
    SystemdAnalyze,
}

impl Program {
    /// Returns the path of the program. The first call in a process builds all programs, unless
    /// [`build_products`] was called.
    pub fn path(self) -> PathBuf {
        match self {
            Self::SimNode => built().join("sim-node"),
            Self::Recorder => built().join("recorder"),
            Self::ViewerBridge => built().join("viewer-bridge"),
            Self::StubbornReader => built().join("stubborn-reader"),
            Self::Grabber => built().join("grabber"),
            Self::Member => built().join("member"),
            Self::Follower => built().join("follower"),
            Self::Restorer => built().join("restorer"),
            Self::ForeignWriter => built().join("examples/foreign-writer"),
            Self::Demo => built().join("demo"),
            Self::Watch => built().join("examples/watch"),
            Self::Grab => built().join("examples/grab"),
            Self::Hold => built().join("examples/hold"),
            Self::Bodies => built().join("examples/bodies"),
            Self::PullCorner => built().join("pull_corner"),
            Self::PullCornerStatic => built().join("pull_corner_static"),
            Self::HoldInCpp => built().join("hold"),
            // Found through the search path.
            Self::Node => PathBuf::from("node"),
            Self::Bash => PathBuf::from("bash"),
            Self::Groff => PathBuf::from("groff"),
            Self::SystemdAnalyze => PathBuf::from("systemd-analyze"),
            Self::Python => Path::new(env!("CARGO_MANIFEST_DIR")).join("../.venv/bin/python3"),
        }
    }
}

/// The folder of the built programs.
static FOLDER: OnceLock<PathBuf> = OnceLock::new();

/// Returns the folder of the programs, built with the profile of this test.
fn built() -> &'static Path {
    FOLDER.get_or_init(|| {
        let selection =
            ["--workspace", "--exclude", "catenary-python", "--lib", "--bins", "--examples"];
        build(&[&["--quiet"], &selection[..]].concat()).expect("the programs")
    })
}

/// Builds the simulation, the recorder and the viewer, and shows the progress of cargo on stderr.
///
/// One call of cargo builds all three, so that it compiles each dependency once. Afterwards
/// [`Program::path`] builds nothing, and the other programs may be missing.
///
/// # Errors
/// If a program does not build, or a signal ends the build.
pub fn build_products() -> anyhow::Result<()> {
    build_folder(&["-p", "sim-node", "-p", "recorder", "-p", "viewer-bridge"])
}

/// Does the same, and builds the example with rigid bodies.
///
/// # Errors
/// If a program does not build, or a signal ends the build.
pub fn build_products_and_bodies() -> anyhow::Result<()> {
    let selection = ["-p", "sim-node", "-p", "recorder", "-p", "viewer-bridge"];
    let example = ["-p", "integration-tests", "--bins", "--example", "bodies"];
    build_folder(&[&selection[..], &example].concat())
}

fn build_folder(selection: &[&str]) -> anyhow::Result<()> {
    if FOLDER.get().is_none() {
        let folder = build(selection)?;
        FOLDER.get_or_init(|| folder);
    }
    Ok(())
}

#[allow(clippy::disallowed_methods, reason = "the harness starts processes")]
fn build(selection: &[&str]) -> anyhow::Result<PathBuf> {
    // The executable is target/PROFILE/deps/TEST-HASH or target/PROFILE/PROGRAM.
    let this = std::env::current_exe().expect("the path of this program");
    let folder = this.ancestors().skip(1).find(|folder| !folder.ends_with("deps"));
    let folder = folder.expect("a target folder").to_owned();
    let profile = match folder.file_name().and_then(|name| name.to_str()) {
        None | Some("debug") => "dev",
        Some(name) => name,
    };
    let target = folder.parent().expect("a target folder");
    let status = Command::new(option_env!("CARGO").unwrap_or("cargo"))
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
        .arg("build")
        .args(selection)
        .args(["--profile", profile, "--target-dir"])
        .arg(target)
        .status()
        .context("cannot start cargo")?;
    anyhow::ensure!(status.success(), "the programs were not built (cargo: {status})");
    Ok(folder)
}
