//! The event that tells sleeping readers to look: one service for all that an owner does.

use std::time::Duration;

use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::{EventActivation, EventId, ipc};

/// What happened; the ids of the event service `<name>/wake`, in this order from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Wake {
    /// A snapshot was published.
    Frame = 0,
    /// A scene was loaded, or what is latched was given to a reader that has just come.
    Load = 1,
    /// Constraints tore.
    Tears = 2,
    /// A command was answered.
    Outcome = 3,
    /// A status was published.
    Status = 4,
    /// The owner has gone. Comes after it has given up the name.
    OwnerGone = 5,
}

impl Wake {
    /// The largest event id.
    pub(crate) const ID_MAX: usize = Self::OwnerGone as usize;

    pub(crate) fn event_id(self) -> EventId {
        EventId::new(self as usize)
    }
}

/// The waking side. Says [`Wake::OwnerGone`] when dropped.
#[derive(Debug)]
pub(crate) struct WakeSender(Notifier<ipc::Service>);

impl WakeSender {
    pub(crate) fn new(notifier: Notifier<ipc::Service>) -> Self {
        Self(notifier)
    }

    /// Wakes everyone who waits; a reader that cannot be reached is none of the owner's concern.
    pub(crate) fn wake(&self, what: Wake) {
        // The only errors are an id out of range and a missed deadline: neither can occur.
        let _ = self.0.notify_with_custom_event_id(what.event_id());
    }
}

impl Drop for WakeSender {
    fn drop(&mut self) {
        self.wake(Wake::OwnerGone);
    }
}

/// What ended a wait, the most telling last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Heard {
    /// Nothing happened in the time given, or a signal came.
    Nothing,
    /// The owner did something.
    Owner,
    /// An owner has gone.
    Farewell,
}

/// The shortest wait: the system's socket timeout counts microseconds, and takes 0 for "for ever".
const TIMEOUT_MIN: Duration = Duration::from_micros(1);

/// The waiting side.
#[derive(Debug)]
pub(crate) struct WakeListener(Listener<ipc::Service>);

impl WakeListener {
    pub(crate) fn new(listener: Listener<ipc::Service>) -> Self {
        Self(listener)
    }

    /// Waits for the next event, at most `timeout`, and takes all that have come.
    pub(crate) fn wait(&self, timeout: Duration) -> Heard {
        let mut heard = Heard::Nothing;
        let take = |event: EventActivation| {
            let is_farewell = event.id == Wake::OwnerGone.event_id();
            heard = if is_farewell { Heard::Farewell } else { heard.max(Heard::Owner) };
        };
        // An interrupted or failed wait is one in which nothing happened: the caller looks again.
        let _ = if timeout < TIMEOUT_MIN {
            self.0.try_wait(take)
        } else {
            self.0.timed_wait(take, timeout)
        };
        heard
    }
}
