//! `viewer-bridge`: shows a running simulation in a browser, and lets it be touched; or a recording.
#![forbid(unsafe_code)]

mod args;

use std::process::ExitCode;
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use anyhow::{Context, anyhow};
use clap::Parser;
use sim_contract::Stop;
use tokio::runtime;
use viewer_bridge::assets::Assets;
use viewer_bridge::live::Live;
use viewer_bridge::replay::Replay;
use viewer_bridge::{Hub, Server, ServerOptions, Source};

use args::Args;

/// Threads of the server: encoding is not among its work, only sending.
const SERVER_THREADS: usize = 2;
/// How often signals and the source are looked at.
const LOOK_PERIOD: Duration = Duration::from_millis(50);

#[allow(clippy::print_stderr, reason = "the one place where errors reach the user")]
fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(args: &Args) -> anyhow::Result<()> {
    let stop = Stop::install()?;
    let source = source(args)?;
    let assets = match &args.assets {
        None => Assets::Embedded,
        Some(folder) => Assets::folder(folder)
            .with_context(|| format!("reading the page from {}", folder.display()))?,
    };
    let options = ServerOptions { listen: args.listen, names: args.hosts.clone(), assets };
    let runtime = runtime::Builder::new_multi_thread()
        .worker_threads(SERVER_THREADS)
        .enable_all()
        .build()
        .context("starting the server's threads")?;
    runtime.block_on(serve(source, options, stop))
}

/// What is shown: a recording, or whatever node has the name.
fn source(args: &Args) -> anyhow::Result<Box<dyn Source>> {
    Ok(match &args.replay {
        Some(path) => Box::new(Replay::open(path, &mut note)?),
        None => Box::new(Live::new(args.endpoint()?)),
    })
}

/// Serves until asked to stop, or until the source fails.
async fn serve(source: Box<dyn Source>, options: ServerOptions, stop: Stop) -> anyhow::Result<()> {
    let server = Server::bind(options).await?;
    let (hub, feeding) = feed(source)?;
    say_ready(&server);
    let watch = async {
        while !stop.is_asked() && !feeding.is_finished() {
            tokio::time::sleep(LOOK_PERIOD).await;
        }
        hub.close();
    };
    tokio::join!(server.serve(Arc::clone(&hub)), watch);
    feeding
        .join()
        .map_err(|_| anyhow!("the thread that reads the node or the recording panicked"))?
}

/// Starts the thread of the source.
fn feed(mut source: Box<dyn Source>) -> anyhow::Result<(Arc<Hub>, JoinHandle<anyhow::Result<()>>)> {
    let (hub, requests) = Hub::new(source.mode());
    let hub = Arc::new(hub);
    let fed = Arc::clone(&hub);
    let feeding = thread::Builder::new()
        .name("source".to_owned())
        .spawn(move || source.run(&fed, &requests))
        .context("starting the thread that reads the node or the recording")?;
    Ok((hub, feeding))
}

fn say_ready(server: &Server) {
    let url = server.url();
    note(&format!("ready {url}"));
    if url.contains('#') {
        note("warning: other machines can reach this; whoever has the token can command the node");
    }
}

#[allow(clippy::print_stderr, reason = "messages to the user")]
fn note(text: &str) {
    eprintln!("{text}");
}
