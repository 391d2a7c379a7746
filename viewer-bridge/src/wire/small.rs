//! TEAR, PINS and COLLIDERS.

use bytemuck::bytes_of;
use bytes::Bytes;
use sim_contract::{ColliderState, ParticleState, TornConstraint};

use super::header::{Kind, Stamp};
use super::writer::Writer;

/// A change of the list of torn constraints: keeps its first entries and replaces the rest.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Tear {
    /// Load and step.
    pub stamp: Stamp,
    /// Number of entries to keep.
    pub first: u32,
    /// Constraints after them, with their causes.
    pub torn: Vec<TornConstraint>,
}

impl Tear {
    /// Encodes the message.
    pub fn encode(&self) -> Bytes {
        let mut writer = Writer::new(Kind::Tear, self.stamp, 27 + 5 * self.torn.len());
        writer.u32(self.first);
        writer.count(&self.torn);
        self.torn.iter().for_each(|torn| writer.u32(torn.constraint));
        self.torn.iter().for_each(|torn| writer.bytes(&[cause_byte(torn.cause)]));
        writer.pad();
        writer.finish()
    }

    /// The constraints after the kept entries, without their causes.
    pub fn constraints(&self) -> Vec<u32> {
        self.torn.iter().map(|torn| torn.constraint).collect()
    }
}

/// A cause as a byte; 255 where it is unknown.
fn cause_byte(cause: u32) -> u8 {
    u8::try_from(cause).unwrap_or(u8::MAX)
}

/// All particles that are not free.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Pins {
    /// Load and step.
    pub stamp: Stamp,
    /// The particles, ascending by index.
    pub particles: Vec<FlaggedParticle>,
}

/// A particle that is not free.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FlaggedParticle {
    /// Its index.
    pub particle: u32,
    /// Its [`sim_contract::ParticleFlags`].
    pub flags: u32,
}

impl Pins {
    /// Finds the particles that are not free.
    pub fn from_particles(stamp: Stamp, particles: &[ParticleState]) -> Self {
        let held = (0..).zip(particles).filter(|(_, state)| state.flags != 0);
        let particles =
            held.map(|(particle, state)| FlaggedParticle { particle, flags: state.flags });
        Self { stamp, particles: particles.collect() }
    }

    /// Encodes the message.
    pub fn encode(&self) -> Bytes {
        let mut writer = Writer::new(Kind::Pins, self.stamp, 24 + 8 * self.particles.len());
        writer.count(&self.particles);
        writer.u32(0);
        for FlaggedParticle { particle, flags } in &self.particles {
            writer.u32(*particle);
            writer.u32(*flags);
        }
        writer.finish()
    }
}

/// All colliders.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Colliders {
    /// Load and step.
    pub stamp: Stamp,
    /// The colliders, by index, in the layout of the contract.
    pub colliders: Vec<ColliderState>,
}

impl Colliders {
    /// Encodes the message.
    pub fn encode(&self) -> Bytes {
        let size = 24 + size_of::<ColliderState>() * self.colliders.len();
        let mut writer = Writer::new(Kind::Colliders, self.stamp, size);
        writer.count(&self.colliders);
        writer.u32(0);
        self.colliders.iter().for_each(|collider| writer.bytes(bytes_of(collider)));
        writer.finish()
    }
}
