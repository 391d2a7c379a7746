//! The seam between what is shown and how it is served: a live node and a recording feed the same
//! hub, and answer the same commands.

pub mod live;
pub mod replay;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use crate::foxglove_server::Recording;
use crate::limits::REQUESTS_QUEUED_MAX;
use crate::message::{Command, Mode};
use crate::pages::hub::Hub;

/// What feeds a hub. It has a thread of its own.
pub trait Source: Send {
    /// Whether pages get a picker of scenes or a timeline.
    fn mode(&self) -> Mode;

    /// The times of the recording that it plays, if it plays one.
    fn recording(&self) -> Option<Recording> {
        None
    }

    /// Feeds the hub and answers the requests until [`Hub::is_closed`].
    ///
    /// What it has to do: keep the slots of the hub up to date ([`Hub::latch`]), show frames while
    /// there is a demand for them ([`Hub::demand`], [`Hub::show`]), answer every command
    /// ([`Hub::send`]), and end what a page holds when it leaves.
    ///
    /// # Errors
    /// It cannot go on at all. That there is no node is none.
    fn run(&mut self, hub: &Hub, requests: &Requests) -> anyhow::Result<()>;
}

/// Something that a page did.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// The page's number.
    pub client: u32,
    /// What it did.
    pub ask: Ask,
}

/// What a page did.
#[derive(Debug, Clone, PartialEq)]
pub enum Ask {
    /// It came, or missed the newest frame: it needs one even if nothing moves.
    Frame,
    /// It has room for frames again: it needs the next one.
    Credit,
    /// It left: what it holds is to be let go.
    Left,
    /// It wants something done. The numbers in it are finite and in range.
    Command {
        /// The page's number for it.
        id: Option<u32>,
        /// What to do.
        command: Command,
    },
}

/// The requests of all pages, in the order of arrival.
#[derive(Debug)]
pub struct Requests {
    receiver: Receiver<Request>,
    queued: Arc<AtomicUsize>,
}

impl Requests {
    /// The next request, waiting for it at most `timeout`.
    pub fn next(&self, timeout: Duration) -> Option<Request> {
        match self.receiver.recv_timeout(timeout) {
            Ok(request) => {
                self.queued.fetch_sub(1, Ordering::Relaxed);
                Some(request)
            }
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => None,
        }
    }
}

/// The other end of [`Requests`].
#[derive(Debug)]
pub(crate) struct RequestSender {
    sender: Sender<Request>,
    queued: Arc<AtomicUsize>,
}

/// Both ends.
pub(crate) fn requests() -> (RequestSender, Requests) {
    let (sender, receiver) = channel();
    let queued = Arc::new(AtomicUsize::new(0));
    (RequestSender { sender, queued: Arc::clone(&queued) }, Requests { receiver, queued })
}

impl RequestSender {
    /// Whether it was taken: a command is not while too many wait. That a page left always is.
    pub(crate) fn send(&self, request: Request) -> bool {
        let is_command = matches!(request.ask, Ask::Command { .. });
        if is_command && self.queued.load(Ordering::Relaxed) >= REQUESTS_QUEUED_MAX {
            return false;
        }
        self.queued.fetch_add(1, Ordering::Relaxed);
        self.sender.send(request).is_ok()
    }
}
