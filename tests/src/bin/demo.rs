//! `cargo demo`: runs a node, a recorder and a viewer as processes until Ctrl-C, then describes the
//! recording.
//!
//! Open the printed address in a browser and drag the curtain. With `--bodies`, the node starts with the scene of
//! the example `bodies`, whose process moves the rigid bodies.
#![forbid(unsafe_code)]

use std::io::{Write, stderr};
use std::net::TcpListener;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, bail};
use integration_tests::{Finished, Process, Program, build_products, build_products_and_bodies};
use sim_contract::{Client, DOMAIN_VARIABLE, Endpoint};
use sim_host::Stop;
use sim_host::clock::{SECOND_NS, realtime_ns};
use sim_host::console::{note, write_result};

/// Limit on each wait for a status of the node, so that the demo notices Ctrl-C.
const POLL: Duration = Duration::from_millis(200);

/// The text of `--help`.
const HELP: &str =
    "Run a node with the scene drape, a recorder and a viewer until Ctrl-C, then describe the recording.

Usage: cargo demo [--bodies]

Options:
  --bodies  start with rigid bodies of another process in a net; the menu of scenes has them, too

Open the printed address in a browser and drag the curtain. Set CATENARY_DOMAIN to separate the demo
from other nodes on this host. The recording goes to the temporary folder.";

/// Address of the viewer, unless the port is in use.
const LISTEN: &str = "127.0.0.1:8080";
/// Fallback: any free port.
const LISTEN_ANYWHERE: &str = "127.0.0.1:0";

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            note(&format!("error: {error:#}"));
            ExitCode::FAILURE
        }
    }
}

fn run() -> anyhow::Result<()> {
    let has_bodies = match std::env::args().nth(1).as_deref() {
        None => false,
        Some("--bodies") => true,
        Some("--help" | "-h") => {
            return result(&format!("{HELP}\n"));
        }
        Some(other) => bail!("unexpected argument '{other}'\n\n{HELP}"),
    };
    let stop = Stop::install()?;
    let domain = std::env::var(DOMAIN_VARIABLE).unwrap_or_default();
    let (seconds, process) = (realtime_ns() / SECOND_NS, std::process::id());
    let file = std::env::temp_dir().join(format!("catenary-demo-{seconds}-{process}.mcap"));
    let file = file.to_str().context("the temporary folder's path is not UTF-8")?;

    note("building the programs");
    let built = if has_bodies { build_products_and_bodies() } else { build_products() };
    if stop.is_requested() {
        bail!("interrupted while building the programs");
    }
    built?;
    note("starting the node");
    let scene = has_bodies.then(bodies_scene).transpose()?;
    let run = ["run", scene.as_deref().unwrap_or("drape")];
    let mut node = Process::start_in(Program::SimNode, &domain, &run);
    node.wait_until_ready();
    let mut bodies = has_bodies.then(|| Process::start_in(Program::Bodies, &domain, &[]));
    if let Some(bodies) = &mut bodies {
        bodies.wait_until_ready();
    }
    let mut recorder = Process::start_in(Program::Recorder, &domain, &["record", "-o", file]);
    recorder.wait_until_ready();
    let mut viewer = start_viewer(&domain, scene.as_deref());
    let url = viewer.wait_for_line("ready ");
    // A recording begins with a keyframe, which arrives a moment after the recorder is ready. Ctrl-C
    // before that would leave nothing to describe.
    recorder.wait_for_line("recording from step ");
    note("the node is running and being recorded; press Ctrl-C to end the demo");
    note(&format!("open in a browser:  {}", url.trim_start_matches("ready ")));

    show_progress(&stop, &mut node, &domain)?;
    let recorded = recorder.interrupt();
    let shown = viewer.interrupt();
    if let Some(bodies) = bodies {
        note(bodies.interrupt().stderr.trim_end());
    }
    let ended = node.interrupt();
    note(format!("{}{}{}", recorded.stderr, shown.stderr, ended.stderr).trim_end());
    // Exit code 3 means that the recording has gaps; the recorder has reported them.
    let is_ok = |ended: &Finished| ended.code == Some(0);
    if !matches!(recorded.code, Some(0 | 3)) || !is_ok(&shown) || !is_ok(&ended) {
        let [recorder, viewer, node] = [recorded.code, shown.code, ended.code];
        bail!(
            "the recorder ended with {recorder:?}, the viewer with {viewer:?}, the node with {node:?}"
        );
    }
    let info = Process::start_in(Program::Recorder, &domain, &["info", file]).wait();
    result(&format!("{file}\n{}", info.stdout))
}

/// Prints a result.
fn result(text: &str) -> anyhow::Result<()> {
    write_result(text.as_bytes()).context("cannot write to stdout")
}

/// Returns the scene of the example `bodies`.
fn bodies_scene() -> anyhow::Result<String> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/bodies/bodies.toml");
    let path = std::fs::canonicalize(path).context(path)?;
    Ok(path.to_str().context("the path of the repository is not UTF-8")?.to_owned())
}

/// Starts the viewer, on a free port if the usual one is in use. Its menu has the built-in scenes, and `scene`.
fn start_viewer(domain: &str, scene: Option<&str>) -> Process {
    let is_free = TcpListener::bind(LISTEN).is_ok();
    let listen = if is_free { LISTEN } else { LISTEN_ANYWHERE };
    let mut args = vec!["--listen", listen];
    args.extend(scene.iter().flat_map(|scene| ["--scene", scene]));
    Process::start_in(Program::ViewerBridge, domain, &args)
}

/// Shows the progress of the node until Ctrl-C, or until the node ends.
fn show_progress(stop: &Stop, node: &mut Process, domain: &str) -> anyhow::Result<()> {
    let domain = Some(domain).filter(|domain| !domain.is_empty());
    let endpoint = Endpoint::new(domain, sim_contract::NAME_DEFAULT)?;
    let mut client = Client::attach(&endpoint)?;
    while !stop.is_requested() && node.is_running() {
        if let Some(status) = client.status(POLL)? {
            // A failure to show the progress is no reason to stop.
            let _ignored = write!(
                stderr(),
                "\rstep {:>8}  x{:.3} real time ",
                status.step,
                status.real_time_factor
            );
        }
    }
    note("");
    Ok(())
}
