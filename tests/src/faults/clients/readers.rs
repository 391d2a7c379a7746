//! Actions on readers of snapshots: those that never return them, and those that go on from node to node.

use crate::faults::action::Ending;
use crate::faults::actor::{Actor, Ends};
use crate::faults::world::World;
use crate::programs::Program;

/// Most readers of each kind at the same time.
const READERS_MAX: usize = 2;

const READER_ENDS: Ends = Ends { codes: &[], errors: &["NoNode"], needs_no_signal: false };

impl World {
    /// Starts a reader that borrows samples and never returns them.
    pub(in crate::faults) fn start_stubborn_reader(&mut self) {
        if self.node.is_some() && self.readers.len() < READERS_MAX {
            let reader = Actor::start(Program::StubbornReader, &self.sandbox, &[], READER_ENDS);
            self.readers.push(reader);
        }
    }

    /// Stops or continues all of them.
    pub(in crate::faults) fn set_stubborn_reader_stopped(&mut self, is_stopped: bool) {
        for reader in &mut self.readers {
            reader.set_stopped(is_stopped);
        }
    }

    /// Kills the oldest of them.
    pub(in crate::faults) fn kill_stubborn_reader(&mut self) {
        if !self.readers.is_empty() {
            self.readers.remove(0).end(Ending::Kill, &self.files, &mut self.journal);
        }
    }

    /// Starts a reader that goes on from node to node.
    pub(in crate::faults) fn start_follower(&mut self) {
        if self.followers.len() == READERS_MAX {
            return;
        }
        let ends = self.client_ends();
        let mut follower = Actor::start(Program::Follower, &self.sandbox, &[], ends);
        if follower.wait_until_ready() {
            self.followers.push(follower);
            self.check_clients_follow();
        } else {
            follower.wait(&mut self.journal);
        }
    }

    /// Stops or continues the oldest of them.
    pub(in crate::faults) fn set_follower_stopped(&mut self, is_stopped: bool) {
        if let Some(follower) = self.followers.first_mut() {
            follower.set_stopped(is_stopped);
            self.check_clients_follow();
        }
    }

    /// Ends the oldest of them.
    pub(in crate::faults) fn end_follower(&mut self, ending: Ending) {
        if !self.followers.is_empty() {
            self.followers.remove(0).end(ending, &self.files, &mut self.journal);
        }
    }
}
