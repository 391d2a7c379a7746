//! Watches a running simulation: `cargo run -p sim-contract --example watch -- 100`
//!
//! Prints step, particle count and lowest particle of 100 snapshots; without an argument, of 10.
//! `--domain` and `--name` select the simulation.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "printing is its purpose")]

use std::error::Error;
use std::process::ExitCode;
use std::time::Duration;

use sim_contract::{Client, Endpoint};

fn main() -> ExitCode {
    let Err(error) = watch() else { return ExitCode::SUCCESS };
    eprintln!("error: {error}");
    ExitCode::FAILURE
}

fn watch() -> Result<(), Box<dyn Error>> {
    let (endpoint, arguments) = Endpoint::from_env_and_args()?;
    let argument = arguments.first().map_or("10", String::as_str);
    if argument == "--help" {
        println!("Usage: watch [--domain DOMAIN] [--name NAME] [SNAPSHOTS]");
        return Ok(());
    }
    let count: u64 = argument.parse().map_err(|_| format!("'{argument}' is not a count"))?;

    // A client connects to a service when a method first needs it: this one only to particles.
    let mut client = Client::attach(&endpoint)?;
    for _ in 0..count {
        // The snapshot stays in shared memory, without a copy, and is valid until it is dropped.
        let Some(snapshot) = client.next_snapshot(Duration::from_secs(5))? else {
            if client.is_owner_alive() {
                eprintln!("{endpoint} publishes nothing: is it paused?");
                continue;
            }
            eprintln!("{endpoint} has ended");
            break;
        };
        let particles = snapshot.particles();
        let (step, count) = (snapshot.header().step, particles.len());
        let heights = particles.iter().map(|particle| particle.position[1]).enumerate();
        let Some((index, y)) = heights.min_by(|(_, a), (_, b)| a.total_cmp(b)) else { continue };
        // Millimetres, without a sign of zero.
        let y = (y * 1e3).round() / 1e3 + 0.0;
        println!("step {step}: {count} particles, lowest {index} at y = {y:.3} m");
    }
    Ok(())
}
