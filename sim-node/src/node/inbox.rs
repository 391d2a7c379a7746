//! Order in which the commands of several clients are applied.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use sim_contract::{
    Action, COMMANDS_PER_STEP_MAX, MalformedState, RESTORES_MAX, ReceivedCommand, ReceivedState,
};

/// A state that a client has given.
pub(super) type Given = Result<ReceivedState, MalformedState>;

/// A command that waits, with the state that a restore puts in place.
#[derive(Debug, Clone)]
pub(super) struct Request {
    pub(super) received: ReceivedCommand,
    pub(super) state: Option<Rc<Given>>,
    /// Number of requests that arrived before.
    arrived_before: u64,
}

/// Commands that wait to be applied.
///
/// A turn is the commands of one poll. They are taken in rounds: one of each client by ascending id,
/// in the client's sequence. A turn continues the round of the turn before, so that a client with many
/// commands cannot starve another. A client whose commands arrive during a round waits for the next
/// one, so that a process with ever new client ids cannot either.
#[derive(Debug, Default)]
pub(super) struct Inbox {
    /// By client.
    queues: BTreeMap<u64, ClientQueue>,
    /// Clients that are still to be served in this round. Each has a command.
    round: BTreeSet<u64>,
    /// Number of commands that wait.
    waiting_count: usize,
    /// Number of commands that have arrived.
    arrived_count: u64,
    /// Number of states that wait. They can be large.
    state_count: usize,
    /// Clients whose commands wait for the end of a job.
    held: BTreeSet<u64>,
}

/// The commands of a client, by sequence, and by order of arrival for equal sequences.
type ClientQueue = BTreeMap<(u64, u64), Request>;

/// Number of commands from which on the inbox accepts no more. The rest waits in shared memory, where
/// each connection has a bounded queue.
const INBOX_MAX: usize = 16 * COMMANDS_PER_STEP_MAX;
/// Number of commands of held clients from which on the inbox accepts no more from anybody. Below it, a
/// held client that goes on sending keeps nobody else out.
const HELD_MAX: usize = 4 * INBOX_MAX;

impl Inbox {
    /// Returns `true` if the inbox accepts more commands.
    pub(super) fn has_room(&self) -> bool {
        let of_held = self.held.iter().filter_map(|client_id| self.queues.get(client_id));
        let held_count: usize = of_held.map(BTreeMap::len).sum();
        self.waiting_count - held_count < INBOX_MAX && held_count < HELD_MAX
    }

    /// Returns `true` if the inbox accepts more states.
    pub(super) fn has_room_for_states(&self) -> bool {
        self.state_count < RESTORES_MAX
    }

    /// Adds commands in their order of arrival.
    pub(super) fn add(&mut self, commands: impl IntoIterator<Item = ReceivedCommand>) {
        for received in commands {
            self.add_request(&received, None);
        }
    }

    /// Adds states in their order of arrival.
    pub(super) fn add_states(
        &mut self,
        states: impl IntoIterator<Item = (ReceivedCommand, Given)>,
    ) {
        for (received, state) in states {
            self.add_request(&received, Some(Rc::new(state)));
        }
    }

    fn add_request(&mut self, received: &ReceivedCommand, state: Option<Rc<Given>>) {
        let arrived_before = self.arrived_count;
        self.arrived_count += 1;
        self.put_back(Request { received: *received, state, arrived_before });
    }

    /// Puts a request back to its place among those of its client.
    pub(super) fn put_back(&mut self, request: Request) {
        let command = &request.received.command;
        let queue = self.queues.entry(command.client_id).or_default();
        self.waiting_count += 1;
        self.state_count += usize::from(request.state.is_some());
        queue.insert((command.sequence, request.arrived_before), request);
    }

    /// Removes the commands of one turn, at most `count_max`, in the order of application. `first` come
    /// before all others. A turn ends with the first load, because a load takes long, and with a
    /// command that puts a state in place, because the next step shows this state without further
    /// changes.
    pub(super) fn next_turn(&mut self, count_max: usize, first: Vec<Request>) -> Vec<Request> {
        let ends_turn = |request: &Request| {
            let action = request.received.command.action();
            matches!(action, Action::Load { .. } | Action::Rewind { .. } | Action::Restore { .. })
        };
        let mut turn = first;
        while turn.len() < count_max
            && !turn.last().is_some_and(ends_turn)
            && let Some(request) = self.next()
        {
            turn.push(request);
        }
        turn
    }

    /// Removes the next command of a client, and while all are settings the ones after it, at most
    /// `count_max`.
    pub(super) fn next_settings(&mut self, client_id: u64, count_max: usize) -> Vec<Request> {
        let is_setting =
            |request: &Request| matches!(request.received.command.action(), Action::Set { .. });
        let mut settings = Vec::new();
        while settings.len() < count_max
            && settings.iter().all(is_setting)
            && (settings.is_empty() || self.first(client_id).is_some_and(is_setting))
            && let Some(request) = self.remove_first(client_id)
        {
            settings.push(request);
        }
        settings
    }

    fn first(&self, client_id: u64) -> Option<&Request> {
        self.queues.get(&client_id)?.values().next()
    }

    /// Keeps the further commands of a client until [`Self::release`].
    pub(super) fn hold(&mut self, client_id: u64) {
        self.held.insert(client_id);
    }

    /// Releases the commands of all clients.
    pub(super) fn release(&mut self) {
        self.held.clear();
    }

    /// Returns `true` if the commands of a client wait for [`Self::release`].
    pub(super) fn is_held(&self, client_id: u64) -> bool {
        self.held.contains(&client_id)
    }

    /// Removes the first command of the next client that is not held.
    fn next(&mut self) -> Option<Request> {
        // At most the rest of a round and a whole one.
        for _ in 0..2 {
            while let Some(client_id) = self.round.pop_first() {
                if !self.is_held(client_id) {
                    return self.remove_first(client_id);
                }
            }
            self.round.extend(self.queues.keys());
        }
        None
    }

    fn remove_first(&mut self, client_id: u64) -> Option<Request> {
        let queue = self.queues.get_mut(&client_id)?;
        let (_, request) = queue.pop_first()?;
        if queue.is_empty() {
            self.queues.remove(&client_id);
        }
        self.waiting_count -= 1;
        self.state_count -= usize::from(request.state.is_some());
        Some(request)
    }
}

#[cfg(test)]
mod tests {
    //! Checks the order of a turn against lists of clients and sequence numbers.
    use sim_contract::{Command, ConnectionId, RestoreContents, Text};

    use super::*;

    fn pin(client_id: u64, sequence: u64) -> ReceivedCommand {
        let command = Command::new(client_id, sequence, Action::Pin { particle: 0 });
        ReceivedCommand { command, connection: ConnectionId::default() }
    }

    fn order(turn: &[Request]) -> Vec<(u64, u64)> {
        let commands = turn.iter().map(|request| request.received.command);
        commands.map(|command| (command.client_id, command.sequence)).collect()
    }

    #[test]
    fn a_turn_alternates_between_clients_and_keeps_their_sequences() {
        let mut inbox = Inbox::default();
        inbox.add([pin(9, 1), pin(9, 2), pin(4, 7), pin(9, 3), pin(4, 6)]);
        assert_eq!(
            order(&inbox.next_turn(COMMANDS_PER_STEP_MAX, Vec::new())),
            [(4, 6), (9, 1), (4, 7), (9, 2), (9, 3)]
        );
        assert!(inbox.next_turn(COMMANDS_PER_STEP_MAX, Vec::new()).is_empty());
    }

    #[test]
    fn commands_beyond_the_limit_of_a_turn_wait_for_the_next_turn() {
        let mut inbox = Inbox::default();
        inbox.add((0..1500).map(|sequence| pin(1, sequence)));
        inbox.add([pin(2, 0)]);
        let first = order(&inbox.next_turn(COMMANDS_PER_STEP_MAX, Vec::new()));
        assert_eq!(first.len(), COMMANDS_PER_STEP_MAX);
        assert_eq!(first[..3], [(1, 0), (2, 0), (1, 1)]);
        let rest = order(&inbox.next_turn(COMMANDS_PER_STEP_MAX, Vec::new()));
        assert_eq!((rest.len(), rest[0]), (1501 - COMMANDS_PER_STEP_MAX, (1, 1023)));
    }

    #[test]
    fn a_turn_begins_after_the_client_that_was_served_last() {
        let mut inbox = Inbox::default();
        let flood = |round| (0..COMMANDS_PER_STEP_MAX as u64).map(move |id| pin(id, round));
        inbox.add([pin(u64::MAX - 1, 0)]);
        inbox.add(flood(0));
        assert_eq!(inbox.next_turn(COMMANDS_PER_STEP_MAX, Vec::new()).len(), COMMANDS_PER_STEP_MAX);
        inbox.add(flood(1));
        assert_eq!(
            order(&inbox.next_turn(COMMANDS_PER_STEP_MAX, Vec::new()))[..2],
            [(u64::MAX - 1, 0), (0, 1)]
        );
    }

    #[test]
    fn a_process_with_ever_new_client_ids_delays_a_client_by_one_round_at_most() {
        let mut inbox = Inbox::default();
        let mut next_id = 1..;
        let mut flood = |count: usize| -> Vec<_> {
            next_id.by_ref().take(count).map(|client_id| pin(client_id, 0)).collect()
        };
        // The inbox is as full as it becomes, and the honest client has the highest id.
        inbox.add(flood(INBOX_MAX));
        inbox.add([pin(u64::MAX, 0)]);
        let is_served = |turn: &[Request]| order(turn).contains(&(u64::MAX, 0));
        let turns = (1..=100).find(|_| {
            let turn = inbox.next_turn(COMMANDS_PER_STEP_MAX, Vec::new());
            inbox.add(flood(COMMANDS_PER_STEP_MAX));
            is_served(&turn)
        });
        assert_eq!(turns, Some(INBOX_MAX / COMMANDS_PER_STEP_MAX + 1));
    }

    #[test]
    fn a_turn_ends_with_a_command_that_replaces_the_state() {
        for action in [
            Action::Load { scene: Text::cut("rope") },
            Action::Rewind { to_step: Some(3), back_steps: None },
        ] {
            let mut inbox = Inbox::default();
            let command = Command::new(1, 2, action);
            let replaces = ReceivedCommand { command, connection: ConnectionId::default() };
            inbox.add([pin(1, 1), replaces, pin(1, 3)]);
            assert_eq!(
                order(&inbox.next_turn(COMMANDS_PER_STEP_MAX, Vec::new())),
                [(1, 1), (1, 2)]
            );
            assert_eq!(order(&inbox.next_turn(COMMANDS_PER_STEP_MAX, Vec::new())), [(1, 3)]);
        }
    }

    #[test]
    fn states_wait_with_the_commands_of_their_client_up_to_a_limit() {
        let state = |sequence| {
            let action = Action::Restore { contents: RestoreContents::Motion, state_hash: 0 };
            let command = Command::new(1, sequence, action);
            let received = ReceivedCommand { command, connection: ConnectionId::default() };
            let state = ReceivedState { scene_hash: 0, particles: Vec::new(), keyframe: None };
            (received, Ok(state))
        };
        let mut inbox = Inbox::default();
        inbox.add([pin(1, 1), pin(1, 4)]);
        inbox.add_states((0..RESTORES_MAX as u64).map(|index| state(2 + 3 * index)));
        assert!(!inbox.has_room_for_states());
        let turn = inbox.next_turn(COMMANDS_PER_STEP_MAX, Vec::new());
        assert_eq!(order(&turn), [(1, 1), (1, 2)]);
        assert!(turn[1].state.is_some());
        assert!(inbox.has_room_for_states());
    }

    #[test]
    fn the_commands_of_a_held_client_wait_for_its_release() {
        let mut inbox = Inbox::default();
        inbox.hold(5);
        inbox.add([pin(5, 1), pin(6, 1), pin(7, 1), pin(7, 2)]);
        let turn = inbox.next_turn(COMMANDS_PER_STEP_MAX, Vec::new());
        assert_eq!(order(&turn), [(6, 1), (7, 1), (7, 2)]);
        assert!(inbox.next_turn(COMMANDS_PER_STEP_MAX, Vec::new()).is_empty());
        inbox.release();
        assert_eq!(order(&inbox.next_turn(COMMANDS_PER_STEP_MAX, Vec::new())), [(5, 1)]);
    }

    #[test]
    fn a_request_that_is_put_back_keeps_its_place_among_those_of_its_client() {
        let mut inbox = Inbox::default();
        inbox.add([pin(5, 1), pin(5, 1), pin(5, 2)]);
        let arrivals = |turn: &[Request]| -> Vec<_> {
            turn.iter().map(|request| request.arrived_before).collect()
        };
        let turn = inbox.next_turn(2, Vec::new());
        assert_eq!(arrivals(&turn), [0, 1]);
        for request in turn.into_iter().rev() {
            inbox.put_back(request);
        }
        let turn = inbox.next_turn(COMMANDS_PER_STEP_MAX, Vec::new());
        assert_eq!((order(&turn), arrivals(&turn)), (vec![(5, 1), (5, 1), (5, 2)], vec![0, 1, 2]));
        assert_eq!((inbox.waiting_count, inbox.state_count), (0, 0));
    }

    #[test]
    fn settings_of_a_client_that_follow_each_other_are_removed_together() {
        let set = |sequence| {
            let action = Action::set("damping", sim_contract::ParameterValue::Off);
            let command = Command::new(5, sequence, action);
            ReceivedCommand { command, connection: ConnectionId::default() }
        };
        let mut inbox = Inbox::default();
        inbox.hold(5);
        inbox.add([set(1), set(2), set(3), pin(5, 4), set(5), pin(6, 1)]);
        let order_of = |inbox: &mut Inbox, count_max| order(&inbox.next_settings(5, count_max));
        assert_eq!(order_of(&mut inbox, 2), [(5, 1), (5, 2)]);
        assert_eq!(order_of(&mut inbox, 9), [(5, 3)]);
        assert_eq!(order_of(&mut inbox, 9), [(5, 4)]);
        assert_eq!(order_of(&mut inbox, 9), [(5, 5)]);
        assert_eq!(order_of(&mut inbox, 9), []);
        assert_eq!(order(&inbox.next_turn(9, Vec::new())), [(6, 1)]);
    }

    #[test]
    fn the_first_request_of_a_turn_comes_before_others_and_may_end_it() {
        let mut inbox = Inbox::default();
        let first = |inbox: &mut Inbox, action| {
            let command = Command::new(1, 1, action);
            inbox.add([ReceivedCommand { command, connection: ConnectionId::default() }]);
            inbox.next_turn(1, Vec::new())
        };
        let cheap = first(&mut inbox, Action::Pause);
        let rewind = first(&mut inbox, Action::Rewind { to_step: Some(3), back_steps: None });
        inbox.add([pin(0, 5), pin(0, 6)]);
        assert_eq!(order(&inbox.next_turn(2, cheap)), [(1, 1), (0, 5)]);
        assert_eq!(order(&inbox.next_turn(2, rewind)), [(1, 1)]);
        assert_eq!(order(&inbox.next_turn(2, Vec::new())), [(0, 6)]);
    }

    #[test]
    fn commands_of_held_clients_take_no_room_from_the_others() {
        let mut inbox = Inbox::default();
        inbox.hold(1);
        inbox.add((0..INBOX_MAX as u64).map(|sequence| pin(1, sequence)));
        assert!(inbox.has_room());
        inbox.add((INBOX_MAX as u64..HELD_MAX as u64).map(|sequence| pin(1, sequence)));
        assert!(!inbox.has_room(), "their memory has a limit, too");
        inbox.release();
        assert!(!inbox.has_room());
    }

    #[test]
    fn a_full_inbox_has_no_room() {
        let mut inbox = Inbox::default();
        inbox.add((0..INBOX_MAX as u64).map(|sequence| pin(1, sequence)));
        assert!(!inbox.has_room());
        inbox.next_turn(COMMANDS_PER_STEP_MAX, Vec::new());
        assert!(inbox.has_room());
    }
}
