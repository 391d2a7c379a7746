//! The schedule: a sequence of random actions that depends on the seed alone, and never on the programs.

use fastrand::Rng;

use crate::faults::action::{Action, CLIENTS, Ending, MEMBERS, RECORDERS, Visit};
use crate::faults::lines::{COMMANDS, CTL_LINES, FLOODS, fill};

/// Scenes of a node. The last one has another rate and 20 times as many particles.
const SCENES: [&str; 4] = ["curtain", "spider-web", "rope-bridge", "tearable-cloth"];

/// Most changes of the files of the domain that a kill waits for. A start of a node makes about 60.
const CHANGES_MAX: u32 = 70;

/// Creates an action with random parameters.
type Create = fn(&mut Rng) -> Action;

/// The actions with their weights.
const ACTIONS: &[(u32, Create)] = &[
    (13, |rng| Action::StartNode { args: node_args(rng) }),
    (3, |rng| Action::KillNodeAtStart { args: node_args(rng), changes: changes(rng) }),
    (4, |rng| Action::EndNode(ending(rng))),
    (2, |rng| Action::KillNodeInLoad { scene: scene(rng), changes: rng.u32(0..20) }),
    (13, |rng| Action::StartRecorder { slot: rng.usize(..RECORDERS), args: recorder_args(rng) }),
    (2, |rng| Action::KillRecorderAtStart { changes: changes(rng) }),
    (7, |rng| Action::EndRecorder { slot: rng.usize(..RECORDERS), ending: ending(rng) }),
    (3, |rng| Action::StopRecorder { slot: rng.usize(..RECORDERS) }),
    (4, |rng| Action::ContinueRecorder { slot: rng.usize(..RECORDERS) }),
    (1, |rng| Action::LimitFileSize {
        slot: rng.usize(..RECORDERS),
        size_bytes: rng.u64(0..4_000_000),
    }),
    (4, |_| Action::StartBridge),
    (2, |rng| Action::EndBridge(ending(rng))),
    (4, |rng| Action::Visit(visit(rng))),
    (16, |rng| Action::Ctl { line: fill(rng, CTL_LINES) }),
    (2, |rng| Action::KillCtl { line: fill(rng, CTL_LINES), changes: changes(rng) }),
    (16, |rng| Action::Request { client: rng.usize(..CLIENTS), command: fill(rng, COMMANDS) }),
    (2, |rng| Action::Flood { clients: 1, count: rng.usize(..3000), command: fill(rng, FLOODS) }),
    (2, |rng| Action::Flood {
        clients: rng.usize(2..16),
        count: rng.usize(..128),
        command: fill(rng, FLOODS),
    }),
    (8, |rng| Action::Wait { steps: rng.u64(..500) }),
    (2, |rng| Action::KillGrabber { particle: rng.u32(..50), changes: changes(rng) }),
    (2, |_| Action::StartStubbornReader),
    (1, |_| Action::StopStubbornReader),
    (1, |_| Action::ContinueStubbornReader),
    (2, |_| Action::KillStubbornReader),
    (4, |_| Action::StartFollower),
    (1, |_| Action::StopFollower),
    (1, |_| Action::ContinueFollower),
    (2, |rng| Action::EndFollower(ending(rng))),
    (8, |rng| Action::StartMember { slot: rng.usize(..MEMBERS), every: every(rng) }),
    (2, |rng| Action::KillMemberAtStart { every: every(rng), changes: changes(rng) }),
    (3, |rng| Action::StopMember { slot: rng.usize(..MEMBERS) }),
    (3, |rng| Action::ContinueMember { slot: rng.usize(..MEMBERS) }),
    (5, |rng| Action::EndMember { slot: rng.usize(..MEMBERS), ending: ending(rng) }),
    (4, |rng| Action::KillRestorer { contents: contents(rng), changes: changes(rng) }),
    (2, |rng| Action::StopRestorer { contents: contents(rng), changes: changes(rng) }),
    (2, |rng| Action::EndRestorer(ending(rng))),
    (5, |rng| Action::Restore {
        time_ms: rng.u32(..3000),
        changes: rng.bool().then(|| changes(rng)),
    }),
    (2, |rng| Action::WriteNoise { steps: rng.u64(..200), ending: ending(rng) }),
    (1, |rng| Action::Clean { args: node_args(rng) }),
    (2, |rng| Action::Play { ending: ending(rng), changes: changes(rng) }),
    (2, |rng| Action::Simulate {
        steps: rng.u32(..500),
        changes: rng.bool().then(|| rng.u32(..8)),
    }),
];

/// Yields the actions of a seed, without end.
pub(super) fn actions(seed: u64) -> impl Iterator<Item = Action> {
    let mut rng = Rng::with_seed(seed);
    std::iter::repeat_with(move || {
        let sum: u32 = ACTIONS.iter().map(|(weight, _)| weight).sum();
        let mut at = rng.u32(..sum);
        let chosen = ACTIONS.iter().find(|(weight, _)| {
            let is_here = at < *weight;
            at = at.saturating_sub(*weight);
            is_here
        });
        let (_, create) = chosen.expect("a number below the sum of the weights");
        create(&mut rng)
    })
}

fn node_args(rng: &mut Rng) -> String {
    let mut args = format!("run {} --threads {}", scene(rng), rng.u32(1..=3));
    if rng.bool() {
        args += &format!(" --every {}", rng.u32(2..=10));
    }
    // Without a rate of its own, a node begins a new run with a scene of another rate.
    args += rng.choice(["", "", " --rate 240", " --rate 1000"]).unwrap_or_default();
    args += rng.choice(["", "", "", " --paused"]).unwrap_or_default();
    args += rng.choice(["", "", " --history 1MiB", " --history 0"]).unwrap_or_default();
    // Short, because each stopped member costs this time.
    args +=
        rng.choice([" --lockstep-timeout 100ms", " --lockstep-timeout 500ms"]).unwrap_or_default();
    args
}

fn recorder_args(rng: &mut Rng) -> String {
    let compression = rng.choice(["zstd", "lz4", "none"]).unwrap_or_default();
    let queue_bytes = rng.choice([1 << 20, 1 << 28]).unwrap_or_default();
    let limit = rng.choice(["", "", "", " --steps 100"]).unwrap_or_default();
    format!("--compression {compression} --queue-bytes {queue_bytes}{limit}")
}

fn scene(rng: &mut Rng) -> &'static str {
    rng.choice(SCENES).unwrap_or_default()
}

/// Contents of a state that a client gives.
fn contents(rng: &mut Rng) -> &'static str {
    if rng.bool() { "state" } else { "motion" }
}

/// Steps from one turn of a member to its next.
fn every(rng: &mut Rng) -> u32 {
    if rng.bool() { 1 } else { rng.u32(2..=8) }
}

fn changes(rng: &mut Rng) -> u32 {
    rng.u32(..CHANGES_MAX)
}

fn ending(rng: &mut Rng) -> Ending {
    match rng.u32(..10) {
        0..3 => Ending::Kill,
        3..5 => Ending::Interrupt,
        5 => Ending::Terminate,
        6 => Ending::HangUp,
        7 => Ending::InterruptTwice,
        _ => Ending::InterruptThenKill(rng.u32(..30)),
    }
}

fn visit(rng: &mut Rng) -> Visit {
    let visits = [
        Visit::Silent,
        Visit::HalfRequest,
        Visit::Download,
        Visit::Page,
        Visit::GrabbingPage,
        Visit::Nonsense,
    ];
    visits[rng.usize(..visits.len())]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_repeats_its_schedule() {
        let describe = |seed| {
            let lines: Vec<_> = actions(seed).take(500).map(|one| format!("{one:?}")).collect();
            lines
        };
        assert_eq!(describe(7), describe(7));
        assert_ne!(describe(7), describe(8));
    }

    #[test]
    fn every_action_occurs() {
        let names = |actions: &mut dyn Iterator<Item = Action>| {
            let mut names: Vec<_> = actions.map(|action| std::mem::discriminant(&action)).collect();
            names.sort_by_key(|name| format!("{name:?}"));
            names.dedup();
            names.len()
        };
        // Two rows of the table are floods.
        assert_eq!(names(&mut actions(1).take(5000)), ACTIONS.len() - 1);
    }
}
