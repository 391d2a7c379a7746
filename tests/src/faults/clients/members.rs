//! Actions on the members of the lockstep.

use sim_contract::NodeStatus;

use crate::faults::action::Ending;
use crate::faults::actor::Actor;
use crate::faults::world::{Member, World};
use crate::programs::Program;
use crate::wait::{Deadline, wait_for};

/// Client id of the first member. Each one has another.
const MEMBER_ID: u64 = 3000;

impl World {
    /// Starts a member, after it has ended the one in the slot.
    pub(in crate::faults) fn start_member(&mut self, slot: usize, every: u32) {
        self.end_member(slot, Ending::Interrupt);
        let mut member = self.create_member(every);
        if member.actor.wait_until_ready() {
            assert!(is_member(&self.node_status(), member.client_id), "{member:?}");
            self.members[slot] = Some(member);
        } else {
            member.actor.wait(&mut self.journal);
        }
    }

    pub(in crate::faults) fn kill_member_at_start(&mut self, every: u32, changes: u32) {
        let Member { actor, client_id } = self.create_member(every);
        actor.kill_after(changes, &self.files, &mut self.journal);
        self.check_leaving(client_id);
    }

    fn create_member(&mut self, every: u32) -> Member {
        let client_id = MEMBER_ID + self.member_count;
        self.member_count += 1;
        let args = [client_id.to_string(), every.to_string()];
        let args = args.each_ref().map(String::as_str);
        let actor = Actor::start(Program::Member, &self.sandbox, &args, self.client_ends());
        Member { actor, client_id }
    }

    /// Stops a member. A node that makes steps drops it after the stated time, and goes on.
    pub(in crate::faults) fn stop_member(&mut self, slot: usize) {
        let Some(member) = &mut self.members[slot] else { return };
        member.actor.set_stopped(true);
        let client_id = member.client_id;
        if self.node.is_none() {
            return;
        }
        let deadline = Deadline::start();
        loop {
            deadline.check("the node to drop a stopped member");
            let status = self.node_status();
            if status.is_paused() || !is_member(&status, client_id) {
                break;
            }
        }
        self.wait_for_steps(1);
    }

    /// Continues a member. If the node makes steps, the member takes part again.
    pub(in crate::faults) fn continue_member(&mut self, slot: usize) {
        let Some(member) = &mut self.members[slot] else { return };
        member.actor.set_stopped(false);
        let client_id = member.client_id;
        if self.node.is_none() {
            return;
        }
        wait_for("a continued member to join again", || {
            let status = self.node_status();
            (status.is_paused() || is_member(&status, client_id)).then_some(())
        });
        self.check_clients_follow();
    }

    /// Ends a member. The node forgets it, whatever its end was.
    pub(in crate::faults) fn end_member(&mut self, slot: usize, ending: Ending) {
        let Some(Member { actor, client_id }) = self.members[slot].take() else { return };
        actor.end(ending, &self.files, &mut self.journal);
        self.check_leaving(client_id);
    }

    fn check_leaving(&mut self, client_id: u64) {
        if self.node.is_some() {
            wait_for("the node to forget a member that has ended", || {
                (!is_member(&self.node_status(), client_id)).then_some(())
            });
        }
    }
}

fn is_member(status: &NodeStatus, client_id: u64) -> bool {
    status.members().iter().any(|member| member.client_id == client_id)
}
