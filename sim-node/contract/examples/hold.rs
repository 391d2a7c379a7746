//! Brings a pendulum to rest: `sim-node run pendulum`, then `cargo run -p sim-contract --example hold`
//!
//! The node waits for this controller at every step, so the run is the same at any speed. It lasts 2400
//! steps, or as many as the argument says. `--domain` and `--name` select the simulation.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "printing is its purpose")]

use std::{error::Error, process::ExitCode, time::Duration};

use sim_contract::{Action, Client, Endpoint, ParticleFlags};

const TIMEOUT: Duration = Duration::from_secs(5);
const NO_PENDULUM: &str = "the scene is no pendulum: `sim-node ctl load pendulum` loads one";
/// Displacement of the pivot against the mass, per speed of the mass, in seconds.
const GAIN: f32 = 0.25;
/// Time in which the pivot follows: an immediate move would jerk the mass.
const OVER_S: f32 = 0.25;

fn main() -> ExitCode {
    let Err(error) = run() else { return ExitCode::SUCCESS };
    eprintln!("error: {error}");
    ExitCode::FAILURE
}

fn run() -> Result<(), Box<dyn Error>> {
    let (endpoint, arguments) = Endpoint::from_env_and_args()?;
    let steps: u64 = arguments.first().map_or(Ok(2400), |text| text.parse())?;
    let mut client = Client::attach(&endpoint)?;
    client.join_lockstep(TIMEOUT)?;
    let (mut rest, mut speed) = (None, 0.0);
    for _ in 0..steps {
        let snapshot = client.next_turn(TIMEOUT)?.ok_or("the node is paused, or gone")?;
        let [pivot, mass] = snapshot.particles() else { return Err(NO_PENDULUM.into()) };
        let [x, y, z] = *rest.get_or_insert(pivot.position);
        // The pivot gives way against the motion of the mass, which damps it as a viscous fluid would.
        let target = [x - GAIN * mass.velocity[0], y, z - GAIN * mass.velocity[2]];
        client.send(if pivot.flags & ParticleFlags::GRABBED == 0 {
            Action::Grab { particle: 0, target, over_s: OVER_S }
        } else {
            Action::Move { particle: 0, target, over_s: OVER_S }
        })?;
        speed = mass.velocity.iter().map(|axis| axis * axis).sum::<f32>().sqrt();
        drop(snapshot);
        client.ready()?;
        while let Some(outcome) = client.next_outcome(Duration::ZERO)? {
            outcome.is_applied().then_some(()).ok_or_else(|| outcome.reason_name())?;
        }
    }
    println!("the mass moves at {speed:.6} m/s");
    Ok(())
}
