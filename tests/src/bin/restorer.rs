//! A client that reads states and gives them back to the node, again and again, until a signal:
//! `restorer CLIENT_ID state|motion`. It goes on with the next node after one has ended.
#![forbid(unsafe_code)]

use std::error::Error;
use std::time::Duration;

use sim_contract::{
    Client, Endpoint, GivenState, Outcome, ParticleState, Reason, RequestError, Tap, Update,
};
use sim_host::Stop;

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
    let (mut held, mut reading) = (None, Reading::default());
    let mut state_count = 0;
    while !stop.is_requested() {
        tap.wait(WAIT_MAX);
        let count_before = state_count;
        while reading.read(&mut tap) {
            state_count += 1;
            held = reading.complete().or(held);
        }
        held = reading.complete().or(held);
        // A paused node publishes no states of its own.
        let is_due = state_count >= STATES_PER_RESTORE || state_count == count_before;
        if let Some(held) = &held
            && is_due
        {
            state_count = 0;
            let keyframe = (!is_motion).then_some(&held.keyframe[..]);
            let Held { scene_hash, ref particles, .. } = *held;
            check(client.restore(&GivenState { scene_hash, particles, keyframe }, WAIT_MAX))?;
        }
    }
    Ok(())
}

/// The newest state and the newest keyframe.
#[derive(Default)]
struct Reading {
    state: Option<(Moment, u64, Vec<ParticleState>)>,
    keyframe: Option<(Moment, Vec<u8>)>,
}

/// A step of a run.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Moment {
    run_id: u64,
    step: u64,
}

impl Reading {
    /// Reads the next state, and the keyframes that have arrived. A paused node publishes one after its state.
    fn read(&mut self, tap: &mut Tap) -> bool {
        let keyframe = &mut self.keyframe;
        let state = tap.next_state(|update| {
            if let Update::Keyframe(header, bytes) = update {
                let moment = Moment { run_id: header.run_id, step: header.step };
                *keyframe = Some((moment, bytes.to_vec()));
            }
        });
        let Some(state) = state else { return false };
        let moment = Moment { run_id: state.header.run_id, step: state.header.step };
        let scene_hash = state.load.header.scene_hash;
        self.state = Some((moment, scene_hash, state.particles.to_vec()));
        true
    }

    /// Returns the state, if its keyframe has arrived.
    fn complete(&self) -> Option<Held> {
        let (moment, scene_hash, particles) = self.state.as_ref()?;
        let (_, keyframe) = self.keyframe.as_ref().filter(|(of, _)| of == moment)?;
        let (particles, keyframe) = (particles.clone(), keyframe.clone());
        Some(Held { scene_hash: *scene_hash, particles, keyframe })
    }
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
