//! Order in which the commands of several clients are applied.

use std::collections::{BTreeMap, BTreeSet};

use sim_contract::{Action, COMMANDS_PER_STEP_MAX, ReceivedCommand};

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
}

/// The commands of a client, by sequence, and by order of arrival for equal sequences.
type ClientQueue = BTreeMap<(u64, u64), ReceivedCommand>;

/// Number of commands from which on the inbox accepts no more. The rest waits in shared memory, where
/// each connection has a bounded queue.
const INBOX_MAX: usize = 16 * COMMANDS_PER_STEP_MAX;

impl Inbox {
    /// Returns `true` if the inbox accepts more commands.
    pub(super) fn has_room(&self) -> bool {
        self.waiting_count < INBOX_MAX
    }

    /// Adds commands in their order of arrival.
    pub(super) fn add(&mut self, commands: impl IntoIterator<Item = ReceivedCommand>) {
        for received in commands {
            let command = &received.command;
            let queue = self.queues.entry(command.client_id).or_default();
            queue.insert((command.sequence, self.arrived_count), received);
            self.arrived_count += 1;
            self.waiting_count += 1;
        }
    }

    /// Removes the commands of one turn, at most `count_max`, in the order of application. A turn ends
    /// with the first load, because a load takes long.
    pub(super) fn next_turn(&mut self, count_max: usize) -> Vec<ReceivedCommand> {
        let mut turn = Vec::new();
        while turn.len() < count_max
            && let Some(received) = self.next()
        {
            turn.push(received);
            if matches!(received.command.action(), Action::Load { .. }) {
                break;
            }
        }
        turn
    }

    /// Removes the first command of the next client.
    fn next(&mut self) -> Option<ReceivedCommand> {
        if self.round.is_empty() {
            self.round.extend(self.queues.keys());
        }
        let client_id = self.round.pop_first()?;
        let queue = self.queues.get_mut(&client_id)?;
        let (_, received) = queue.pop_first()?;
        if queue.is_empty() {
            self.queues.remove(&client_id);
        }
        self.waiting_count -= 1;
        Some(received)
    }
}

#[cfg(test)]
mod tests {
    //! Checks the order of a turn against lists of clients and sequence numbers.
    use sim_contract::{Command, ConnectionId, Text};

    use super::*;

    fn pin(client_id: u64, sequence: u64) -> ReceivedCommand {
        let command = Command::new(client_id, sequence, Action::Pin { particle: 0 });
        ReceivedCommand { command, connection: ConnectionId::default() }
    }

    fn order(turn: &[ReceivedCommand]) -> Vec<(u64, u64)> {
        let commands = turn.iter().map(|received| received.command);
        commands.map(|command| (command.client_id, command.sequence)).collect()
    }

    #[test]
    fn a_turn_alternates_between_clients_and_keeps_their_sequences() {
        let mut inbox = Inbox::default();
        inbox.add([pin(9, 1), pin(9, 2), pin(4, 7), pin(9, 3), pin(4, 6)]);
        assert_eq!(
            order(&inbox.next_turn(COMMANDS_PER_STEP_MAX)),
            [(4, 6), (9, 1), (4, 7), (9, 2), (9, 3)]
        );
        assert!(inbox.next_turn(COMMANDS_PER_STEP_MAX).is_empty());
    }

    #[test]
    fn commands_beyond_the_limit_of_a_turn_wait_for_the_next_turn() {
        let mut inbox = Inbox::default();
        inbox.add((0..1500).map(|sequence| pin(1, sequence)));
        inbox.add([pin(2, 0)]);
        let first = order(&inbox.next_turn(COMMANDS_PER_STEP_MAX));
        assert_eq!(first.len(), COMMANDS_PER_STEP_MAX);
        assert_eq!(first[..3], [(1, 0), (2, 0), (1, 1)]);
        let rest = order(&inbox.next_turn(COMMANDS_PER_STEP_MAX));
        assert_eq!((rest.len(), rest[0]), (1501 - COMMANDS_PER_STEP_MAX, (1, 1023)));
    }

    #[test]
    fn a_turn_begins_after_the_client_that_was_served_last() {
        let mut inbox = Inbox::default();
        let flood = |round| (0..COMMANDS_PER_STEP_MAX as u64).map(move |id| pin(id, round));
        inbox.add([pin(u64::MAX - 1, 0)]);
        inbox.add(flood(0));
        assert_eq!(inbox.next_turn(COMMANDS_PER_STEP_MAX).len(), COMMANDS_PER_STEP_MAX);
        inbox.add(flood(1));
        assert_eq!(
            order(&inbox.next_turn(COMMANDS_PER_STEP_MAX))[..2],
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
        let is_served = |turn: &[ReceivedCommand]| order(turn).contains(&(u64::MAX, 0));
        let turns = (1..=100).find(|_| {
            let turn = inbox.next_turn(COMMANDS_PER_STEP_MAX);
            inbox.add(flood(COMMANDS_PER_STEP_MAX));
            is_served(&turn)
        });
        assert_eq!(turns, Some(INBOX_MAX / COMMANDS_PER_STEP_MAX + 1));
    }

    #[test]
    fn a_turn_ends_with_the_first_load() {
        let mut inbox = Inbox::default();
        let load = Command::new(1, 2, Action::Load { scene: Text::cut("rope") });
        let load = ReceivedCommand { command: load, connection: ConnectionId::default() };
        inbox.add([pin(1, 1), load, pin(1, 3)]);
        assert_eq!(order(&inbox.next_turn(COMMANDS_PER_STEP_MAX)), [(1, 1), (1, 2)]);
        assert_eq!(order(&inbox.next_turn(COMMANDS_PER_STEP_MAX)), [(1, 3)]);
    }

    #[test]
    fn a_full_inbox_has_no_room() {
        let mut inbox = Inbox::default();
        inbox.add((0..INBOX_MAX as u64).map(|sequence| pin(1, sequence)));
        assert!(!inbox.has_room());
        inbox.next_turn(COMMANDS_PER_STEP_MAX);
        assert!(inbox.has_room());
    }
}
