//! The physics against closed forms and invariants, which are known without running the solver. Each
//! comparison prints the expected value, the actual value and the tolerance.
#![allow(
    clippy::print_stdout,
    reason = "the values of a comparison, for a person who runs the test"
)]

mod anchors;
mod bending;
mod colliders;
mod constraints;
mod contacts;
mod energy;
mod forces;
mod hardening;
mod motion;
mod motions;
mod order;
mod parameters;
mod surfaces;
mod tearing;
mod tethers;
mod wind;

use sim_solver::{Particle, Scene, Solver};

/// A floor at y = 0. More of its keys can follow.
const FLOOR: &str = "[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0\n";

/// Returns the start of a `[solver]` table. More of its keys can follow.
fn rates(rate_hz: u32, substeps: u32) -> String {
    format!("[solver]\nrate_hz = {rate_hz}\nsubsteps = {substeps}\n")
}

/// Returns the solver of a scene. `text` lacks only the line with the version.
fn solver(text: &str) -> Solver {
    Solver::new(&Scene::from_toml(&format!("version = 1\n{text}"), "test").unwrap())
}

fn step(solver: &mut Solver, steps: u32) {
    for _ in 0..steps {
        solver.step();
    }
}

fn stepped(text: &str, steps: u32) -> Solver {
    let mut solver = solver(text);
    step(&mut solver, steps);
    solver
}

/// Asserts that a number agrees with its closed form within an absolute tolerance.
#[track_caller]
fn assert_near(name: &str, expected: f64, actual: f64, tolerance: f64) {
    println!("{name}: expected {expected}, got {actual}, tolerance {tolerance}");
    let error = (actual - expected).abs();
    assert!(error <= tolerance, "{name}: expected {expected}, got {actual}, off by {error}");
}

/// Asserts that a number agrees with its closed form within a fraction of it.
#[track_caller]
fn assert_close(name: &str, expected: f64, actual: f64, fraction: f64) {
    assert_near(name, expected, actual, fraction * expected.abs());
}

/// Asserts that a number does not exceed a limit.
#[track_caller]
fn assert_at_most(name: &str, max: f64, actual: f64) {
    println!("{name}: at most {max}, got {actual}");
    assert!(actual <= max, "{name}: got {actual}, more than {max}");
}

fn position(solver: &Solver, index: usize) -> [f64; 3] {
    solver.particle(index).position.map(f64::from)
}

fn velocity(solver: &Solver, index: usize) -> [f64; 3] {
    solver.particle(index).velocity.map(f64::from)
}

fn distance(solver: &Solver, a: usize, b: usize) -> f64 {
    let (a, b) = (position(solver, a), position(solver, b));
    (0..3).map(|axis| (b[axis] - a[axis]).powi(2)).sum::<f64>().sqrt()
}

fn particles(solver: &Solver) -> impl Iterator<Item = Particle> + '_ {
    (0..solver.particle_count()).map(|index| solver.particle(index))
}

/// Returns every bit of the published state.
fn bits(solver: &Solver) -> Vec<u8> {
    bytemuck::cast_slice(&particles(solver).collect::<Vec<_>>()).to_vec()
}
