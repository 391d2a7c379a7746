//! Past states of the run, to rewind to.

use std::collections::VecDeque;
use std::rc::Rc;

use anyhow::Context;
use sim_contract::Reason;
use sim_solver::{Blocks, Chain, Keyframe, Particle, Solver};

/// Most rewinds to remember. Beyond it the oldest rewinds are forgotten, and steps back across them are counted as if they
/// had not happened.
const BRANCHES_MAX: usize = 4096;
/// Most states. To thin more of them would take milliseconds of the loop.
const STATES_MAX: usize = 1 << 17;

/// The list of the states takes at least 1/16 of the memory, because a load may bring a scene with smaller states.
const LIST_PART: usize = 16;
/// Fewest particles for which a state takes memory.
const PARTICLES_MIN: usize = 8;
/// Size of the list's entry for a state with a keyframe of its own.
const ENTRY_SIZE_BYTES: usize = size_of::<KeptState>() + size_of::<(usize, usize, KeptKeyframe)>();

/// Kept states, with their keyframes, in a fixed memory.
///
/// Each step is kept while there is room. Whenever the memory is full, every second state of the older half is removed,
/// so that the distance between states grows with their age. The oldest state stays.
#[derive(Debug)]
pub(super) struct History {
    /// By ascending step, all of the same scene.
    states: VecDeque<KeptState>,
    count_max: usize,
    blocks: Blocks,
    /// By ascending step.
    branches: VecDeque<Branch>,
    newest: Option<Newest>,
    /// States are asked for, and at least one of the scene fits.
    is_on: bool,
}

/// A kept state.
#[derive(Debug)]
pub(super) struct KeptState {
    pub(super) step: u64,
    scene_step: u64,
    particles: Chain,
    /// Shared by steps that differ only in their scene step.
    keyframe: Rc<KeptKeyframe>,
}

/// An encoded keyframe.
#[derive(Debug)]
struct KeptKeyframe {
    chain: Chain,
    size_bytes: usize,
}

/// A step whose state is a copy of the state of an earlier step, which a rewind put in place.
#[derive(Debug, Clone, Copy)]
struct Branch {
    step: u64,
    from: u64,
}

/// The keyframe of the newest state, and what it depends on besides commands.
#[derive(Debug)]
struct Newest {
    keyframe: Rc<KeptKeyframe>,
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
        const PROBLEM: &str = "no memory for --history";
        let count_max = longest_list(limit_bytes, solver.particle_count());
        let mut states = VecDeque::new();
        states.try_reserve_exact(count_max).context(PROBLEM)?;
        let mut history = Self {
            states,
            count_max,
            blocks: Blocks::new(limit_bytes.saturating_sub(count_max * ENTRY_SIZE_BYTES))
                .context(PROBLEM)?,
            branches: VecDeque::with_capacity(BRANCHES_MAX),
            newest: None,
            is_on: false,
        };
        history.restart(solver);
        Ok(history)
    }

    /// Forgets all states. Those of another scene follow.
    pub(super) fn restart(&mut self, solver: &Solver) {
        self.states.clear();
        self.newest = None;
        self.branches.clear();
        self.blocks.divide(solver.particle_count());
        self.is_on = self.count_max > 0 && self.has_room(solver);
    }

    /// Returns `true` if at least the state of one step fits, or none is asked for. Call it before one is kept.
    pub(super) fn has_room(&self, solver: &Solver) -> bool {
        let keyframe_size_bytes = solver.keyframe().encode().len();
        self.count_max == 0
            || self.block_count(solver, keyframe_size_bytes) <= self.blocks.free_count()
    }

    /// Number of blocks of a state, with a keyframe of this size.
    fn block_count(&self, solver: &Solver, keyframe_size_bytes: usize) -> usize {
        let Self { blocks, .. } = self;
        blocks.count_for(solver.particle_count()) + blocks.count_for_bytes(keyframe_size_bytes)
    }

    /// Keeps the state after a step. `is_commanded` is true if a command was applied before it.
    pub(super) fn keep(&mut self, step: u64, solver: &Solver, is_commanded: bool) {
        if !self.is_on {
            return;
        }
        let (torn_count, frozen_count) = (solver.torn().len(), solver.frozen_count());
        let is_same = |newest: &mut Newest| {
            !is_commanded
                && !solver.changes_without_commands()
                && (newest.torn_count, newest.frozen_count) == (torn_count, frozen_count)
        };
        if self.newest.as_mut().is_none_or(|newest| !is_same(newest)) {
            let bytes = solver.keyframe().encode();
            self.forget_newest();
            if !self.make_room(self.block_count(solver, bytes.len())) {
                return;
            }
            let Some(chain) = self.blocks.store_bytes(&bytes) else { return };
            let keyframe = Rc::new(KeptKeyframe { chain, size_bytes: bytes.len() });
            self.newest = Some(Newest { keyframe, torn_count, frozen_count });
        }
        // The newest keyframe fits beside one state: it was stored for one.
        if self.make_room(self.block_count(solver, 0))
            && let Some(newest) = &self.newest
            && let Some(particles) = self.blocks.store(solver.particles())
        {
            let (scene_step, keyframe) = (solver.scene_step(), Rc::clone(&newest.keyframe));
            self.states.push_back(KeptState { step, scene_step, particles, keyframe });
        }
    }

    /// Removes states until this number of blocks is free, and there is a place in the list. Returns `false` if the
    /// blocks are not free without any state.
    fn make_room(&mut self, block_count: usize) -> bool {
        while self.blocks.free_count() < block_count || self.states.len() == self.count_max {
            if self.states.is_empty() {
                return false;
            }
            self.thin();
        }
        true
    }

    /// Removes every second state of the older half, but not the oldest. A single state is removed.
    fn thin(&mut self) {
        let older_count = (self.states.len() / 2).max(2);
        let is_removed = |index: usize| index < older_count && index % 2 == 1;
        if self.states.len() == 1 {
            self.remove_last();
            return;
        }
        // The states behind the first removed one move up.
        let mut kept_count = 1;
        for index in 1..self.states.len() {
            if !is_removed(index) {
                self.states.swap(kept_count, index);
                kept_count += 1;
            }
        }
        while self.states.len() > kept_count {
            self.remove_last();
        }
    }

    fn remove_last(&mut self) {
        if let Some(KeptState { particles, keyframe, .. }) = self.states.pop_back() {
            self.blocks.release(particles);
            self.drop_keyframe(keyframe);
        }
    }

    fn forget_newest(&mut self) {
        if let Some(newest) = self.newest.take() {
            self.drop_keyframe(newest.keyframe);
        }
    }

    /// Frees the memory of a keyframe that no other state shares.
    fn drop_keyframe(&mut self, keyframe: Rc<KeptKeyframe>) {
        if let Ok(keyframe) = Rc::try_unwrap(keyframe) {
            self.blocks.release(keyframe.chain);
        }
    }

    /// Returns a copy of the particles of a kept state.
    pub(super) fn particles(&self, state: &KeptState) -> Vec<Particle> {
        self.blocks.read(&state.particles)
    }

    /// Returns a copy of the keyframe of a kept state.
    pub(super) fn keyframe(&self, state: &KeptState) -> Keyframe {
        let KeptKeyframe { chain, size_bytes } = &*state.keyframe;
        let bytes = self.blocks.read_bytes(chain, *size_bytes);
        let keyframe = Keyframe::decode(&bytes);
        let Ok(keyframe) = keyframe else {
            unreachable!("an encoded keyframe decodes: {keyframe:?}")
        };
        keyframe.at_scene_step(state.scene_step)
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
        if self.count_max == 0 {
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

/// Returns the most states that fit into the memory beside their entries in the list: at least one, if there is any
/// memory.
fn longest_list(limit_bytes: usize, particle_count: usize) -> usize {
    let state_size_bytes = particle_count.max(PARTICLES_MIN) * size_of::<Particle>();
    let count = limit_bytes / (ENTRY_SIZE_BYTES + state_size_bytes);
    let count = count.max(limit_bytes / LIST_PART / ENTRY_SIZE_BYTES);
    count.clamp(limit_bytes.min(1), STATES_MAX)
}

#[cfg(test)]
mod tests {
    //! Checks which states are kept, and that each is the one of its step.
    use sim_solver::{Grab, Pose, Scene, builtin};

    use super::*;

    fn pendulum() -> Solver {
        let text = builtin::text("pendulum").unwrap();
        Solver::new(&Scene::from_toml(text, "pendulum").unwrap())
    }

    fn cloth() -> Solver {
        Solver::new(&Scene::from_toml(builtin::text("curtain").unwrap(), "curtain").unwrap())
    }

    fn steps(history: &History) -> Vec<u64> {
        history.states.iter().map(|state| state.step).collect()
    }

    /// Memory for `count` states and one keyframe.
    fn limit_bytes(count: usize, solver: &Solver) -> usize {
        let state = ENTRY_SIZE_BYTES + solver.particle_count().max(8) * size_of::<Particle>() + 4;
        count * state + if count == 0 { 0 } else { solver.keyframe().encode().len() + 400 }
    }

    /// A history with room for about `count` states, after the steps up to `last`.
    fn history_after(count: usize, last: u64) -> History {
        let mut solver = pendulum();
        let mut history = History::new(limit_bytes(count, &solver), &solver).unwrap();
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
        }
    }

    #[test]
    fn a_history_for_a_single_state_keeps_the_last_one() {
        assert_eq!(steps(&history_after(1, 7)), [7]);
        let history = history_after(0, 7);
        assert!(steps(&history).is_empty());
        assert!(history.has_room(&pendulum()), "none is asked for");
    }

    #[test]
    fn a_memory_that_is_too_small_for_a_state_is_not_none() {
        for limit_bytes in [1, 300, 1300, 5000] {
            let mut history = History::new(limit_bytes, &cloth()).unwrap();
            assert!(!history.has_room(&cloth()), "{limit_bytes}");
            history.keep(0, &cloth(), false);
            let target = Target { to_step: Some(0), back_steps: None };
            assert_eq!(history.find(0, target).unwrap_err(), Reason::UnknownStep);
        }
    }

    #[test]
    fn states_of_any_size_fill_the_memory() {
        for (mut solver, limit_bytes) in [(pendulum(), 1 << 17), (cloth(), 1 << 21)] {
            let mut history = History::new(limit_bytes, &solver).unwrap();
            let all = history.blocks.free_count();
            let mut fewest_free = all;
            for step in 0..1000 {
                history.keep(step, &solver, false);
                fewest_free = fewest_free.min(history.blocks.free_count());
                solver.step();
            }
            assert!(fewest_free * 10 < all, "{fewest_free} of {all} blocks were never used");
        }
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
            assert_eq!(
                history.keyframe(history.states.back().unwrap()),
                solver.keyframe(),
                "{step}"
            );
        }
        for from in [0, 19, 20, 25, 89, 90, 150] {
            let state =
                history.find(199, Target { to_step: Some(from), back_steps: None }).unwrap();
            assert_eq!(state.step, from);
            let mut again = pendulum();
            again.put_in_place(&history.particles(state), &history.keyframe(state)).unwrap();
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
    fn a_state_on_the_way_of_a_collider_is_kept_with_its_place() {
        let text = "version = 1\n[[particle]]\nposition = [0, 0.2, 0]\n\
            [[collider]]\nshape = \"sphere\"\ncenter = [0, 0, 0]\nradius = 0.1\n";
        let scene = Scene::from_toml(text, "test").unwrap();
        let mut solver = Solver::new(&scene);
        let mut history = History::new(1 << 20, &solver).unwrap();
        let mut keyframes = Vec::new();
        for step in 0..200 {
            let is_commanded = step == 20;
            if is_commanded {
                let pose = Pose { translation: [0.3, 0.1, 0.0], rotation: [0.0, 0.0, 0.0, 1.0] };
                solver.move_collider_over(0, pose, 0.5).unwrap();
            }
            solver.step();
            history.keep(step, &solver, is_commanded);
            let kept = history.states.back().unwrap();
            assert_eq!(history.keyframe(kept), solver.keyframe(), "{step}");
            keyframes.push(Rc::as_ptr(&kept.keyframe));
        }
        keyframes.dedup();
        // One before the motion, one for each of its 120 steps, and none after it.
        assert_eq!(keyframes.len(), 121);
    }

    /// The bytes that a history takes beside its branches.
    fn size_bytes(history: &History) -> usize {
        let keyframes = history.states.iter().map(|state| Rc::as_ptr(&state.keyframe));
        let keyframes: std::collections::BTreeSet<_> = keyframes.collect();
        history.blocks.size_bytes()
            + history.states.capacity() * size_of::<KeptState>()
            + keyframes.len() * (ENTRY_SIZE_BYTES - size_of::<KeptState>())
    }

    #[test]
    fn states_with_keyframes_of_their_own_stay_within_the_memory_and_it_is_full() {
        for (mut solver, limit_bytes) in [(pendulum(), 1 << 17), (cloth(), 1 << 20)] {
            let mut history = History::new(limit_bytes, &solver).unwrap();
            let mut fullest = 0;
            for step in 0..2000 {
                // Each step needs a keyframe of its own.
                history.keep(step, &solver, true);
                assert!(size_bytes(&history) <= limit_bytes, "{step}");
                let state = history.states.back().unwrap();
                assert_eq!(
                    (state.step, history.particles(state)),
                    (step, solver.particles().to_vec())
                );
                fullest = fullest.max(history.states.len());
                if step % 100 == 99 {
                    solver.step();
                }
            }
            let state = history.block_count(&solver, solver.keyframe().encode().len());
            let all = history.blocks.free_count() + history.states.len() * state;
            assert!(fullest == history.count_max || (fullest + 1) * state > all, "{fullest}");
            while !history.states.is_empty() {
                history.remove_last();
            }
            history.forget_newest();
            assert_eq!(history.blocks.free_count(), all, "every block is free again");
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
