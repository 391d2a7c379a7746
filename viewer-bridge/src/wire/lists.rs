//! The messages that are lists: TEAR, PINS, COLLIDERS, FORCES, SPEEDS, INSPECTED and GHOST; and PAST, which announces others.

use bytemuck::bytes_of;
use bytes::Bytes;
use sim_contract::{ColliderState, ForceRow, ParticleState, TornConstraint};

use super::writer::{Kind, Stamp, Writer, count_u32};

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

/// The impulses of a step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Forces {
    /// Load and step.
    pub stamp: Stamp,
    /// Steps per second: a force is an impulse times this rate.
    pub rate_hz: u32,
    /// The rows in the layout and order of the contract.
    pub rows: Vec<ForceRow>,
}

impl Forces {
    /// Encodes the message.
    pub fn encode(&self) -> Bytes {
        let size = 24 + size_of::<ForceRow>() * self.rows.len();
        let mut writer = Writer::new(Kind::Forces, self.stamp, size);
        writer.count(&self.rows);
        writer.u32(self.rate_hz);
        self.rows.iter().for_each(|row| writer.bytes(bytes_of(row)));
        writer.finish()
    }
}

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

/// A state of another recording of the scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ghost {
    /// The load on show, and the step of the ghost.
    pub stamp: Stamp,
    /// The particle that is farthest from its place in the state on show.
    pub farthest: u32,
    /// Its distance in m; not a number if the two states have different steps.
    pub distance: f32,
    /// Positions. Shape: particle count. Not numbers for one that is not finite.
    pub positions: Vec<[f32; 3]>,
    /// Constraints that the ghost does not have: they are torn, or an end has no finite position.
    pub hidden: Vec<u32>,
}

impl Ghost {
    /// Encodes the message.
    pub fn encode(&self) -> Bytes {
        let size = 32 + 12 * self.positions.len() + 4 * self.hidden.len();
        let mut writer = Writer::new(Kind::Ghost, self.stamp, size);
        writer.count(&self.positions);
        writer.count(&self.hidden);
        writer.u32(self.farthest);
        writer.f32(self.distance);
        self.positions.iter().for_each(|position| writer.vector(*position));
        self.hidden.iter().for_each(|constraint| writer.u32(*constraint));
        writer.finish()
    }
}

/// The head of an earlier state, for a page that looks back. The next `count` binary messages show it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Past {
    /// Load and step.
    pub stamp: Stamp,
    /// Number of messages that follow.
    pub count: usize,
}

impl Past {
    /// Encodes the message.
    pub fn encode(&self) -> Bytes {
        let mut writer = Writer::new(Kind::Past, self.stamp, 24);
        writer.u32(count_u32(self.count));
        writer.u32(0);
        writer.finish()
    }
}
