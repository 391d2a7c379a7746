//! `viewer-bridge`: shows a running simulation or a recording in a browser, and lets users interact
//! with it.
#![forbid(unsafe_code)]

mod args;

use std::future::poll_fn;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::task::Poll;

use anyhow::{Context, anyhow};
use clap::CommandFactory;
use sim_host::{Stop, console, report_bus_errors};
use tokio::runtime;
use tokio::signal::unix::{SignalKind, signal};
use viewer_bridge::message::Mode;
use viewer_bridge::pages::assets::Assets;
use viewer_bridge::request::requests;
use viewer_bridge::scene::catalog::Catalog;
use viewer_bridge::source::live::Live;
use viewer_bridge::source::replay::Replay;
use viewer_bridge::source::start_source;
use viewer_bridge::{
    FoxgloveOptions, FoxgloveServer, Hub, Recordings, Replays, Server, ServerOptions, Shutdown,
    Sinks, Source, newest_recording, open_files_warning,
};

use args::{Args, RecordingPlan};

/// Threads of the servers. They only send; the thread of the source encodes.
const SERVER_THREADS: usize = 2;

fn main() -> ExitCode {
    let args = args::parse(std::env::args_os()).unwrap_or_else(|error| exit_with_usage(&error));
    match run(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            note(&format!("error: {error:#}"));
            ExitCode::FAILURE
        }
    }
}

/// Ends the program as clap does.
#[allow(clippy::exit, reason = "clap ends the program in the same way")]
fn exit_with_usage(error: &clap::Error) -> ! {
    let (printed, code) = (error.print(), error.exit_code());
    std::process::exit(console::usage_exit_code(printed, error.use_stderr(), code))
}

fn run(args: &Args) -> anyhow::Result<()> {
    sim_host::report_file_size_limit()?;
    if let Some(document) = &args.document {
        return document.run(Args::command());
    }
    let stop = Stop::install()?;
    report_bus_errors()?;
    let source = match open_source(args, &stop) {
        Err(_) if stop.is_requested() => return Ok(()),
        source => source?,
    };
    let foxglove = args.foxglove(source.recording());
    let assets = match &args.assets {
        None => Assets::Embedded,
        Some(folder) => Assets::folder(folder)
            .with_context(|| format!("reading the page from {}", folder.display()))?,
    };
    let options = ServerOptions {
        listen: args.listen,
        names: args.hosts.clone(),
        token: args.token_demand(),
        assets,
    };
    let runtime = runtime::Builder::new_multi_thread()
        .worker_threads(SERVER_THREADS)
        .enable_all()
        .build()
        .context("starting the threads of the servers")?;
    let recording = args.recording_plan()?;
    let replays = args.replay.clone().filter(|path| path.is_dir());
    runtime.block_on(serve(source, Servers { pages: options, foxglove, recording, replays }, stop))
}

fn open_source(args: &Args, stop: &Stop) -> anyhow::Result<Box<dyn Source>> {
    if let Some(path) = &args.replay {
        let path = if path.is_dir() { newest_in(path)? } else { path.clone() };
        return Ok(Box::new(Replay::open(&path, args.start(), args.ghosts()?, stop, &mut note)?));
    }
    let mut catalog = Catalog::default();
    args.scenes.iter().try_for_each(|path| catalog.add_file(path))?;
    Ok(Box::new(Live::new(args.endpoint()?, catalog)))
}

/// Returns the newest recording in a folder.
fn newest_in(folder: &Path) -> anyhow::Result<PathBuf> {
    let newest = newest_recording(folder);
    let newest = newest.with_context(|| format!("{}: cannot read the folder", folder.display()))?;
    newest.with_context(|| {
        format!(
            "{}: has no recording (*.mcap); give a file written by `recorder record` or `recorder simulate`, or \
             a folder of them",
            folder.display()
        )
    })
}

/// The servers, and the recordings of their pages.
struct Servers {
    pages: ServerOptions,
    foxglove: Option<FoxgloveOptions>,
    /// The recordings that pages can start, if the source is live.
    recording: Option<RecordingPlan>,
    /// Folder of the recordings that pages of a replay can open instead.
    replays: Option<PathBuf>,
}

/// Serves until a signal arrives or the source ends.
async fn serve(source: Box<dyn Source>, servers: Servers, stop: Stop) -> anyhow::Result<()> {
    let stop_signal = stop_signal(&stop)?;
    let Servers { pages, foxglove, recording, replays } = servers;
    let server = Server::bind(pages).await?;
    let (sender, requests) = requests();
    let shutdown = Shutdown::default();
    let mode = source.mode();
    let hub = Hub::new(mode, source.scenes(), sender.clone()).with_folder(replays.clone());
    let hub = Arc::new(hub);
    let mut sinks = Sinks::new(shutdown.clone());
    sinks.add(Arc::<Hub>::clone(&hub));
    let (recordings, replays) = match recording {
        None => (None, replays),
        Some(RecordingPlan { endpoint, folder }) => {
            let folder = folder.folder(server.is_local());
            let recordings = Recordings::new(Arc::clone(&hub), endpoint, folder.clone());
            (Some(Arc::new(recordings)), folder)
        }
    };
    let replays = Replays::new(replays, stop);
    let foxglove = match foxglove {
        None => None,
        Some(options) => {
            let server = FoxgloveServer::start(options, sender).await?;
            sinks.add(server.sink());
            Some(server)
        }
    };
    let source_thread = start_source(source, sinks, requests, shutdown.clone())?;
    announce(&server, foxglove.as_ref(), mode);
    let serve_foxglove = async {
        if let Some(foxglove) = foxglove {
            foxglove.serve(shutdown.clone()).await;
        }
    };
    let wait_for_end = async {
        tokio::select! {
            () = stop_signal => {}
            () = shutdown.begun() => {}
        }
        shutdown.begin();
    };
    let serve_pages = server.serve(hub, recordings.clone(), replays, shutdown.clone());
    tokio::join!(serve_pages, serve_foxglove, wait_for_end);
    if let Some(recordings) = recordings {
        recordings.finish();
    }
    source_thread.join().map_err(|_| anyhow!("the thread of the source panicked"))?
}

/// Waits for the signals that [`Stop`] handles. It has seen any that came earlier.
fn stop_signal(stop: &Stop) -> anyhow::Result<impl Future<Output = ()> + use<>> {
    let listen = |number: &i32| signal(SignalKind::from_raw(*number));
    let signals: Result<Vec<_>, _> = stop.signals().iter().map(listen).collect();
    let mut signals = signals.context("listening for signals")?;
    let is_requested = stop.is_requested();
    Ok(async move {
        if !is_requested {
            poll_fn(|context| {
                let mut polls = signals.iter_mut().map(|signal| signal.poll_recv(context));
                // Every signal is polled, so that each of them wakes the task.
                let arrived = polls.by_ref().filter(Poll::is_ready).count();
                if arrived > 0 { Poll::Ready(()) } else { Poll::Pending }
            })
            .await;
        }
    })
}

/// Prints the addresses.
fn announce(server: &Server, foxglove: Option<&FoxgloveServer>, mode: Mode) {
    let url = server.url();
    if let Some(warning) = open_files_warning() {
        note(&warning);
    }
    if let Some(foxglove) = foxglove {
        note(&format!("foxglove {}", foxglove.url()));
    }
    note(&format!("ready {url}"));
    if !server.is_local() {
        let controlled = match mode {
            Mode::Live => "the node",
            Mode::Replay => "the playback",
        };
        note(&format!(
            "warning: other machines can connect; anyone with the token can control {controlled}"
        ));
    }
}

fn note(text: &str) {
    console::note(text);
}
