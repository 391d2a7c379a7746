//! Between one source and many pages.
//!
//! There are two paths. Reliable messages go into a bounded queue of each page; what is latched is
//! also given to pages that come later. Frames are lossy: a page takes the newest one whenever it
//! has credit. A frame is shown after everything that it builds on was queued, and a page's task
//! empties its queue before it sends a frame: so no frame arrives before its scene.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use axum::extract::ws::Message;
use bytes::Bytes;
use recorder::Topic;
use tokio::sync::{mpsc, watch};

pub(crate) use super::connection::{Connection, Credit, Shown, Taken};

use crate::foxglove_server::{CLIENT_FIRST, Publisher};
use crate::limits::{F32_PARTICLES_MAX, PROTOCOL, RELIABLE_QUEUED_MAX};
use crate::message::settings;
use crate::message::{Choice, Limits, Mode, ToPage, Welcome};
use crate::scene::catalog;
use crate::source::{Ask, Request, RequestSender, Requests, requests};

/// What a page that comes late is given, in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Slot {
    /// Whether there is a node.
    Node,
    /// The parameters.
    Parameters,
    /// What a recording holds.
    Timeline,
    /// How it is played.
    Playback,
    /// The load. A new one empties the slots behind it.
    Scene,
    /// What is torn.
    Tear,
    /// What is not free.
    Pins,
}

/// The state of a step, encoded as often as there is a demand for.
#[derive(Debug, Clone, Default)]
pub struct FrameSet {
    /// Number of the frame; ascending.
    pub number: u32,
    /// Particles in it.
    pub particle_count: usize,
    /// Encoded as FRAME f32.
    pub f32: Option<Bytes>,
    /// Encoded as FRAME u16.
    pub u16: Option<Bytes>,
    /// The colliders of the load, if it has any.
    pub colliders: Option<ColliderSet>,
}

/// Colliders in their poses.
#[derive(Debug, Clone)]
pub struct ColliderSet {
    /// Changes with every change.
    pub number: u64,
    /// Encoded as COLLIDERS.
    pub bytes: Bytes,
}

/// Which encodings pages wait for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Demand {
    /// FRAME f32.
    pub f32: bool,
    /// FRAME u16.
    pub u16: bool,
    /// Foxglove clients wait for a state.
    pub foxglove: bool,
}

impl Demand {
    /// Whether anybody waits for a frame.
    pub fn is_any(self) -> bool {
        self.is_of_pages() || self.foxglove
    }

    /// Whether a page does.
    pub fn is_of_pages(self) -> bool {
        self.f32 || self.u16
    }
}

/// How that page gets a scene of that many particles.
pub(super) fn wants_f32(choice: Choice, particle_count: usize) -> bool {
    match choice {
        Choice::Auto => particle_count <= F32_PARTICLES_MAX,
        Choice::F32 => true,
        Choice::U16 => false,
    }
}

/// Between one source and many pages.
#[derive(Debug)]
pub struct Hub {
    mode: Mode,
    state: Mutex<State>,
    frames: watch::Sender<Arc<FrameSet>>,
    closed: watch::Sender<bool>,
    requests: RequestSender,
    /// The Foxglove side, if there is one.
    publisher: OnceLock<Arc<Publisher>>,
}

#[derive(Debug, Default)]
struct State {
    latched: BTreeMap<Slot, Message>,
    clients: BTreeMap<u32, Member>,
    /// Number of the last page that came.
    last_client: u32,
}

/// A page, seen from the hub.
#[derive(Debug)]
struct Member {
    queue: mpsc::Sender<Message>,
    choice: Choice,
    credit: Arc<Credit>,
}

impl State {
    /// Queues a message for everyone. Whoever has no room is given up: its task sees the end of its
    /// queue, and closes.
    fn queue(&mut self, message: &Message) {
        self.clients.retain(|_, member| member.queue.try_send(message.clone()).is_ok());
    }
}

impl Hub {
    /// A hub without pages, and the requests of those that will come.
    pub fn new(mode: Mode) -> (Self, Requests) {
        let (sender, receiver) = requests();
        let hub = Self {
            mode,
            state: Mutex::default(),
            frames: watch::Sender::default(),
            closed: watch::Sender::new(false),
            requests: sender,
            publisher: OnceLock::new(),
        };
        (hub, receiver)
    }

    /// A panic in one task must not take the others with it: every change of the state is complete
    /// at every point where it could come.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds the Foxglove side; the first one stays.
    pub(crate) fn set_publisher(&self, publisher: Arc<Publisher>) {
        let _first = self.publisher.set(publisher);
    }

    /// The Foxglove side, if there is one.
    pub(crate) fn publisher(&self) -> Option<&Publisher> {
        self.publisher.get().map(Arc::as_ref)
    }

    /// Says something on a topic of recordings, to Foxglove clients; it is made only if one hears it.
    pub fn say(&self, topic: Topic, make: impl FnOnce() -> recorder::Message) {
        if let Some(publisher) = self.publisher() {
            publisher.say(topic, make);
        }
    }

    /// Tells everyone something that stays true: pages that come later are told as well.
    pub fn latch(&self, slot: Slot, message: &ToPage) {
        if self.publisher().is_some_and(|publisher| publisher.hear(message)) {
            self.request(CLIENT_FIRST, Ask::Frame);
        }
        self.latch_bytes(slot, &text(message), None);
    }

    /// The same for a binary message. Where `change` is given, those who are here get that, and
    /// `full` is for those who come.
    pub fn latch_binary(&self, slot: Slot, full: Bytes, change: Option<Bytes>) {
        self.latch_bytes(slot, &Message::Binary(full), change.map(Message::Binary).as_ref());
    }

    fn latch_bytes(&self, slot: Slot, full: &Message, change: Option<&Message>) {
        let mut state = self.state();
        if slot == Slot::Scene {
            state.latched.retain(|slot, _| *slot < Slot::Scene);
        }
        state.latched.insert(slot, full.clone());
        state.queue(change.unwrap_or(full));
    }

    /// Nothing is known of that any more; those who are here keep what they were told.
    pub fn forget(&self, slot: Slot) {
        self.state().latched.remove(&slot);
    }

    /// Tells everyone who is here.
    pub fn broadcast(&self, message: &ToPage) {
        self.state().queue(&text(message));
    }

    /// The same for a binary message.
    pub fn broadcast_binary(&self, bytes: Bytes) {
        self.state().queue(&Message::Binary(bytes));
    }

    /// Tells one page, if it is still here.
    pub fn send(&self, client: u32, message: &ToPage) {
        if client >= CLIENT_FIRST {
            if let (Some(publisher), ToPage::Outcome(outcome)) = (self.publisher(), message) {
                publisher.answer(outcome);
            }
            return;
        }
        let mut state = self.state();
        if let Some(member) = state.clients.get(&client)
            && member.queue.try_send(text(message)).is_err()
        {
            state.clients.remove(&client);
        }
    }

    /// Shows a frame to all who have credit, now or later; the one before it is forgotten.
    pub fn show(&self, frame: FrameSet) {
        self.frames.send_replace(Arc::new(frame));
    }

    /// Shows the last frame once more, to those who have not seen it.
    pub fn show_again(&self) {
        self.frames.send_modify(|_| {});
    }

    /// Which encodings pages with credit wait for, in a scene of that many particles.
    pub fn demand(&self, particle_count: usize) -> Demand {
        let foxglove = self.publisher().is_some_and(Publisher::is_awaiting);
        let mut demand = Demand { foxglove, ..Demand::default() };
        for member in self.state().clients.values().filter(|member| member.credit.is_left()) {
            if wants_f32(member.choice, particle_count) {
                demand.f32 = true;
            } else {
                demand.u16 = true;
            }
        }
        demand
    }

    /// How many pages there are.
    pub fn client_count(&self) -> usize {
        self.state().clients.len()
    }

    /// Ends everything: pages are told that the server goes, and the source ends.
    pub fn close(&self) {
        self.closed.send_replace(true);
        self.state().clients.clear();
    }

    /// Whether the server ends.
    pub fn is_closed(&self) -> bool {
        *self.closed.borrow()
    }

    /// Waits for the end of the server.
    pub async fn closed(&self) {
        let mut closed = self.closed.subscribe();
        // The sender is ours: it cannot be gone.
        let _ended = closed.wait_for(|is_closed| *is_closed).await;
    }

    /// Takes in a page; its queue begins with the greeting and everything latched.
    pub(crate) fn join(&self, choice: Choice) -> Connection {
        let (queue, receiver) = mpsc::channel(RELIABLE_QUEUED_MAX);
        let credit = Arc::new(Credit::default());
        let mut state = self.state();
        state.last_client += 1;
        let client = state.last_client;
        let welcome = text(&ToPage::Hello(Box::new(self.welcome(client, choice))));
        for message in std::iter::once(&welcome).chain(state.latched.values()) {
            // The queue is longer than this.
            let _queued = queue.try_send(message.clone());
        }
        state.clients.insert(client, Member { queue, choice, credit: Arc::clone(&credit) });
        let count = text(&ToPage::Clients { count: state.clients.len() });
        state.queue(&count);
        drop(state);
        let mut frames = self.frames.subscribe();
        frames.mark_unchanged();
        let connection = Connection { client, choice, queue: receiver, frames, credit };
        self.request(client, Ask::Frame);
        connection
    }

    fn welcome(&self, client: u32, format: Choice) -> Welcome {
        let scenes = match self.mode {
            Mode::Live => catalog::all(),
            Mode::Replay => Vec::new(),
        };
        Welcome {
            protocol: PROTOCOL,
            version: env!("CARGO_PKG_VERSION"),
            client,
            mode: self.mode,
            format,
            scenes,
            settings: &settings::SETTINGS,
            limits: Limits::default(),
        }
    }

    /// Lets a page go.
    pub(crate) fn leave(&self, client: u32) {
        let mut state = self.state();
        state.clients.remove(&client);
        let count = text(&ToPage::Clients { count: state.clients.len() });
        state.queue(&count);
        drop(state);
        self.request(client, Ask::Left);
    }

    /// Hands a request to the source; whether it was taken.
    pub(crate) fn request(&self, client: u32, ask: Ask) -> bool {
        self.requests.send(Request { client, ask })
    }
}

/// A text message.
fn text(message: &ToPage) -> Message {
    Message::Text(message.to_json().into())
}
