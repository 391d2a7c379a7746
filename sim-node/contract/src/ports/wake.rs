//! The event service that wakes waiting processes: one for all events of an owner.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::{EventActivation, EventId, ipc_threadsafe};

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
    const ALL: [Self; Self::ID_MAX + 1] =
        [Self::Frame, Self::Load, Self::Tears, Self::Outcome, Self::Status, Self::OwnerGone];

    /// Largest event id.
    pub(crate) const ID_MAX: usize = Self::OwnerGone as usize;

    pub(crate) fn event_id(self) -> EventId {
        EventId::new(self as usize)
    }
}

/// Number of waiting processes from which on the thread wakes them. To wake the thread costs the owner
/// about as much as to wake one process.
const SHARED_MIN: usize = 2;

/// Sender of wake events. Sends [`Wake::OwnerGone`] when dropped.
#[derive(Debug)]
pub(crate) struct WakeSender {
    notifier: Arc<Notifier<ipc_threadsafe::Service>>,
    thread: Option<WakeThread>,
}

impl WakeSender {
    pub(crate) fn new(notifier: Notifier<ipc_threadsafe::Service>) -> Self {
        Self { notifier: Arc::new(notifier), thread: None }
    }

    /// Starts a thread that wakes the processes if there are several.
    pub(crate) fn start_thread(&mut self) -> io::Result<()> {
        self.thread = Some(WakeThread::start(Arc::clone(&self.notifier))?);
        Ok(())
    }

    /// Wakes all waiting processes, whose number is `listener_count`. A process that cannot be reached
    /// does not concern the owner.
    pub(crate) fn wake(&self, event: Wake, listener_count: usize) {
        match &self.thread {
            Some(thread) if listener_count >= SHARED_MIN => thread.wake(event),
            _ => notify(&self.notifier, event),
        }
    }
}

impl Drop for WakeSender {
    fn drop(&mut self) {
        // Its last events come first.
        self.thread = None;
        notify(&self.notifier, Wake::OwnerGone);
    }
}

fn notify(notifier: &Notifier<ipc_threadsafe::Service>, event: Wake) {
    // The only errors are an id out of range and a missed deadline. Neither can occur.
    let _ = notifier.notify_with_custom_event_id(event.event_id());
}

/// A thread that wakes processes, so that their number does not delay the owner.
#[derive(Debug)]
struct WakeThread {
    requested: Arc<AtomicU32>,
    /// `None` while it is dropped.
    thread: Option<JoinHandle<()>>,
}

/// Bit of a request that ends the thread. The bits below stand for the events.
const END: u32 = 1 << (Wake::ID_MAX + 1);

impl WakeThread {
    fn start(notifier: Arc<Notifier<ipc_threadsafe::Service>>) -> io::Result<Self> {
        let requested = Arc::new(AtomicU32::new(0));
        let requests = Arc::clone(&requested);
        let run = move || send_requested(&notifier, &requests);
        let thread = thread::Builder::new().name("wake".to_owned()).spawn(run)?;
        Ok(Self { requested, thread: Some(thread) })
    }

    fn wake(&self, event: Wake) {
        self.request(1 << event as u32);
    }

    fn request(&self, bit: u32) {
        // Release: the thread wakes the processes after everything that was published before.
        if self.requested.fetch_or(bit, Ordering::Release) == 0
            && let Some(thread) = &self.thread
        {
            thread.thread().unpark();
        }
    }
}

impl Drop for WakeThread {
    fn drop(&mut self) {
        self.request(END);
        if let Some(thread) = self.thread.take() {
            // It cannot panic.
            let _ended = thread.join();
        }
    }
}

/// Sends the requested events until the end is requested.
fn send_requested(notifier: &Notifier<ipc_threadsafe::Service>, requested: &AtomicU32) {
    loop {
        let events = requested.swap(0, Ordering::Acquire);
        for event in Wake::ALL {
            if events & (1 << event as u32) != 0 {
                notify(notifier, event);
            }
        }
        if events & END != 0 {
            return;
        }
        if events == 0 {
            thread::park();
        }
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
pub(crate) struct WakeListener(Listener<ipc_threadsafe::Service>);

impl WakeListener {
    pub(crate) fn new(listener: Listener<ipc_threadsafe::Service>) -> Self {
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
