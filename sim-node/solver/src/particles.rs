//! The state of the particles: one array per field, hot arrays apart from cold ones.

use bytemuck::{Pod, Zeroable};

use crate::scene::SceneParticle;

/// One particle as it is published and hashed: 32 bytes, little-endian, no padding.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Particle {
    /// Position relative to the scene's origin, in the scene's unit.
    pub position: [f32; 3],
    /// 1/mass as the step uses it: 0 for pinned, grabbed and frozen particles.
    pub inverse_mass: f32,
    /// Velocity per second; 0 for pinned and frozen particles.
    pub velocity: [f32; 3],
    /// Bits of [`flag`].
    pub flags: u32,
}

const _: () = assert!(size_of::<Particle>() == 32);

/// The bits of [`Particle::flags`].
pub mod flag {
    /// Held where it stands.
    pub const PINNED: u32 = 1;
    /// Driven to a client's target.
    pub const GRABBED: u32 = 1 << 1;
    /// Driven by an anchor's motion.
    pub const ANCHORED: u32 = 1 << 2;
    /// Taken out because its state was no longer finite.
    pub const FROZEN: u32 = 1 << 3;
    /// All that this version can set.
    pub(crate) const KNOWN: u32 = PINNED | GRABBED | ANCHORED | FROZEN;
    /// With any of these, the step uses inverse mass 0.
    pub(crate) const FIXED: u32 = PINNED | GRABBED | ANCHORED | FROZEN;
}

/// All particles, `particle_count` entries in each array. Vectors are padded to four lanes, so
/// that a particle is one 16-byte load for a vector kernel.
#[derive(Debug, Clone)]
pub(crate) struct Particles {
    /// x, y, z, and in the last lane the inverse mass that the step uses.
    pub(crate) positions: Vec<[f32; 4]>,
    /// The displacement d of the running substep; the last lane is 0.
    pub(crate) displacements: Vec<[f32; 4]>,
    /// The last lane is 0.
    pub(crate) velocities: Vec<[f32; 4]>,
    /// Cold: the inverse mass of the particle when nothing holds it.
    pub(crate) base_inverse_masses: Vec<f32>,
    /// Cold: bits of [`flag`].
    pub(crate) flags: Vec<u32>,
    /// Positions at the start of the step, for particles that must be frozen at its end.
    pub(crate) step_starts: Vec<[f32; 4]>,
}

impl Particles {
    /// The particles of a scene at its step 0; what follows an anchor is held by that alone.
    pub(crate) fn new(scene: &[SceneParticle], anchored: impl Iterator<Item = u32>) -> Self {
        let mut flags: Vec<_> =
            scene.iter().map(|one| if one.pinned { flag::PINNED } else { 0 }).collect();
        for particle in anchored {
            flags[particle as usize] = flag::ANCHORED;
        }
        let pad = |[x, y, z]: [f32; 3], last| [x + 0.0, y + 0.0, z + 0.0, last];
        let base_inverse_mass = |particle: &SceneParticle| 1.0 / particle.mass;
        let positions: Vec<_> = scene
            .iter()
            .zip(&flags)
            .map(|(one, flags)| {
                pad(one.position, if *flags == 0 { base_inverse_mass(one) } else { 0.0 })
            })
            .collect();
        Self {
            displacements: vec![[0.0; 4]; scene.len()],
            velocities: scene.iter().map(|one| pad(one.velocity, 0.0)).collect(),
            base_inverse_masses: scene.iter().map(base_inverse_mass).collect(),
            flags,
            step_starts: positions.clone(),
            positions,
        }
    }

    pub(crate) fn count(&self) -> usize {
        self.positions.len()
    }

    pub(crate) fn get(&self, index: usize) -> Particle {
        let [x, y, z, inverse_mass] = self.positions[index];
        let [vx, vy, vz, _] = self.velocities[index];
        Particle {
            position: [x, y, z],
            inverse_mass,
            velocity: [vx, vy, vz],
            flags: self.flags[index],
        }
    }

    pub(crate) fn set(&mut self, index: usize, particle: &Particle) {
        let [x, y, z] = particle.position;
        let [vx, vy, vz] = particle.velocity;
        self.positions[index] = [x, y, z, particle.inverse_mass];
        self.velocities[index] = [vx, vy, vz, 0.0];
        self.displacements[index] = [0.0; 4];
        self.flags[index] = particle.flags;
    }

    /// Sets and clears flags, and gives the particle the inverse mass that follows from them.
    pub(crate) fn change_flags(&mut self, index: usize, set: u32, clear: u32) {
        let flags = (self.flags[index] | set) & !clear;
        self.flags[index] = flags;
        let is_fixed = flags & flag::FIXED != 0;
        self.positions[index][3] = if is_fixed { 0.0 } else { self.base_inverse_masses[index] };
    }

    pub(crate) fn stop(&mut self, index: usize) {
        self.velocities[index] = [0.0; 4];
    }
}
