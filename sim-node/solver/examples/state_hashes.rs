//! Prints a state hash of every built-in scene and of test scenes that use every mechanism:
//! `cargo run --release -p sim-solver --example state_hashes`
//!
//! Each scene makes 10,000 steps (a larger one 4,000 or 1,000) with commands of every kind. Two builds that
//! print the same lines compute the same bits, regardless of optimisation. `tests/state_hashes.txt`
//! has the same lines. It may change only together with the solver's version.
//!
//! With a number n as argument, each scene makes 1/n of the steps, with the same commands: without optimisation,
//! all steps take a quarter of an hour.
#![allow(clippy::print_stdout, reason = "printing is what it is for")]

use std::env;
use std::error::Error;
use std::num::NonZero;
use std::thread;

use sim_solver::{
    Grab, ParameterValue, Pose, Push, SOLVER_VERSION, Scene, Solver, Sphere, Sweep, builtin,
};

/// The test scenes.
const SCENES: [(&str, &str); 6] = [
    ("bends", include_str!("../tests/scenes/bends.toml")),
    ("everything", include_str!("../tests/scenes/everything.toml")),
    ("touching", include_str!("../tests/scenes/touching.toml")),
    ("surfaces", include_str!("../tests/scenes/surfaces.toml")),
    ("draped", include_str!("../tests/scenes/draped.toml")),
    ("stiffness", include_str!("../tests/scenes/stiffness.toml")),
];

/// Returns the number of steps. Large scenes make fewer, because they take longer.
fn steps(solver: &Solver) -> u32 {
    match solver.particle_count() {
        0..170 => 10_000,
        170..500 => 4_000,
        _ => 1_000,
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let divisor = match env::args().nth(1) {
        Some(number) => {
            number.parse().map_err(|_| format!("expected a number > 0, not {number}"))?
        }
        None => NonZero::<u32>::MIN,
    };
    print!("{}", lines(divisor)?);
    Ok(())
}

/// Returns the solver's version, then a line for each scene. `divisor` divides the numbers of steps, and the steps of
/// the commands.
pub(crate) fn lines(divisor: NonZero<u32>) -> Result<String, Box<dyn Error>> {
    let built_in = builtin::names().filter_map(|name| Some((name, builtin::text(name)?)));
    let scenes: Result<Vec<_>, _> =
        built_in.chain(SCENES).map(|(name, text)| Scene::from_toml(text, name)).collect();
    let scenes = scenes?;
    let hashes: Vec<_> = thread::scope(|scope| {
        let running: Vec<_> =
            scenes.iter().map(|scene| scope.spawn(move || run(scene, divisor.get()))).collect();
        running.into_iter().map(thread::ScopedJoinHandle::join).collect()
    });
    let mut lines = format!("solver_version {SOLVER_VERSION}\n");
    for (scene, hash) in scenes.iter().zip(hashes) {
        let hash = hash.map_err(|_| "a scene panicked")?;
        lines += &format!("{} {hash:016x}\n", scene.name);
    }
    Ok(lines)
}

fn run(scene: &Scene, divisor: u32) -> u64 {
    let mut solver = Solver::new(scene);
    for step in 0..steps(&solver) / divisor {
        // A command without meaning in a scene is refused by every build.
        let _refused = command(&mut solver, divisor * step);
        solver.step();
    }
    solver.state_hash()
}

fn command(solver: &mut Solver, step: u32) -> Result<(), sim_solver::Reason> {
    let [x, y, _] = solver.particle(solver.particle_count() / 2).position;
    let sphere = Sphere { center: [x, y, 0.0], radius: 0.3 };
    let pose = Pose { translation: [0.1, 0.05, 0.0], rotation: [0.0, 0.0, 0.3, 1.0] };
    match step {
        100 => solver.grab(1, Grab { particle: 20, target: [0.3, 0.7, 0.0], over_s: 0.2 }),
        300 => solver.pin(15),
        500 => solver.release(1, 20),
        700 => solver.push(Push { sphere, delta: [0.01, 0.02, 0.0], limit: Some(0.015) }),
        900 => solver.cut(17),
        1000 => solver.cut_segment(Sweep {
            from: [x - 0.05, y - 0.05, 0.0],
            to: [x + 0.05, y + 0.1, 0.0],
            direction: [0.0, 0.0, 1.0],
        }),
        1500 => solver.move_anchor(0, pose),
        2000 => solver.move_collider(1, pose),
        2500 => solver.set("gravity", ParameterValue::Vector([0.5, -3.0, 0.0]), None),
        3000 => solver.set("substeps", ParameterValue::Number(4.0), None),
        3500 => solver.set("wind.velocity", ParameterValue::Vector([-4.0, 0.0, 0.0]), None),
        4000 => solver.unpin(15),
        5000 => solver.cut_radius(Sphere { radius: 0.15, ..sphere }),
        6000 => {
            solver.reset();
            Ok(())
        }
        _ => Ok(()),
    }
}
