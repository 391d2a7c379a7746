//! Scenes that a running node loads.

use std::panic::resume_unwind;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

use sim_contract::{Reason, Stop};
use sim_solver::{Scene, Solver};

use super::Options;
use super::real_time::cpus::Cpus;
use super::real_time::scheduling::leave_fifo;
use super::threads::start_threads;
use crate::scene_source;

/// Interval between two checks for a request to stop.
const POLL: Duration = Duration::from_millis(50);

/// Why a scene cannot be loaded.
pub(super) struct Refusal {
    /// For the people who read the node's warnings.
    pub(super) problem: String,
    /// For the outcome of the command.
    pub(super) reason: Reason,
}

/// Reads and builds a scene for a node that runs at `rate_hz`.
///
/// That takes seconds for a large scene, so a thread of its own does it. Returns `None` soon after a
/// stop is requested; the thread then ends with the process.
pub(super) fn load_scene(
    source: &str,
    options: Options,
    rate_hz: u32,
    cpus: &Cpus,
    stop: &Stop,
) -> Option<Result<(Scene, Solver), Refusal>> {
    let source = source.to_owned();
    let work = move || {
        leave_fifo();
        let scene = read_scene(&source, options, rate_hz)?;
        let solver = Solver::new_in_run(&scene);
        Ok((scene, solver))
    };
    let loaded = cpus.lend(|| unless_stopped(stop, work)).unwrap_or_else(|problem| {
        let reason = Reason::NoEffectHere;
        Some(Err(Refusal { problem, reason }))
    });
    loaded.map(|result| {
        result.map(|(scene, mut solver)| {
            start_threads(&mut solver, options.threads, cpus);
            (scene, solver)
        })
    })
}

/// Reads a scene that a run at `rate_hz` can continue with.
fn read_scene(source: &str, options: Options, rate_hz: u32) -> Result<Scene, Refusal> {
    let out_of_range = |problem| Refusal { problem, reason: Reason::OutOfRange };
    let mut scene =
        scene_source::load(source).map_err(|error| out_of_range(format!("{error:#}")))?;
    scene.override_solver(options.rate_hz, options.substeps).map_err(out_of_range)?;
    let scene_rate_hz = scene.solver.rate_hz;
    if scene_rate_hz == rate_hz {
        return Ok(scene);
    }
    let problem = format!("the scene runs at {scene_rate_hz} Hz, this node at {rate_hz} Hz");
    Err(Refusal { problem, reason: Reason::NoEffectHere })
}

/// Runs `work` on a thread of its own. Returns its result, or `None` if a stop is requested meanwhile.
fn unless_stopped<T: Send + 'static>(
    stop: &Stop,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<Option<T>, String> {
    let (sender, receiver) = sync_channel(1);
    let worker = thread::Builder::new()
        .name("load".to_owned())
        .spawn(move || {
            // Nobody waits for the result once a stop is requested.
            let _unwanted = sender.send(work());
        })
        .map_err(|error| format!("cannot start a thread: {error}"))?;
    loop {
        match receiver.recv_timeout(POLL) {
            Ok(_) | Err(RecvTimeoutError::Timeout) if stop.is_requested() => return Ok(None),
            Ok(result) => return Ok(Some(result)),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => match worker.join() {
                Err(panic) => resume_unwind(panic),
                Ok(()) => unreachable!("the thread sends its result"),
            },
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
        assert_eq!(unless_stopped(&stop, || 7), Ok(Some(7)));
        let (sender, receiver) = sync_channel::<()>(0);
        let work = move || receiver.recv().is_err();
        stop.flag().store(true, Ordering::Relaxed);
        assert_eq!(unless_stopped(&stop, work), Ok(None));
        drop(sender);
    }

    #[test]
    #[should_panic(expected = "wrong")]
    fn a_panic_of_the_work_is_passed_on() {
        let _ = unless_stopped(&Stop::default(), || panic!("wrong"));
    }
}
