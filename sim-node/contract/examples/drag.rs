//! Drags a particle around: `cargo run -p sim-contract --example drag -- 7`
//!
//! Grabs the particle that the argument says (0 if there is none), moves it once around a circle
//! in two seconds, and lets it go. `--domain` and `--name` say which simulation.
#![allow(clippy::print_stdout, reason = "printing is what it is for")]

use std::error::Error;
use std::f32::consts::TAU;
use std::time::Duration;

use sim_contract::{Action, Client, Endpoint, GRAB_OVER_S_DEFAULT};

const TIMEOUT: Duration = Duration::from_secs(1);
const MOVES: u16 = 120;

fn main() -> Result<(), Box<dyn Error>> {
    let (endpoint, arguments) = Endpoint::from_env_and_args()?;
    let particle: u32 = arguments.first().map_or(Ok(0), |argument| argument.parse())?;

    let mut client = Client::attach(&endpoint).map_err(|error| error.to_string())?;
    let rate_hz = client.topology(TIMEOUT)?.ok_or("nothing is loaded")?.header.rate_hz;
    let snapshot = client.latest_snapshot(TIMEOUT)?.ok_or("nothing is published")?;
    let start = snapshot.particles().get(particle as usize).ok_or("no such particle")?.position;
    drop(snapshot);

    // A command has taken effect when its outcome says so, and at the step that it names.
    let over_s = GRAB_OVER_S_DEFAULT;
    let grab = client.request(Action::Grab { particle, target: start, over_s }, TIMEOUT)?;
    if !grab.is_applied() {
        return Err(format!("the grab was rejected: {}", grab.reason_name()).into());
    }
    let mut step = grab.step;
    for index in 1..=MOVES {
        // Simulated time sets the pace: each move takes effect 1/60 s after the one before, so
        // wait for the step before that.
        let awaited = step + u64::from(rate_hz / 60).saturating_sub(1);
        while client.latest_snapshot(TIMEOUT)?.ok_or("the node stands still")?.header().step
            < awaited
        {}
        let angle = TAU * f32::from(index) / f32::from(MOVES);
        let target = [start[0] + angle.sin(), start[1] + 1.0 - angle.cos(), start[2]];
        step = client.request(Action::Move { particle, target, over_s }, TIMEOUT)?.step;
    }
    let release = client.request(Action::Release { particle }, TIMEOUT)?;
    println!("released at step {}", release.step);
    Ok(())
}
