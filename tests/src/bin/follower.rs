//! A reader of snapshots that holds a few of them, goes on with the next node after one has ended, and ends
//! at SIGINT. It prints `run RUN_ID` for every run, and fails if the steps of a run do not ascend.
#![forbid(unsafe_code)]
#![allow(clippy::print_stderr, reason = "messages to the test")]

use std::collections::VecDeque;
use std::error::Error;
use std::time::Duration;

use sim_contract::{BORROWED_SAMPLES_MAX, Client, Endpoint};
use sim_host::Stop;

/// Longest wait for a snapshot before the next check for a signal.
const WAIT_MAX: Duration = Duration::from_millis(50);

fn main() -> Result<(), Box<dyn Error>> {
    let stop = Stop::install()?;
    let mut client = match Client::attach(&Endpoint::from_env_and_args()?.0) {
        Ok(client) => client,
        Err(error) => return Err(error.to_string().into()),
    };
    eprintln!("ready");
    let mut held = VecDeque::new();
    let mut last = None;
    while !stop.is_requested() {
        let Some(snapshot) = client.next_snapshot(WAIT_MAX)? else { continue };
        let (run_id, step) = (snapshot.header().run_id, snapshot.header().step);
        match last {
            Some((last_run, last_step)) if last_run == run_id => {
                if step <= last_step {
                    return Err(format!("step {step} after {last_step}").into());
                }
            }
            _ => eprintln!("run {run_id}"),
        }
        last = Some((run_id, step));
        held.push_back(snapshot);
        // One more could not be received.
        if held.len() == BORROWED_SAMPLES_MAX {
            held.pop_front();
        }
    }
    Ok(())
}
