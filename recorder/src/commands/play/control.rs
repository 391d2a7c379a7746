//! The commands that a replay obeys: pause, resume and step.

use sim_contract::{Action, Reason};

/// The state of the playback.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Control {
    pub(crate) is_paused: bool,
    /// Snapshots to publish while paused.
    steps_due: u64,
}

impl Control {
    /// A replay that starts paused still publishes its first snapshot.
    pub(crate) fn new(starts_paused: bool) -> Self {
        Self { is_paused: starts_paused, steps_due: u64::from(starts_paused) }
    }

    pub(crate) fn is_moving(self) -> bool {
        !self.is_paused || self.steps_due > 0
    }

    /// Counts a published snapshot.
    pub(crate) fn count_step(&mut self) {
        self.steps_due = self.steps_due.saturating_sub(1);
    }

    /// Executes a command. Rejects commands that would change the recording.
    pub(crate) fn obey(&mut self, action: Action) -> Result<(), Reason> {
        match action {
            Action::Pause => *self = Self { is_paused: true, steps_due: 0 },
            Action::Resume => *self = Self { is_paused: false, steps_due: 0 },
            Action::Step { count: 0 } => return Err(Reason::OutOfRange),
            Action::Step { count } if self.is_paused => self.steps_due += u64::from(count),
            _ => return Err(Reason::NoEffectHere),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_replay_obeys_only_pause_resume_and_step() {
        let mut control = Control::new(false);
        assert!(control.is_moving());
        assert_eq!(control.obey(Action::Step { count: 1 }), Err(Reason::NoEffectHere));
        assert_eq!(control.obey(Action::Pause), Ok(()));
        assert!(!control.is_moving());
        assert_eq!(control.obey(Action::Step { count: 0 }), Err(Reason::OutOfRange));
        assert_eq!(control.obey(Action::Step { count: 2 }), Ok(()));
        for _ in 0..2 {
            assert!(control.is_moving());
            control.count_step();
        }
        assert!(!control.is_moving());
        assert_eq!(control.obey(Action::Resume), Ok(()));
        assert!(control.is_moving());
        for action in [Action::Pin { particle: 0 }, Action::Reset, Action::Unknown { number: 99 }] {
            assert_eq!(control.obey(action), Err(Reason::NoEffectHere));
        }
    }

    #[test]
    fn a_replay_that_starts_paused_publishes_one_snapshot() {
        let mut control = Control::new(true);
        assert!(control.is_moving());
        control.count_step();
        assert!(!control.is_moving());
    }
}
