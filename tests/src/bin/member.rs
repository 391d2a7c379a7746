//! A member of the lockstep: `member CLIENT_ID EVERY`. It grabs a particle and moves it in its turns, goes
//! on with the next node after one has ended, and leaves the lockstep at SIGINT.
//!
//! It prints `run RUN_ID` for every run, and fails if a turn is not its own.
#![forbid(unsafe_code)]
#![allow(clippy::print_stderr, reason = "messages to the test")]

use std::error::Error;
use std::num::NonZeroU32;
use std::time::Duration;

use integration_tests::DEADLINE;
use sim_contract::{Action, Client, Endpoint, RequestError, SnapshotHeader};
use sim_host::Stop;

/// Longest wait for a turn before the next check for a signal.
const WAIT_MAX: Duration = Duration::from_millis(50);
const OVER_S: f32 = 0.05;

fn main() -> Result<(), Box<dyn Error>> {
    let stop = Stop::install()?;
    let (endpoint, arguments) = Endpoint::from_env_and_args()?;
    let [client_id, every] = &arguments[..] else { return Err("needs CLIENT_ID EVERY".into()) };
    let (client_id, every): (u64, NonZeroU32) = (client_id.parse()?, every.parse()?);
    let mut client = match Client::attach_as(&endpoint, client_id) {
        Ok(client) => client,
        Err(error) => return Err(error.to_string().into()),
    };
    client.join_lockstep_every(every, DEADLINE)?;
    eprintln!("ready");
    let mut last: Option<SnapshotHeader> = None;
    while !stop.is_requested() {
        let Some(snapshot) = client.next_turn(WAIT_MAX)? else { continue };
        let header = *snapshot.header();
        drop(snapshot);
        check_turn(last.as_ref(), &header, every)?;
        if last.is_none_or(|last| last.run_id != header.run_id) {
            eprintln!("run {}", header.run_id);
        }
        last = Some(header);
        send(&mut client, &header)?;
        client.ready()?;
        while client.next_outcome(Duration::ZERO)?.is_some() {}
    }
    Ok(())
}

/// Fails unless the turn is one of this member, and the first one of its step.
fn check_turn(
    last: Option<&SnapshotHeader>,
    now: &SnapshotHeader,
    every: NonZeroU32,
) -> Result<(), String> {
    let is_own = now.step.is_multiple_of(u64::from(every.get()));
    let is_later = last.is_none_or(|last| last.run_id != now.run_id || last.step < now.step);
    let step = now.step;
    (is_own && is_later).then_some(()).ok_or(format!("a turn at step {step} after {last:?}"))
}

/// Sends a command for the next step. A node that has ended, or does not receive, is no fault of a member.
fn send(client: &mut Client, header: &SnapshotHeader) -> Result<(), RequestError> {
    let share = (header.step % 100) as f32 / 100.0;
    let (particle, target) = (30, [share, 0.2, 0.3]);
    let action = if header.step.is_multiple_of(20) {
        Action::Grab { particle, target, over_s: OVER_S }
    } else {
        Action::Move { particle, target, over_s: OVER_S }
    };
    match client.send(action) {
        Ok(_) | Err(RequestError::NoReceiver { .. } | RequestError::QueueFull { .. }) => Ok(()),
        Err(error) => Err(error),
    }
}
