//! What the particles of a snapshot lack to be the complete state.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::Solver;
use crate::drive::Grab;
use crate::hash::state_hash;
use crate::particles::{Particle, flag};

/// First four bytes of an encoded keyframe, little-endian. It changes with the fields below.
const KEYFRAME_VERSION: u32 = 1;

/// What the particles of a snapshot lack to be the complete state after the same step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Keyframe {
    /// Whether the node was paused. The solver knows no pause and only carries it along.
    pub paused: bool,
    scene_step: u64,
    /// The masses that fixed particles have when nothing holds them, ascending by particle.
    fixed: Vec<FixedParticle>,
    grabs: Vec<Grab>,
    /// Torn constraints in the order of tearing.
    torn: Vec<u32>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct FixedParticle {
    particle: u32,
    base_inverse_mass: f32,
}

/// Why bytes are not a keyframe.
#[derive(Debug, Error)]
pub enum KeyframeError {
    /// Fewer than four bytes.
    #[error("a keyframe of {0} bytes is too short")]
    TooShort(usize),
    /// Written by another version.
    #[error("keyframe version {found}, this program reads version {KEYFRAME_VERSION}")]
    Version {
        /// The version in the bytes.
        found: u32,
    },
    /// The bytes do not decode.
    #[error("damaged keyframe: {0}")]
    Damaged(#[from] postcard::Error),
}

/// Why a snapshot and a keyframe are not a state of this scene.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum RestoreError {
    /// The snapshot is of another scene.
    #[error("the snapshot has {found} particles, the scene {expected}")]
    ParticleCount {
        /// Particles of the scene.
        expected: usize,
        /// Particles of the snapshot.
        found: usize,
    },
    /// A particle that no step produces.
    #[error("particle {particle} of the snapshot is not a state: {what}")]
    Particle {
        /// Its index.
        particle: usize,
        /// What is wrong with it.
        what: &'static str,
    },
    /// The keyframe belongs to another snapshot.
    #[error("the keyframe does not belong to the snapshot: {what}")]
    Mismatch {
        /// What differs.
        what: &'static str,
    },
}

impl Keyframe {
    /// As bytes: the version as u32 little-endian, then the fields in postcard's encoding.
    ///
    /// # Panics
    /// Never: the fields always encode into memory.
    #[allow(clippy::expect_used, reason = "encoding numbers into a growing Vec has no error case")]
    pub fn encode(&self) -> Vec<u8> {
        let bytes = KEYFRAME_VERSION.to_le_bytes().to_vec();
        postcard::to_extend(self, bytes).expect("numbers encode into memory")
    }

    /// From the bytes of [`Self::encode`].
    ///
    /// # Errors
    /// Another version, or damaged bytes.
    pub fn decode(bytes: &[u8]) -> Result<Self, KeyframeError> {
        let Some((version, fields)) = bytes.split_first_chunk() else {
            return Err(KeyframeError::TooShort(bytes.len()));
        };
        let found = u32::from_le_bytes(*version);
        if found != KEYFRAME_VERSION {
            return Err(KeyframeError::Version { found });
        }
        Ok(postcard::from_bytes(fields)?)
    }
}

impl Solver {
    /// What the particles lack, after the last step. Taken at a boundary before any command of it.
    pub fn keyframe(&self) -> Keyframe {
        let fixed = (0_u32..)
            .zip(&self.particles.base_inverse_masses)
            .filter(|(particle, _)| self.is_fixed(*particle))
            .map(|(particle, base)| FixedParticle { particle, base_inverse_mass: *base })
            .collect();
        Keyframe {
            paused: false,
            scene_step: self.scene_step,
            fixed,
            grabs: self.grabs.clone(),
            torn: self.torn().to_vec(),
        }
    }

    /// Most bytes that an encoded keyframe of this scene can have.
    pub fn keyframe_size_bytes_max(&self) -> usize {
        // Variable-length integers: u32 at most 5 bytes, u64 and lengths at most 10.
        let (fixed, grab, torn) = (5 + 4, 5 + 10 + 12 + 5, 5);
        let head = 4 + 1 + 10 + 3 * 10;
        head + self.particle_count() * (fixed + grab) + self.constraint_count() * torn
    }

    /// Takes over the state that a snapshot and the keyframe of the same step describe.
    ///
    /// # Errors
    /// They are not a state of this scene; then nothing is changed.
    pub fn restore(
        &mut self,
        particles: &[Particle],
        keyframe: &Keyframe,
    ) -> Result<(), RestoreError> {
        self.check(particles, keyframe)?;
        for (index, particle) in particles.iter().enumerate() {
            self.particles.set(index, particle);
            if particle.inverse_mass != 0.0 {
                self.particles.base_inverse_masses[index] = particle.inverse_mass;
            }
        }
        for one in &keyframe.fixed {
            self.particles.base_inverse_masses[one.particle as usize] = one.base_inverse_mass;
        }
        self.grabs.clear();
        self.grabs.extend_from_slice(&keyframe.grabs);
        self.scene_step = keyframe.scene_step;
        self.is_restored = false;
        self.state_hash = state_hash(&self.particles, self.torn());
        Ok(())
    }

    fn is_fixed(&self, particle: u32) -> bool {
        self.particles.flags[particle as usize] & flag::FIXED != 0
    }

    fn check(&self, particles: &[Particle], keyframe: &Keyframe) -> Result<(), RestoreError> {
        let (expected, found) = (self.particle_count(), particles.len());
        if expected != found {
            return Err(RestoreError::ParticleCount { expected, found });
        }
        for (particle, state) in particles.iter().enumerate() {
            check_particle(state).map_err(|what| RestoreError::Particle { particle, what })?;
        }
        check_keyframe(particles, keyframe).map_err(|what| RestoreError::Mismatch { what })
    }
}

fn check_particle(particle: &Particle) -> Result<(), &'static str> {
    let is_fixed = particle.flags & flag::FIXED != 0;
    if !particle.position.iter().chain(&particle.velocity).all(|number| number.is_finite()) {
        return Err("a number is not finite");
    }
    if particle.flags & !flag::KNOWN != 0 {
        return Err("it has flags that this version does not know");
    }
    if is_fixed != (particle.inverse_mass == 0.0) {
        return Err("its flags and its inverse mass contradict each other");
    }
    if is_fixed || is_inverse_mass(particle.inverse_mass) {
        Ok(())
    } else {
        Err("its inverse mass is not a positive number")
    }
}

fn is_inverse_mass(number: f32) -> bool {
    number.is_finite() && number > 0.0
}

fn check_keyframe(particles: &[Particle], keyframe: &Keyframe) -> Result<(), &'static str> {
    let with = |flags: u32| {
        let indices = (0_u32..).zip(particles);
        indices.filter(move |(_, one)| one.flags & flags != 0).map(|(index, _)| index)
    };
    if !with(flag::FIXED).eq(keyframe.fixed.iter().map(|one| one.particle)) {
        return Err("other particles are fixed");
    }
    if !with(flag::GRABBED).eq(keyframe.grabs.iter().map(|grab| grab.particle)) {
        return Err("other particles are grabbed");
    }
    if !keyframe.fixed.iter().all(|one| is_inverse_mass(one.base_inverse_mass)) {
        return Err("a mass is not a positive number");
    }
    if !keyframe.grabs.iter().all(|grab| grab.target.iter().all(|axis| axis.is_finite())) {
        return Err("a target is not finite");
    }
    if keyframe.torn.is_empty() { Ok(()) } else { Err("it has torn constraints") }
}
