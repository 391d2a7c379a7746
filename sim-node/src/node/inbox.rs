//! Order in which the commands of several clients are applied.

use std::collections::BTreeMap;
use std::ops::Bound;

use sim_contract::{Action, COMMANDS_PER_STEP_MAX, ReceivedCommand};

/// Commands that wait to be applied.
///
/// A turn is the commands of one poll. They are taken round-robin: one of each client by ascending id,
/// in the client's sequence. A turn continues after the client that was served last, so that no client
/// can starve another.
#[derive(Debug)]
pub(super) struct Inbox {
    waiting: BTreeMap<Place, ReceivedCommand>,
    /// Number of commands that have arrived.
    arrived_count: u64,
    /// The client that was served last. The greatest id before the first one, so that the lowest
    /// follows.
    last_served: u64,
}

/// The key of a command: client, sequence, and order of arrival for equal sequences.
type Place = (u64, u64, u64);

/// Number of commands from which on the inbox accepts no more. The rest waits in shared memory, where
/// each client has a bounded queue.
const INBOX_MAX: usize = 16 * COMMANDS_PER_STEP_MAX;

impl Default for Inbox {
    fn default() -> Self {
        Self { waiting: BTreeMap::new(), arrived_count: 0, last_served: u64::MAX }
    }
}

impl Inbox {
    /// Returns `true` if the inbox accepts more commands.
    pub(super) fn has_room(&self) -> bool {
        self.waiting.len() < INBOX_MAX
    }

    /// Adds commands in their order of arrival.
    pub(super) fn add(&mut self, commands: impl IntoIterator<Item = ReceivedCommand>) {
        for received in commands {
            let command = &received.command;
            let place = (command.client_id, command.sequence, self.arrived_count);
            self.waiting.insert(place, received);
            self.arrived_count += 1;
        }
    }

    /// Removes the commands of one turn, in the order of application. A turn ends with the first load,
    /// because a load takes long, and the node must notice a request to stop after it.
    pub(super) fn next_turn(&mut self) -> Vec<ReceivedCommand> {
        let mut turn = Vec::new();
        while turn.len() < COMMANDS_PER_STEP_MAX
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
        let end_of_last = Bound::Excluded((self.last_served, u64::MAX, u64::MAX));
        let after_last = self.waiting.range((end_of_last, Bound::Unbounded)).next();
        let (place, _) = after_last.or_else(|| self.waiting.first_key_value())?;
        let place = *place;
        self.last_served = place.0;
        self.waiting.remove(&place)
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
    fn a_turn_begins_after_the_client_that_was_served_last() {
        let mut inbox = Inbox::default();
        let flood = |round| (0..COMMANDS_PER_STEP_MAX as u64).map(move |id| pin(id, round));
        inbox.add([pin(u64::MAX - 1, 0)]);
        inbox.add(flood(0));
        assert_eq!(inbox.next_turn().len(), COMMANDS_PER_STEP_MAX);
        inbox.add(flood(1));
        assert_eq!(order(&inbox.next_turn())[..2], [(u64::MAX - 1, 0), (0, 1)]);
    }

    #[test]
    fn a_turn_ends_with_the_first_load() {
        let mut inbox = Inbox::default();
        let load = Command::new(1, 2, Action::Load { scene: Text::cut("rope") });
        let load = ReceivedCommand { command: load, connection: ConnectionId::default() };
        inbox.add([pin(1, 1), load, pin(1, 3)]);
        assert_eq!(order(&inbox.next_turn()), [(1, 1), (1, 2)]);
        assert_eq!(order(&inbox.next_turn()), [(1, 3)]);
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
