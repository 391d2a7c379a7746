//! Commands from shared memory: a rejected one changes no bit, and no sequence of them breaks the state.
#![no_main]

use fuzz::simulation::{Pair, start, state};
use libfuzzer_sys::fuzz_target;
use sim_contract::{Action, Command};
use sim_solver::Applied;

/// Most commands of an input.
const COMMANDS_MAX: usize = 24;

// The first byte selects the scene. The rest are commands of 256 bytes, and zeros to complete the last
// one. A command with a spare field of 0 is followed by a step.
fuzz_target!(|data: &[u8]| {
    let Some((first, rest)) = data.split_first() else { return };
    let (scene, mut pair) = start(*first);
    for bytes in rest.chunks(size_of::<Command>()).take(COMMANDS_MAX) {
        let command = read_command(bytes);
        let action = checked_action(&command);
        apply(&mut pair, command.client_id, &action);
        if !pair.is_cheap() {
            return;
        }
        if command.spare == 0 {
            pair.step();
        }
    }
    pair.step();
    pair.check_restored(&scene);
});

fn read_command(bytes: &[u8]) -> Command {
    let mut padded = [0; size_of::<Command>()];
    padded[..bytes.len()].copy_from_slice(bytes);
    bytemuck::pod_read_unaligned(&padded)
}

/// Decodes the action, which has an encoding with the same meaning.
fn checked_action(command: &Command) -> Action {
    let action = command.action();
    let again = Command::new(command.client_id, command.sequence, action).action();
    fuzz::assert_same(&again, &action);
    action
}

fn apply(pair: &mut Pair, client_id: u64, action: &Action) {
    let before = pair.clone();
    let applied = pair.both(|solver| solver.apply(client_id, action));
    // A control concerns the node. The pace, which is one, has its value checked by the solver.
    if applied.is_ok_and(|applied| !matches!(applied, Applied::Control(_))) {
        return;
    }
    assert!(state(&pair.fast) == state(&before.fast), "{action:?} changed the state");
    if before.is_cheap() {
        let (mut after, mut before) = (pair.fast.clone(), before.fast);
        after.step();
        before.step();
        assert!(state(&after) == state(&before), "{action:?} changed the next step");
    }
}
