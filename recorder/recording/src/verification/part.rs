//! The parts of a recording, each of which one thread simulates.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, TryIter, channel, sync_channel};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::{Builder, Scope};

use sim_messages::ParticleState;
use sim_solver::Solver;

use super::finding::{SnapshotFinding, StepGap};
use super::past_states::PastStates;
use super::resimulation::{Resimulation, ResimulationError};
use crate::log::Frame;

/// Fewest snapshots of a part that another one follows. To restore a state takes as long as some steps.
const PART_SNAPSHOTS_MIN: usize = 200;
/// Size at which snapshots are passed on, in bytes. Each time takes some microseconds, which is longer than a step of
/// a small scene.
const BATCH_SIZE_BYTES: usize = 1 << 18;
/// Most memory of snapshots that are read and not compared, in bytes: seconds of 10,000 particles for each of some
/// threads. The parts of a much larger scene are simulated one after the other.
const WAITING_SIZE_BYTES_MAX: usize = 512 << 20;

/// The result of a part.
#[derive(Debug, Default)]
pub(super) struct PartResult {
    pub(super) first_step: u64,
    /// Number of identical states after the first one.
    pub(super) identical_count: u64,
    pub(super) last_identical_step: Option<u64>,
    /// In order: missing outcomes, and the difference that ends the part.
    pub(super) findings: Vec<SnapshotFinding>,
    pub(super) gaps: Vec<StepGap>,
    /// The states, which prove those that a later command puts in place again.
    pub(super) past: Option<PastStates>,
    /// Messages before the first state that do not describe it.
    pub(super) earlier_count: usize,
}

/// A part: its number, and its snapshots as they are read. The first one is a complete state, and the last one is the
/// first of the next part.
#[derive(Debug)]
struct Part {
    number: usize,
    batches: Receiver<Batch>,
}

/// Snapshots that are passed on together.
#[derive(Debug)]
struct Batch {
    frames: Vec<Arc<Frame>>,
    /// Released when the batch is dropped.
    #[allow(dead_code, reason = "its destructor releases it")]
    memory: Memory,
}

/// Shared state of the threads.
#[derive(Debug)]
struct Shared {
    waiting_size_bytes: Mutex<usize>,
    has_space: Condvar,
    /// Number of the first part that differs. Later ones are of no use.
    last_part: AtomicUsize,
}

/// A share of the memory for snapshots that wait, until it is dropped.
#[derive(Debug)]
struct Memory {
    shared: Arc<Shared>,
    size_bytes: usize,
}

impl Memory {
    /// Waits until there is memory. Nothing is too large if nothing else waits.
    fn take(shared: &Arc<Shared>, size_bytes: usize) -> Self {
        let is_full =
            |waiting: &mut usize| *waiting > 0 && *waiting + size_bytes > WAITING_SIZE_BYTES_MAX;
        let waiting = shared.waiting_size_bytes.lock().unwrap_or_else(PoisonError::into_inner);
        let waiting = shared.has_space.wait_while(waiting, is_full);
        *waiting.unwrap_or_else(PoisonError::into_inner) += size_bytes;
        Self { shared: Arc::clone(shared), size_bytes }
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        let waiting = &self.shared.waiting_size_bytes;
        *waiting.lock().unwrap_or_else(PoisonError::into_inner) -= self.size_bytes;
        self.shared.has_space.notify_one();
    }
}

/// The number of a part, and its result.
type Finished = (usize, Result<PartResult, ResimulationError>);

/// The threads that simulate parts, and the part that is being read.
#[derive(Debug)]
pub(super) struct Parts {
    shared: Arc<Shared>,
    queue: SyncSender<Part>,
    results: Receiver<Finished>,
    spares: Receiver<Vec<ParticleState>>,
    /// Takes the batches of the newest part.
    newest: Option<Sender<Batch>>,
    /// Number of parts so far.
    count: usize,
    /// Snapshots of the newest part so far.
    frame_count: usize,
    /// Snapshots that are not passed on yet.
    batch: Vec<Arc<Frame>>,
    batch_size_bytes: usize,
}

impl Parts {
    /// Starts at most `thread_count` threads. `loaded` has the scene at load. The parts of a scene that is too large to wait in
    /// memory are not simulated side by side; then its solver has several threads.
    pub(super) fn start<'scope>(
        threads: &'scope Scope<'scope, '_>,
        loaded: &'scope Solver,
        thread_count: usize,
        stop: &'scope AtomicBool,
    ) -> io::Result<Self> {
        let shared = Arc::new(Shared {
            waiting_size_bytes: Mutex::new(0),
            has_space: Condvar::new(),
            last_part: AtomicUsize::new(usize::MAX),
        });
        // One part waits, so that a thread that has finished one finds the next one read.
        let (queue, parts) = sync_channel(1);
        let parts = Arc::new(Mutex::new(parts));
        let (results, received) = channel();
        let (spare, spares) = channel();
        let part_size_bytes =
            loaded.particle_count() * size_of::<ParticleState>() * PART_SNAPSHOTS_MIN;
        let thread_count = thread_count.max(1);
        let part_count = (WAITING_SIZE_BYTES_MAX / part_size_bytes.max(1)).clamp(1, thread_count);
        for _ in 0..part_count {
            let worker = Worker {
                loaded,
                solver_threads: thread_count / part_count,
                solver: None,
                parts: Arc::clone(&parts),
                results: results.clone(),
                spare: spare.clone(),
                shared: Arc::clone(&shared),
                stop,
            };
            let thread = Builder::new().name("simulate".to_owned());
            thread.spawn_scoped(threads, move || worker.run())?;
        }
        Ok(Self {
            shared,
            queue,
            results: received,
            spares,
            newest: None,
            count: 0,
            frame_count: 0,
            batch: Vec::new(),
            batch_size_bytes: 0,
        })
    }

    /// Returns `true` once a part has begun.
    pub(super) fn has_begun(&self) -> bool {
        self.count > 0
    }

    /// Returns the memory of particles that are compared. To allocate it for each snapshot would take longer than to
    /// read it.
    pub(super) fn spares(&self) -> TryIter<'_, Vec<ParticleState>> {
        self.spares.try_iter()
    }

    /// Adds the next snapshot; the first one is a complete state. Returns `false` if a part differs.
    pub(super) fn add(&mut self, frame: Frame) -> bool {
        let frame = Arc::new(frame);
        let begins =
            self.count == 0 || self.frame_count >= PART_SNAPSHOTS_MIN && frame.is_complete_state();
        if self.count > 0 {
            self.push(Arc::clone(&frame));
        }
        if begins {
            self.pass_on();
            self.begin_part();
            self.push(frame);
        }
        self.shared.last_part.load(Ordering::Relaxed) == usize::MAX
    }

    fn begin_part(&mut self) {
        let (batches, received) = channel();
        let number = self.count;
        // The threads outlive the queue.
        let _sent = self.queue.send(Part { number, batches: received });
        (self.newest, self.count, self.frame_count) = (Some(batches), number + 1, 0);
    }

    fn push(&mut self, frame: Arc<Frame>) {
        self.frame_count += 1;
        self.batch_size_bytes += frame.size_bytes();
        self.batch.push(frame);
        if self.batch_size_bytes >= BATCH_SIZE_BYTES {
            self.pass_on();
        }
    }

    /// Passes the batch on. After a difference, nobody takes it.
    fn pass_on(&mut self) {
        let Some(newest) = &self.newest else { return };
        let memory = Memory::take(&self.shared, std::mem::take(&mut self.batch_size_bytes));
        let _sent = newest.send(Batch { frames: std::mem::take(&mut self.batch), memory });
    }

    /// Waits for all parts. Returns their results in order, up to the first part that differs.
    ///
    /// # Errors
    /// If a part has no valid state to start from, although the part before leads to it.
    pub(super) fn finish(mut self) -> Result<Vec<PartResult>, ResimulationError> {
        self.pass_on();
        let Self { queue, newest, results, .. } = self;
        drop((queue, newest));
        let mut all: Vec<Finished> = results.iter().collect();
        all.sort_by_key(|(number, _)| *number);
        let mut results: Vec<PartResult> = Vec::new();
        for (_, result) in all {
            if results.last().is_some_and(PartResult::ends_early) {
                break;
            }
            results.push(result?);
        }
        Ok(results)
    }
}

/// A thread that simulates one part after the other.
struct Worker<'a> {
    /// The scene at load.
    loaded: &'a Solver,
    solver_threads: usize,
    /// The solver of the part before.
    solver: Option<Solver>,
    parts: Arc<Mutex<Receiver<Part>>>,
    results: Sender<Finished>,
    spare: Sender<Vec<ParticleState>>,
    shared: Arc<Shared>,
    stop: &'a AtomicBool,
}

impl Worker<'_> {
    fn run(mut self) {
        while let Some(part) = self.next_part() {
            let number = part.number;
            if number > self.shared.last_part.load(Ordering::Relaxed) {
                continue;
            }
            if let Some(result) = self.simulate(part) {
                if result.as_ref().map_or(true, PartResult::ends_early) {
                    self.shared.last_part.fetch_min(number, Ordering::Relaxed);
                }
                // The receiver outlives the threads.
                let _sent = self.results.send((number, result));
            }
        }
    }

    fn next_part(&self) -> Option<Part> {
        self.parts.lock().unwrap_or_else(PoisonError::into_inner).recv().ok()
    }

    /// Simulates a part up to its end or its first difference. `None` for a part without snapshots.
    fn simulate(&mut self, part: Part) -> Option<Result<PartResult, ResimulationError>> {
        let mut running: Option<(Resimulation, PartResult)> = None;
        for batch in part.batches {
            for frame in batch.frames {
                if let Some((simulation, result)) = &mut running {
                    result.add(simulation.advance(&frame, self.stop), frame.row.step);
                } else {
                    match self.start(part.number, &frame) {
                        Ok(started) => running = Some(started),
                        Err(error) => return Some(Err(error)),
                    }
                }
                if running.as_ref().is_some_and(|(_, result)| result.ends_early()) {
                    return running.map(|(simulation, result)| Ok(result.finish(simulation).0));
                }
                // The last one is needed by the next part, too.
                if let Ok(Frame { particles: Some(particles), .. }) = Arc::try_unwrap(frame) {
                    let _reader_has_ended = self.spare.send(particles);
                }
            }
        }
        let (simulation, result) = running?;
        let (result, solver) = result.finish(simulation);
        self.solver = Some(solver);
        Some(Ok(result))
    }

    fn start(
        &mut self,
        number: usize,
        frame: &Frame,
    ) -> Result<(Resimulation, PartResult), ResimulationError> {
        let loaded = self.loaded;
        let mut solver = self.solver.take().unwrap_or_else(|| loaded.clone());
        solver.set_threads(self.solver_threads);
        let mut simulation = Resimulation::start_with(solver, frame)?;
        let step = frame.row.step;
        let mut result = PartResult { first_step: step, ..PartResult::default() };
        // The part before compares the first state of this one with its own.
        if number == 0 {
            result.add(simulation.compare_start(frame), step);
        }
        Ok((simulation, result))
    }
}

impl PartResult {
    /// Returns `true` after a difference or a signal.
    fn ends_early(&self) -> bool {
        self.findings.iter().any(SnapshotFinding::ends_comparison)
    }

    /// Removes the results from a step on, whose state is not the one that it was taken for.
    pub(super) fn cut(&mut self, step: u64) {
        self.findings.retain(|finding| finding.step().is_some_and(|one| one < step));
        self.last_identical_step = self.last_identical_step.map(|last| last.min(step - 1));
        self.identical_count = self.identical_count.min(step.saturating_sub(self.first_step + 1));
    }

    fn add(&mut self, finding: SnapshotFinding, step: u64) {
        match finding {
            SnapshotFinding::NotCompared => {}
            SnapshotFinding::Identical => {
                self.last_identical_step = Some(step);
                self.identical_count += u64::from(step != self.first_step);
            }
            finding => self.findings.push(finding),
        }
    }

    /// Adds what the simulation has counted, and returns its solver.
    fn finish(self, simulation: Resimulation) -> (Self, Solver) {
        let counted = Self {
            gaps: simulation.gaps().to_vec(),
            earlier_count: simulation.earlier_count(),
            ..self
        };
        let (past, solver) = simulation.finish();
        (Self { past: Some(past), ..counted }, solver)
    }
}
