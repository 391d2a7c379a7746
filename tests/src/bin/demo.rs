//! `cargo demo`: a node, a recorder and a viewer as processes, until Ctrl-C; then what was recorded.
//!
//! Open the printed address in a browser meanwhile, and drag the curtain.
#![forbid(unsafe_code)]
#![allow(clippy::print_stderr, clippy::print_stdout, reason = "it talks to the user")]

use std::net::TcpListener;
use std::time::Duration;

use anyhow::{Context, bail};
use integration_tests::{Finished, Process, Program};
use sim_contract::clock::{SECOND_NS, realtime_ns};
use sim_contract::{Client, DOMAIN_VARIABLE, Endpoint, Stop};

/// How long the demo waits for news before it looks for Ctrl-C again.
const POLL: Duration = Duration::from_millis(200);

/// What `--help` says.
const HELP: &str =
    "Run a node with the curtain, a recorder and a viewer, until Ctrl-C; then say what was recorded.

Usage: cargo demo

Open the printed address in a browser and drag the curtain. CATENARY_DOMAIN keeps it apart from
other nodes on this host. The recording goes to the temporary folder.";

/// Where the viewer listens unless that is taken.
const LISTEN: &str = "127.0.0.1:8080";
/// Any free port.
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

    eprintln!("building the programs ...");
    let mut node = Process::start_in(Program::SimNode, &domain, &["run", "curtain"]);
    node.wait_until_ready();
    let mut recorder = Process::start_in(Program::Recorder, &domain, &["record", "-o", file]);
    recorder.wait_until_ready();
    let mut viewer = start_viewer(&domain);
    let url = viewer.wait_for_line("ready ");
    eprintln!("the curtain hangs, and everything is recorded; Ctrl-C ends the demo");
    eprintln!("see it, drag it, cut it:  {}", url.trim_start_matches("ready "));

    watch(&stop, &mut node, &domain)?;
    let recorded = recorder.interrupt();
    let shown = viewer.interrupt();
    let ended = node.interrupt();
    eprint!("{}{}{}", recorded.stderr, shown.stderr, ended.stderr);
    // Exit code 3: finished, and it says itself what was lost.
    let is_well = |ended: &Finished| ended.code == Some(0);
    if !matches!(recorded.code, Some(0 | 3)) || !is_well(&shown) || !is_well(&ended) {
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

/// Starts the viewer, on another port where the usual one is taken.
fn start_viewer(domain: &str) -> Process {
    let is_free = TcpListener::bind(LISTEN).is_ok();
    let listen = if is_free { LISTEN } else { LISTEN_ANYWHERE };
    Process::start_in(Program::ViewerBridge, domain, &["--listen", listen])
}

/// Shows how the node does until Ctrl-C, or until it ends by itself.
fn watch(stop: &Stop, node: &mut Process, domain: &str) -> anyhow::Result<()> {
    let domain = Some(domain).filter(|domain| !domain.is_empty());
    let endpoint = Endpoint::new(domain, sim_contract::NAME_DEFAULT)?;
    let mut client = Client::attach(&endpoint)?;
    while !stop.is_asked() && node.is_running() {
        if let Some(status) = client.status(POLL)? {
            eprint!("\rstep {:>8}  x{:.3} real time ", status.step, status.real_time_factor);
        }
    }
    eprintln!();
    Ok(())
}
