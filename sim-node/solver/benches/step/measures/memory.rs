//! Memory of a solver, counted by the allocator.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use serde::Serialize;
use sim_solver::scene::SceneParticle;
use sim_solver::{ParticleFlags, Scene, Solver};

struct Counting;

/// Bytes that are allocated and not yet freed.
static LIVE_BYTES: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is forwarded to the system's allocator unchanged. Counting touches none of its memory.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LIVE_BYTES.fetch_add(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller upholds the contract of `alloc`, which is the system's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        LIVE_BYTES.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the pointer came from `System.alloc` with this layout.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Size of a triangle's corner in the surface of a solver, in bytes.
const CORNER_SIZE: usize = 4;

/// Memory of a solver on the heap, including its working memory.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct Footprint {
    /// Memory of the same scene without constraints.
    pub(crate) bytes_per_particle: f64,
    /// Memory that the constraints add, including their order and tethers, but not the corners of
    /// triangles.
    pub(crate) bytes_per_constraint: f64,
}

impl Footprint {
    pub(crate) fn measure(scene: &Scene) -> Self {
        let (whole, solver) = heap_bytes(scene);
        let (loose, _) = heap_bytes(&without_constraints(scene, &solver));
        let surface = (3 * CORNER_SIZE * solver.triangles().len()) as f64;
        Self {
            bytes_per_particle: loose / solver.particle_count() as f64,
            bytes_per_constraint: (whole - loose - surface) / solver.constraint_count() as f64,
        }
    }
}

/// Returns the bytes of a solver after its first step, and that solver.
fn heap_bytes(scene: &Scene) -> (f64, Solver) {
    let before = LIVE_BYTES.load(Ordering::Relaxed);
    let mut solver = Solver::new(scene);
    solver.step();
    ((LIVE_BYTES.load(Ordering::Relaxed) - before) as f64, solver)
}

/// Returns the particles of a scene with its colliders, anchors and settings.
fn without_constraints(scene: &Scene, solver: &Solver) -> Scene {
    let particle = |index: usize| {
        let one = solver.particle(index);
        SceneParticle {
            position: one.position,
            mass: 1.0,
            pinned: one.flags & ParticleFlags::PINNED != 0,
            velocity: one.velocity,
        }
    };
    Scene {
        particles: (0..solver.particle_count()).map(particle).collect(),
        constraints: Vec::new(),
        generators: Vec::new(),
        ..scene.clone()
    }
}
