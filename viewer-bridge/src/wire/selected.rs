//! SPEEDS and INSPECTED: what a page asks for beyond the positions.

use bytes::Bytes;
use sim_contract::ParticleState;

use super::header::{Kind, Stamp};
use super::writer::Writer;

/// Size of a row of [`Inspected`].
const ROW_SIZE_BYTES: usize = 32;

/// The speeds of all particles.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Speeds {
    /// Load and step.
    pub stamp: Stamp,
    /// Length of the velocity of each particle.
    pub speeds: Vec<f32>,
}

/// The exact states of some particles.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Inspected {
    /// Load and step.
    pub stamp: Stamp,
    /// The particles, ascending by index.
    pub particles: Vec<InspectedParticle>,
}

/// The exact state of a particle.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct InspectedParticle {
    /// Its index.
    pub particle: u32,
    /// Its position.
    pub position: [f32; 3],
    /// Its velocity.
    pub velocity: [f32; 3],
    /// Its inverse mass; 0 while something holds it.
    pub inverse_mass: f32,
}

impl Speeds {
    /// Measures all particles.
    pub fn from_particles(stamp: Stamp, particles: &[ParticleState]) -> Self {
        let speed = |[x, y, z]: [f32; 3]| (x * x + y * y + z * z).sqrt();
        Self { stamp, speeds: particles.iter().map(|one| speed(one.velocity)).collect() }
    }

    /// Encodes the message.
    pub fn encode(&self) -> Bytes {
        let mut writer = Writer::new(Kind::Speeds, self.stamp, 24 + 4 * self.speeds.len());
        writer.count(&self.speeds);
        writer.u32(0);
        self.speeds.iter().for_each(|speed| writer.f32(*speed));
        writer.finish()
    }
}

impl Inspected {
    /// Copies the particles with these indices. An index that the state does not have is left out: the
    /// page can have asked for it in a previous load.
    pub fn from_particles(stamp: Stamp, particles: &[ParticleState], wanted: &[u32]) -> Self {
        let row = |particle: &u32| {
            particles.get(*particle as usize).map(|state| InspectedParticle {
                particle: *particle,
                position: state.position,
                velocity: state.velocity,
                inverse_mass: state.inverse_mass,
            })
        };
        Self { stamp, particles: wanted.iter().filter_map(row).collect() }
    }

    /// Encodes the message.
    pub fn encode(&self) -> Bytes {
        let size = 24 + ROW_SIZE_BYTES * self.particles.len();
        let mut writer = Writer::new(Kind::Inspected, self.stamp, size);
        writer.count(&self.particles);
        writer.u32(0);
        for one in &self.particles {
            writer.u32(one.particle);
            writer.vector(one.position);
            writer.vector(one.velocity);
            writer.f32(one.inverse_mass);
        }
        writer.finish()
    }
}
