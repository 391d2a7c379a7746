//! Work on a thread of its own.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError, sync_channel};
use std::thread;
use std::time::Duration;

use sim_contract::Stop;

use crate::node::real_time::scheduling::leave_fifo;

/// Interval between two checks for a request to stop.
const POLL: Duration = Duration::from_millis(50);

/// Work that runs without real-time scheduling. A panic of the work is passed on.
#[derive(Debug)]
pub(in crate::node) struct Work<T>(Receiver<thread::Result<T>>);

impl<T: Send + 'static> Work<T> {
    /// Starts a thread with this name.
    pub(super) fn start(
        name: &str,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<Self, String> {
        let (sender, receiver) = sync_channel(1);
        thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || {
                leave_fifo();
                // The receiver is gone if the node has stopped.
                let _unwanted = sender.send(catch_unwind(AssertUnwindSafe(work)));
            })
            .map_err(|error| format!("cannot start a thread: {error}"))?;
        Ok(Self(receiver))
    }

    /// Returns the result, once it is there.
    pub(super) fn poll(&self) -> Option<T> {
        match self.0.try_recv() {
            Ok(result) => Some(result.unwrap_or_else(|panic| resume_unwind(panic))),
            Err(TryRecvError::Empty | TryRecvError::Disconnected) => None,
        }
    }

    /// Waits for the end of the work.
    pub(in crate::node) fn join(self) {
        if let Ok(Err(panic)) = self.0.recv() {
            resume_unwind(panic);
        }
    }

    /// Waits for the result. Returns `None` soon after a stop is requested; the thread then ends with
    /// the process.
    pub(super) fn wait(&self, stop: &Stop) -> Option<T> {
        loop {
            match self.0.recv_timeout(POLL) {
                Ok(_) | Err(RecvTimeoutError::Timeout) if stop.is_requested() => return None,
                Ok(result) => return Some(result.unwrap_or_else(|panic| resume_unwind(panic))),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return None,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::Ordering;

    use super::*;

    #[test]
    fn work_is_waited_for_until_a_stop_is_requested() {
        let stop = Stop::default();
        assert_eq!(Work::start("test", || 7).unwrap().wait(&stop), Some(7));
        let (sender, receiver) = sync_channel::<()>(0);
        let work = Work::start("test", move || receiver.recv().is_err()).unwrap();
        assert_eq!(work.poll(), None);
        stop.flag().store(true, Ordering::Relaxed);
        assert_eq!(work.wait(&stop), None);
        drop(sender);
    }

    #[test]
    #[should_panic(expected = "wrong")]
    fn a_panic_of_the_work_is_passed_on() {
        let _ = Work::start("test", || panic!("wrong")).unwrap().wait(&Stop::default());
    }
}
