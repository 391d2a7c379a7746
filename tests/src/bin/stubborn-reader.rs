//! A reader that borrows as many snapshots as it may, never returns one, and waits to be killed, like
//! a reader stopped in a debugger.
#![forbid(unsafe_code)]

use std::error::Error;
use std::time::Duration;

use sim_contract::{BORROWED_SAMPLES_MAX, Client, Endpoint};

#[allow(clippy::print_stderr, reason = "messages to the test")]
fn main() -> Result<(), Box<dyn Error>> {
    let mut client = Client::attach(&Endpoint::from_env_and_args()?.0)?;
    let mut borrowed = Vec::new();
    while borrowed.len() < BORROWED_SAMPLES_MAX {
        borrowed.extend(client.next_snapshot(Duration::from_millis(100))?);
        if borrowed.len() == 1 {
            eprintln!("attached");
        }
    }
    eprintln!("ready: borrowed {}", borrowed.len());
    // Loops forever: no status has step u64::MAX.
    while client.status(Duration::from_secs(1))?.is_none_or(|status| status.step < u64::MAX) {}
    Ok(())
}
