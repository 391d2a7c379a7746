//! Past states of the run, to rewind to.

use std::collections::VecDeque;
use std::rc::Rc;

use anyhow::Context;
use sim_contract::Reason;
use sim_solver::{Keyframe, Particle, Slot, Slots, Solver};

/// Most places where the run continued from another state than the last one. Beyond it the oldest are
/// forgotten, and steps back across them are counted as if they did not exist.
const BRANCHES_MAX: usize = 4096;

/// Kept states, in bounded memory.
///
/// Each step is kept while it fits. Then every second state of the older half is removed, again and
/// again, so that the distance between states grows with their age. The oldest one stays.
#[derive(Debug)]
pub(super) struct History {
    limit_bytes: usize,
    /// By ascending step, all of the same scene.
    states: VecDeque<KeptState>,
    size_bytes: usize,
    slots: Slots,
    /// By ascending step.
    branches: VecDeque<Branch>,
    newest: Option<Newest>,
}

/// A kept state.
#[derive(Debug)]
pub(super) struct KeptState {
    pub(super) step: u64,
    scene_step: u64,
    particles: Slot,
    /// Shared by steps that differ only in their scene step.
    keyframe: Rc<Keyframe>,
    size_bytes: usize,
}

impl KeptState {
    pub(super) fn keyframe(&self) -> Keyframe {
        self.keyframe.at_scene_step(self.scene_step)
    }
}

/// A step whose state was put in place: it is that of an earlier step.
#[derive(Debug, Clone, Copy)]
struct Branch {
    step: u64,
    from: u64,
}

/// The keyframe of the newest state, and what it depends on besides commands.
#[derive(Debug)]
struct Newest {
    keyframe: Rc<Keyframe>,
    torn_count: usize,
    frozen_count: u64,
}

/// Where to rewind to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Target {
    pub(super) to_step: Option<u64>,
    pub(super) back_steps: Option<u32>,
}

impl History {
    /// Takes `limit_bytes` of memory for the states of a solver; 0 keeps none.
    ///
    /// # Errors
    /// There is not enough memory.
    pub(super) fn new(limit_bytes: usize, solver: &Solver) -> anyhow::Result<Self> {
        let mut history = Self {
            limit_bytes,
            states: VecDeque::new(),
            size_bytes: 0,
            slots: Slots::new(limit_bytes).context("no memory for --history")?,
            branches: VecDeque::with_capacity(BRANCHES_MAX),
            newest: None,
        };
        history.restart(solver);
        Ok(history)
    }

    /// Forgets all states. Those of another scene follow.
    pub(super) fn restart(&mut self, solver: &Solver) {
        let count_max = self.limit_bytes / state_size_bytes(solver);
        self.states.clear();
        self.states.reserve(count_max);
        self.size_bytes = 0;
        self.slots.divide(solver.particle_count(), count_max);
        self.branches.clear();
        self.newest = None;
    }

    /// Returns `true` if at least the state of one step fits, or none is asked for.
    pub(super) fn has_room(&self, solver: &Solver) -> bool {
        self.limit_bytes == 0 || state_size_bytes(solver) <= self.limit_bytes
    }

    /// Keeps the state after a step. `is_commanded` is true if a command was applied before it.
    pub(super) fn keep(&mut self, step: u64, solver: &Solver, is_commanded: bool) {
        if self.limit_bytes == 0 {
            return;
        }
        let keyframe = self.keyframe(solver, is_commanded);
        // A shared keyframe counts for each of its states, so that the memory is never exceeded.
        let size_bytes = state_size_bytes(solver) + keyframe.size_bytes();
        if size_bytes > self.limit_bytes {
            return;
        }
        while self.size_bytes + size_bytes > self.limit_bytes && !self.states.is_empty() {
            self.thin();
        }
        let Some(particles) = self.slots.store(solver.particles()) else {
            unreachable!("{} states fill the memory for more of them", self.states.len())
        };
        self.size_bytes += size_bytes;
        let scene_step = solver.scene_step();
        self.states.push_back(KeptState { step, scene_step, particles, keyframe, size_bytes });
    }

    /// Returns the keyframe of the solver. Its scene step may be an earlier one.
    fn keyframe(&mut self, solver: &Solver, is_commanded: bool) -> Rc<Keyframe> {
        let (torn_count, frozen_count) = (solver.torn().len(), solver.frozen_count());
        let is_same = |newest: &&Newest| {
            !is_commanded
                && solver.grabs().len() == 0
                && (newest.torn_count, newest.frozen_count) == (torn_count, frozen_count)
        };
        if let Some(newest) = self.newest.as_ref().filter(is_same) {
            return Rc::clone(&newest.keyframe);
        }
        let keyframe = Rc::new(solver.keyframe());
        self.newest = Some(Newest { keyframe: Rc::clone(&keyframe), torn_count, frozen_count });
        keyframe
    }

    /// Removes every second state of the older half, but not the oldest. A single state is removed.
    fn thin(&mut self) {
        let older_count = (self.states.len() / 2).max(2);
        let is_removed = |index: usize| index < older_count && index % 2 == 1;
        if self.states.len() == 1 {
            self.remove_all();
            return;
        }
        let mut index = 0;
        let Self { states, slots, size_bytes, .. } = self;
        states.retain(|state| {
            let keeps = !is_removed(index);
            index += 1;
            if !keeps {
                *size_bytes -= state.size_bytes;
                slots.release(state.particles);
            }
            keeps
        });
    }

    fn remove_all(&mut self) {
        for state in self.states.drain(..) {
            self.slots.release(state.particles);
        }
        self.size_bytes = 0;
    }

    /// Returns the particles of a kept state.
    pub(super) fn particles(&self, state: &KeptState) -> &[Particle] {
        self.slots.particles(state.particles)
    }

    /// Notes that the state of `step` is that of the step `from`.
    pub(super) fn add_branch(&mut self, step: u64, from: u64) {
        if self.branches.len() == BRANCHES_MAX {
            self.branches.pop_front();
        }
        self.branches.push_back(Branch { step, from });
    }

    /// Returns the newest kept state at or before the target. The last step is `step`.
    pub(super) fn find(&self, step: u64, target: Target) -> Result<&KeptState, Reason> {
        if self.limit_bytes == 0 {
            return Err(Reason::NoEffectHere);
        }
        let target = match target {
            Target { to_step: Some(to_step), back_steps: None } if to_step <= step => to_step,
            Target { to_step: None, back_steps: Some(back_steps) } => {
                self.steps_before(step, back_steps.into()).ok_or(Reason::UnknownStep)?
            }
            _ => return Err(Reason::OutOfRange),
        };
        let count = self.states.partition_point(|state| state.step <= target);
        count.checked_sub(1).and_then(|index| self.states.get(index)).ok_or(Reason::UnknownStep)
    }

    /// Returns the step that lies `back_steps` before `step`, on the way to it. A rewind continues from
    /// the step that it went to, so the steps that it left behind do not count.
    fn steps_before(&self, step: u64, back_steps: u64) -> Option<u64> {
        let (mut at, mut left) = (step, back_steps);
        for branch in self.branches.iter().rev() {
            if branch.step > at {
                continue;
            }
            let since = at - branch.step;
            if left <= since {
                break;
            }
            (at, left) = (branch.from, left - since);
        }
        at.checked_sub(left)
    }
}

/// Memory of a state without its keyframe, which other states may share.
fn state_size_bytes(solver: &Solver) -> usize {
    size_of::<KeptState>() + size_of_val(solver.particles())
}

#[cfg(test)]
mod tests {
    //! Checks which states are kept, and that each is the one of its step.
    use sim_solver::{Grab, Scene, builtin};

    use super::*;

    fn pendulum() -> Solver {
        let text = builtin::text("pendulum").unwrap();
        Solver::new(&Scene::from_toml(text, "pendulum").unwrap())
    }

    fn steps(history: &History) -> Vec<u64> {
        history.states.iter().map(|state| state.step).collect()
    }

    /// A history with room for about `count` states, after the steps up to `last`.
    fn history_after(count: usize, last: u64) -> History {
        let mut solver = pendulum();
        let size_bytes = state_size_bytes(&solver) + solver.keyframe().size_bytes();
        let mut history = History::new(count * size_bytes, &solver).unwrap();
        history.keep(0, &solver, false);
        for step in 1..=last {
            solver.step();
            history.keep(step, &solver, false);
        }
        history
    }

    #[test]
    fn every_step_is_kept_while_it_fits() {
        let history = history_after(100, 99);
        assert_eq!(steps(&history), (0..100).collect::<Vec<_>>());
    }

    #[test]
    fn old_states_are_further_apart_and_the_first_and_the_last_stay() {
        for last in [100, 1000, 10_000] {
            let history = history_after(64, last);
            let kept = steps(&history);
            assert_eq!((kept[0], *kept.last().unwrap()), (0, last));
            assert!((32..=64).contains(&kept.len()), "{kept:?}");
            let gaps: Vec<_> = kept.windows(2).map(|pair| pair[1] - pair[0]).collect();
            assert_eq!(gaps[gaps.len() - 16..], [1; 16], "{gaps:?}");
            assert!(gaps.is_sorted_by(|old, new| new <= old), "{gaps:?}");
            assert!(history.size_bytes <= history.limit_bytes);
            let sum: usize = history.states.iter().map(|state| state.size_bytes).sum();
            assert_eq!(history.size_bytes, sum);
        }
    }

    #[test]
    fn a_history_for_a_single_state_keeps_the_last_one() {
        assert_eq!(steps(&history_after(1, 7)), [7]);
        let history = history_after(0, 7);
        assert!(steps(&history).is_empty());
        assert!(history.has_room(&pendulum()), "none is asked for");
        assert!(!History::new(10, &pendulum()).unwrap().has_room(&pendulum()));
    }

    #[test]
    fn a_kept_state_continues_as_its_step_did() {
        let mut solver = pendulum();
        let mut history = History::new(1 << 20, &solver).unwrap();
        let mut hashes = Vec::new();
        for step in 0..200 {
            if step == 20 {
                solver
                    .grab(1, Grab { particle: 1, target: [0.2, -0.4, 0.1], over_s: 0.2 })
                    .unwrap();
            }
            if step == 90 {
                solver.release(1, 1).unwrap();
            }
            solver.step();
            let kept = [20, 90].contains(&step);
            history.keep(step, &solver, kept);
            hashes.push(solver.state_hash());
            assert_eq!(history.states.back().unwrap().keyframe(), solver.keyframe(), "{step}");
        }
        for from in [0, 19, 20, 25, 89, 90, 150] {
            let state =
                history.find(199, Target { to_step: Some(from), back_steps: None }).unwrap();
            assert_eq!(state.step, from);
            let mut again = pendulum();
            again.put_in_place(history.particles(state), &state.keyframe()).unwrap();
            again.step();
            assert_eq!(again.state_hash(), hashes[usize::try_from(from).unwrap()]);
            let commanded = [20, 90].into_iter().find(|step| *step > from).unwrap_or(200);
            for step in from + 1..commanded {
                again.step();
                assert_eq!(again.state_hash(), hashes[usize::try_from(step).unwrap()], "{step}");
            }
        }
    }

    #[test]
    fn steps_back_follow_the_way_to_the_current_state() {
        let mut history = history_after(1000, 700);
        let back = |history: &History, step, back_steps| history.steps_before(step, back_steps);
        assert_eq!(back(&history, 700, 50), Some(650));
        // Step 701 has the state of step 500.
        history.add_branch(701, 500);
        assert_eq!(back(&history, 701, 0), Some(701));
        assert_eq!(back(&history, 711, 10), Some(701));
        assert_eq!(back(&history, 711, 20), Some(490));
        // Step 720 has the state of step 710: twenty steps before it lies step 490.
        history.add_branch(720, 710);
        assert_eq!(back(&history, 720, 9), Some(701));
        assert_eq!(back(&history, 720, 19), Some(490));
        // Step 730 has the state of step 100, before all branches.
        history.add_branch(730, 100);
        assert_eq!(back(&history, 731, 11), Some(90));
        assert_eq!(back(&history, 731, 102), None);
    }

    #[test]
    fn a_target_that_is_not_kept_has_a_reason() {
        let target = |to_step, back_steps| Target { to_step, back_steps };
        let reason = |history: &History, target| history.find(700, target).map(|kept| kept.step);
        let history = history_after(1000, 700);
        assert_eq!(reason(&history, target(Some(300), None)), Ok(300));
        assert_eq!(reason(&history, target(None, Some(0))), Ok(700));
        assert_eq!(reason(&history, target(None, Some(701))), Err(Reason::UnknownStep));
        for wrong in [target(Some(701), None), target(None, None), target(Some(1), Some(1))] {
            assert_eq!(reason(&history, wrong), Err(Reason::OutOfRange));
        }
        let thinned = history_after(64, 700);
        let found = reason(&thinned, target(Some(123), None)).unwrap();
        assert!(found <= 123);
        assert_eq!(reason(&history_after(1, 700), target(Some(3), None)), Err(Reason::UnknownStep));
        assert_eq!(
            reason(&History::new(0, &pendulum()).unwrap(), target(Some(3), None)),
            Err(Reason::NoEffectHere)
        );
    }
}
