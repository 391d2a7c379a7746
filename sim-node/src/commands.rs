//! From the commands that clients send to changes of the solver, in an order that is logged.

use std::collections::{BTreeMap, VecDeque};

use sim_contract::{COMMANDS_PER_STEP_MAX, Command, Reason};
use sim_solver::{Applied, Control};

/// Commands that have arrived and wait for their turn, by client.
///
/// A turn goes round the clients in ascending id and takes one command of each, in its sequence,
/// so that no client can starve another.
#[derive(Debug, Default)]
pub(crate) struct Inbox {
    queues: BTreeMap<u64, VecDeque<Command>>,
    count: usize,
}

/// The inbox takes no more while it holds this many: the rest waits in shared memory, where each
/// client has a bounded queue.
const INBOX_MAX: usize = 16 * COMMANDS_PER_STEP_MAX;

impl Inbox {
    /// Whether there is room for what has arrived.
    pub(crate) fn has_room(&self) -> bool {
        self.count < INBOX_MAX
    }

    /// Adds commands in their order of arrival.
    pub(crate) fn add(&mut self, commands: impl IntoIterator<Item = Command>) {
        for command in commands {
            let queue = self.queues.entry(command.client_id).or_default();
            // Sorted by sequence. Equal ones keep their order; mostly this appends.
            let place = queue.partition_point(|queued| queued.sequence <= command.sequence);
            queue.insert(place, command);
            self.count += 1;
        }
    }

    /// The commands of one boundary, in the order of application.
    pub(crate) fn take_turn(&mut self) -> Vec<Command> {
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

/// Whether, how long and how fast the node goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Progress {
    pub(crate) is_paused: bool,
    /// Steps to make while paused.
    pub(crate) steps_due: u64,
    /// The state was reset or loaded: even a paused node makes the one step that shows it.
    pub(crate) is_reset_due: bool,
    /// The pace against real time.
    pub(crate) time_scale: f64,
}

impl Progress {
    pub(crate) fn is_stepping(self) -> bool {
        !self.is_paused || self.steps_due > 0 || self.is_reset_due
    }

    /// Follows an action that the solver has applied or passed on.
    ///
    /// # Errors
    /// The action has no effect in this state of the loop. A `load` has none here: the node itself
    /// replaces the scene.
    pub(crate) fn apply(&mut self, applied: Applied) -> Result<(), Reason> {
        let control = match applied {
            Applied::State | Applied::Target => return Ok(()),
            Applied::Reset => {
                self.is_reset_due = true;
                return Ok(());
            }
            Applied::Control(control) => control,
        };
        match control {
            Control::Pause => (self.is_paused, self.steps_due) = (true, 0),
            Control::Resume => (self.is_paused, self.steps_due) = (false, 0),
            Control::Step { count: 0 } => return Err(Reason::OutOfRange),
            Control::Step { count } if self.is_paused => self.steps_due += u64::from(count),
            Control::TimeScale(scale) => self.time_scale = f64::from(scale),
            // A running node needs no `step`.
            Control::Step { .. } | Control::Load { .. } => return Err(Reason::NoEffectHere),
        }
        Ok(())
    }

    /// A step was made. The one that shows a reset is not one of those asked for.
    pub(crate) fn count_step(&mut self) {
        if self.is_reset_due {
            self.is_reset_due = false;
        } else {
            self.steps_due = self.steps_due.saturating_sub(1);
        }
    }
}

#[cfg(test)]
mod tests {
    //! The order of a turn, and the control of the loop; what the solver does has tests of its own.
    use sim_contract::{Action, KindFilter, ParameterValue, Text};
    use sim_solver::{Scene, Solver};

    use super::*;

    fn pin(client_id: u64, sequence: u64) -> Command {
        Command::new(client_id, sequence, Action::Pin { particle: 0 })
    }

    fn order(turn: &[Command]) -> Vec<(u64, u64)> {
        turn.iter().map(|command| (command.client_id, command.sequence)).collect()
    }

    #[test]
    fn a_turn_goes_round_the_clients_and_keeps_their_sequences() {
        let mut inbox = Inbox::default();
        inbox.add([pin(9, 1), pin(9, 2), pin(4, 7), pin(9, 3), pin(4, 6)]);
        assert_eq!(order(&inbox.take_turn()), [(4, 6), (9, 1), (4, 7), (9, 2), (9, 3)]);
        assert!(inbox.take_turn().is_empty());
    }

    #[test]
    fn what_exceeds_a_turn_waits_for_the_next_one() {
        let mut inbox = Inbox::default();
        inbox.add((0..1500).map(|sequence| pin(1, sequence)));
        inbox.add([pin(2, 0)]);
        let first = order(&inbox.take_turn());
        assert_eq!(first.len(), COMMANDS_PER_STEP_MAX);
        assert_eq!(first[..3], [(1, 0), (2, 0), (1, 1)]);
        let rest = order(&inbox.take_turn());
        assert_eq!((rest.len(), rest[0]), (1501 - COMMANDS_PER_STEP_MAX, (1, 1023)));
    }

    #[test]
    fn the_inbox_takes_no_more_than_its_limit() {
        let mut inbox = Inbox::default();
        inbox.add((0..INBOX_MAX as u64).map(|sequence| pin(1, sequence)));
        assert!(!inbox.has_room());
        inbox.take_turn();
        assert!(inbox.has_room());
    }

    fn progress(is_paused: bool, steps_due: u64, is_reset_due: bool) -> Progress {
        Progress { is_paused, steps_due, is_reset_due, time_scale: 1.0 }
    }

    #[test]
    fn only_a_paused_node_takes_steps() {
        let mut now = progress(false, 0, false);
        let mut apply = |control| now.apply(Applied::Control(control)).map(|()| now);
        assert_eq!(apply(Control::Step { count: 3 }), Err(Reason::NoEffectHere));
        assert_eq!(apply(Control::Pause), Ok(progress(true, 0, false)));
        assert_eq!(apply(Control::Step { count: 0 }), Err(Reason::OutOfRange));
        assert_eq!(apply(Control::Step { count: 3 }), Ok(progress(true, 3, false)));
        assert_eq!(apply(Control::Resume), Ok(progress(false, 0, false)));
    }

    #[test]
    fn a_time_scale_is_the_pace_of_the_node_and_a_wrong_one_is_rejected() {
        let mut solver = Solver::new(&Scene::from_toml("version = 1", "empty").unwrap());
        let mut now = progress(false, 0, false);
        let mut set = |value, constraint_kind| {
            let parameter = Text::new("time_scale").unwrap();
            let action = Action::Set { parameter, value, constraint_kind };
            let applied = solver.apply(1, &action)?;
            now.apply(applied).map(|()| now.time_scale)
        };
        assert_eq!(set(ParameterValue::Number(0.5), None), Ok(0.5));
        assert_eq!(set(ParameterValue::Number(0.0), None), Err(Reason::OutOfRange));
        assert_eq!(set(ParameterValue::Off, None), Err(Reason::OutOfRange));
        assert_eq!(set(ParameterValue::Number(f32::NAN), None), Err(Reason::NonFinite));
        assert_eq!(
            set(ParameterValue::Number(2.0), Some(KindFilter::Unknown)),
            Err(Reason::OutOfRange)
        );
        assert_eq!(set(ParameterValue::Number(2.0), None), Ok(2.0));
    }

    #[test]
    fn resets_at_one_boundary_make_one_step_even_if_a_pause_follows() {
        let mut now = progress(true, 2, false);
        for applied in [Applied::Reset, Applied::Reset, Applied::Control(Control::Pause)] {
            now.apply(applied).unwrap();
        }
        assert!(now.is_stepping());
        now.count_step();
        assert_eq!(now, progress(true, 0, false));
        assert!(!now.is_stepping());
    }
}
