//! What a solver keeps in memory, counted by the allocator.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use serde::Serialize;
use sim_solver::scene::SceneParticle;
use sim_solver::{ParticleFlags, Scene, Solver};

struct Counting;

/// Bytes that are allocated and not yet freed.
static LIVE_BYTES: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes on to the system's allocator unchanged; counting touches no memory of it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LIVE_BYTES.fetch_add(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `alloc`, which is the system's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        LIVE_BYTES.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the pointer came from `System.alloc` with this layout, as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A corner of a triangle in the surface of a solver, in bytes.
const CORNER_SIZE: usize = 4;

/// Memory of a solver on the heap; what is needed between steps is part of it.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct Footprint {
    /// Of the same scene without constraints.
    pub(crate) bytes_per_particle: f64,
    /// What the constraints add, their order and tethers included; the corners of triangles are
    /// left out.
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

/// Bytes of a solver after its first step, and that solver.
fn heap_bytes(scene: &Scene) -> (f64, Solver) {
    let before = LIVE_BYTES.load(Ordering::Relaxed);
    let mut solver = Solver::new(scene);
    solver.step();
    ((LIVE_BYTES.load(Ordering::Relaxed) - before) as f64, solver)
}

/// The particles of a scene alone, with its colliders, anchors and settings.
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
