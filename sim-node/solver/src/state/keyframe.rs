//! Keyframes: the state beside the particles of a snapshot.

use serde::{Deserialize, Serialize};
use sim_scene::rotation::Pose;
use thiserror::Error;

use glam::{Quat, Vec3};
use sim_types::{ParameterValues, ParticleFlags, SETTINGS_COUNT, TearCause};

use crate::constraints::tethers::TetherBasis;
use crate::frame::Frame;
use crate::motion::{MOTION_POINTS_MAX, MOTION_SIZE_BYTES_MAX, Motion, MotionState};
use crate::parameters::{Parameters, SETTING_SIZE_BYTES_MAX};
use crate::solver::Solver;
use crate::step::drive::ActiveGrab;

/// First four bytes of an encoded keyframe, little-endian. It changes with the fields below.
const KEYFRAME_VERSION: u32 = 6;

/// The state beside the particles of a snapshot. Both together are the complete state after a step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Keyframe {
    /// True if the node was paused. The solver only carries it: its own steps never pause.
    pub paused: bool,
    pub(super) scene_step: u64,
    /// Masses of fixed particles when they are free, ascending by particle.
    pub(super) fixed: Vec<FixedParticle>,
    pub(super) grabs: Vec<ActiveGrab>,
    /// Torn constraints in the order of tearing, and the cause of each tear.
    pub(crate) torn: Vec<u32>,
    pub(super) tear_causes: Vec<TearCause>,
    /// State from which the tethers were last derived.
    pub(crate) tethers: TetherBasis,
    pub(crate) parameters: Parameters,
    /// Anchors and colliders that clients have moved, ascending by index.
    pub(super) moved_anchors: Vec<Moved>,
    pub(super) moved_colliders: Vec<Moved>,
    /// The motions, begun by clients, of grab targets, anchors and colliders.
    pub(super) motions: Motions,
}

/// The motions of each kind of object, ascending by the index of the particle, anchor or collider.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Motions {
    pub(super) grabs: Vec<MotionState>,
    pub(super) anchors: Vec<MotionState>,
    pub(super) colliders: Vec<MotionState>,
}

impl Motions {
    pub(super) fn all(&self) -> impl Iterator<Item = &MotionState> {
        self.grabs.iter().chain(&self.anchors).chain(&self.colliders)
    }
}

/// An anchor or a collider that a client has moved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Moved {
    pub(super) index: u32,
    pub(super) translation: [f32; 3],
    /// A unit quaternion.
    pub(super) rotation: [f32; 4],
}

impl Moved {
    fn all<'a>(frames: impl Iterator<Item = &'a Option<Frame>>) -> Vec<Self> {
        let moved = (0_u32..).zip(frames).filter_map(|(index, frame)| Some((index, (*frame)?)));
        let moved = moved.map(|(index, frame)| {
            let Pose { translation, rotation } = frame.to_pose();
            Self { index, translation, rotation }
        });
        moved.collect()
    }

    /// The frame, bit for bit: the rotation is normalised already.
    pub(super) fn frame(&self) -> Frame {
        Frame {
            translation: Vec3::from_array(self.translation),
            rotation: Quat::from_array(self.rotation),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct FixedParticle {
    pub(super) particle: u32,
    pub(super) base_inverse_mass: f32,
}

/// Error of decoding a keyframe.
#[derive(Debug, Error)]
pub enum KeyframeError {
    /// Fewer than four bytes.
    #[error("a keyframe of {0} bytes is too short")]
    TooShort(usize),
    /// Bytes are left after the last field.
    #[error("{0} bytes follow the end of the keyframe")]
    TooLong(usize),
    /// Another version wrote it.
    #[error("keyframe version {found}; this program reads version {KEYFRAME_VERSION}")]
    Version {
        /// The version in the bytes.
        found: u32,
    },
    /// The bytes do not decode.
    #[error("damaged keyframe: {0}")]
    Damaged(#[from] postcard::Error),
}

impl Keyframe {
    /// Returns the torn constraints, in the order of tearing.
    pub fn torn(&self) -> &[u32] {
        &self.torn
    }

    /// Returns `true` if a client grabs a particle.
    pub fn has_grabs(&self) -> bool {
        !self.grabs.is_empty()
    }

    /// Returns `true` if steps change more than the step of the scene, even without commands, tears and frozen
    /// particles: a client grabs a particle, or a motion is under way.
    pub fn changes_without_commands(&self) -> bool {
        self.has_grabs() || self.motions.all().any(|motion| motion.is_under_way(self.scene_step))
    }

    /// Returns the parameters, with a time scale of 1: the pace belongs to the node and is not part of the state.
    pub fn parameter_values(&self) -> &ParameterValues {
        &self.parameters.values
    }

    /// Returns the same state at another step of the scene, for the steps that change nothing else.
    #[must_use]
    pub fn at_scene_step(&self, scene_step: u64) -> Self {
        Self { scene_step, ..self.clone() }
    }

    /// Returns the approximate memory use, in bytes.
    pub fn size_bytes(&self) -> usize {
        size_of::<Self>()
            + size_of_val(self.fixed.as_slice())
            + size_of_val(self.grabs.as_slice())
            + size_of_val(self.torn.as_slice())
            + size_of_val(self.tear_causes.as_slice())
            + self.tethers.size_bytes()
            + size_of_val(self.moved_anchors.as_slice())
            + size_of_val(self.moved_colliders.as_slice())
            + size_of_val(self.parameters.values.bending_by_block.as_slice())
            + size_of_val(self.parameters.surfaces.all())
            + self.motions.all().map(MotionState::size_bytes).sum::<usize>()
    }

    /// Returns the cause of each tear in [`Self::torn`].
    pub fn tear_causes(&self) -> &[TearCause] {
        &self.tear_causes
    }

    /// Encodes the keyframe: its version as a little-endian u32, then the fields in postcard's
    /// encoding.
    ///
    /// # Panics
    /// Never: the fields always have an encoding.
    #[allow(clippy::expect_used, reason = "encoding numbers into a growing Vec cannot fail")]
    pub fn encode(&self) -> Vec<u8> {
        let bytes = KEYFRAME_VERSION.to_le_bytes().to_vec();
        postcard::to_extend(self, bytes).expect("numbers have an encoding")
    }

    /// Decodes the bytes of [`Self::encode`].
    ///
    /// # Errors
    /// Another version wrote the bytes, or they are damaged.
    pub fn decode(bytes: &[u8]) -> Result<Self, KeyframeError> {
        let Some((version, fields)) = bytes.split_first_chunk() else {
            return Err(KeyframeError::TooShort(bytes.len()));
        };
        let found = u32::from_le_bytes(*version);
        if found != KEYFRAME_VERSION {
            return Err(KeyframeError::Version { found });
        }
        let (keyframe, rest) = postcard::take_from_bytes(fields)?;
        if rest.is_empty() { Ok(keyframe) } else { Err(KeyframeError::TooLong(rest.len())) }
    }
}

/// Returns the size of an integer up to `max` in postcard's encoding: seven bits in each byte.
fn encoded_size_bytes(max: usize) -> usize {
    max.checked_ilog2().map_or(1, |bits| bits as usize / 7 + 1)
}

impl Solver {
    /// Returns the state beside the particles after the last step. Call it at a boundary, before any
    /// command.
    pub fn keyframe(&self) -> Keyframe {
        self.assert_whole();
        let fixed = (0_u32..)
            .zip(&self.particles.base_inverse_masses)
            .filter(|(particle, _)| self.is_fixed(*particle))
            .map(|(particle, base)| FixedParticle { particle, base_inverse_mass: *base })
            .collect();
        Keyframe {
            paused: false,
            scene_step: self.scene_step,
            fixed,
            grabs: self.grabs.iter().map(ActiveGrab::without_motion).collect(),
            torn: self.torn().to_vec(),
            tear_causes: self.tear_causes().to_vec(),
            tethers: self.tethers.basis.clone(),
            parameters: self.parameters.clone(),
            moved_anchors: Moved::all(self.anchors.moved.iter()),
            moved_colliders: Moved::all(self.colliders.iter().map(|one| &one.moved)),
            motions: self.motion_states(),
        }
    }

    fn motion_states(&self) -> Motions {
        let state = |index, motion: &Option<Motion>| {
            motion.as_ref().map(|motion| motion.state(index, self.scene_step))
        };
        let (anchors, colliders) = ((0..).zip(&self.anchors.motions), (0..).zip(&self.colliders));
        Motions {
            grabs: self.grabs.iter().filter_map(|one| state(one.particle, &one.motion)).collect(),
            anchors: anchors.filter_map(|(index, motion)| state(index, motion)).collect(),
            colliders: colliders.filter_map(|(index, one)| state(index, &one.motion)).collect(),
        }
    }

    /// Returns the largest size of an encoded keyframe of this scene, in bytes.
    pub fn keyframe_size_bytes_max(&self) -> usize {
        // Integers have variable length: an index as many bytes as the largest one needs, another u32
        // at most 5, a u64 or a length at most 10.
        let (index, link) = (
            encoded_size_bytes(self.particle_count()),
            encoded_size_bytes(self.constraint_count()),
        );
        let (fixed, grab) = (index + 4, index + 10 + 12 + 5);
        let (torn, cause, moved) = (link, 1, 5 + 12 + 16);
        let (root, basis) = if self.settings.has_tethers() { (index, link) } else { (0, 0) };
        let settings = SETTINGS_COUNT + self.model.bent_blocks.len();
        let (parameters, surface) = (2 * 10 + settings * SETTING_SIZE_BYTES_MAX, 2 * 4);
        let motions = 3 * 10 + MOTION_POINTS_MAX * MOTION_SIZE_BYTES_MAX;
        let head = 4 + 1 + 10 + 9 * 10 + parameters + motions;
        head + self.particle_count() * (fixed + grab + root)
            + self.constraint_count() * (torn + cause + basis)
            + (self.anchor_count() + self.collider_count()) * moved
            + self.collider_count() * surface
    }

    fn is_fixed(&self, particle: u32) -> bool {
        self.particles.states[particle as usize].flags & ParticleFlags::ALL != 0
    }
}
