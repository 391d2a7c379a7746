//! Steps allocate nothing on any of several threads. A counting allocator checks it.
//!
//! There is no test harness, whose thread could allocate meanwhile.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};

use sim_solver::{Scene, Solver};

struct Counting;

/// Allocations of all threads.
static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

// SAFETY: every call is forwarded to the system's allocator unchanged. Counting touches none of its memory.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller upholds the contract of `alloc`, which is the system's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the pointer came from `System.alloc` with this layout.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn main() {
    // Those who list tests or run the ignored ones find none here.
    if std::env::args().any(|argument| ["--list", "--ignored"].contains(&argument.as_str())) {
        return;
    }
    for mode in ["particles", "surfaces"] {
        assert_no_allocation(&folding(mode), mode);
    }
    // The counter sees other threads.
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    std::thread::spawn(|| drop(std::hint::black_box(vec![0_u8; 100]))).join().unwrap();
    assert!(ALLOCATIONS.load(Ordering::Relaxed) > before);
}

/// A cloth that folds on a ball, with enough particles and contacts for three threads.
fn folding(mode: &str) -> String {
    format!(
        "version = 1\n[solver]\nrate_hz = 60\nsubsteps = 16\n[contact]\nmode = \"{mode}\"\n\
         [[generate]]\nshape = \"cloth\"\ncolumns = 70\nrows = 70\nspacing = 0.02\npinned = \"none\"\n\
         mass = 0.001\norigin = [-0.7, 0.42, -0.7]\nright = [1, 0, 0]\ndown = [0, 0, 1]\n\
         [[collider]]\nshape = \"sphere\"\ncenter = [0, 0.2, 0]\nradius = 0.2\nfriction = 0.3\n\
         [[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0\nfriction = 0.3\n"
    )
}

fn assert_no_allocation(text: &str, name: &str) {
    let mut solver = Solver::new(&Scene::from_toml(text, name).unwrap());
    solver.set_threads(3);
    assert_eq!(solver.threads(), 3);
    // All threads have started when it ends, since each had a part of it.
    solver.step();
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    for _ in 0..60 {
        solver.step();
    }
    assert_eq!(ALLOCATIONS.load(Ordering::Relaxed) - before, 0, "{name}");
}
