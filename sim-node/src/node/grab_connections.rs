//! The connection that each grab belongs to. A grab ends with its connection.

use std::collections::BTreeMap;

use sim_contract::{
    Action, COMMANDS_PER_STEP_MAX, CONSOLE_CLIENT_ID, Command, ConnectionId, ReceivedCommand,
    RestoreContents,
};
use sim_host::clock::SECOND_NS;

/// Time between two checks of the connections. A check reads the state of every client from files.
const CHECK_PERIOD_NS: u64 = SECOND_NS / 5;

/// The grabs that end with a connection.
///
/// A grab belongs to the connection of its latest `grab` or `move`, not to the client id: a program
/// that starts again under the same id has another connection. Grabs of the console belong to none,
/// because each call of `sim-node ctl` ends with its command.
#[derive(Debug, Default)]
pub(super) struct GrabConnections {
    by_particle: BTreeMap<u32, GrabConnection>,
    /// CLOCK_MONOTONIC of the next check.
    next_check_ns: u64,
}

#[derive(Debug, Clone, Copy)]
struct GrabConnection {
    client_id: u64,
    connection: ConnectionId,
}

impl GrabConnections {
    /// Updates the grabs after a command was applied.
    pub(super) fn on_applied(&mut self, received: &ReceivedCommand) {
        let ReceivedCommand { command: Command { client_id, .. }, connection } = *received;
        match received.command.action() {
            Action::Grab { particle, .. } | Action::Move { particle, .. }
                if client_id != CONSOLE_CLIENT_ID =>
            {
                self.by_particle.insert(particle, GrabConnection { client_id, connection });
            }
            Action::Grab { particle, .. }
            | Action::Move { particle, .. }
            | Action::Release { particle, .. } => _ = self.by_particle.remove(&particle),
            // Grabs of a given state belong to no connection: they end with a release.
            Action::Reset
            | Action::Load { .. }
            | Action::Restore { contents: RestoreContents::State, .. } => self.by_particle.clear(),
            _ => {}
        }
    }

    /// Updates the grabs after a rewind to a state with these grabs, each a particle and its client. A grab
    /// continues if its client still holds the particle. The others are lost, because their clients do
    /// not know of them.
    pub(super) fn on_rewind(&mut self, grabs: impl Iterator<Item = (u32, u64)>) {
        let before = std::mem::take(&mut self.by_particle);
        let grabs = grabs.filter(|(_, client_id)| *client_id != CONSOLE_CLIENT_ID);
        self.by_particle.extend(grabs.map(|(particle, client_id)| {
            let held = before.get(&particle).filter(|held| held.client_id == client_id);
            let connection = held.map_or_else(ConnectionId::default, |held| held.connection);
            (particle, GrabConnection { client_id, connection })
        }));
    }

    /// Removes grabs whose connection has ended, and returns their releases. Calls `living` for the
    /// connections of living clients a few times a second, and only if there are grabs. Returns at
    /// most [`COMMANDS_PER_STEP_MAX`] releases at a time.
    pub(super) fn remove_lost(
        &mut self,
        now_ns: u64,
        living: impl FnOnce() -> Vec<ConnectionId>,
    ) -> Vec<Command> {
        if self.by_particle.is_empty() || now_ns < self.next_check_ns {
            return Vec::new();
        }
        let living = living();
        let is_lost = |_: &u32, grab: &mut GrabConnection| !living.contains(&grab.connection);
        let lost = self.by_particle.extract_if(.., is_lost).take(COMMANDS_PER_STEP_MAX);
        let release = |particle| Action::Release { particle, force: false };
        let releases: Vec<_> = lost
            .map(|(particle, grab)| Command::new(grab.client_id, 0, release(particle)))
            .collect();
        if releases.len() < COMMANDS_PER_STEP_MAX {
            self.next_check_ns = now_ns + CHECK_PERIOD_NS;
        }
        releases
    }
}

#[cfg(test)]
mod tests {
    //! Checks the releases after sequences of commands against the connections that are left.
    use super::*;

    fn received(client_id: u64, connection: u128, action: Action) -> ReceivedCommand {
        let command = Command::new(client_id, 7, action);
        ReceivedCommand { command, connection: ConnectionId(connection) }
    }

    fn grab(particle: u32) -> Action {
        Action::Grab { particle, target: [0.0; 3], over_s: 0.0 }
    }

    fn pull(particle: u32) -> Action {
        Action::Move { particle, target: [0.0; 3], over_s: 0.0 }
    }

    /// Client and particle of each release, if only these connections are left.
    fn releases(grabs: &mut GrabConnections, living: &[u128]) -> Vec<(u64, u32)> {
        grabs.next_check_ns = 0;
        let living = living.iter().copied().map(ConnectionId).collect();
        let releases = grabs.remove_lost(1, || living);
        let particle = |command: &Command| match command.action() {
            Action::Release { particle, force: false } => particle,
            action => panic!("{action:?}"),
        };
        releases.iter().map(|command| (command.client_id, particle(command))).collect()
    }

    #[test]
    fn after_a_rewind_only_the_grabs_that_a_client_still_holds_continue() {
        let mut grabs = GrabConnections::default();
        for (client_id, connection, particle) in [(5, 1, 10), (6, 2, 11), (7, 3, 12)] {
            grabs.on_applied(&received(client_id, connection, grab(particle)));
        }
        // Then client 5 held 10, client 6 had not grabbed 11, 8 held 12, and the console 13.
        grabs.on_rewind([(10, 5), (12, 8), (13, CONSOLE_CLIENT_ID), (14, 6)].into_iter());
        assert_eq!(releases(&mut grabs, &[1, 2, 3]), [(8, 12), (6, 14)]);
        assert_eq!(releases(&mut grabs, &[2, 3]), [(5, 10)]);
    }

    #[test]
    fn a_grab_ends_with_its_connection_and_not_with_its_client_id() {
        let mut grabs = GrabConnections::default();
        grabs.on_applied(&received(5, 1, grab(10)));
        grabs.on_applied(&received(5, 1, grab(11)));
        grabs.on_applied(&received(6, 2, grab(12)));
        assert_eq!(releases(&mut grabs, &[1, 2]), []);
        // The same client id comes back through another connection and moves one of the two.
        grabs.on_applied(&received(5, 3, pull(11)));
        assert_eq!(releases(&mut grabs, &[2, 3]), [(5, 10)]);
        assert_eq!(releases(&mut grabs, &[]), [(5, 11), (6, 12)]);
        assert_eq!(releases(&mut grabs, &[]), []);
    }

    #[test]
    fn grabs_of_the_console_and_ended_grabs_are_not_released() {
        let mut grabs = GrabConnections::default();
        grabs.on_applied(&received(CONSOLE_CLIENT_ID, 1, grab(10)));
        grabs.on_applied(&received(5, 1, grab(11)));
        grabs.on_applied(&received(6, 2, Action::Release { particle: 11, force: true }));
        assert_eq!(releases(&mut grabs, &[]), []);
        for end in [Action::Reset, Action::Load { scene: sim_contract::Text::cut("rope") }] {
            grabs.on_applied(&received(5, 1, grab(12)));
            grabs.on_applied(&received(6, 2, end));
            assert_eq!(releases(&mut grabs, &[]), []);
        }
    }

    #[test]
    fn connections_are_read_only_if_there_are_grabs_and_a_check_is_due() {
        let mut grabs = GrabConnections::default();
        assert!(grabs.remove_lost(1, || panic!("no grabs")).is_empty());
        grabs.on_applied(&received(5, 1, grab(10)));
        assert!(grabs.remove_lost(1, || vec![ConnectionId(1)]).is_empty());
        assert!(grabs.remove_lost(CHECK_PERIOD_NS, || panic!("too early")).is_empty());
        assert_eq!(grabs.remove_lost(CHECK_PERIOD_NS + 1, Vec::new).len(), 1);
    }

    #[test]
    fn many_releases_are_spread_over_turns_without_a_pause_between_them() {
        let mut grabs = GrabConnections::default();
        let count = COMMANDS_PER_STEP_MAX + 5;
        for particle in 0..u32::try_from(count).unwrap() {
            grabs.on_applied(&received(5, 1, grab(particle)));
        }
        assert_eq!(grabs.remove_lost(1, Vec::new).len(), COMMANDS_PER_STEP_MAX);
        assert_eq!(grabs.remove_lost(2, Vec::new).len(), 5);
    }
}
