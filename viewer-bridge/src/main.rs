//! `viewer-bridge`: shows a running simulation in a browser, and lets it be touched; or a recording.
#![forbid(unsafe_code)]

mod args;

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::process::ExitCode;
use std::sync::Arc;
use std::thread::{self, JoinHandle};

use anyhow::{Context, anyhow};
use clap::Parser;
use sim_contract::Stop;
use tokio::runtime;
use tokio::signal::unix::{SignalKind, signal};

use viewer_bridge::pages::assets::Assets;
use viewer_bridge::source::Requests;
use viewer_bridge::source::live::Live;
use viewer_bridge::source::replay::Replay;
use viewer_bridge::{FoxgloveOptions, FoxgloveServer, Hub, Server, ServerOptions, Source};

use args::Args;

/// Threads of the server: encoding is not among its work, only sending.
const SERVER_THREADS: usize = 2;

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
    let foxglove = args.foxglove(source.recording());
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
    runtime.block_on(serve(source, options, foxglove, stop))
}

/// What is shown: a recording, or whatever node has the name.
fn source(args: &Args) -> anyhow::Result<Box<dyn Source>> {
    Ok(match &args.replay {
        Some(path) => Box::new(Replay::open(path, &mut note)?),
        None => Box::new(Live::new(args.endpoint()?)),
    })
}

/// Serves until asked to stop, or until the source fails.
async fn serve(
    source: Box<dyn Source>,
    options: ServerOptions,
    foxglove: Option<FoxgloveOptions>,
    stop: Stop,
) -> anyhow::Result<()> {
    let asked_to_stop = asked(&stop)?;
    let server = Server::bind(options).await?;
    let (hub, requests) = Hub::new(source.mode());
    let hub = Arc::new(hub);
    // Before the source starts: it has to hear everything.
    let foxglove = match foxglove {
        None => None,
        Some(options) => Some(FoxgloveServer::start(options, &hub).await?),
    };
    let feeding = feed(source, &hub, requests)?;
    say_ready(&server, foxglove.as_ref());
    let serve_foxglove = async {
        if let Some(foxglove) = foxglove {
            foxglove.serve(Arc::clone(&hub)).await;
        }
    };
    let watch = async {
        tokio::select! {
            () = asked_to_stop => {}
            // The source has ended.
            () = hub.closed() => {}
        }
        hub.close();
    };
    tokio::join!(server.serve(Arc::clone(&hub)), serve_foxglove, watch);
    feeding
        .join()
        .map_err(|_| anyhow!("the thread that reads the node or the recording panicked"))?
}

/// Waits for the signals that [`Stop`] knows of: it has taken note of what came before.
fn asked(stop: &Stop) -> anyhow::Result<impl Future<Output = ()> + use<>> {
    let listen = |kind| signal(kind).context("listening to signals");
    let (mut interrupt, mut terminate) =
        (listen(SignalKind::interrupt())?, listen(SignalKind::terminate())?);
    let is_asked = stop.is_asked();
    Ok(async move {
        if !is_asked {
            tokio::select! {
                _ = interrupt.recv() => {}
                _ = terminate.recv() => {}
            }
        }
    })
}

/// Starts the thread of the source. With its end, however it ends, the hub is closed.
fn feed(
    mut source: Box<dyn Source>,
    hub: &Arc<Hub>,
    requests: Requests,
) -> anyhow::Result<JoinHandle<anyhow::Result<()>>> {
    let hub = Arc::clone(hub);
    thread::Builder::new()
        .name("source".to_owned())
        .spawn(move || {
            let ended = catch_unwind(AssertUnwindSafe(|| source.run(&hub, &requests)));
            hub.close();
            ended.unwrap_or_else(|panic| resume_unwind(panic))
        })
        .context("starting the thread that reads the node or the recording")
}

fn say_ready(server: &Server, foxglove: Option<&FoxgloveServer>) {
    let url = server.url();
    if let Some(foxglove) = foxglove {
        note(&format!("foxglove {}", foxglove.url()));
    }
    note(&format!("ready {url}"));
    if url.contains('#') {
        note("warning: other machines can reach this; whoever has the token can command the node");
    }
}

#[allow(clippy::print_stderr, reason = "messages to the user")]
fn note(text: &str) {
    eprintln!("{text}");
}
