//! Sending of commands, and their outcomes.

use std::mem::MaybeUninit;
use std::time::Duration;

use sim_contract::{Action, Client, Command, GivenState, Outcome, ParticleState};

use crate::attached::{ClientHandle, with_client};
use crate::outcome::{CatenaryResult, Failure};
use crate::pointers::{array, check_place, timeout, write};

/// Longest wait for the number of elements of the scene, which a node has published with its load.
const REMEDY_TIMEOUT: Duration = Duration::from_millis(100);

/// A complete state for `catenary_restore`, or the motion of its particles.
#[derive(Debug)]
#[repr(C)]
pub struct StateToRestore {
    /// `scene_hash` of the load header of the scene that the state belongs to.
    pub scene_hash: u64,
    /// All particles of the scene.
    pub particles: *const ParticleState,
    /// Number of particles.
    pub particle_count: usize,
    /// The bytes of the keyframe of the same step. Null for positions and velocities only.
    pub keyframe: *const u8,
    /// Number of bytes.
    pub keyframe_size_bytes: usize,
}

/// Sends a command and waits for its outcome, applied or rejected. `*outcome` is written in both cases;
/// it may be null.
///
/// `CATENARY_OK` means that the command took effect, at `outcome->step`. A member of the lockstep sends
/// commands of its turn with `catenary_send`, because the outcome comes only after the turn.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_request(
    client: *mut ClientHandle,
    command: Command,
    timeout_s: f64,
    outcome: Option<&mut MaybeUninit<Outcome>>,
) -> CatenaryResult {
    with_client(client, |attached| {
        let action = action(&command)?;
        let answer = attached.client.request(action, timeout(timeout_s)?)?;
        report(&mut attached.client, &answer, outcome)
    })
}

/// Sends a command without waiting. Only the outcome proves that it took effect; see
/// `catenary_next_outcome`. `*sequence`, if it is not null, is the number in `outcome.command.sequence`.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_send(
    client: *mut ClientHandle,
    command: Command,
    sequence: Option<&mut MaybeUninit<u64>>,
) -> CatenaryResult {
    with_client(client, |attached| {
        let sent = attached.client.send(action(&command)?)?;
        sequence.map_or(Ok(()), |place| write(Some(place), sent, "sequence"))
    })
}

/// Reads the next outcome of this client's commands, applied or rejected (`outcome->status`), in the order
/// of application. Those that `catenary_request` has returned are left out. A client reads it often
/// enough: the library keeps the last 2048.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_next_outcome(
    client: *mut ClientHandle,
    timeout_s: f64,
    outcome: Option<&mut MaybeUninit<Outcome>>,
) -> CatenaryResult {
    with_client(client, |attached| {
        check_place(outcome.as_deref(), "outcome")?;
        let timeout = timeout(timeout_s)?;
        let next = attached.client.next_outcome(timeout)?;
        write(outcome, next.ok_or_else(|| attached.nothing(timeout))?, "outcome")
    })
}

/// Gives a state to the node, which puts it in place at the next boundary, and waits for the outcome as
/// `catenary_request` does. The node rejects a state that is damaged or belongs to another scene.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_restore(
    client: *mut ClientHandle,
    state: Option<&StateToRestore>,
    timeout_s: f64,
    outcome: Option<&mut MaybeUninit<Outcome>>,
) -> CatenaryResult {
    with_client(client, |attached| {
        let state = state.ok_or_else(|| Failure::misuse("state is null"))?;
        let keyframe = array(state.keyframe, state.keyframe_size_bytes, "keyframe")?;
        let given = GivenState {
            scene_hash: state.scene_hash,
            particles: array(state.particles, state.particle_count, "particles")?,
            keyframe: (!state.keyframe.is_null()).then_some(keyframe),
        };
        let answer = attached.client.restore(&given, timeout(timeout_s)?)?;
        report(&mut attached.client, &answer, outcome)
    })
}

fn action(command: &Command) -> Result<Action, Failure> {
    if command.kind == 0 {
        return Err(Failure::misuse(
            "the command is empty: a pointer was null, or a text was not UTF-8 or longer than 160 bytes",
        ));
    }
    Ok(command.action())
}

fn report(
    client: &mut Client,
    answer: &Outcome,
    place: Option<&mut MaybeUninit<Outcome>>,
) -> Result<(), Failure> {
    if let Some(place) = place {
        place.write(*answer);
    }
    if answer.is_applied() {
        return Ok(());
    }
    let explanation = answer.reason().map(|reason| format!(": {reason}")).unwrap_or_default();
    let remedy = client.remedy(answer, REMEDY_TIMEOUT);
    let remedy = remedy.map(|remedy| format!(" ({remedy})")).unwrap_or_default();
    let (step, name) = (answer.step, answer.reason_name());
    let text = format!("rejected at step {step}: {name}{explanation}{remedy}");
    Err(Failure::new(CatenaryResult::Rejected, text))
}
