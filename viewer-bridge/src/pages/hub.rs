//! The sink of the pages: between one source and many pages.
//!
//! Messages take one of two paths. Reliable messages go into a bounded queue for each page; the latched
//! ones are also sent to pages that join later. Frames are lossy: a page receives the newest one when
//! it has credit. A frame is published after the messages that it depends on, and the task of a page
//! empties its queue before it sends a frame. Therefore no frame arrives before its scene.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::extract::ws::Message;
use bytes::Bytes;
use sim_contract::Reason;
use tokio::sync::{mpsc, watch};

use super::connection::{Connection, Credit, SentFrames, Subscription};
pub use super::frames::Formats;
use super::frames::{FrameEncoder, FrameProperties, FrameSet, Wanted};
use super::history::{History, PastMessages, Viewer};
use crate::limits::{PROTOCOL, RELIABLE_QUEUED_MAX};
use crate::message::{
    Choice, Level, Mode, Node, PageLimits, RecordingText, Refusal, ToPage, Toward, Welcome,
};
use crate::request::{ClientId, RequestKind, RequestSender};
use crate::scene::catalog::SceneEntry;
use crate::sink::{Demand, Sink, State, Torn, Update};
use crate::source::recording_files::names_in;
use crate::wire::{Stamp, Statistics, Tear, count_u32};

/// Latched messages, in the order in which a new page receives them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Slot {
    Node,
    Parameters,
    Timeline,
    Playback,
    Ghost,
    Recording,
    /// A new scene empties the slots after this one.
    Scene,
    Tear,
    Pins,
    History,
    /// The notice about a newer load that cannot be shown.
    LoadRefused,
}

/// The sink of the pages.
#[derive(Debug)]
pub struct Hub {
    mode: Mode,
    scenes: Vec<SceneEntry>,
    /// Folder of the recordings that pages of a replay can open instead.
    folder: Option<PathBuf>,
    state: Mutex<HubState>,
    encoder: Mutex<FrameEncoder>,
    /// The past of a live simulation.
    history: Mutex<History>,
    frames: watch::Sender<Arc<FrameSet>>,
    requests: RequestSender,
}

#[derive(Debug, Default)]
struct HubState {
    latched: BTreeMap<Slot, Message>,
    pages: BTreeMap<ClientId, Page>,
    /// The newest state of the node.
    node: Node,
    last_number: u32,
}

/// A page, seen from the hub.
#[derive(Debug)]
struct Page {
    queue: mpsc::Sender<Message>,
    choice: Choice,
    credit: Arc<Credit>,
    subscription: Arc<Mutex<Subscription>>,
    /// Latched messages that this page has missed, because its queue was half full.
    missed: BTreeSet<Slot>,
}

impl HubState {
    /// Queues a message for each page. Removes a page whose queue is full: its task sees the end of
    /// the queue and closes the connection.
    fn queue(&mut self, message: &Message) {
        self.pages.retain(|_, page| page.queue.try_send(message.clone()).is_ok());
    }

    /// Queues a message that is sent several times a second, for each page whose queue is not half full: a page that
    /// receives a long scene over a slow line gets the next one, and the newest of each latched message that it missed.
    fn queue_periodic(&mut self, slot: Option<Slot>, message: &Message) {
        let Self { pages, latched, .. } = self;
        pages.retain(|_, page| {
            if page.queue.capacity() < RELIABLE_QUEUED_MAX / 2 {
                page.missed.extend(slot);
                return true;
            }
            let missed = std::mem::take(&mut page.missed).into_iter();
            let missed =
                missed.filter(|one| Some(*one) != slot).filter_map(|one| latched.get(&one));
            missed.chain([message]).all(|one| page.queue.try_send(one.clone()).is_ok())
        });
    }

    fn queue_count(&mut self) {
        let count = text(&ToPage::Clients { count: self.pages.len() });
        self.queue(&count);
    }

    /// Queues a message for each page and keeps it for later ones.
    fn latch(&mut self, slot: Slot, message: Message) {
        match slot {
            Slot::History | Slot::Recording => self.queue_periodic(Some(slot), &message),
            _ => self.queue(&message),
        }
        if slot == Slot::Scene {
            self.latched.retain(|slot, _| *slot < Slot::Scene);
        }
        self.latched.insert(slot, message);
    }
}

/// A panic in one task must not stop the others. Every change under this lock is complete wherever a
/// panic could occur.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn text(message: &ToPage) -> Message {
    Message::Text(message.to_json().into())
}

impl Hub {
    /// Creates a hub without pages, which can load `scenes`. The requests of its pages go to `requests`.
    pub fn new(mode: Mode, scenes: Vec<SceneEntry>, requests: RequestSender) -> Self {
        Self {
            mode,
            scenes,
            folder: None,
            state: Mutex::default(),
            encoder: Mutex::default(),
            history: Mutex::default(),
            frames: watch::Sender::default(),
            requests,
        }
    }

    /// Lets the pages of a replay choose from the recordings of a folder.
    #[must_use]
    pub fn with_folder(self, folder: Option<PathBuf>) -> Self {
        Self { folder, ..self }
    }

    /// Returns the formats in which pages with credit wait for this state.
    pub fn awaited_formats(&self, state: &State<'_>) -> Formats {
        let properties = FrameProperties::from_state(state);
        let mut formats = Formats::default();
        for page in lock(&self.state).pages.values().filter(|page| page.credit.is_left()) {
            formats.add(properties.format_for(page.choice));
        }
        formats
    }

    /// Returns what pages want to know of a state besides the positions.
    fn wanted(&self) -> Wanted {
        let mut wanted = Wanted::default();
        for page in lock(&self.state).pages.values() {
            let subscription = lock(&page.subscription);
            wanted.speeds |= subscription.speeds;
            wanted.particles.extend(&subscription.particles);
        }
        wanted.particles.sort_unstable();
        wanted.particles.dedup();
        wanted
    }

    /// Number of pages.
    pub fn client_count(&self) -> usize {
        lock(&self.state).pages.len()
    }

    fn latch(&self, slot: Slot, message: &ToPage) {
        lock(&self.state).latch(slot, text(message));
    }

    fn latch_binary(&self, slot: Slot, bytes: Bytes) {
        lock(&self.state).latch(slot, Message::Binary(bytes));
    }

    fn broadcast(&self, message: &ToPage) {
        lock(&self.state).queue(&text(message));
    }

    /// Sends the change of the list to the pages, and keeps the whole list for later ones.
    fn publish_torn(&self, Torn { stamp, all, known_count }: &Torn<'_>) {
        let tear = |first: usize| {
            let tear = Tear { stamp: *stamp, first: count_u32(first), torn: all[first..].to_vec() };
            Message::Binary(tear.encode())
        };
        let all_of_them = tear(0);
        if let Message::Binary(bytes) = &all_of_them {
            let (known_count, count) = (count_u32(*known_count), count_u32(all.len()));
            lock(&self.history).set_torn(stamp.step, known_count, count, bytes.clone());
        }
        let mut state = lock(&self.state);
        state.queue(&tear(*known_count));
        state.latched.insert(Slot::Tear, all_of_them);
    }

    /// Encodes a state in the formats that pages wait for, and keeps it for those that look back.
    fn publish_state(&self, state: &State<'_>) {
        let formats = self.awaited_formats(state);
        if !formats.is_any() {
            return;
        }
        let frame = Arc::new(lock(&self.encoder).encode(state, formats, &self.wanted()));
        if self.mode == Mode::Live {
            let stamp = Stamp { epoch: state.epoch, step: state.row.step };
            lock(&self.history).keep(stamp, &frame);
        }
        self.frames.send_replace(frame);
    }

    /// The newest state of the node.
    pub(super) fn node(&self) -> Node {
        lock(&self.state).node.clone()
    }

    /// Shows the recording that the bridge makes.
    pub(super) fn publish_recording(&self, recording: &RecordingText) {
        self.latch(Slot::Recording, &ToPage::Recording(recording.clone()));
    }

    fn publish_history(&self) {
        let change = lock(&self.history).take_change();
        if let Some(text) = change.filter(|_| self.mode == Mode::Live) {
            self.latch(Slot::History, &ToPage::History(text));
        }
    }

    /// Finds the past state nearest to a step for a page.
    pub(super) fn look(
        &self,
        page: &Connection,
        step: u64,
        toward: Toward,
    ) -> Result<PastMessages, Refusal> {
        if self.mode != Mode::Live {
            return Err(Refusal::OnlyLive);
        }
        let subscription = lock(&page.subscription);
        let viewer = Viewer { choice: page.choice, subscription: &subscription };
        lock(&self.history).find(step, toward, viewer).ok_or(Reason::UnknownStep.into())
    }

    fn publish_statistics(&self, statistics: &Statistics) {
        let rate = lock(&self.encoder).take_rate();
        let mut state = lock(&self.state);
        let statistics = Statistics {
            client_count: count_u32(state.pages.len()),
            encode_us: rate.encode_us,
            frames_per_second: rate.frames_per_second,
            ..*statistics
        };
        state.queue_periodic(None, &Message::Binary(statistics.encode()));
    }

    /// Sends a message to one page, if it is still there.
    pub(super) fn send(&self, client: ClientId, message: &ToPage) {
        let mut state = lock(&self.state);
        if let Some(page) = state.pages.get(&client)
            && page.queue.try_send(text(message)).is_err()
        {
            state.pages.remove(&client);
        }
    }

    /// Adds a page. Its queue begins with the greeting and the latched messages.
    pub(crate) fn join(&self, choice: Choice) -> Connection {
        let (queue, receiver) = mpsc::channel(RELIABLE_QUEUED_MAX);
        let credit = Arc::new(Credit::default());
        let recordings = self.folder.as_deref().map(names_in).unwrap_or_default();
        let mut state = lock(&self.state);
        if state.pages.is_empty() {
            // Frames before a pause without pages are not part of the rate.
            lock(&self.encoder).take_rate();
        }
        state.last_number += 1;
        let number = state.last_number;
        let client = ClientId::Page(number);
        let welcome = text(&ToPage::Hello(Box::new(self.welcome(number, choice, recordings))));
        for message in std::iter::once(&welcome).chain(state.latched.values()) {
            // The queue has room for all of them.
            let _queued = queue.try_send(message.clone());
        }
        let subscription = Arc::new(Mutex::new(Subscription::default()));
        let (seen_credit, seen_subscription) = (Arc::clone(&credit), Arc::clone(&subscription));
        let missed = BTreeSet::new();
        let page =
            Page { queue, choice, credit: seen_credit, subscription: seen_subscription, missed };
        state.pages.insert(client, page);
        state.queue_count();
        drop(state);
        let mut frames = self.frames.subscribe();
        frames.mark_unchanged();
        self.request(client, RequestKind::State);
        let sent = SentFrames::default();
        Connection { client, choice, queue: receiver, frames, credit, subscription, sent }
    }

    fn welcome(&self, client: u32, format: Choice, recordings: Vec<String>) -> Welcome {
        Welcome {
            protocol: PROTOCOL,
            version: env!("CARGO_PKG_VERSION"),
            client,
            mode: self.mode,
            format,
            scenes: self.scenes.clone(),
            recordings,
            limits: PageLimits::default(),
        }
    }

    /// Removes a page.
    pub(crate) fn leave(&self, client: ClientId) {
        let mut state = lock(&self.state);
        state.pages.remove(&client);
        state.queue_count();
        drop(state);
        self.request(client, RequestKind::Left);
    }

    /// Sends a request other than a command to the source.
    pub(super) fn request(&self, client: ClientId, kind: RequestKind) {
        // Only commands are refused, unless the source has ended.
        let _sent = self.requests.send(client, kind);
    }

    /// Sender of requests to the source.
    pub(super) fn requests(&self) -> &RequestSender {
        &self.requests
    }
}

impl Sink for Hub {
    fn has_demand(&self, demand: Demand) -> bool {
        match demand {
            Demand::State => lock(&self.state).pages.values().any(|page| page.credit.is_left()),
            Demand::Statistics => self.client_count() > 0,
            Demand::Forces => {
                lock(&self.state).pages.values().any(|page| lock(&page.subscription).forces)
            }
        }
    }

    fn publish(&self, update: &Update<'_>) {
        match *update {
            Update::Load(scene) => {
                lock(&self.encoder).begin_load(scene);
                lock(&self.history).begin_load(scene.rate_hz);
                self.latch_binary(Slot::Scene, scene.encode());
            }
            Update::LoadRefused { text } => {
                let text = text.to_owned();
                self.latch(Slot::LoadRefused, &ToPage::Notice { level: Level::Error, text });
            }
            Update::Torn(torn) => self.publish_torn(&torn),
            Update::Pins(pins) => {
                let bytes = pins.encode();
                lock(&self.history).set_pins(bytes.clone());
                self.latch_binary(Slot::Pins, bytes);
            }
            Update::Colliders(colliders) => lock(&self.encoder).set_colliders(colliders),
            Update::State(state) => self.publish_state(&state),
            Update::SameState => self.frames.send_modify(|_| {}),
            Update::Statistics(statistics) => {
                self.publish_history();
                self.publish_statistics(statistics);
            }
            Update::Node(node) => {
                lock(&self.state).node = node.clone();
                self.latch(Slot::Node, &ToPage::Node(node.clone()));
            }
            Update::Parameters(parameters) => {
                self.latch(Slot::Parameters, &ToPage::Parameters(Box::new(parameters.clone())));
            }
            Update::Timeline(timeline) => {
                self.latch(Slot::Timeline, &ToPage::Timeline(Box::new(timeline.clone())));
            }
            Update::Ghost(ghost) => self.latch(Slot::Ghost, &ToPage::Ghost(ghost.clone())),
            Update::Playback(playback) => self.latch(Slot::Playback, &ToPage::Playback(*playback)),
            Update::Reset { step } => self.broadcast(&ToPage::Reset { step }),
            Update::Notice { level, text } => {
                self.broadcast(&ToPage::Notice { level, text: text.to_owned() });
            }
            Update::Answer { client, outcome } => {
                self.send(client, &ToPage::Outcome(outcome.clone()));
            }
            Update::Undoable { client, what } => self.send(client, &ToPage::Undoable { what }),
            Update::Outcome(row) => lock(&self.history).add_outcome(row),
            // Pages receive the answers to their own commands, and statistics, and the topology in SCENE.
            Update::Topology(_) | Update::Status(_) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_that_was_busy_receives_the_newest_of_what_it_missed() {
        let (queue, mut receiver) = mpsc::channel(RELIABLE_QUEUED_MAX);
        let page = Page {
            queue,
            choice: Choice::default(),
            credit: Arc::default(),
            subscription: Arc::default(),
            missed: BTreeSet::new(),
        };
        let pages = BTreeMap::from([(ClientId::Page(1), page)]);
        let mut state = HubState { pages, ..HubState::default() };
        let message = |text: &str| Message::Text(text.to_owned().into());
        for _ in 0..=RELIABLE_QUEUED_MAX / 2 {
            state.queue(&message("a scene"));
        }
        state.latch(Slot::Recording, message("running"));
        state.queue_periodic(None, &message("statistics"));
        state.latch(Slot::Recording, message("finished"));
        let mut received = || std::iter::from_fn(|| receiver.try_recv().ok()).collect::<Vec<_>>();
        assert_eq!(received(), vec![message("a scene"); RELIABLE_QUEUED_MAX / 2 + 1]);
        state.queue_periodic(None, &message("statistics"));
        assert_eq!(received(), ["finished", "statistics"].map(message));
        state.queue_periodic(None, &message("statistics"));
        assert_eq!(received(), ["statistics"].map(message));
    }
}
