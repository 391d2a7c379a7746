//! The event service that wakes waiting processes: one for all events of an owner.

use std::time::Duration;

use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::{EventActivation, EventId, ipc};

/// Event of the service `<name>/wake`; the number is the event id.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Wake {
    /// A snapshot was published.
    Frame = 0,
    /// A scene was loaded, or a new reader has received the latched messages.
    Load = 1,
    /// Constraints tore.
    Tears = 2,
    /// A command was answered.
    Outcome = 3,
    /// A status was published.
    Status = 4,
    /// The owner is gone, and the name is free.
    OwnerGone = 5,
}

impl Wake {
    /// Largest event id.
    pub(crate) const ID_MAX: usize = Self::OwnerGone as usize;

    pub(crate) fn event_id(self) -> EventId {
        EventId::new(self as usize)
    }
}

/// Sender of wake events. Sends [`Wake::OwnerGone`] when dropped.
#[derive(Debug)]
pub(crate) struct WakeSender(Notifier<ipc::Service>);

impl WakeSender {
    pub(crate) fn new(notifier: Notifier<ipc::Service>) -> Self {
        Self(notifier)
    }

    /// Wakes all waiting processes. A process that cannot be reached does not concern the owner.
    pub(crate) fn wake(&self, event: Wake) {
        // The only errors are an id out of range and a missed deadline. Neither can occur.
        let _ = self.0.notify_with_custom_event_id(event.event_id());
    }
}

impl Drop for WakeSender {
    fn drop(&mut self) {
        self.wake(Wake::OwnerGone);
    }
}

/// Cause of the end of a wait, by ascending weight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum WakeCause {
    /// The timeout passed without an event, or a signal arrived.
    Timeout,
    /// The owner sent an event.
    Event,
    /// An owner is gone.
    OwnerGone,
}

/// Shortest wait: the socket timeout of the system counts microseconds, and 0 means no timeout.
const TIMEOUT_MIN: Duration = Duration::from_micros(1);

/// Receiver of wake events.
#[derive(Debug)]
pub(crate) struct WakeListener(Listener<ipc::Service>);

impl WakeListener {
    pub(crate) fn new(listener: Listener<ipc::Service>) -> Self {
        Self(listener)
    }

    /// Waits for the next event, at most `timeout`, and receives all pending events.
    pub(crate) fn wait(&self, timeout: Duration) -> WakeCause {
        let mut cause = WakeCause::Timeout;
        let receive = |event: EventActivation| {
            let is_last = event.id == Wake::OwnerGone.event_id();
            cause = cause.max(if is_last { WakeCause::OwnerGone } else { WakeCause::Event });
        };
        // An interrupted or failed wait counts as a timeout: the caller polls again.
        let _ = if timeout < TIMEOUT_MIN {
            self.0.try_wait(receive)
        } else {
            self.0.timed_wait(receive, timeout)
        };
        cause
    }
}
