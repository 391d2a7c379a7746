//! The limit on the work of a step, at every door; and steps that are given up.
//!
//! The work is substeps x (constraints x iterations + particles x (colliders + 1)). The scenes have
//! counts whose work is one above or exactly at a bound, computed by hand.

use std::sync::atomic::{AtomicBool, Ordering};

use sim_solver::{Parameter, ParameterValue, Reason, Scene, Solver};
use sim_types::STEP_WORK_MAX;

/// A cloth of 100 x 100 particles: 2 x 100 x 99 structural and 2 x 99 x 99 shear constraints.
const CLOTH: &str = "[[generate]]\nshape = \"cloth\"\ncolumns = 100\nrows = 100\nspacing = 0.01\n";
const PARTICLES: u64 = 10_000;
const CONSTRAINTS: u64 = 39_402;

fn read(text: &str) -> Result<Scene, String> {
    Scene::from_toml(&format!("version = 1\n{text}"), "f.toml").map_err(|error| error.to_string())
}

fn number(value: u16) -> ParameterValue {
    ParameterValue::Number(value.into())
}

/// Most iterations of the cloth with 1000 substeps and without colliders.
fn iterations_max() -> u64 {
    (STEP_WORK_MAX / 1000 - PARTICLES) / CONSTRAINTS
}

#[test]
fn a_scene_beyond_the_limit_is_refused_with_the_sum() {
    let max = iterations_max();
    let scene = |iterations: u64| {
        read(&format!("[solver]\nsubsteps = 1000\niterations = {iterations}\n{CLOTH}"))
    };
    scene(max).unwrap();
    let over = max + 1;
    let work = 1000 * (CONSTRAINTS * over + PARTICLES);
    let expected = format!(
        "f.toml:4: solver: a step of 1000 substeps x ({CONSTRAINTS} constraints x {over} iterations \
         + {PARTICLES} particles x (0 colliders + 1)) is {work} projections and tests (allowed: \
         {STEP_WORK_MAX})"
    );
    assert_eq!(scene(over).unwrap_err(), expected);
}

#[test]
fn colliders_count_because_every_particle_is_tested_against_each() {
    let rope = "[[generate]]\nshape = \"rope\"\ncount = 100000\nfrom = [0, 0, 0]\nto = [9, 0, 0]\n";
    let plane = "[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0\n";
    // 4 substeps x (99,999 + 100,000 x (n + 1)) is below 2^30 up to n = 2682.
    read(&format!("{rope}{}", plane.repeat(2682))).unwrap();
    let error = read(&format!("{rope}{}", plane.repeat(2683))).unwrap_err();
    assert!(error.starts_with("f.toml:1: solver: a step of 4 substeps"), "{error}");
}

#[test]
fn a_cloth_of_a_million_particles_with_20_substeps_needs_about_an_eighth_of_the_limit() {
    // The same work: 16 times fewer particles than 1000 x 1000, and 16 times more substeps than 20.
    let sheet = "[[generate]]\nshape = \"mesh\"\ncolumns = 250\nrows = 250\nspacing = 0.01\n";
    let scene = |iterations: u32| {
        read(&format!("[solver]\nsubsteps = 320\niterations = {iterations}\n{sheet}"))
    };
    scene(8).unwrap();
    scene(9).unwrap_err();
}

#[test]
fn a_set_beyond_the_limit_is_rejected_and_changes_no_bit() {
    let mut solver = Solver::new(&read(CLOTH).unwrap());
    let mut other = solver.clone();
    let max = u16::try_from(iterations_max()).unwrap();
    solver.set("substeps", number(1000), None).unwrap();
    assert_eq!(solver.set("iterations", number(1000), None), Err(Reason::OutOfRange));
    assert_eq!(solver.set("iterations", number(max + 1), None), Err(Reason::OutOfRange));
    solver.set("iterations", number(max), None).unwrap();
    assert_eq!(solver.parameter_values().count(Parameter::Iterations), u32::from(max));
    // Other parameters stay settable at the limit.
    solver.set("damping", number(1), None).unwrap();

    assert_eq!(other.set("iterations", number(1000), None), Ok(()));
    assert_eq!(other.set("substeps", number(1000), None), Err(Reason::OutOfRange));
    other.set("iterations", number(1), None).unwrap();
    let mut expected = Solver::new(&read(CLOTH).unwrap());
    expected.step();
    other.step();
    assert_eq!(other.state_hash(), expected.state_hash());
}

#[test]
fn substeps_of_a_command_line_beyond_the_limit_are_refused() {
    let mut scene = read(&format!("[solver]\niterations = 1000\n{CLOTH}")).unwrap();
    scene.override_solver(None, Some(27)).unwrap();
    let error = scene.override_solver(None, Some(28)).unwrap_err();
    assert!(error.starts_with("substeps: a step of 28 substeps x (39402 constraints"), "{error}");
    assert!(error.ends_with(&format!("(allowed: {STEP_WORK_MAX})")), "{error}");
}

#[test]
fn a_keyframe_with_passes_beyond_the_limit_of_its_scene_is_refused() {
    let particles = "[[particle]]\nposition = [0, 9, 0]\n".repeat(100);
    let constraints = "[[constraint]]\nparticles = [0, 1]\n".repeat(5000);
    // Without constraints 1000 x 100, with them 1000 x 5000 x 1000.
    let mut light = Solver::new(&read(&particles).unwrap());
    light.set("substeps", number(1000), None).unwrap();
    light.set("iterations", number(1000), None).unwrap();
    let mut heavy = Solver::new(&read(&format!("{particles}{constraints}")).unwrap());
    let error = heavy.restore(light.particles(), &light.keyframe()).unwrap_err().to_string();
    assert!(error.contains("a parameter is out of its range"), "{error}");
    light.set("iterations", number(100), None).unwrap();
    heavy.restore(light.particles(), &light.keyframe()).unwrap();
}

#[test]
fn a_step_is_given_up_when_the_flag_is_set_and_is_the_same_step_when_it_is_not() {
    let rope = "[[generate]]\nshape = \"rope\"\ncount = 50\nfrom = [0, 0, 0]\nto = [9, 0, 0]\n";
    let plane = "[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = -1\n";
    let scene = read(&format!("{CLOTH}{rope}{plane}")).unwrap();
    let (mut plain, mut interruptible) = (Solver::new(&scene), Solver::new(&scene));
    let stop = AtomicBool::new(false);
    for _ in 0..3 {
        plain.step();
        assert!(interruptible.step_unless(&stop));
        assert_eq!(interruptible.state_hash(), plain.state_hash());
    }
    stop.store(true, Ordering::Relaxed);
    assert!(!interruptible.step_unless(&stop));
    // The particles and the hash are still those of the last complete step.
    assert_eq!(interruptible.state_hash(), plain.state_hash());
    assert_eq!(interruptible.particles(), plain.particles());
}
