//! Keyframes: the state beside the particles of a snapshot.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use glam::{Quat, Vec3};
use sim_types::{Method, ParameterValues, ParticleFlags, TearCause};

use crate::constraints::tethers::TetherBasis;
use crate::frame::{Frame, Pose};
use crate::motion::{MOTION_POINTS_MAX, MOTION_SIZE_BYTES_MAX, Motion, MotionState};
use crate::parameters::Parameters;
use crate::parameters::block_bending::BlockBending;
use crate::parameters::surfaces::{ColliderSurface, Surfaces};
use crate::solver::Solver;
use crate::step::drive::ActiveGrab;

/// First four bytes of an encoded keyframe, little-endian. It changes with the fields below.
const KEYFRAME_VERSION: u32 = 5;
/// The version without the surfaces of colliders and without motions.
const WITHOUT_SURFACES_VERSION: u32 = 4;
/// The version that is also without the bending of blocks.
const WITHOUT_BLOCKS_VERSION: u32 = 3;

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
    /// The motions, begun by clients, of grab targets, anchors and colliders. Encoded behind the other fields.
    #[serde(skip)]
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
    #[error(
        "keyframe version {found}; this program reads versions {WITHOUT_BLOCKS_VERSION} to {KEYFRAME_VERSION}"
    )]
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

    /// Returns the parameters of a scene that uses `method`, with a time scale of 1: the pace belongs to
    /// the node and is not part of the state.
    pub fn parameter_values(&self, method: Method) -> ParameterValues {
        self.parameters.values(method)
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
            + self.parameters.block_bending.size_bytes()
            + size_of_val(self.parameters.surfaces.all())
            + self.motions.all().map(MotionState::size_bytes).sum::<usize>()
    }

    /// Returns the cause of each tear in [`Self::torn`].
    pub fn tear_causes(&self) -> &[TearCause] {
        &self.tear_causes
    }

    /// Encodes the keyframe: its version as a little-endian u32, then the fields in postcard's
    /// encoding, the bending of each generated block, the surface of each collider, and the motions.
    ///
    /// # Panics
    /// Never: the fields always have an encoding.
    #[allow(clippy::expect_used, reason = "encoding numbers into a growing Vec cannot fail")]
    pub fn encode(&self) -> Vec<u8> {
        let bytes = KEYFRAME_VERSION.to_le_bytes().to_vec();
        let Parameters { block_bending, surfaces, .. } = &self.parameters;
        let fields = (self, block_bending.used(), surfaces.all(), &self.motions);
        postcard::to_extend(&fields, bytes).expect("numbers have an encoding")
    }

    /// Decodes the bytes of [`Self::encode`], also those of version 4, in which colliders have the surfaces of the
    /// scene, and of version 3, in which no block has a bending of its own either.
    ///
    /// # Errors
    /// Another version wrote the bytes, or they are damaged.
    pub fn decode(bytes: &[u8]) -> Result<Self, KeyframeError> {
        let Some((version, fields)) = bytes.split_first_chunk() else {
            return Err(KeyframeError::TooShort(bytes.len()));
        };
        let (keyframe, rest) = match u32::from_le_bytes(*version) {
            KEYFRAME_VERSION => {
                let ((keyframe, blocks, surfaces, motions), rest) =
                    postcard::take_from_bytes(fields)?;
                (Self { motions, ..Self::with(keyframe, blocks, surfaces) }, rest)
            }
            WITHOUT_SURFACES_VERSION => {
                let ((keyframe, blocks), rest) = postcard::take_from_bytes(fields)?;
                (Self::with(keyframe, blocks, Vec::new()), rest)
            }
            WITHOUT_BLOCKS_VERSION => postcard::take_from_bytes(fields)?,
            found => return Err(KeyframeError::Version { found }),
        };
        if rest.is_empty() { Ok(keyframe) } else { Err(KeyframeError::TooLong(rest.len())) }
    }

    /// Adds the parts that are encoded behind the other fields.
    fn with(mut self, blocks: Vec<Option<f32>>, surfaces: Vec<ColliderSurface>) -> Self {
        self.parameters.block_bending = BlockBending::from_used(blocks);
        self.parameters.surfaces = Surfaces::from_all(surfaces);
        self
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
        let parameters = 2 * 12 + 4 * 4 + 2 * 5 + 9 * 5 + 10 + self.model.bent_blocks.len() * 5;
        let surface = 2 * 4;
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
