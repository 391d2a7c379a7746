//! Neither steps nor commands allocate. A counting allocator checks it.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use sim_solver::{BodyMotion, Grab, ParameterValue, Part, Pose, Scene, Solver, builtin};

struct Counting;

thread_local! {
    /// Allocations of this thread. The thread that waits for the test may allocate.
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

fn allocations() -> u64 {
    ALLOCATIONS.get()
}

// SAFETY: every call is forwarded to the system's allocator unchanged. Counting touches none of its memory.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
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

/// A cloth that tears, among colliders that move by themselves, by commands, and as bodies.
const TEARING: &str = r#"
version = 1
[solver]
tethers = true
tear_force = 3
[[generate]]
shape = "cloth"
columns = 20
rows = 20
spacing = 0.05
mass = 0.05
pinned = "top"
[[collider]]
shape = "box"
center = [0.5, -0.5, 0.2]
half_extents = [0.2, 0.2, 0.1]
velocity = [0, 0, -0.3]
angular_velocity = [0, 1, 0]
[[collider]]
shape = "sphere"
center = [0.3, -0.3, -0.4]
radius = 0.2
[[collider]]
shape = "sphere"
center = [0.7, -0.6, -0.4]
radius = 0.2
body = { mass = 1, inertia = [0.02, 0.02, 0.02] }
"#;

#[test]
fn neither_steps_nor_commands_allocate() {
    // A pin recomputes the tethers at its boundary, which may allocate.
    let text = builtin::text("curtain").unwrap().replace("tethers = 1", "tethers = false");
    let scene = Scene::from_toml(&text, "curtain").unwrap();
    let mut solver = Solver::new(&scene);
    let before = allocations();
    for round in 0..100_u8 {
        let particle = 20 + u32::from(round);
        let target = [0.0, f32::from(round) * 0.01, 0.1];
        solver.grab(1, Grab { particle, target, over_s: 0.02 }).unwrap();
        solver.step();
        solver.release(1, particle).unwrap();
        solver.pin(particle).unwrap();
        solver.step();
    }
    assert_eq!(allocations() - before, 0);
    // Contacts, wind, anchors and many tears in one step do not allocate either.
    // Nor do bends, and their end at a tear.
    for text in [
        include_str!("scenes/everything.toml"),
        include_str!("scenes/stiffness.toml"),
        include_str!("scenes/bends.toml"),
        include_str!("scenes/touching.toml"),
        include_str!("scenes/surfaces.toml"),
        include_str!("scenes/draped.toml"),
    ] {
        let mut solver = Solver::new(&Scene::from_toml(text, "test").unwrap());
        solver.step();
        // A parameter takes effect at its boundary, which may allocate.
        solver.set("tear_distance", ParameterValue::Number(0.0), None).unwrap();
        solver.step();
        let before = allocations();
        for _ in 0..200 {
            solver.step();
        }
        assert_eq!(allocations() - before, 0);
        assert!(solver.torn().len() > 100, "{} tore", solver.torn().len());
    }
    // Nor does a step with everything that a node reads after it: forces, colliders that move, and tears that drop tethers.
    let mut solver = Solver::new(&Scene::from_toml(TEARING, "test").unwrap());
    solver.compute_forces(true);
    solver.step();
    let before = allocations();
    for round in 0..200_u8 {
        let translation = [0.0, 0.0, f32::from(round) * 0.002];
        let pose = Pose { translation, rotation: [0.0, 0.0, 0.0, 1.0] };
        solver.move_collider(1, pose).unwrap();
        solver.drive_body(2, pose, &BodyMotion::default()).unwrap();
        solver.step();
        let moving = solver.colliders().filter(|one| one.velocity != [0.0; 3]).count();
        assert!(moving >= 2 && solver.has_moving_colliders());
        assert!(solver.forces().is_some());
    }
    assert_eq!(allocations() - before, 0);
    assert!(solver.torn().len() > 100, "{} tore", solver.torn().len());
    // The counter works.
    drop(std::hint::black_box(vec![0_u8; 100]));
    assert!(allocations() > before);
}

#[test]
fn a_change_of_a_parameter_in_use_allocates_nothing() {
    for text in [
        builtin::text("tearable-cloth").unwrap(),
        include_str!("scenes/everything.toml"),
        include_str!("scenes/bends.toml"),
    ] {
        let mut solver = Solver::new(&Scene::from_toml(text, "test").unwrap());
        let changes = [
            ("max_stretch", [ParameterValue::Number(1.2), ParameterValue::Number(1.3)]),
            ("tear_stretch", [ParameterValue::Number(9.0), ParameterValue::Off]),
            ("tear_distance", [ParameterValue::Number(9.0), ParameterValue::Number(8.0)]),
            ("tear_force", [ParameterValue::Number(1e9), ParameterValue::Off]),
            ("substeps", [ParameterValue::Number(3.0), ParameterValue::Number(2.0)]),
            ("iterations", [ParameterValue::Number(2.0), ParameterValue::Number(3.0)]),
            ("damping", [ParameterValue::Number(0.5), ParameterValue::Off]),
            ("bending", [ParameterValue::Number(0.01), ParameterValue::Number(0.0)]),
        ];
        // A scene without bends refuses it.
        let is_used = |(name, _): &(&str, _)| *name != "bending" || solver.bend_count() > 0;
        let changes: Vec<_> = changes.into_iter().filter(is_used).collect();
        // The first use of a parameter makes room for its fields.
        for (name, [first, _]) in changes.iter().copied() {
            solver.set(name, first, None).unwrap();
            solver.step();
        }
        let has_bends = solver.bend_count() > 0;
        let before = allocations();
        for (name, [first, second]) in changes {
            for value in [second, first] {
                solver.set(name, value, None).unwrap();
                solver.finish_boundary();
                solver.step();
            }
        }
        for value in [0.02, 0.03] {
            let set = solver.set_for("bending", ParameterValue::Number(value), Part::Block(0));
            assert_eq!(set.is_ok(), has_bends);
            solver.finish_boundary();
            solver.step();
        }
        assert_eq!(allocations() - before, 0);
    }
}
