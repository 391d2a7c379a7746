//! The finished recordings that pages have opened: each is a source of its own, with pages of its own.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use sim_host::Stop;
use sim_host::console::note;
use tokio::sync::OnceCell;
use tokio::task::spawn_blocking;

use super::hub::{Hub, lock};
use crate::limits::REPLAYS_MAX;
use crate::message::Mode;
use crate::request::requests;
use crate::shutdown::Shutdown;
use crate::sink::Sinks;
use crate::source::recording_files::path_of;
use crate::source::replay::{GhostChoice, InitialPlayback, Replay};
use crate::source::{Source, start_source};

/// The open recordings of a folder.
#[derive(Debug)]
pub struct Replays {
    /// `None` if the bridge has no recordings.
    folder: Option<PathBuf>,
    stop: Stop,
    /// Oldest first. Locked only for a look at the list, never while a file is read.
    open: Mutex<Vec<Arc<OpenReplay>>>,
}

/// A recording that is open, or is being opened. Each of its pages holds it from the request on, so one that
/// only the list holds has no pages.
#[derive(Debug)]
struct OpenReplay {
    name: String,
    shown: OnceCell<ShownReplay>,
}

/// The source of an open recording.
#[derive(Debug)]
struct ShownReplay {
    hub: Arc<Hub>,
    shutdown: Shutdown,
    source: JoinHandle<anyhow::Result<()>>,
}

/// An open recording, for a page that keeps it open.
#[derive(Debug)]
pub(super) struct HeldReplay {
    pub(super) hub: Arc<Hub>,
    /// Ends the source.
    pub(super) shutdown: Shutdown,
    _held: Arc<OpenReplay>,
}

impl Replays {
    /// Pages can open the recordings of this folder, if there is one, until a signal arrives.
    pub fn new(folder: Option<PathBuf>, stop: Stop) -> Self {
        Self { folder, stop, open: Mutex::default() }
    }

    /// Returns a recording, which stays open while a page holds it. Opens the recording if it is not open, in
    /// the place of one without pages if there are too many.
    ///
    /// # Errors
    /// A sentence for the user.
    pub(super) async fn open(&self, name: &str) -> Result<HeldReplay, String> {
        let place = self.folder.as_ref().and_then(|folder| Some((folder, path_of(folder, name)?)));
        let (folder, path) = place.ok_or_else(|| "there is no such recording".to_owned())?;
        let replay = self.reserve(name)?;
        let opening = || ShownReplay::open(path, folder, self.stop.clone());
        let shown = replay.shown.get_or_try_init(opening).await?;
        let (hub, shutdown) = (Arc::clone(&shown.hub), shown.shutdown.clone());
        Ok(HeldReplay { hub, shutdown, _held: replay })
    }

    /// Returns the entry of a recording in the list.
    fn reserve(&self, name: &str) -> Result<Arc<OpenReplay>, String> {
        let mut open = lock(&self.open);
        open.retain(|one| match one.shown.get() {
            Some(shown) => !shown.source.is_finished(),
            // Without a page that waits for it, the opening has failed or was given up.
            None => is_held(one),
        });
        if let Some(known) = open.iter().find(|one| one.name == name) {
            return Ok(Arc::clone(known));
        }
        if open.len() >= REPLAYS_MAX {
            let unused = open.iter().position(|one| !is_held(one));
            let unused = unused.ok_or_else(|| {
                format!("{REPLAYS_MAX} recordings are open; close the pages of one")
            })?;
            open.remove(unused).end();
        }
        let replay = Arc::new(OpenReplay { name: name.to_owned(), shown: OnceCell::new() });
        open.push(Arc::clone(&replay));
        Ok(replay)
    }

    /// Ends all of them.
    pub(super) fn end(&self) {
        lock(&self.open).drain(..).for_each(|one| one.end());
    }
}

/// Returns `true` if a page holds a recording of the list, whose lock is held.
fn is_held(replay: &Arc<OpenReplay>) -> bool {
    Arc::strong_count(replay) > 1
}

impl OpenReplay {
    fn end(&self) {
        if let Some(shown) = self.shown.get() {
            shown.shutdown.begin();
        }
    }
}

impl ShownReplay {
    /// Opens a file and starts its source. The error is a sentence for the user.
    async fn open(path: PathBuf, folder: &Path, stop: Stop) -> Result<Self, String> {
        let ghosts = GhostChoice { folder: Some(folder.to_owned()), given: None };
        let start = InitialPlayback::Paused;
        let open_file = move || Replay::open(&path, start, ghosts, &stop, &mut note);
        let opened = spawn_blocking(open_file).await;
        let replay = opened.map_err(|_| "the recording cannot be read".to_owned())?;
        let replay = replay.map_err(|error| {
            // The first cause is the path, which pages need not know.
            let causes: Vec<_> = error.chain().skip(1).map(ToString::to_string).collect();
            causes.join(": ")
        })?;
        Self::start(replay, folder.to_owned()).map_err(|error| format!("{error:#}"))
    }

    fn start(replay: Replay, folder: PathBuf) -> anyhow::Result<Self> {
        let (sender, requests) = requests();
        let shutdown = Shutdown::default();
        let hub = Hub::new(Mode::Replay, replay.scenes(), sender).with_folder(Some(folder));
        let hub = Arc::new(hub);
        let mut sinks = Sinks::new(shutdown.clone());
        sinks.add(Arc::<Hub>::clone(&hub));
        let source = start_source(Box::new(replay), sinks, requests, shutdown.clone())?;
        Ok(Self { hub, shutdown, source })
    }
}

#[cfg(test)]
mod tests {
    use std::future::pending;
    use std::time::Duration;

    use tokio::runtime::Builder;
    use tokio::time::timeout;

    use super::*;

    fn replays() -> Replays {
        Replays::new(Some(std::env::temp_dir()), Stop::default())
    }

    #[test]
    fn a_recording_that_a_page_has_requested_gives_its_place_to_no_other() {
        let replays = replays();
        let names: Vec<_> = (0..REPLAYS_MAX).map(|number| format!("open {number}")).collect();
        let mut held: Vec<_> = names.iter().map(|name| replays.reserve(name).unwrap()).collect();
        let refused = replays.reserve("another").unwrap_err();
        assert_eq!(refused, "4 recordings are open; close the pages of one");
        // A second page of the first recording keeps it open.
        let second = replays.reserve(&names[0]).unwrap();
        assert!(Arc::ptr_eq(&second, &held[0]));
        drop(held.remove(0));
        assert!(replays.reserve("another").is_err());
        drop(second);
        let another = replays.reserve("another").unwrap();
        assert_eq!(another.name, "another");
        assert_eq!(lock(&replays.open).len(), REPLAYS_MAX);
    }

    #[test]
    fn a_recording_that_takes_long_to_open_delays_only_its_own_pages() {
        let replays = replays();
        let slow = replays.reserve("slow").unwrap();
        let runtime = Builder::new_current_thread().enable_time().build().unwrap();
        runtime.block_on(async {
            let opening = slow.shown.get_or_try_init(pending::<Result<ShownReplay, String>>);
            let other = timeout(Duration::from_secs(10), replays.open("no such file"));
            tokio::select! {
                _ = opening => unreachable!("it never opens"),
                opened = other => {
                    let error = opened.expect("it waits for another recording").unwrap_err();
                    assert!(error.starts_with("no such file"), "{error}");
                }
            }
        });
    }
}
