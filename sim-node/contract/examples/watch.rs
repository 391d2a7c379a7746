//! Watches a running simulation: `cargo run -p sim-contract --example watch -- 100`
//!
//! Prints the step, the number of particles and the lowest particle of as many snapshots as the
//! argument says (10 if there is none). `--domain` and `--name` say which simulation.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "printing is what it is for")]

use std::error::Error;
use std::time::Duration;

use sim_contract::{Client, Endpoint};

fn main() -> Result<(), Box<dyn Error>> {
    let (endpoint, arguments) = Endpoint::from_env_and_args()?;
    let count: u64 = arguments.first().map_or(Ok(10), |argument| argument.parse())?;

    // Attaching takes no place at any service: only what is used below is connected.
    let mut client = Client::attach(&endpoint).map_err(|error| error.to_string())?;
    for _ in 0..count {
        // The snapshot lies in shared memory: nothing is copied, and it stays valid until dropped.
        let Some(snapshot) = client.next_snapshot(Duration::from_secs(5))? else {
            // Nothing came. Either the simulation stands still, or its process is gone.
            if client.is_owner_alive() {
                eprintln!("{endpoint} publishes nothing: is it paused?");
                continue;
            }
            eprintln!("{endpoint} has ended");
            break;
        };
        let heights = snapshot.particles().iter().map(|particle| particle.position[1]);
        let lowest = heights.enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b));
        let (step, particles) = (snapshot.header().step, snapshot.particles().len());
        match lowest {
            Some((index, y)) => {
                println!("step {step}: {particles} particles, lowest {index} at y = {y:.3} m");
            }
            None => println!("step {step}: no particles"),
        }
    }
    Ok(())
}
