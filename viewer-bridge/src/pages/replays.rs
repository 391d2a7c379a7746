//! The finished recordings that pages have opened: each is a source of its own, with pages of its own.

use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;

use sim_contract::Stop;
use sim_contract::console::note;
use tokio::sync::Mutex;
use tokio::task::spawn_blocking;

use super::hub::Hub;
use crate::limits::REPLAYS_MAX;
use crate::message::Mode;
use crate::request::requests;
use crate::shutdown::Shutdown;
use crate::sink::Sinks;
use crate::source::Source;
use crate::source::recording_files::path_of;
use crate::source::replay::{GhostChoice, InitialPlayback, Replay};
use crate::source::thread::start_source;

/// The open recordings of a folder.
#[derive(Debug)]
pub struct Replays {
    /// `None` if the bridge has no recordings.
    folder: Option<PathBuf>,
    stop: Stop,
    /// Oldest first.
    open: Mutex<Vec<OpenReplay>>,
}

/// An open recording.
#[derive(Debug)]
struct OpenReplay {
    name: String,
    hub: Arc<Hub>,
    shutdown: Shutdown,
    source: JoinHandle<anyhow::Result<()>>,
}

impl Replays {
    /// Pages can open the recordings of this folder, if there is one, until a signal arrives.
    pub fn new(folder: Option<PathBuf>, stop: Stop) -> Self {
        Self { folder, stop, open: Mutex::default() }
    }

    /// Returns the hub of a recording, and the flag that ends it. Opens the recording if it is not open,
    /// in the place of one without pages if there are too many.
    ///
    /// # Errors
    /// A sentence for the user.
    pub(super) async fn open(&self, name: &str) -> Result<(Arc<Hub>, Shutdown), String> {
        let path = self.folder.as_ref().and_then(|folder| path_of(folder, name));
        let path = path.ok_or_else(|| "there is no such recording".to_owned())?;
        let mut open = self.open.lock().await;
        open.retain(|one| !one.source.is_finished());
        if let Some(known) = open.iter().find(|one| one.name == name) {
            return Ok((Arc::clone(&known.hub), known.shutdown.clone()));
        }
        if open.len() >= REPLAYS_MAX {
            let unused = open.iter().position(|one| one.hub.client_count() == 0);
            let unused = unused.ok_or_else(|| {
                format!("{REPLAYS_MAX} recordings are open; close the pages of one")
            })?;
            open.remove(unused).shutdown.begin();
        }
        let stop = self.stop.clone();
        let start = InitialPlayback::Paused;
        let ghosts = GhostChoice { folder: self.folder.clone(), given: None };
        let open_file = move || Replay::open(&path, start, ghosts, &stop, &mut note);
        let opened = spawn_blocking(open_file).await;
        let replay = opened.map_err(|_| "the recording cannot be read".to_owned())?;
        let replay = replay.map_err(|error| {
            // The first cause is the path, which pages need not know.
            let causes: Vec<_> = error.chain().skip(1).map(ToString::to_string).collect();
            causes.join(": ")
        })?;
        let started = OpenReplay::start(name, replay, self.folder.clone());
        let replay = started.map_err(|error| format!("{error:#}"))?;
        let found = (Arc::clone(&replay.hub), replay.shutdown.clone());
        open.push(replay);
        Ok(found)
    }

    /// Ends all of them.
    pub(super) async fn end(&self) {
        for one in self.open.lock().await.drain(..) {
            one.shutdown.begin();
        }
    }
}

impl OpenReplay {
    fn start(name: &str, replay: Replay, folder: Option<PathBuf>) -> anyhow::Result<Self> {
        let (sender, requests) = requests();
        let shutdown = Shutdown::default();
        let hub = Hub::new(Mode::Replay, replay.scenes(), sender).with_folder(folder);
        let hub = Arc::new(hub);
        let mut sinks = Sinks::new(shutdown.clone());
        sinks.add(Arc::<Hub>::clone(&hub));
        let source = start_source(Box::new(replay), sinks, requests, shutdown.clone())?;
        Ok(Self { name: name.to_owned(), hub, shutdown, source })
    }
}
