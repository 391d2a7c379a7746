//! The state of the particles between two steps, as it is published.

use bytemuck::{Pod, Zeroable};
use sim_scene::scene::SceneParticle;
use sim_types::ParticleFlags;

/// A particle as it is published and hashed: 32 bytes, little-endian, without padding.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Particle {
    /// Position relative to the scene's origin, in the scene's unit.
    pub position: [f32; 3],
    /// Inverse mass in 1/kg as the step uses it: 0 for pinned, grabbed, anchored and frozen particles.
    pub inverse_mass: f32,
    /// Velocity in units per second; 0 for pinned and frozen particles.
    pub velocity: [f32; 3],
    /// Bits of [`ParticleFlags`].
    pub flags: u32,
}

const _: () = assert!(size_of::<Particle>() == 32);

/// All particles between two steps, `particle_count` entries in each array.
#[derive(Debug, Clone)]
pub(crate) struct Particles {
    /// The published state.
    pub(crate) states: Vec<Particle>,
    /// Inverse mass of each particle when it is free.
    pub(crate) base_inverse_masses: Vec<f32>,
}

impl Particles {
    /// The particles of a scene at its step 0. An anchored particle is not pinned as well.
    pub(crate) fn new(scene: &[SceneParticle], anchored: impl Iterator<Item = u32>) -> Self {
        let state = |one: &SceneParticle| Particle {
            position: one.position.map(|axis| axis + 0.0),
            inverse_mass: 0.0,
            velocity: one.velocity.map(|axis| axis + 0.0),
            flags: if one.pinned { ParticleFlags::PINNED } else { 0 },
        };
        let mut states: Vec<_> = scene.iter().map(state).collect();
        for particle in anchored {
            states[particle as usize].flags = ParticleFlags::ANCHORED;
        }
        let base_inverse_masses: Vec<_> = scene.iter().map(|one| 1.0 / one.mass).collect();
        for (state, base) in states.iter_mut().zip(&base_inverse_masses) {
            state.inverse_mass = if state.flags == 0 { *base } else { 0.0 };
        }
        Self { states, base_inverse_masses }
    }

    /// Sets and clears flags, and updates the inverse mass accordingly.
    pub(crate) fn change_flags(&mut self, index: usize, set: u32, clear: u32) {
        let state = &mut self.states[index];
        state.flags = (state.flags | set) & !clear;
        let is_fixed = state.flags & ParticleFlags::ALL != 0;
        state.inverse_mass = if is_fixed { 0.0 } else { self.base_inverse_masses[index] };
    }

    pub(crate) fn stop(&mut self, index: usize) {
        self.states[index].velocity = [0.0; 3];
    }

    /// Replaces -0, which commands may leave, by +0.
    pub(crate) fn make_zeros_canonical(&mut self) {
        for state in &mut self.states {
            for number in state.position.iter_mut().chain(&mut state.velocity) {
                *number += 0.0;
            }
        }
    }
}
