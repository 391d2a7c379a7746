//! Prints a state hash of every built-in scene: `cargo run -p sim-solver --example state_hashes`
//!
//! Each scene makes 1,000 steps with a drag, a pin and a release. Two builds that print the same
//! lines make the same bits, whatever their optimisation.
#![allow(clippy::print_stdout, reason = "printing is what it is for")]

use std::error::Error;

use sim_solver::{Grip, Scene, Solver, builtin};

fn main() -> Result<(), Box<dyn Error>> {
    for name in builtin::names() {
        let text = builtin::text(name).unwrap_or_default();
        let mut solver = Solver::new(&Scene::from_toml(text, name)?);
        for step in 0..1000 {
            match step {
                100 => {
                    solver.grab(1, Grip { particle: 20, target: [0.3, 0.7, 0.4], over_s: 0.2 })?;
                }
                300 => solver.pin(30)?,
                500 => solver.release(1, 20)?,
                _ => {}
            }
            solver.step();
        }
        println!("{name} {:016x}", solver.state_hash());
    }
    Ok(())
}
