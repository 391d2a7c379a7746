//! A client that reads states and gives them back to the node, again and again, until a signal:
//! `restorer CLIENT_ID state|motion`. It goes on with the next node after one has ended.
#![forbid(unsafe_code)]

use std::error::Error;
use std::time::Duration;

use sim_contract::{
    Change, Client, Endpoint, GivenState, Outcome, ParticleState, Reason, RequestError, State,
    Stop, Tap,
};

/// Longest wait for a message or an outcome before the next check for a signal.
const WAIT_MAX: Duration = Duration::from_millis(50);
/// Number of states from one restore to the next: a node that gets them without a pause makes few steps of
/// its own.
const STATES_PER_RESTORE: u32 = 10;

/// A state that was read.
struct Held {
    scene_hash: u64,
    particles: Vec<ParticleState>,
    keyframe: Vec<u8>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let stop = Stop::install()?;
    let (endpoint, arguments) = Endpoint::from_env_and_args()?;
    let [client_id, contents] = &arguments[..] else {
        return Err("needs CLIENT_ID CONTENTS".into());
    };
    let is_motion = contents == "motion";
    let attach = || -> Result<_, Box<dyn Error>> {
        let tap = Tap::attach(&endpoint).map_err(|error| error.to_string())?;
        let client = Client::attach_as(&endpoint, client_id.parse()?);
        Ok((tap, client.map_err(|error| error.to_string())?))
    };
    let (mut tap, mut client) = attach()?;
    let mut held: Option<Held> = None;
    let mut state_count = 0;
    while !stop.is_requested() {
        tap.wait(WAIT_MAX);
        while let Some(state) = tap.next_state(|_| {}) {
            state_count += 1;
            held = complete(&state).or(held);
        }
        if let Some(held) = &held
            && state_count >= STATES_PER_RESTORE
        {
            state_count = 0;
            let keyframe = (!is_motion).then_some(&held.keyframe[..]);
            let Held { scene_hash, ref particles, .. } = *held;
            check(client.restore(&GivenState { scene_hash, particles, keyframe }, WAIT_MAX))?;
        }
    }
    Ok(())
}

/// Returns a state that has arrived with its keyframe.
fn complete(state: &State<'_>) -> Option<Held> {
    let keyframe = state.changes.iter().find_map(|change| match change {
        Change::Keyframe(header, bytes) if header.step == state.header.step => Some(bytes.clone()),
        _ => None,
    })?;
    let scene_hash = state.load.header.scene_hash;
    Some(Held { scene_hash, particles: state.particles.to_vec(), keyframe })
}

/// Fails unless the state was put in place, or could not be: the node may have ended, be busy, or have loaded
/// another scene meanwhile.
fn check(result: Result<Outcome, RequestError>) -> Result<(), String> {
    match result {
        Ok(outcome) if outcome.is_applied() || outcome.reason() == Some(Reason::InvalidState) => {
            Ok(())
        }
        Err(
            RequestError::Timeout { .. }
            | RequestError::NoReceiver { .. }
            | RequestError::OutcomesMissed { .. },
        ) => Ok(()),
        Ok(outcome) => Err(format!("{outcome:?}")),
        Err(error) => Err(error.to_string()),
    }
}
