//! Scenes that are read and built beside the loop.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError, sync_channel};
use std::thread;
use std::time::Duration;

use sim_contract::{Reason, Stop};
use sim_solver::{Scene, Solver};

use super::inbox::Request;
use super::real_time::cpus::Cpus;
use super::real_time::scheduling::leave_fifo;
use crate::scene_source;

/// Interval between two checks for a request to stop.
const POLL: Duration = Duration::from_millis(50);

/// Settings of the node that replace those of each scene.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Overrides {
    pub(crate) rate_hz: Option<u32>,
    pub(crate) substeps: Option<u32>,
}

/// Why a scene cannot be loaded.
#[derive(Debug)]
pub(super) struct Refusal {
    /// For the people who read the node's warnings.
    pub(super) problem: String,
    /// For the outcome of the command.
    pub(super) reason: Reason,
}

/// A scene that is ready to run, but for the threads of its solver.
#[derive(Debug)]
pub(super) struct Loaded {
    pub(super) scene: Scene,
    pub(super) solver: Solver,
    /// Its rate is not that of the run.
    pub(super) begins_run: bool,
}

/// A load on a thread of its own, because it takes seconds for a large scene.
#[derive(Debug)]
pub(super) struct Loading {
    /// The command.
    pub(super) request: Request,
    work: Work<Result<Loaded, Refusal>>,
}

impl Loading {
    /// Starts to load a scene for a run at `rate_hz`, beside the CPU of the loop.
    pub(super) fn start(
        request: Request,
        source: &str,
        overrides: Overrides,
        rate_hz: u32,
        cpus: &Cpus,
    ) -> Result<Self, Refusal> {
        let source = source.to_owned();
        let start = || Work::start(move || load(&source, overrides, rate_hz));
        let work = cpus.lend(start).map_err(|problem| {
            let reason = Reason::NoEffectHere;
            Refusal { problem, reason }
        })?;
        Ok(Self { request, work })
    }

    /// Returns the result, once it is there.
    pub(super) fn poll(&self) -> Option<Result<Loaded, Refusal>> {
        self.work.poll()
    }

    /// Waits for the result. Returns `None` soon after a stop is requested; the thread then ends with
    /// the process.
    pub(super) fn wait(&self, stop: &Stop) -> Option<Result<Loaded, Refusal>> {
        self.work.wait(stop)
    }
}

/// Reads and builds a scene for a run at `rate_hz`, or for a new one if the scene has another rate.
fn load(source: &str, overrides: Overrides, rate_hz: u32) -> Result<Loaded, Refusal> {
    leave_fifo();
    let reason = Reason::OutOfRange;
    let mut scene = scene_source::load(source)
        .map_err(|error| Refusal { problem: format!("{error:#}"), reason })?;
    scene
        .override_solver(overrides.rate_hz, overrides.substeps)
        .map_err(|problem| Refusal { problem, reason })?;
    let begins_run = scene.solver.rate_hz != rate_hz;
    let solver = if begins_run { Solver::new(&scene) } else { Solver::new_in_run(&scene) };
    Ok(Loaded { scene, solver, begins_run })
}

/// Work on a thread of its own. A panic of the work is passed on.
#[derive(Debug)]
struct Work<T>(Receiver<thread::Result<T>>);

impl<T: Send + 'static> Work<T> {
    fn start(work: impl FnOnce() -> T + Send + 'static) -> Result<Self, String> {
        let (sender, receiver) = sync_channel(1);
        thread::Builder::new()
            .name("load".to_owned())
            .spawn(move || {
                // Nobody waits for the result once a stop is requested.
                let _unwanted = sender.send(catch_unwind(AssertUnwindSafe(work)));
            })
            .map_err(|error| format!("cannot start a thread: {error}"))?;
        Ok(Self(receiver))
    }

    fn poll(&self) -> Option<T> {
        match self.0.try_recv() {
            Ok(result) => Some(result.unwrap_or_else(|panic| resume_unwind(panic))),
            Err(TryRecvError::Empty | TryRecvError::Disconnected) => None,
        }
    }

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
        assert_eq!(Work::start(|| 7).unwrap().wait(&stop), Some(7));
        let (sender, receiver) = sync_channel::<()>(0);
        let work = Work::start(move || receiver.recv().is_err()).unwrap();
        assert_eq!(work.poll(), None);
        stop.flag().store(true, Ordering::Relaxed);
        assert_eq!(work.wait(&stop), None);
        drop(sender);
    }

    #[test]
    #[should_panic(expected = "wrong")]
    fn a_panic_of_the_work_is_passed_on() {
        let _ = Work::start(|| panic!("wrong")).unwrap().wait(&Stop::default());
    }
}
