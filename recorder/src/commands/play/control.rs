//! The controls of a replay: pause, step, seek and rate.

use std::ops::RangeInclusive;

use sim_contract::{Action, Parameter, ParameterValue, Reason};

/// Simulated time per wall-clock time.
pub(super) const RATES: RangeInclusive<f64> = 0.01..=100.0;

/// The rate without deadlines.
pub(super) const MAX_RATE: f64 = f64::INFINITY;

/// The state of the playback.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Control {
    pub(super) is_paused: bool,
    /// Snapshots to publish while paused.
    steps_due: u64,
    /// Simulated time per wall-clock time.
    pub(super) rate: f64,
}

/// A change of the playback.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Request {
    Pause,
    Resume,
    /// Publishes snapshots while paused.
    Step(u64),
    Rate(f64),
    /// Continues at another place, as a new run.
    Seek(Target),
}

/// A place to continue at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Target {
    /// A step of the recorded run, or the last recorded one before it.
    Step(u64),
    /// A number of steps back in the recorded run.
    BackSteps(u64),
    /// The recorded snapshot before the last published one.
    Previous,
    /// A simulated time from the last published snapshot on, in nanoseconds.
    By(i64),
    /// A part of the replay.
    Percent(u8),
}

impl Request {
    /// Returns the change that a command asks for. Rejects commands that would change the recording.
    pub(super) fn from_action(action: &Action) -> Result<Self, Reason> {
        Ok(match *action {
            Action::Pause => Self::Pause,
            Action::Resume => Self::Resume,
            Action::Step { count: 0 } => return Err(Reason::OutOfRange),
            Action::Step { count } => Self::Step(count.into()),
            Action::Rewind { to_step: Some(step), back_steps: None } => {
                Self::Seek(Target::Step(step))
            }
            Action::Rewind { to_step: None, back_steps: Some(count) } => {
                Self::Seek(Target::BackSteps(count.into()))
            }
            Action::Set { parameter, value, constraint_kind, block, collider } => {
                if Parameter::from_name(parameter.as_str()) != Some(Parameter::TimeScale) {
                    return Err(Reason::NoEffectHere);
                }
                let is_of_some = constraint_kind.is_some() || block.is_some() || collider.is_some();
                Self::Rate(rate(value).filter(|_| !is_of_some).ok_or(Reason::OutOfRange)?)
            }
            _ => return Err(Reason::NoEffectHere),
        })
    }
}

/// Returns the rate in a command. Its numbers have fewer digits than ours, so a rate is the shortest decimal
/// that they stand for: 0.1, not 0.10000000149.
fn rate(value: ParameterValue) -> Option<f64> {
    let ParameterValue::Number(number) = value else { return None };
    #[allow(
        clippy::cast_possible_truncation,
        reason = "the limits are compared as the command has them"
    )]
    let limits = *RATES.start() as f32..=*RATES.end() as f32;
    limits.contains(&number).then(|| number.to_string().parse().ok()).flatten()
}

impl Control {
    pub(super) fn new(starts_paused: bool, rate: f64) -> Self {
        Self { is_paused: starts_paused, steps_due: 0, rate }
    }

    /// Begins a run. A paused replay still publishes its first snapshot.
    pub(super) fn begin_run(&mut self) {
        self.steps_due = u64::from(self.is_paused);
    }

    pub(super) fn is_moving(self) -> bool {
        !self.is_paused || self.steps_due > 0
    }

    /// Counts a published snapshot.
    pub(super) fn count_step(&mut self) {
        self.steps_due = self.steps_due.saturating_sub(1);
    }

    /// Gives up the steps after the last snapshot.
    pub(super) fn end(&mut self) {
        self.steps_due = 0;
    }

    pub(super) fn set_paused(&mut self, is_paused: bool) {
        (self.is_paused, self.steps_due) = (is_paused, 0);
    }

    /// Publishes snapshots while paused.
    pub(super) fn step(&mut self, count: u64) -> Result<(), Reason> {
        if !self.is_paused {
            return Err(Reason::NoEffectHere);
        }
        self.steps_due = self.steps_due.saturating_add(count);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use sim_contract::{KindFilter, Part};

    use super::*;

    fn set(parameter: &str, value: f32) -> Action {
        let value = ParameterValue::Number(value);
        Action::set(parameter, value)
    }

    #[test]
    fn steps_are_counted_while_paused() {
        let mut control = Control::new(false, 1.0);
        assert!(control.is_moving());
        assert_eq!(control.step(1), Err(Reason::NoEffectHere));
        control.set_paused(true);
        assert!(!control.is_moving());
        assert_eq!(control.step(2), Ok(()));
        for _ in 0..2 {
            assert!(control.is_moving());
            control.count_step();
        }
        assert!(!control.is_moving());
        control.step(3).unwrap();
        control.end();
        assert!(!control.is_moving());
        control.set_paused(false);
        assert!(control.is_moving());
    }

    #[test]
    fn a_paused_replay_publishes_the_first_snapshot_of_each_run() {
        let mut control = Control::new(true, 1.0);
        control.begin_run();
        assert!(control.is_moving());
        control.count_step();
        assert!(!control.is_moving());
    }

    #[test]
    fn commands_control_the_replay_or_are_rejected_with_the_reason() {
        let rewind = |to_step, back_steps| Action::Rewind { to_step, back_steps };
        for (action, request) in [
            (Action::Pause, Ok(Request::Pause)),
            (Action::Step { count: 2 }, Ok(Request::Step(2))),
            (Action::Step { count: 0 }, Err(Reason::OutOfRange)),
            (rewind(Some(480), None), Ok(Request::Seek(Target::Step(480)))),
            (rewind(None, Some(9)), Ok(Request::Seek(Target::BackSteps(9)))),
            (set("time_scale", 0.5), Ok(Request::Rate(0.5))),
            (set("time_scale", 0.01), Ok(Request::Rate(0.01))),
            (set("time_scale", 0.1), Ok(Request::Rate(0.1))),
            (set("time_scale", 100.0), Ok(Request::Rate(100.0))),
            (set("time_scale", 0.0), Err(Reason::OutOfRange)),
            (set("time_scale", f32::NAN), Err(Reason::OutOfRange)),
            (set("time_scale", 100.1), Err(Reason::OutOfRange)),
            (set("damping", 0.1), Err(Reason::NoEffectHere)),
            (set("colour", 0.1), Err(Reason::NoEffectHere)),
            (Action::Pin { particle: 0 }, Err(Reason::NoEffectHere)),
            (Action::Reset, Err(Reason::NoEffectHere)),
            (Action::Unknown { number: 99 }, Err(Reason::NoEffectHere)),
        ] {
            assert_eq!(Request::from_action(&action), request, "{action:?}");
        }
        let Action::Set { parameter, value, .. } = set("time_scale", 1.0) else { unreachable!() };
        let constraint_kind = Some(KindFilter::Unknown);
        let of_kind =
            Action::Set { parameter, value, constraint_kind, block: None, collider: None };
        let of_block = set("time_scale", 1.0).for_part(Part::Block(0));
        for action in [of_kind, of_block] {
            assert_eq!(Request::from_action(&action), Err(Reason::OutOfRange));
        }
    }
}
