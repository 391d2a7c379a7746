//! Requests: the path from the clients of all sinks to the source.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use crate::limits::{DEMANDS_QUEUED_MAX, REQUESTS_QUEUED_MAX};
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
#[allow(clippy::large_enum_variant, reason = "a full queue has less than 1 MiB")]
pub enum RequestKind {
    /// The client needs the newest state even if nothing has changed: it has just arrived, or the
    /// newest state was not encoded in its format.
    State,
    /// The client can receive states again, and needs the next one.
    Credit,
    /// The client has left. Its grabs must end.
    Left,
    /// The client wants something to be done. The numbers in the command are finite and in range.
    Command(Command),
}

impl RequestKind {
    /// Returns whether the client needs a state.
    fn is_demand(&self) -> bool {
        matches!(self, Self::State | Self::Credit)
    }
}

/// The requests of all clients, in the order of arrival.
#[derive(Debug)]
pub struct Requests {
    receiver: Receiver<Request>,
    counts: Arc<Counts>,
}

/// Numbers of requests in the queue.
#[derive(Debug, Default)]
struct Counts {
    all: AtomicUsize,
    /// Requests for a state.
    demands: AtomicUsize,
}

impl Requests {
    /// Returns the next request. Waits for it no longer than `timeout`.
    pub fn next(&self, timeout: Duration) -> Option<Request> {
        match self.receiver.recv_timeout(timeout) {
            Ok(request) => {
                self.counts.all.fetch_sub(1, Ordering::Relaxed);
                if request.kind.is_demand() {
                    self.counts.demands.fetch_sub(1, Ordering::Relaxed);
                }
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
    counts: Arc<Counts>,
}

/// The queue is full: too many commands wait for the source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct QueueFull;

/// Creates both ends of the queue.
pub fn requests() -> (RequestSender, Requests) {
    let (sender, receiver) = channel();
    let counts = Arc::new(Counts::default());
    let requests = Requests { receiver, counts: Arc::clone(&counts) };
    (RequestSender { sender, counts }, requests)
}

impl RequestSender {
    /// Queues a request. Only commands are refused when the queue is full: a client that leaves must
    /// always be noticed. A request for a state is dropped if enough others wait, because the state that
    /// they cause goes to every client.
    pub(crate) fn send(&self, client: ClientId, kind: RequestKind) -> Result<(), QueueFull> {
        let is_command = matches!(kind, RequestKind::Command(_));
        if is_command && self.counts.all.load(Ordering::Relaxed) >= REQUESTS_QUEUED_MAX {
            return Err(QueueFull);
        }
        if kind.is_demand()
            && self.counts.demands.fetch_add(1, Ordering::Relaxed) >= DEMANDS_QUEUED_MAX
        {
            self.counts.demands.fetch_sub(1, Ordering::Relaxed);
            return Ok(());
        }
        self.counts.all.fetch_add(1, Ordering::Relaxed);
        self.sender.send(Request { client, kind }).map_err(|_| QueueFull)
    }
}

#[cfg(test)]
mod tests {
    use sim_contract::Action;

    use super::*;

    #[test]
    fn a_flood_of_demands_leaves_room_for_commands_and_departures() {
        let (sender, requests) = requests();
        let client = ClientId::FoxgloveCaller(1);
        let command = RequestKind::Command(Command::new(Action::Pause));
        for kind in [RequestKind::State, RequestKind::Credit] {
            (0..100_000).for_each(|_| assert_eq!(sender.send(client, kind.clone()), Ok(())));
        }
        assert_eq!(sender.send(client, command.clone()), Ok(()));
        assert_eq!(sender.send(client, RequestKind::Left), Ok(()));
        let next = || requests.next(Duration::ZERO).map(|request| request.kind);
        assert_eq!(next(), Some(RequestKind::State));
        // There is room for one more, after the others.
        assert_eq!(sender.send(client, RequestKind::Credit), Ok(()));
        let rest: Vec<_> = std::iter::from_fn(next).collect();
        assert_eq!(rest.len(), DEMANDS_QUEUED_MAX + 2);
        assert_eq!(
            rest[DEMANDS_QUEUED_MAX - 1..],
            [command, RequestKind::Left, RequestKind::Credit]
        );
    }
}
