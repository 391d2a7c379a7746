//! Grabs a particle and moves it around a level circle of 0.6 m: `cargo run -p sim-contract --example grab -- 7`
//!
//! It is particle 7 here, particle 0 without an argument. The circle takes two seconds; then the
//! particle is released. `--domain` and `--name` select the simulation.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "printing is its purpose")]

use std::{error::Error, f32::consts::TAU, process::ExitCode, time::Duration};

use sim_contract::{Action, Client, Endpoint, GRAB_OVER_S_DEFAULT};

const TIMEOUT: Duration = Duration::from_secs(1);
const MOVES: u16 = 120;
/// Radius of the circle, in m. It leaves the plane of a curtain, which so swings back and does not turn over.
const RADIUS: f32 = 0.3;

fn main() -> ExitCode {
    let Err(error) = run() else { return ExitCode::SUCCESS };
    eprintln!("error: {error}");
    ExitCode::FAILURE
}

fn run() -> Result<(), Box<dyn Error>> {
    let (endpoint, arguments) = Endpoint::from_env_and_args()?;
    let argument = arguments.first().map_or("0", String::as_str);
    let particle: u32 = argument.parse().map_err(|_| format!("'{argument}' is not an index"))?;
    let mut client = Client::attach(&endpoint)?;
    let rate_hz = client.topology(TIMEOUT)?.ok_or("the node has no scene")?.header.rate_hz;
    let snapshot = client.latest_snapshot(TIMEOUT)?.ok_or("the node publishes nothing")?;
    let particles = snapshot.particles();
    let unknown = format!("no such particle (allowed: 0 to {})", particles.len().max(1) - 1);
    let start = particles.get(particle as usize).ok_or(unknown)?.position;
    drop(snapshot);
    // The outcome proves that a command took effect, and names the first step that shows it.
    let over_s = GRAB_OVER_S_DEFAULT;
    let grab = client.request(Action::Grab { particle, target: start, over_s }, TIMEOUT)?;
    grab.is_applied().then_some(()).ok_or_else(|| format!("rejected: {}", grab.reason_name()))?;
    let mut step = grab.step;
    for index in 1..=MOVES {
        // Simulated time sets the pace: one move every 1/60 s.
        let due = step + u64::from(rate_hz / 60).saturating_sub(1);
        while client.latest_snapshot(TIMEOUT)?.ok_or("the node is paused")?.header().step < due {}
        let angle = TAU * f32::from(index) / f32::from(MOVES);
        let (x, z) = (RADIUS * angle.sin(), RADIUS * (1.0 - angle.cos()));
        let target = [start[0] + x, start[1], start[2] + z];
        step = client.request(Action::Move { particle, target, over_s }, TIMEOUT)?.step;
    }
    let release = client.request(Action::Release { particle, force: false }, TIMEOUT)?;
    println!("released at step {}", release.step);
    Ok(())
}
