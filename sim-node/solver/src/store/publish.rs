//! The state of a particle at the end of a step.

use sim_types::ParticleFlags;

use crate::state::particles::Particle;

/// State of a particle after the last substep.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PublishedMotion {
    pub(crate) position: [f32; 3],
    pub(crate) displacement: [f32; 3],
    /// Length of a substep in seconds.
    pub(crate) h: f32,
}

/// Writes a state back with v = d / h and every zero as +0, so that equal numbers have equal bits.
/// Returns true if the particle froze: if its state is not finite, it stays for good where it was at
/// the start of the step.
#[inline(always)]
pub(crate) fn publish(state: &mut Particle, motion: PublishedMotion) -> bool {
    let PublishedMotion { position, displacement, h } = motion;
    let velocity = displacement.map(|axis| axis / h);
    let is_finite = position.iter().chain(&velocity).all(|number| number.is_finite());
    if is_finite {
        state.position = position.map(|axis| axis + 0.0);
        state.velocity = velocity.map(|axis| axis + 0.0);
    } else {
        state.velocity = [0.0; 3];
        state.inverse_mass = 0.0;
        state.flags = (state.flags | ParticleFlags::FROZEN) & !ParticleFlags::GRABBED;
    }
    !is_finite
}
