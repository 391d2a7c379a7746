//! Threads that work on one job at a time. The one file of this crate, beside the intrinsics, with
//! code that the compiler cannot check.
//!
//! A job within a step is a few microseconds, so members wait for it spinning; between steps they
//! park. A job is divided the same way every time, and parts are never stolen: which thread does
//! what changes no bit.
#![allow(unsafe_code, reason = "work is lent to threads that live longer; see `Crew::run`")]

use std::cell::{Cell, UnsafeCell};
use std::fmt;
use std::hint::spin_loop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::thread::{self, JoinHandle};

/// Most threads that step a solver.
pub const THREADS_MAX: u8 = 64;

/// Most members of a crew.
pub(crate) const MEMBERS_MAX: usize = THREADS_MAX as usize;

/// How often a member looks for a job, or for its end, before it gives the core away: some ten
/// microseconds.
const SPINS: u32 = 1 << 9;

/// A job: what the member of that number does.
type Job<'a> = dyn Fn(usize) + Sync + 'a;

/// Some threads; the caller's is member 0.
pub(crate) struct Crew {
    board: Arc<Board>,
    others: Vec<JoinHandle<()>>,
}

/// Where jobs are announced.
struct Board {
    /// Counts jobs; a member has done all up to the number that it has seen.
    number: AtomicU64,
    /// The job of that number, while it lasts.
    job: JobCell,
    /// Members that have not finished it.
    busy: AtomicUsize,
    /// A member has panicked.
    is_broken: AtomicBool,
    /// There will be no more jobs.
    is_over: AtomicBool,
    /// By member, without the first: it is parked, or about to be.
    is_parked: Vec<AtomicBool>,
}

/// A job whose lifetime is forgotten.
struct JobCell(UnsafeCell<Option<&'static Job<'static>>>);

// SAFETY: `Crew::run` alone writes it, while no member is busy; members read it while it is theirs
// to do. `number` and `busy` order the two.
unsafe impl Sync for JobCell {}

impl Crew {
    /// Starts threads until there are so many members, at least 1 and at most [`MEMBERS_MAX`]. Where
    /// the system gives no more threads there are fewer.
    pub(crate) fn new(members: usize) -> Self {
        let others = members.clamp(1, MEMBERS_MAX) - 1;
        let board = Arc::new(Board {
            number: AtomicU64::new(0),
            job: JobCell(UnsafeCell::new(None)),
            busy: AtomicUsize::new(0),
            is_broken: AtomicBool::new(false),
            is_over: AtomicBool::new(false),
            is_parked: (0..others).map(|_| AtomicBool::new(false)).collect(),
        });
        let start = |member: usize| {
            let board = Arc::clone(&board);
            let thread = thread::Builder::new().name(format!("solver-{member}"));
            thread.spawn(move || board.work(member)).ok()
        };
        let others = (1..=others).map_while(start).collect();
        Self { board, others }
    }

    pub(crate) fn members(&self) -> usize {
        self.others.len() + 1
    }

    /// Lets member `m` work on part `m`, and returns when all are done. There are at most as many
    /// parts as members.
    ///
    /// # Panics
    /// If there are more, or if a member panics.
    pub(crate) fn each<P: Send>(&self, parts: &mut [P], work: impl Fn(&mut P) + Sync) {
        assert!(parts.len() <= self.members(), "more parts than members");
        if let [part] = parts {
            work(part);
            return;
        }
        let (count, parts) = (parts.len(), Parts(parts.as_mut_ptr()));
        self.run(&|member| {
            if member < count {
                let part = parts.part(member);
                // SAFETY: the part is within the slice, which outlives `run`, and each member has
                // another number.
                work(unsafe { &mut *part });
            }
        });
    }

    fn run(&self, job: &Job<'_>) {
        let board = &*self.board;
        // SAFETY: only the lifetime changes. The job leaves the board at the end of this function,
        // which waits until no member is at it.
        let lent = unsafe { std::mem::transmute::<&Job<'_>, &'static Job<'static>>(job) };
        // SAFETY: no member is busy, so nobody reads the cell.
        unsafe { *board.job.0.get() = Some(lent) };
        board.busy.store(self.others.len(), Ordering::Relaxed);
        // All that was written is seen by whoever sees the number; and `is_parked` is read only
        // after it (see `Board::wait`).
        board.number.fetch_add(1, Ordering::SeqCst);
        for (is_parked, other) in board.is_parked.iter().zip(&self.others) {
            if is_parked.load(Ordering::SeqCst) {
                other.thread().unpark();
            }
        }
        let result = catch_unwind(AssertUnwindSafe(|| job(0)));
        let mut spins = 0;
        while board.busy.load(Ordering::Acquire) > 0 {
            rest(&mut spins);
        }
        // SAFETY: no member is busy any more.
        unsafe { *board.job.0.get() = None };
        if let Err(panic) = result {
            std::panic::resume_unwind(panic);
        }
        assert!(!board.is_broken.load(Ordering::Relaxed), "a thread of the solver has panicked");
    }
}

/// Waits a little: first on the core, then beside it.
fn rest(spins: &mut u32) {
    *spins += 1;
    if *spins < SPINS { spin_loop() } else { thread::yield_now() }
}

impl Board {
    /// The life of a member.
    fn work(&self, member: usize) {
        let mut seen = 0;
        loop {
            self.wait(member, seen);
            if self.is_over.load(Ordering::Acquire) {
                return;
            }
            seen += 1;
            // SAFETY: the number says that a job is there, and `busy` keeps it there.
            let job = unsafe { *self.job.0.get() };
            if let Some(job) = job {
                let result = catch_unwind(AssertUnwindSafe(|| job(member)));
                if result.is_err() {
                    self.is_broken.store(true, Ordering::Relaxed);
                }
            }
            self.busy.fetch_sub(1, Ordering::Release);
        }
    }

    /// Waits for the job after the one that was seen last.
    fn wait(&self, member: usize, seen: u64) {
        let is_there = || self.number.load(Ordering::SeqCst) != seen;
        for _ in 0..SPINS {
            if is_there() {
                return;
            }
            spin_loop();
        }
        let is_parked = &self.is_parked[member - 1];
        is_parked.store(true, Ordering::SeqCst);
        // Looked at again after saying so: whoever announces a job looks the other way round, so
        // one of the two sees the other.
        while !is_there() {
            thread::park();
        }
        is_parked.store(false, Ordering::Relaxed);
    }
}

impl Drop for Crew {
    fn drop(&mut self) {
        self.board.is_over.store(true, Ordering::Release);
        self.board.number.fetch_add(1, Ordering::SeqCst);
        for other in self.others.drain(..) {
            other.thread().unpark();
            // A panic of a member has been reported by `run`.
            let _panicked = other.join();
        }
    }
}

impl Clone for Crew {
    /// Another crew of as many members.
    fn clone(&self) -> Self {
        Self::new(self.members())
    }
}

impl fmt::Debug for Crew {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Crew of {}", self.members())
    }
}

/// The first of some parts.
struct Parts<P>(*mut P);

// SAFETY: members take different parts, and these may be sent.
unsafe impl<P: Send> Sync for Parts<P> {}

impl<P> Parts<P> {
    fn part(&self, member: usize) -> *mut P {
        self.0.wrapping_add(member)
    }
}

/// Numbers that several members change, each other ones.
#[derive(Clone, Copy)]
pub(crate) struct Shared<'a, T>(&'a [Cell<T>]);

// SAFETY: whoever makes one promises that no two members touch the same cell; see `Shared::new`.
unsafe impl<T: Send> Sync for Shared<'_, T> {}
// SAFETY: as above.
unsafe impl<T: Send> Send for Shared<'_, T> {}

impl<'a, T> Shared<'a, T> {
    /// # Safety
    /// Until the next barrier (the end of [`Crew::each`]), a cell that one member writes must be
    /// touched by no other.
    pub(crate) unsafe fn new(numbers: &'a mut [T]) -> Self {
        Self(Cell::from_mut(numbers).as_slice_of_cells())
    }

    pub(crate) fn cells(&self) -> &'a [Cell<T>] {
        self.0
    }
}

#[cfg(test)]
mod tests {
    //! Every part is worked on once, whatever the number of parts and members.
    use super::*;

    #[test]
    fn every_part_is_worked_on_once() {
        for members in [1, 2, 3, 4, 8] {
            let crew = Crew::new(members);
            for count in 0..=crew.members() {
                let mut parts = vec![0_u32; count];
                for _ in 0..500 {
                    crew.each(&mut parts, |part| *part += 1);
                }
                assert_eq!(parts, vec![500; count], "{members} members");
            }
        }
    }

    #[test]
    fn a_member_that_was_parked_comes_back() {
        let crew = Crew::new(3);
        let mut parts = [0_u32; 3];
        for round in 1..=5 {
            // Until the others are parked: that is seen, not waited for.
            while !crew.board.is_parked.iter().all(|one| one.load(Ordering::SeqCst)) {
                thread::yield_now();
            }
            crew.each(&mut parts, |part| *part += 1);
            assert_eq!(parts, [round; 3]);
        }
    }

    #[test]
    fn a_panic_of_a_member_reaches_the_caller() {
        let crew = Crew::new(2);
        let mut parts = [0, 1];
        let result = catch_unwind(AssertUnwindSafe(|| {
            crew.each(&mut parts, |part| assert_eq!(*part, 0));
        }));
        assert!(result.is_err());
    }
}
