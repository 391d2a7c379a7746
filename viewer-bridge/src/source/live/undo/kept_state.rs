//! Complete states that the bridge keeps, to give them back to the node.

use std::collections::VecDeque;

use sim_contract::{GivenState, ParticleFlags, Text};
use sim_solver::Keyframe;

use crate::source::live::newest_state::LoadedState;

/// Newest keyframes that are kept. The node publishes one with each command and each second, and the state
/// that the bridge reads can be some steps older than the newest one.
const KEYFRAMES_MAX: usize = 8;

/// The newest keyframes of a run, as the node published them.
#[derive(Debug, Default)]
pub(in crate::source::live) struct Keyframes(VecDeque<(u64, Vec<u8>)>);

impl Keyframes {
    /// Keeps the keyframe of a step. A node may publish it twice.
    pub(in crate::source::live) fn add(&mut self, step: u64, bytes: Vec<u8>) {
        if self.0.back().is_some_and(|(last, _)| *last == step) {
            self.0.pop_back();
        } else if self.0.len() == KEYFRAMES_MAX {
            self.0.pop_front();
        }
        self.0.push_back((step, bytes));
    }

    /// Returns the keyframe that completes a state, if it is certain and no particle is grabbed.
    ///
    /// Between two keyframes, only the step of the scene changes, unless something tears or freezes, a particle is
    /// grabbed, or a motion is under way: commands other than the motion of a grab have a keyframe of their own.
    fn of_state(&self, state: &LoadedState<'_>) -> Option<Vec<u8>> {
        let header = state.header;
        let at = |step| self.0.iter().rev().find(|(one, _)| *one == step);
        let (step, bytes) = at(header.step).or_else(|| at(header.keyframe_step))?;
        let keyframe = Keyframe::decode(bytes).ok()?;
        if keyframe.has_grabs() || keyframe.torn().len() != header.torn_count as usize {
            return None;
        }
        if *step == header.step {
            return Some(bytes.clone());
        }
        if keyframe.changes_without_commands() {
            return None;
        }
        let is_frozen = state.particles.iter().any(|one| one.flags & ParticleFlags::FROZEN != 0);
        (!is_frozen).then(|| keyframe.at_scene_step(header.scene_step).encode())
    }
}

/// A complete state, and the scene that it belongs to.
#[derive(Debug)]
pub(super) struct KeptState {
    pub(super) scene_hash: u64,
    /// The name or path that the node loads to run the scene again, if it is known.
    pub(super) source: Option<Text>,
    particles: Vec<sim_contract::ParticleState>,
    keyframe: Vec<u8>,
}

impl KeptState {
    /// Copies a state, if it can be completed.
    pub(super) fn copy(
        state: &LoadedState<'_>,
        keyframes: &Keyframes,
        source: Option<Text>,
    ) -> Option<Self> {
        let keyframe = keyframes.of_state(state)?;
        let scene_hash = state.load.header.scene_hash;
        Some(Self { scene_hash, source, particles: state.particles.to_vec(), keyframe })
    }

    /// The state, for the node.
    pub(super) fn given(&self) -> GivenState<'_> {
        let Self { scene_hash, particles, keyframe, .. } = self;
        GivenState { scene_hash: *scene_hash, particles, keyframe: Some(keyframe) }
    }

    pub(super) fn size_bytes(&self) -> usize {
        size_of_val(self.particles.as_slice()) + self.keyframe.len()
    }
}
