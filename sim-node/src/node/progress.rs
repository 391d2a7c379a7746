//! Pause, steps and pace of the loop.

use sim_contract::Reason;
use sim_solver::{Applied, Control};

/// State of the loop: paused or running, and at which pace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Progress {
    pub(super) is_paused: bool,
    /// Steps still to make while paused.
    pub(super) steps_due: u64,
    /// A reset or load waits for the step that shows it, which a paused node makes as well.
    pub(super) is_state_due: bool,
    /// Simulated time per wall-clock time.
    pub(super) time_scale: f64,
}

impl Progress {
    /// Returns `true` if the node makes another step without a further command.
    pub(super) fn is_stepping(self) -> bool {
        !self.is_paused || self.steps_due > 0 || self.is_state_due
    }

    /// Updates the loop for an action that the solver has accepted.
    ///
    /// # Errors
    /// The action has no effect in this state of the loop. `load`, `rewind` and `restore` never
    /// have one here: the node itself replaces the scene or the state.
    pub(super) fn apply(&mut self, applied: Applied) -> Result<(), Reason> {
        let control = match applied {
            Applied::State | Applied::Target => return Ok(()),
            Applied::InPlace => {
                self.is_state_due = true;
                return Ok(());
            }
            Applied::Control(control) => control,
        };
        match control {
            Control::Pause => (self.is_paused, self.steps_due) = (true, 0),
            Control::Resume => (self.is_paused, self.steps_due) = (false, 0),
            Control::Step { count } if self.is_paused => self.steps_due += u64::from(count),
            Control::TimeScale(scale) => self.time_scale = f64::from(scale),
            Control::Mark => {}
            // A running node needs no `step`.
            Control::Step { .. }
            | Control::Load { .. }
            | Control::Rewind { .. }
            | Control::Restore => return Err(Reason::NoEffectHere),
        }
        Ok(())
    }

    /// Keeps only the pause and the pace.
    pub(super) fn begin_run(&mut self) {
        (self.steps_due, self.is_state_due) = (0, false);
    }

    /// Counts a step. The step that shows a reset is not one of `steps_due`.
    pub(super) fn count_step(&mut self) {
        if self.is_state_due {
            self.is_state_due = false;
        } else {
            self.steps_due = self.steps_due.saturating_sub(1);
        }
    }
}

#[cfg(test)]
mod tests {
    //! Checks the state of the loop after sequences of commands; the solver has tests of its own.
    use sim_contract::{Action, KindFilter, ParameterValue, Text};
    use sim_solver::{Scene, Solver};

    use super::*;

    fn progress(is_paused: bool, steps_due: u64, is_state_due: bool) -> Progress {
        Progress { is_paused, steps_due, is_state_due, time_scale: 1.0 }
    }

    #[test]
    fn only_a_paused_node_accepts_step() {
        let mut now = progress(false, 0, false);
        let mut apply = |control| now.apply(Applied::Control(control)).map(|()| now);
        assert_eq!(apply(Control::Step { count: 3 }), Err(Reason::NoEffectHere));
        assert_eq!(apply(Control::Pause), Ok(progress(true, 0, false)));
        assert_eq!(apply(Control::Step { count: 3 }), Ok(progress(true, 3, false)));
        assert_eq!(apply(Control::Pause), Ok(progress(true, 0, false)), "it cancels the steps");
        assert_eq!(apply(Control::Resume), Ok(progress(false, 0, false)));
    }

    #[test]
    fn a_valid_time_scale_changes_the_pace_and_an_invalid_one_is_rejected() {
        let mut solver = Solver::new(&Scene::from_toml("version = 1", "empty").unwrap());
        let mut now = progress(false, 0, false);
        let mut set = |value, constraint_kind| {
            let parameter = Text::new("time_scale").unwrap();
            let (block, collider) = (None, None);
            let action = Action::Set { parameter, value, constraint_kind, block, collider };
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
    fn resets_at_one_boundary_make_one_step_even_before_a_pause() {
        let mut now = progress(true, 2, false);
        for applied in [Applied::InPlace, Applied::InPlace, Applied::Control(Control::Pause)] {
            now.apply(applied).unwrap();
        }
        assert!(now.is_stepping());
        now.count_step();
        assert_eq!(now, progress(true, 0, false));
        assert!(!now.is_stepping());
    }
}
