//! A reader that takes as many snapshots as it may hold, never gives one back, and waits to be
//! killed: what a debugger's breakpoint makes of any reader.
#![forbid(unsafe_code)]

use std::error::Error;
use std::time::Duration;

use sim_contract::{BORROWED_SAMPLES_MAX, Client, Endpoint};

#[allow(clippy::print_stderr, reason = "messages to the test")]
fn main() -> Result<(), Box<dyn Error>> {
    let mut client = Client::attach(&Endpoint::from_env_and_args()?.0)?;
    let mut held = Vec::new();
    while held.len() < BORROWED_SAMPLES_MAX {
        held.extend(client.next_snapshot(Duration::from_millis(100))?);
        if held.len() == 1 {
            eprintln!("attached");
        }
    }
    eprintln!("ready: holding {}", held.len());
    // Never comes back: no status of step u64::MAX is ever published.
    while client.status(Duration::from_secs(1))?.is_none_or(|status| status.step < u64::MAX) {}
    Ok(())
}
