//! Order in which the commands of several clients are applied.

use std::collections::{BTreeMap, VecDeque};

use sim_contract::{COMMANDS_PER_STEP_MAX, Command};

/// Commands that wait to be applied, by client.
///
/// A turn, the commands of one poll, visits the clients round-robin by ascending id and takes one command of each, in the
/// client's sequence, so that no client can starve another.
#[derive(Debug, Default)]
pub(super) struct Inbox {
    queues: BTreeMap<u64, VecDeque<Command>>,
    count: usize,
}

/// Number of commands from which on the inbox accepts no more. The rest waits in shared memory, where
/// each client has a bounded queue.
const INBOX_MAX: usize = 16 * COMMANDS_PER_STEP_MAX;

impl Inbox {
    /// Returns `true` if the inbox accepts more commands.
    pub(super) fn has_room(&self) -> bool {
        self.count < INBOX_MAX
    }

    /// Adds commands in their order of arrival.
    pub(super) fn add(&mut self, commands: impl IntoIterator<Item = Command>) {
        for command in commands {
            let queue = self.queues.entry(command.client_id).or_default();
            // Sorted by sequence, equal numbers in their order of arrival; this mostly appends.
            let place = queue.partition_point(|queued| queued.sequence <= command.sequence);
            queue.insert(place, command);
            self.count += 1;
        }
    }

    /// Removes the commands of one turn, in the order of application.
    pub(super) fn next_turn(&mut self) -> Vec<Command> {
        let mut turn = Vec::new();
        while self.count > 0 && turn.len() < COMMANDS_PER_STEP_MAX {
            let room = COMMANDS_PER_STEP_MAX - turn.len();
            let fronts = self.queues.values_mut().take(room).filter_map(VecDeque::pop_front);
            let before = turn.len();
            turn.extend(fronts);
            self.count -= turn.len() - before;
            self.queues.retain(|_, queue| !queue.is_empty());
        }
        turn
    }
}

#[cfg(test)]
mod tests {
    //! Checks the order of a turn against lists of clients and sequence numbers.
    use sim_contract::Action;

    use super::*;

    fn pin(client_id: u64, sequence: u64) -> Command {
        Command::new(client_id, sequence, Action::Pin { particle: 0 })
    }

    fn order(turn: &[Command]) -> Vec<(u64, u64)> {
        turn.iter().map(|command| (command.client_id, command.sequence)).collect()
    }

    #[test]
    fn a_turn_alternates_between_clients_and_keeps_their_sequences() {
        let mut inbox = Inbox::default();
        inbox.add([pin(9, 1), pin(9, 2), pin(4, 7), pin(9, 3), pin(4, 6)]);
        assert_eq!(order(&inbox.next_turn()), [(4, 6), (9, 1), (4, 7), (9, 2), (9, 3)]);
        assert!(inbox.next_turn().is_empty());
    }

    #[test]
    fn commands_beyond_the_limit_of_a_turn_wait_for_the_next_turn() {
        let mut inbox = Inbox::default();
        inbox.add((0..1500).map(|sequence| pin(1, sequence)));
        inbox.add([pin(2, 0)]);
        let first = order(&inbox.next_turn());
        assert_eq!(first.len(), COMMANDS_PER_STEP_MAX);
        assert_eq!(first[..3], [(1, 0), (2, 0), (1, 1)]);
        let rest = order(&inbox.next_turn());
        assert_eq!((rest.len(), rest[0]), (1501 - COMMANDS_PER_STEP_MAX, (1, 1023)));
    }

    #[test]
    fn a_full_inbox_has_no_room() {
        let mut inbox = Inbox::default();
        inbox.add((0..INBOX_MAX as u64).map(|sequence| pin(1, sequence)));
        assert!(!inbox.has_room());
        inbox.next_turn();
        assert!(inbox.has_room());
    }
}
