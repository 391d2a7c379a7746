//! Requests: the path from the clients of all sinks to the source.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use crate::limits::REQUESTS_QUEUED_MAX;
use crate::message::Command;

/// The sender of a request. A source treats each as a client of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ClientId {
    /// A page, by number.
    Page(u32),
    /// A Foxglove client that calls services and sets parameters.
    FoxgloveCaller(u32),
    /// A Foxglove client that publishes commands. Its grabs end when it stops publishing; what it
    /// called as a [`ClientId::FoxgloveCaller`] is still answered.
    FoxglovePublisher(u32),
}

/// A request of a client.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// The sender.
    pub client: ClientId,
    /// The content.
    pub kind: RequestKind,
}

/// The content of a request.
#[derive(Debug, Clone, PartialEq)]
pub enum RequestKind {
    /// The client needs the newest state even if nothing has changed: it has just arrived, or the
    /// newest state was not encoded in its format.
    State,
    /// The client can receive states again, and needs the next one.
    Credit,
    /// The client has left. Its grabs must end.
    Left,
    /// The client wants something to be done. The numbers in the command are finite and in range.
    Command {
        /// The client's number for the command.
        id: Option<u32>,
        /// The command.
        command: Command,
    },
}

/// The requests of all clients, in the order of arrival.
#[derive(Debug)]
pub struct Requests {
    receiver: Receiver<Request>,
    queued_count: Arc<AtomicUsize>,
}

impl Requests {
    /// Returns the next request. Waits for it no longer than `timeout`.
    pub fn next(&self, timeout: Duration) -> Option<Request> {
        match self.receiver.recv_timeout(timeout) {
            Ok(request) => {
                self.queued_count.fetch_sub(1, Ordering::Relaxed);
                Some(request)
            }
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => None,
        }
    }
}

/// The sending end of [`Requests`].
#[derive(Debug, Clone)]
pub struct RequestSender {
    sender: Sender<Request>,
    queued_count: Arc<AtomicUsize>,
}

/// The queue is full: too many commands wait for the source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct QueueFull;

/// Creates both ends of the queue.
pub fn requests() -> (RequestSender, Requests) {
    let (sender, receiver) = channel();
    let queued_count = Arc::new(AtomicUsize::new(0));
    let requests = Requests { receiver, queued_count: Arc::clone(&queued_count) };
    (RequestSender { sender, queued_count }, requests)
}

impl RequestSender {
    /// Queues a request. Only commands are refused when the queue is full: a client that leaves must
    /// always be noticed.
    pub(crate) fn send(&self, client: ClientId, kind: RequestKind) -> Result<(), QueueFull> {
        let is_command = matches!(kind, RequestKind::Command { .. });
        if is_command && self.queued_count.load(Ordering::Relaxed) >= REQUESTS_QUEUED_MAX {
            return Err(QueueFull);
        }
        self.queued_count.fetch_add(1, Ordering::Relaxed);
        self.sender.send(Request { client, kind }).map_err(|_| QueueFull)
    }
}
