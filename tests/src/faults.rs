//! Random faults: starts, kills, stops and floods the programs, and checks after each action that no
//! recording is damaged, no loss is undeclared, no program hangs and no name stays taken.

mod action;
mod actor;
mod clients;
mod commands;
mod domain_files;
mod journal;
mod kept_files;
mod lines;
mod node;
mod recorders;
mod recording;
mod schedule;
mod visitors;
mod world;

use action::Action;
use world::World;

/// Numbers of a run without a fault.
#[derive(Debug, Clone, Copy)]
pub struct Summary {
    /// Number of actions.
    pub actions: usize,
    /// Number of recordings that were read and verified.
    pub recordings: u32,
    /// Number of those that lack snapshots, and declare it.
    pub lossy: u32,
    /// Number of those without an end, because their recorder was killed or its disk was full.
    pub unfinished: u32,
    /// Number of snapshots in all.
    pub snapshots: u64,
}

/// Performs the first `count` actions of a seed. Before each, calls `goes_on` with its number and its
/// description, and ends early if it returns `false`.
///
/// # Panics
/// At the first fault, with the seed, the last actions and the output of the programs.
pub fn run(seed: u64, count: usize, mut goes_on: impl FnMut(usize, &str) -> bool) -> Summary {
    let mut world = World::new(seed);
    let mut actions = 0;
    for action in schedule::actions(seed).take(count) {
        let description = format!("{action:?}");
        if !goes_on(actions + 1, &description) {
            break;
        }
        actions += 1;
        world.journal.begin_action(&description);
        world.perform(action);
        world.check_lasting_programs();
    }
    world.check_remains();
    Summary {
        actions,
        recordings: world.kept.checked_count,
        lossy: world.kept.lossy_count,
        unfinished: world.kept.unfinished_count,
        snapshots: world.kept.snapshot_count,
    }
}

impl World {
    fn perform(&mut self, action: Action) {
        match action {
            Action::StartNode { args } => self.start_node(&args),
            Action::KillNodeAtStart { args, changes } => self.kill_node_at_start(&args, changes),
            Action::EndNode(ending) => self.end_node(ending),
            Action::KillNodeInLoad { scene, changes } => self.kill_node_in_load(scene, changes),
            Action::StartRecorder { slot, args } => self.start_recorder(slot, &args),
            Action::KillRecorderAtStart { changes } => self.kill_recorder_at_start(changes),
            Action::EndRecorder { slot, ending } => self.end_recorder(slot, ending),
            Action::StopRecorder { slot } => self.set_recorder_stopped(slot, true),
            Action::ContinueRecorder { slot } => self.set_recorder_stopped(slot, false),
            Action::LimitFileSize { slot, size_bytes } => self.limit_file_size(slot, size_bytes),
            Action::StartBridge => self.start_bridge(),
            Action::EndBridge(ending) => self.end_bridge(ending),
            Action::Visit(visit) => self.visit(visit),
            Action::Ctl { line } => self.ctl(&line),
            Action::KillCtl { line, changes } => self.kill_ctl(&line, changes),
            Action::Request { client, command } => self.request(client, &command),
            Action::Flood { clients, count, command } => self.flood(clients, count, &command),
            Action::Wait { steps } => self.wait_for_steps(steps),
            Action::KillGrabber { particle, changes } => self.kill_grabber(particle, changes),
            Action::StartStubbornReader => self.start_stubborn_reader(),
            Action::StopStubbornReader => self.set_stubborn_reader_stopped(true),
            Action::ContinueStubbornReader => self.set_stubborn_reader_stopped(false),
            Action::KillStubbornReader => self.kill_stubborn_reader(),
            Action::StartFollower => self.start_follower(),
            Action::StopFollower => self.set_follower_stopped(true),
            Action::ContinueFollower => self.set_follower_stopped(false),
            Action::EndFollower(ending) => self.end_follower(ending),
            Action::StartMember { slot, every } => self.start_member(slot, every),
            Action::KillMemberAtStart { every, changes } => {
                self.kill_member_at_start(every, changes);
            }
            Action::StopMember { slot } => self.stop_member(slot),
            Action::ContinueMember { slot } => self.continue_member(slot),
            Action::EndMember { slot, ending } => self.end_member(slot, ending),
            Action::KillRestorer { contents, changes } => self.kill_restorer(contents, changes),
            Action::StopRestorer { contents, changes } => self.stop_restorer(contents, changes),
            Action::EndRestorer(ending) => self.end_restorer(ending),
            Action::Restore { time_ms, changes } => self.restore(time_ms, changes),
            Action::WriteNoise { steps, ending } => self.write_noise(steps, ending),
            Action::Clean { args } => self.clean(&args),
            Action::Play { ending, changes } => self.play(ending, changes),
            Action::Simulate { steps, changes } => self.simulate(steps, changes),
        }
    }
}
