//! The physics against closed forms and invariants: what gravity, a stick, a spring, a slope or a
//! threshold must do is known without running anything. Each comparison prints what was expected,
//! what was found and the tolerance.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]
#![allow(clippy::print_stdout, reason = "the numbers of a comparison, for whoever asks for them")]

mod anchors;
mod colliders;
mod constraints;
mod contacts;
mod cuts;
mod hardening;
mod motion;
mod order;
mod parameters;
mod tearing;
mod tethers;
mod wind;

use sim_solver::{Particle, Scene, Solver};

/// A floor at y = 0; keys of it can follow.
const FLOOR: &str = "[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0\n";

/// The head of a scene's settings.
fn rates(rate_hz: u32, substeps: u32) -> String {
    format!("[solver]\nrate_hz = {rate_hz}\nsubsteps = {substeps}\n")
}

/// The solver of a scene without its first line.
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

/// A number against its closed form, within an absolute tolerance.
#[track_caller]
fn assert_near(what: &str, expected: f64, found: f64, tolerance: f64) {
    println!("{what}: expected {expected}, found {found}, tolerance {tolerance}");
    let error = (found - expected).abs();
    assert!(error <= tolerance, "{what}: expected {expected}, found {found}, off by {error}");
}

/// A number against its closed form, within a share of it.
#[track_caller]
fn assert_close(what: &str, expected: f64, found: f64, share: f64) {
    assert_near(what, expected, found, share * expected.abs());
}

/// A number that must not exceed another one.
#[track_caller]
fn assert_at_most(what: &str, most: f64, found: f64) {
    println!("{what}: at most {most}, found {found}");
    assert!(found <= most, "{what}: found {found}, more than {most}");
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

/// Every bit of the published state.
fn bits(solver: &Solver) -> Vec<u8> {
    bytemuck::cast_slice(&particles(solver).collect::<Vec<_>>()).to_vec()
}
