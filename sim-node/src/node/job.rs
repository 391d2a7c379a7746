//! The long work of a command, beside the loop.

mod beside;

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError, sync_channel};
use std::thread;
use std::time::Duration;

use sim_contract::{LoadPreparer, Reason};
use sim_host::Stop;
use sim_solver::{Prepared, Scene, Solver};

use super::inbox::Request;
use crate::node::publisher::LoadMessages;
use crate::node::real_time::leave_fifo;
use crate::scene_source;

/// Commands of a client whose work takes longer than the loop can wait.
#[derive(Debug)]
pub(super) struct Job {
    /// A single one, or settings.
    requests: Vec<Request>,
    /// None if nothing is left to do.
    work: Option<Work<Done>>,
}

/// Result of the work.
#[derive(Debug)]
pub(super) enum Done {
    /// Of a load.
    Scene(Result<Box<Loaded>, Refusal>),
    /// Of commands that change many constraints.
    Constraints(Box<Prepared>),
    /// Of commands that do their work themselves.
    Nothing,
}

/// Settings of the node that replace the settings of each scene.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Overrides {
    pub(crate) rate_hz: Option<u32>,
    pub(crate) substeps: Option<u32>,
}

/// Refusal of a scene.
#[derive(Debug)]
pub(super) struct Refusal {
    /// For the people who read the node's warnings.
    pub(super) problem: String,
    /// For the outcome of the command.
    pub(super) reason: Reason,
}

/// A scene that is ready to run, but for the threads of its solver. Its shared memory is prepared.
#[derive(Debug)]
pub(super) struct Loaded {
    pub(super) scene: Scene,
    pub(super) solver: Solver,
    pub(super) messages: LoadMessages,
    /// The scene and the run have different rates.
    pub(super) begins_run: bool,
}

/// Reads and builds a scene for a run at `rate_hz`, or for a new one if the scene has another rate.
fn load(
    source: &str,
    overrides: Overrides,
    rate_hz: u32,
    preparer: &LoadPreparer,
) -> Result<Loaded, Refusal> {
    let reason = Reason::OutOfRange;
    let mut scene = scene_source::load(source)
        .map_err(|error| Refusal { problem: format!("{error:#}"), reason })?;
    scene
        .override_solver(overrides.rate_hz, overrides.substeps)
        .map_err(|problem| Refusal { problem, reason })?;
    scene
        .check_memory(scene.published_bytes())
        .map_err(|error| Refusal { problem: error.to_string(), reason: Reason::NoEffectHere })?;
    let begins_run = scene.solver.rate_hz != rate_hz;
    let solver = if begins_run { Solver::new(&scene) } else { Solver::new_in_run(&scene) };
    let messages = LoadMessages::new(&scene, &solver);
    messages
        .check_memory()
        .map_err(|error| Refusal { problem: error.to_string(), reason: Reason::NoEffectHere })?;
    preparer
        .prepare(&messages.sizes())
        .map_err(|error| Refusal { problem: error.to_string(), reason: Reason::NoEffectHere })?;
    Ok(Loaded { scene, solver, messages, begins_run })
}

/// Interval between two checks for a request to stop.
const POLL: Duration = Duration::from_millis(50);

/// Work that runs without real-time scheduling. A panic of the work is passed on.
#[derive(Debug)]
pub(super) struct Work<T>(Receiver<thread::Result<T>>);

impl<T: Send + 'static> Work<T> {
    /// Starts a thread with this name.
    fn start(name: &str, work: impl FnOnce() -> T + Send + 'static) -> Result<Self, String> {
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
    fn poll(&self) -> Option<T> {
        match self.0.try_recv() {
            Ok(result) => Some(result.unwrap_or_else(|panic| resume_unwind(panic))),
            Err(TryRecvError::Empty | TryRecvError::Disconnected) => None,
        }
    }

    /// Waits for the end of the work.
    pub(super) fn join(self) {
        if let Ok(Err(panic)) = self.0.recv() {
            resume_unwind(panic);
        }
    }

    /// Waits for the result. Returns `None` soon after a stop is requested; the thread then ends with
    /// the process.
    fn wait(&self, stop: &Stop) -> Option<T> {
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
