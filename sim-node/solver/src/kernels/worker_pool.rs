//! Threads that work on one job at a time.
//!
//! A job within a step takes a few microseconds, so workers spin while they wait for one; between
//! steps they park, and the next step wakes them before it needs them. A job is always divided in the same
//! way and parts are never stolen, so the assignment of threads changes no bit.
#![allow(unsafe_code, reason = "lends work to threads that outlive it; see `WorkerPool::run`")]

use std::cell::{Cell, UnsafeCell};
use std::fmt;
use std::hint::spin_loop;
use std::num::NonZero;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock};
use std::thread::{self, JoinHandle};

/// Largest number of threads that step a solver.
pub const THREADS_MAX: u8 = 64;

/// Largest number of workers in a pool.
pub(crate) const WORKERS_MAX: usize = THREADS_MAX as usize;

/// Checks for a job before a worker yields or, between steps, parks: 20 to 100 microseconds, depending on how long the
/// processor pauses between two of them. Waking a parked worker takes as long.
const SPINS: u32 = 1 << 11;
/// The same number if there are more workers than processors: another worker needs the processor.
const SPINS_CROWDED: u32 = 1 << 6;

/// Checks for a milestone before a worker yields. It is usually reached long before.
const MILESTONE_SPINS: u32 = 1 << 6;

/// Number of processors of the process. It is read when the first pool is made: later, the calling thread may be bound to
/// one of them, or to the others.
static PROCESSORS: LazyLock<usize> =
    LazyLock::new(|| thread::available_parallelism().map_or(1, NonZero::get));

/// A job, called with the index of the worker.
type Job<'a> = dyn Fn(usize) + Sync + 'a;

/// A fixed set of threads. The calling thread is worker 0.
pub(crate) struct WorkerPool {
    slot: Arc<JobSlot>,
    others: Vec<JoinHandle<()>>,
    /// There are more workers than processors.
    is_crowded: bool,
    /// Number of jobs before the running step.
    jobs_before: u64,
}

/// The current job, shared with all workers.
struct JobSlot {
    /// Number of jobs so far. A worker compares it with the number that it has finished.
    job_count: AtomicU64,
    /// The running job.
    job: JobCell,
    /// Workers that have not finished it.
    busy_count: AtomicUsize,
    has_panicked: AtomicBool,
    /// A step that may have jobs is running, so workers do not park.
    is_stepping: AtomicBool,
    is_shut_down: AtomicBool,
    /// By worker, without the first: it is parked, or about to park.
    is_parked: Vec<AtomicBool>,
    /// Checks for a job before a worker yields or parks.
    spins: u32,
}

/// A job whose lifetime is erased.
struct JobCell(UnsafeCell<Option<&'static Job<'static>>>);

// SAFETY: only `WorkerPool::run` writes the cell, while no worker is busy, and workers read it only
// while they are busy. `job_count` and `busy_count` order the two.
unsafe impl Sync for JobCell {}

impl WorkerPool {
    /// Starts threads until there are `workers`, limited to 1..=[`WORKERS_MAX`]. The pool is smaller
    /// if the system refuses a thread.
    pub(crate) fn new(workers: usize) -> Self {
        let others = workers.clamp(1, WORKERS_MAX) - 1;
        let is_crowded = others >= *PROCESSORS;
        let slot = Arc::new(JobSlot {
            job_count: AtomicU64::new(0),
            job: JobCell(UnsafeCell::new(None)),
            busy_count: AtomicUsize::new(0),
            has_panicked: AtomicBool::new(false),
            is_stepping: AtomicBool::new(false),
            is_shut_down: AtomicBool::new(false),
            is_parked: (0..others).map(|_| AtomicBool::new(false)).collect(),
            spins: if is_crowded { SPINS_CROWDED } else { SPINS },
        });
        let start = |worker: usize| {
            let slot = Arc::clone(&slot);
            let thread = thread::Builder::new().name(format!("solver-{worker}"));
            thread.spawn(move || slot.serve(worker)).ok()
        };
        let others = (1..=others).map_while(start).collect();
        Self { slot, others, is_crowded, jobs_before: 0 }
    }

    pub(crate) fn worker_count(&self) -> usize {
        self.others.len() + 1
    }

    /// Wakes the workers and keeps them awake until the result is dropped. Does nothing if the step before had no jobs,
    /// or if there are more workers than processors.
    pub(crate) fn begin_step(&mut self) -> RunningStep {
        let job_count = self.slot.job_count.load(Ordering::Relaxed);
        let had_jobs = std::mem::replace(&mut self.jobs_before, job_count) != job_count;
        if had_jobs && !self.is_crowded {
            self.slot.is_stepping.store(true, Ordering::SeqCst);
            self.wake();
        }
        RunningStep(Arc::clone(&self.slot))
    }

    /// Wakes the workers that are parked.
    fn wake(&self) {
        for (is_parked, other) in self.slot.is_parked.iter().zip(&self.others) {
            if is_parked.load(Ordering::SeqCst) {
                other.thread().unpark();
            }
        }
    }

    /// Runs `work` on every part, part `i` on worker `i`, and returns when all parts are done. Parts run side
    /// by side, so one may wait for a [`Milestone`] of another.
    ///
    /// # Panics
    /// If there are more parts than workers, or if a worker panics.
    pub(crate) fn for_each<P: Send>(&mut self, parts: &mut [P], work: impl Fn(&mut P) + Sync) {
        assert!(parts.len() <= self.worker_count(), "more parts than workers");
        if let [part] = parts {
            work(part);
            return;
        }
        let (count, parts) = (parts.len(), Parts(parts.as_mut_ptr()));
        self.run(&|worker| {
            if worker < count {
                let part = parts.part(worker);
                // SAFETY: the index is within the slice, the slice outlives `run`, and no two
                // workers have the same index.
                work(unsafe { &mut *part });
            }
        });
    }

    fn run(&mut self, job: &Job<'_>) {
        let slot = &*self.slot;
        // SAFETY: only the lifetime changes. This function removes the job from the slot, after it
        // has waited for every worker to finish it.
        let erased = unsafe { std::mem::transmute::<&Job<'_>, &'static Job<'static>>(job) };
        // SAFETY: no worker is busy, and `&mut self` excludes a second caller.
        unsafe { *slot.job.0.get() = Some(erased) };
        slot.busy_count.store(self.others.len(), Ordering::Relaxed);
        // Publishes the writes above. `is_parked` is read only after it; see `JobSlot::wait`.
        slot.job_count.fetch_add(1, Ordering::SeqCst);
        self.wake();
        let result = catch_unwind(AssertUnwindSafe(|| job(0)));
        let mut spins = 0;
        while slot.busy_count.load(Ordering::Acquire) > 0 {
            back_off(&mut spins, slot.spins);
        }
        // SAFETY: every worker has finished.
        unsafe { *slot.job.0.get() = None };
        let has_panicked = slot.has_panicked.load(Ordering::Relaxed);
        if let Err(panic) = result {
            std::panic::resume_unwind(panic);
        }
        assert!(!has_panicked, "a thread of the solver has panicked");
    }
}

/// A step whose workers stay awake. They park when it is dropped, after a panic as well.
pub(crate) struct RunningStep(Arc<JobSlot>);

impl Drop for RunningStep {
    fn drop(&mut self) {
        self.0.is_stepping.store(false, Ordering::Relaxed);
    }
}

impl JobSlot {
    /// Runs jobs until the pool shuts down.
    fn serve(&self, worker: usize) {
        let mut done_count = 0;
        loop {
            self.wait(worker, done_count);
            if self.is_shut_down.load(Ordering::Acquire) {
                return;
            }
            done_count += 1;
            // SAFETY: `job_count` announced the job, and `busy_count` keeps it in place.
            let job = unsafe { *self.job.0.get() };
            if let Some(job) = job {
                let result = catch_unwind(AssertUnwindSafe(|| job(worker)));
                if result.is_err() {
                    self.has_panicked.store(true, Ordering::Relaxed);
                }
            }
            self.busy_count.fetch_sub(1, Ordering::Release);
        }
    }

    /// Waits until more than `done_count` jobs were announced.
    fn wait(&self, worker: usize, done_count: u64) {
        let is_announced = || self.job_count.load(Ordering::SeqCst) != done_count;
        let is_stepping = || self.is_stepping.load(Ordering::SeqCst);
        let mut spins = 0;
        while !is_announced() {
            if spins < self.spins || is_stepping() {
                back_off(&mut spins, self.spins);
                continue;
            }
            let is_parked = &self.is_parked[worker - 1];
            is_parked.store(true, Ordering::SeqCst);
            // This side sets `is_parked` and then reads `job_count` and `is_stepping`; `run` and `begin_step` write one of
            // these and then read `is_parked`. So at least one of the two sides sees the other.
            while !is_announced() && !is_stepping() {
                thread::park();
            }
            is_parked.store(false, Ordering::Relaxed);
            spins = 0;
        }
    }
}

impl Drop for WorkerPool {
    fn drop(&mut self) {
        self.slot.is_shut_down.store(true, Ordering::Release);
        self.slot.job_count.fetch_add(1, Ordering::SeqCst);
        for other in self.others.drain(..) {
            other.thread().unpark();
            // `run` has already reported a panic of this worker.
            let _panicked = other.join();
        }
    }
}

impl Clone for WorkerPool {
    /// Starts another pool of the same size.
    fn clone(&self) -> Self {
        Self::new(self.worker_count())
    }
}

impl fmt::Debug for WorkerPool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "WorkerPool of {}", self.worker_count())
    }
}

/// Spins at first, then yields the core.
fn back_off(spins: &mut u32, spins_max: u32) {
    if *spins < spins_max {
        *spins += 1;
        spin_loop();
    } else {
        thread::yield_now();
    }
}

/// A point in the work of one part of a job that another part waits for.
#[derive(Debug)]
pub(crate) struct Milestone(AtomicBool);

/// Reaches a milestone when it is dropped. Since a panic drops it as well, nobody waits forever.
pub(crate) struct OnTheWay<'a>(&'a Milestone);

impl Milestone {
    pub(crate) const fn new() -> Self {
        Self(AtomicBool::new(false))
    }

    /// Everything that this thread does until the result is dropped happens before [`Self::wait`] returns.
    pub(crate) fn reach_when_dropped(&self) -> OnTheWay<'_> {
        OnTheWay(self)
    }

    /// Waits until the other thread has reached it.
    pub(crate) fn wait(&self) {
        let mut spins = 0;
        while !self.0.load(Ordering::Acquire) {
            back_off(&mut spins, MILESTONE_SPINS);
        }
    }
}

impl Drop for OnTheWay<'_> {
    fn drop(&mut self) {
        self.0.0.store(true, Ordering::Release);
    }
}

/// Pointer to the first of a slice of parts.
struct Parts<P>(*mut P);

// SAFETY: each worker accesses a different part, and parts are `Send`.
unsafe impl<P: Send> Sync for Parts<P> {}

impl<P> Parts<P> {
    fn part(&self, index: usize) -> *mut P {
        self.0.wrapping_add(index)
    }
}

/// A slice that threads write at disjoint indices.
#[derive(Clone, Copy)]
pub(crate) struct SharedSlice<'a, T>(&'a [Cell<T>]);

// SAFETY: the caller of `SharedSlice::new` guarantees disjoint access.
unsafe impl<T: Send> Sync for SharedSlice<'_, T> {}
// SAFETY: as above.
unsafe impl<T: Send> Send for SharedSlice<'_, T> {}

impl<'a, T> SharedSlice<'a, T> {
    /// # Safety
    /// Within one call of [`WorkerPool::for_each`], an element that one worker writes must not be
    /// accessed by another.
    pub(crate) unsafe fn new(slice: &'a mut [T]) -> Self {
        Self(Cell::from_mut(slice).as_slice_of_cells())
    }

    pub(crate) fn cells(&self) -> &'a [Cell<T>] {
        self.0
    }
}

#[cfg(test)]
mod tests {
    //! Every part is processed once, for any number of parts and workers.
    use super::*;

    #[test]
    fn every_part_is_processed_once() {
        for workers in [1, 2, 3, 4, 8] {
            let mut pool = WorkerPool::new(workers);
            for count in 0..=pool.worker_count() {
                let mut parts = vec![0_u32; count];
                for _ in 0..500 {
                    pool.for_each(&mut parts, |part| *part += 1);
                }
                assert_eq!(parts, vec![500; count], "{workers} workers");
            }
        }
    }

    #[test]
    fn a_parked_worker_wakes_for_the_next_job() {
        let mut pool = WorkerPool::new(3);
        let mut parts = [0_u32; 3];
        for round in 1..=5 {
            // Waits until the workers report that they are parked.
            while !pool.slot.is_parked.iter().all(|one| one.load(Ordering::SeqCst)) {
                thread::yield_now();
            }
            pool.for_each(&mut parts, |part| *part += 1);
            assert_eq!(parts, [round; 3]);
        }
    }

    #[test]
    fn workers_wake_for_a_step_after_one_with_jobs_and_park_after_it() {
        let mut pool = WorkerPool::new(2);
        pool.is_crowded = false;
        let is_parked = |pool: &WorkerPool| pool.slot.is_parked[0].load(Ordering::SeqCst);
        let step = pool.begin_step();
        assert!(!pool.slot.is_stepping.load(Ordering::SeqCst), "there was no job yet");
        pool.for_each(&mut [0, 1], |part| *part += 1);
        drop(step);
        while !is_parked(&pool) {
            thread::yield_now();
        }
        let step = pool.begin_step();
        // It wakes without a job.
        while is_parked(&pool) {
            thread::yield_now();
        }
        let mut parts = [0, 1];
        pool.for_each(&mut parts, |part| *part += 1);
        assert_eq!(parts, [1, 2]);
        drop(step);
        while !is_parked(&pool) {
            thread::yield_now();
        }
    }

    #[test]
    fn a_panic_releases_the_worker_that_waits_for_a_milestone() {
        let mut pool = WorkerPool::new(2);
        let milestone = Milestone::new();
        let result = catch_unwind(AssertUnwindSafe(|| {
            pool.for_each(&mut [0, 1], |part| {
                if *part == 0 {
                    milestone.wait();
                } else {
                    let _on_the_way = milestone.reach_when_dropped();
                    panic!("on the way");
                }
            });
        }));
        assert!(result.is_err());
    }

    #[test]
    fn a_step_that_panics_between_two_jobs_lets_its_workers_park() {
        let mut pool = WorkerPool::new(2);
        pool.is_crowded = false;
        pool.for_each(&mut [0, 1], |part| *part += 1);
        let result = catch_unwind(AssertUnwindSafe(|| {
            let _step = pool.begin_step();
            assert!(!pool.slot.is_stepping.load(Ordering::SeqCst), "between two jobs");
        }));
        assert!(result.is_err());
        assert!(!pool.slot.is_stepping.load(Ordering::SeqCst));
    }

    #[test]
    fn a_panic_of_a_worker_reaches_the_caller() {
        let mut pool = WorkerPool::new(2);
        let mut parts = [0, 1];
        let result = catch_unwind(AssertUnwindSafe(|| {
            pool.for_each(&mut parts, |part| assert_eq!(*part, 0));
        }));
        assert!(result.is_err());
    }
}
