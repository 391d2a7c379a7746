//! Actions on the node.

use crate::faults::action::Ending;
use crate::faults::actor::{Actor, Ends};
use crate::faults::world::World;
use crate::programs::Program;
use crate::wait::{Deadline, wait_for};

const NODE_ENDS: Ends = Ends { codes: &[0], errors: &[], needs_no_signal: false };
/// Ends of a node whose name another one has.
const REFUSED: Ends =
    Ends { codes: &[], errors: &["is already running, as process"], needs_no_signal: true };

impl World {
    /// Starts a node. One that runs already keeps the name; after any kill, the name is free.
    pub(super) fn start_node(&mut self, args: &str) {
        let words: Vec<_> = args.split(' ').collect();
        if self.node.is_some() {
            self.run(Program::SimNode, &words, REFUSED);
            return;
        }
        let mut node = Actor::start(Program::SimNode, &self.sandbox, &words, NODE_ENDS);
        if !node.wait_until_ready() {
            node.wait(&mut self.journal);
            return;
        }
        self.load_count += 1;
        self.node = Some(node);
        self.check_clients_follow();
    }

    /// Kills a node during its start. If another one runs, the new one may be refused before.
    pub(super) fn kill_node_at_start(&mut self, args: &str, changes: u32) {
        let words: Vec<_> = args.split(' ').collect();
        let ends = if self.node.is_some() { REFUSED } else { NODE_ENDS };
        let node = Actor::start(Program::SimNode, &self.sandbox, &words, ends);
        node.kill_after(changes, &self.files, &mut self.journal);
    }

    /// Ends the node. Recorders that are not stopped notice it and end.
    pub(super) fn end_node(&mut self, ending: Ending) {
        let Some(node) = self.node.take() else { return };
        node.end(ending, &self.files, &mut self.journal);
        self.load_count += 1;
        for recorder in self.recorders.iter_mut().flatten() {
            if !recorder.actor.is_stopped() {
                wait_for("the end of a recorder without a node", || {
                    (!recorder.actor.is_running()).then_some(())
                });
            }
        }
    }

    /// Removes the files of a node, as a cleaner of `/tmp` does. The node reports it, and keeps its name.
    /// Then all programs have to end, because they cannot see each other.
    ///
    /// The shared memory of a program that was killed before, or is killed now, would stay: only the removed
    /// files name it. So a new node removes it first.
    pub(super) fn clean(&mut self, args: &str) {
        self.end_clients();
        self.end_node(Ending::Interrupt);
        self.start_node(args);
        let root = self.sandbox.root();
        self.files.clean_root();
        let node = self.node.as_mut().expect("a node that has just started");
        let warning = node.wait_for_line(&format!("warning: {}", root.display()));
        assert!(warning.contains("is gone, perhaps removed by a cleaner of /tmp"), "{warning}");
        self.run(Program::SimNode, &["run", "curtain"], REFUSED);
        self.end_all();
    }

    /// Ends all programs, without a kill where that is possible, and checks their recordings.
    pub(super) fn end_all(&mut self) {
        for slot in 0..self.recorders.len() {
            self.end_recorder(slot, Ending::Interrupt);
        }
        self.end_clients();
        // After the members, because a client asks the node whether it has forgotten them.
        self.clients = Default::default();
        self.end_bridge(Ending::Interrupt);
        self.end_node(Ending::Interrupt);
    }

    /// Ends the programs that stay connected from node to node.
    fn end_clients(&mut self) {
        while !self.readers.is_empty() {
            self.kill_stubborn_reader();
        }
        for slot in 0..self.members.len() {
            self.end_member(slot, Ending::Interrupt);
        }
        while !self.followers.is_empty() {
            self.end_follower(Ending::Interrupt);
        }
        while !self.restorers.is_empty() {
            self.end_restorer(Ending::Interrupt);
        }
    }

    /// Starts a node of each name and ends it, until nothing is left in the domain. Half-created nodes of iceoryx2 are
    /// left until they are old enough that their process cannot be about to finish them.
    pub(super) fn check_remains(&mut self) {
        self.end_all();
        let deadline = Deadline::start();
        loop {
            for args in ["run curtain", "run curtain --name played"] {
                self.start_node(args);
                self.end_node(Ending::Interrupt);
            }
            let remains = self.files.list_remains();
            if remains.is_empty() {
                return;
            }
            deadline.check(&format!("a domain without {remains:#?}"));
        }
    }
}
