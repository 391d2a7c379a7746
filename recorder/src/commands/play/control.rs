//! The controls of a replay: pause, step, seek and rate, and the deadlines of its snapshots.

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
    Seek(SeekTarget),
}

/// A place to continue at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum SeekTarget {
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
        action.validate()?;
        Ok(match *action {
            Action::Pause => Self::Pause,
            Action::Resume => Self::Resume,
            Action::Step { count } => Self::Step(count.into()),
            Action::Rewind { to_step: Some(step), back_steps: None } => {
                Self::Seek(SeekTarget::Step(step))
            }
            Action::Rewind { to_step: None, back_steps: Some(count) } => {
                Self::Seek(SeekTarget::BackSteps(count.into()))
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

/// Longest delay to catch up, in nanoseconds. After a longer one the replay continues from the
/// current time.
const CATCH_UP_MAX_NS: u64 = 200_000_000;

/// Maps recorded time to CLOCK_MONOTONIC. All times are in nanoseconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pace {
    /// Recorded time per wall-clock time. Infinite where every snapshot is due at once.
    rate: f64,
    /// `None` before the first snapshot and after a pause.
    base: Option<Base>,
}

/// A recorded time and its deadline.
#[derive(Debug, Clone, Copy)]
struct Base {
    recorded_ns: u64,
    deadline_ns: u64,
}

impl Pace {
    pub(crate) fn new(rate: f64) -> Self {
        Self { rate, base: None }
    }

    /// Makes the next snapshot due at once.
    pub(crate) fn restart(&mut self) {
        self.base = None;
    }

    /// Changes the rate. The place in the recording stays the same.
    pub(crate) fn set_rate(&mut self, rate: f64, now_ns: u64) {
        if self.rate.is_infinite() {
            // Nothing was due at a time.
            self.restart();
        } else if let Some(base) = &mut self.base {
            let passed_ns = now_ns.saturating_sub(base.deadline_ns) as f64 * self.rate;
            base.recorded_ns = base.recorded_ns.saturating_add(whole_ns(passed_ns));
            base.deadline_ns = base.deadline_ns.max(now_ns);
        }
        self.rate = rate;
    }

    /// Returns the deadline of the snapshot at `recorded_ns`. The previous snapshot is published
    /// already.
    pub(crate) fn deadline_ns(&mut self, recorded_ns: u64, now_ns: u64) -> u64 {
        let base = *self.base.get_or_insert(Base { recorded_ns, deadline_ns: now_ns });
        let passed_ns = recorded_ns.saturating_sub(base.recorded_ns) as f64 / self.rate;
        let deadline_ns = base.deadline_ns.saturating_add(whole_ns(passed_ns));
        if deadline_ns.saturating_add(CATCH_UP_MAX_NS) < now_ns {
            self.base = Some(Base { recorded_ns, deadline_ns: now_ns });
            return now_ns;
        }
        deadline_ns
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "positive, and saturating at the maximum"
)]
fn whole_ns(ns: f64) -> u64 {
    ns as u64
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
            (rewind(Some(480), None), Ok(Request::Seek(SeekTarget::Step(480)))),
            (rewind(None, Some(9)), Ok(Request::Seek(SeekTarget::BackSteps(9)))),
            (set("time_scale", 0.5), Ok(Request::Rate(0.5))),
            (set("time_scale", 0.01), Ok(Request::Rate(0.01))),
            (set("time_scale", 0.1), Ok(Request::Rate(0.1))),
            (set("time_scale", 100.0), Ok(Request::Rate(100.0))),
            (set("time_scale", 0.0), Err(Reason::OutOfRange)),
            (set("time_scale", f32::NAN), Err(Reason::NonFinite)),
            (set("time_scale", 100.1), Err(Reason::OutOfRange)),
            (set("damping", 0.1), Err(Reason::NoEffectHere)),
            (set("colour", 0.1), Err(Reason::UnknownParameter)),
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

#[cfg(test)]
mod pace_tests {
    use super::*;

    const STEP_NS: u64 = 4_000_000;

    #[test]
    fn snapshots_are_due_at_the_recorded_intervals_divided_by_the_rate() {
        for (rate, expected_ns) in [(1.0, STEP_NS), (2.0, STEP_NS / 2), (0.5, STEP_NS * 2)] {
            let mut pace = Pace::new(rate);
            for step in 0..100 {
                let deadline_ns = pace.deadline_ns(77 + step * STEP_NS, 1000 + step * expected_ns);
                assert_eq!(deadline_ns, 1000 + step * expected_ns);
            }
        }
    }

    #[test]
    fn a_late_snapshot_does_not_delay_the_following_ones() {
        let mut pace = Pace::new(1.0);
        pace.deadline_ns(0, 0);
        assert_eq!(pace.deadline_ns(STEP_NS, STEP_NS * 3), STEP_NS);
        assert_eq!(pace.deadline_ns(STEP_NS * 4, STEP_NS * 3), STEP_NS * 4);
    }

    #[test]
    fn a_change_of_the_rate_keeps_the_place_in_the_recording() {
        let mut pace = Pace::new(1.0);
        pace.deadline_ns(0, 0);
        // Half of a step has passed. The other half takes twice its time.
        pace.set_rate(0.5, STEP_NS / 2);
        assert_eq!(pace.deadline_ns(STEP_NS, STEP_NS / 2), STEP_NS / 2 + STEP_NS);
        pace.set_rate(2.0, STEP_NS / 2 + STEP_NS);
        assert_eq!(pace.deadline_ns(STEP_NS * 3, STEP_NS * 2), STEP_NS / 2 + STEP_NS * 2);
    }

    #[test]
    fn without_a_limit_each_snapshot_is_due_at_once_until_a_rate_is_set() {
        let mut pace = Pace::new(f64::INFINITY);
        for step in 0..100 {
            assert!(pace.deadline_ns(step * STEP_NS, 1000 + step) <= 1000 + step);
        }
        pace.set_rate(1.0, 2000);
        assert_eq!(pace.deadline_ns(100 * STEP_NS, 2000), 2000);
        assert_eq!(pace.deadline_ns(101 * STEP_NS, 2000), 2000 + STEP_NS);
    }

    #[test]
    fn after_a_long_delay_the_replay_continues_from_the_current_time() {
        let mut pace = Pace::new(1.0);
        pace.deadline_ns(0, 0);
        let late_ns = CATCH_UP_MAX_NS * 2;
        assert_eq!(pace.deadline_ns(STEP_NS, late_ns), late_ns);
        assert_eq!(pace.deadline_ns(STEP_NS * 2, late_ns), late_ns + STEP_NS);
    }
}
