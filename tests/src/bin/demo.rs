//! `cargo demo`: runs a node, a recorder and a viewer as processes until Ctrl-C, then describes the
//! recording.
//!
//! Open the printed address in a browser and drag the curtain.
#![forbid(unsafe_code)]
#![allow(clippy::print_stderr, clippy::print_stdout, reason = "messages to the user")]

use std::net::TcpListener;
use std::time::Duration;

use anyhow::{Context, bail};
use integration_tests::{Finished, Process, Program, build_products};
use sim_contract::clock::{SECOND_NS, realtime_ns};
use sim_contract::{Client, DOMAIN_VARIABLE, Endpoint, Stop};

/// Limit on each wait for a status of the node, so that the demo notices Ctrl-C.
const POLL: Duration = Duration::from_millis(200);

/// The text of `--help`.
const HELP: &str =
    "Run a node with the curtain scene, a recorder and a viewer until Ctrl-C, then describe the recording.

Usage: cargo demo

Open the printed address in a browser and drag the curtain. Set CATENARY_DOMAIN to separate the demo
from other nodes on this host. The recording goes to the temporary folder.";

/// Address of the viewer, unless the port is in use.
const LISTEN: &str = "127.0.0.1:8080";
/// Fallback: any free port.
const LISTEN_ANYWHERE: &str = "127.0.0.1:0";

fn main() -> anyhow::Result<()> {
    match std::env::args().nth(1).as_deref() {
        None => {}
        Some("--help" | "-h") => {
            println!("{HELP}");
            return Ok(());
        }
        Some(other) => bail!("unexpected argument '{other}'\n\n{HELP}"),
    }
    let stop = Stop::install()?;
    let domain = std::env::var(DOMAIN_VARIABLE).unwrap_or_default();
    let file =
        std::env::temp_dir().join(format!("catenary-demo-{}.mcap", realtime_ns() / SECOND_NS));
    let file = file.to_str().context("the temporary folder's path is not UTF-8")?;

    eprintln!("building the programs");
    build_products();
    eprintln!("starting the node");
    let mut node = Process::start_in(Program::SimNode, &domain, &["run", "curtain"]);
    node.wait_until_ready();
    let mut recorder = Process::start_in(Program::Recorder, &domain, &["record", "-o", file]);
    recorder.wait_until_ready();
    let mut viewer = start_viewer(&domain);
    let url = viewer.wait_for_line("ready ");
    eprintln!("the node is running and being recorded; press Ctrl-C to end the demo");
    eprintln!("open in a browser:  {}", url.trim_start_matches("ready "));

    show_progress(&stop, &mut node, &domain)?;
    let recorded = recorder.interrupt();
    let shown = viewer.interrupt();
    let ended = node.interrupt();
    eprint!("{}{}{}", recorded.stderr, shown.stderr, ended.stderr);
    // Exit code 3 means that the recording has gaps; the recorder has reported them.
    let is_ok = |ended: &Finished| ended.code == Some(0);
    if !matches!(recorded.code, Some(0 | 3)) || !is_ok(&shown) || !is_ok(&ended) {
        let [recorder, viewer, node] = [recorded.code, shown.code, ended.code];
        bail!(
            "the recorder ended with {recorder:?}, the viewer with {viewer:?}, the node with {node:?}"
        );
    }
    println!("{file}");
    let info = Process::start_in(Program::Recorder, &domain, &["info", file]).wait();
    print!("{}", info.stdout);
    Ok(())
}

/// Starts the viewer, on a free port if the usual one is in use.
fn start_viewer(domain: &str) -> Process {
    let is_free = TcpListener::bind(LISTEN).is_ok();
    let listen = if is_free { LISTEN } else { LISTEN_ANYWHERE };
    Process::start_in(Program::ViewerBridge, domain, &["--listen", listen])
}

/// Shows the progress of the node until Ctrl-C, or until the node ends.
fn show_progress(stop: &Stop, node: &mut Process, domain: &str) -> anyhow::Result<()> {
    let domain = Some(domain).filter(|domain| !domain.is_empty());
    let endpoint = Endpoint::new(domain, sim_contract::NAME_DEFAULT)?;
    let mut client = Client::attach(&endpoint)?;
    while !stop.is_requested() && node.is_running() {
        if let Some(status) = client.status(POLL)? {
            eprint!("\rstep {:>8}  x{:.3} real time ", status.step, status.real_time_factor);
        }
    }
    eprintln!();
    Ok(())
}
