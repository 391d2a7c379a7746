//! The messages of the service `restore`: states that clients give to the node.

use bytemuck::{Pod, Zeroable};
use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;
use sim_types::RestoreContents;
use thiserror::Error;
use xxhash_rust::xxh3::xxh3_64;

use crate::command::Command;
use crate::snapshot::ParticleState;
use sim_types::Action;

/// Header of `restore`: 40 bytes, alignment 8. The payload has `particle_count` [`ParticleState`]s, and
/// after them the bytes of the keyframe if the state is complete. Written by clients, read by the owner
/// of the name, and answered by an [`crate::Outcome`] with [`Action::Restore`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.RestoreHeader")]
pub struct RestoreHeader {
    /// Same as in [`Command`].
    pub client_id: u64,
    /// Number of the message among the commands of its client.
    pub sequence: u64,
    /// Same as in [`crate::LoadHeader`]: the scene that the state belongs to.
    pub scene_hash: u64,
    /// Length of the payload in bytes.
    pub size_bytes: u64,
    /// Number of particles in the payload.
    pub particle_count: u32,
    /// A [`RestoreContents`] as a number.
    pub contents: u32,
}

const _: () = assert!(size_of::<RestoreHeader>() == 40 && align_of::<RestoreHeader>() == 8);

/// Returns the hash that identifies a scene: the XXH3-64 of its complete text.
pub fn scene_hash(text: &[u8]) -> u64 {
    xxh3_64(text)
}

/// A state for the node.
#[derive(Debug, Clone, Copy)]
pub struct GivenState<'a> {
    /// The scene that the state belongs to; see [`crate::LoadHeader::scene_hash`]. The node refuses the
    /// state of another scene.
    pub scene_hash: u64,
    /// All particles of the scene. Without a keyframe, only positions and velocities count.
    pub particles: &'a [ParticleState],
    /// The bytes of the keyframe of the same step. `None` to keep everything but the motion of the
    /// particles.
    pub keyframe: Option<&'a [u8]>,
}

impl GivenState<'_> {
    /// Returns the header of the message `sequence` of the client `client_id`.
    pub fn header(&self, client_id: u64, sequence: u64) -> RestoreHeader {
        let keyframe_size_bytes = self.keyframe.map_or(0, <[u8]>::len);
        RestoreHeader {
            client_id,
            sequence,
            scene_hash: self.scene_hash,
            size_bytes: (size_of_val(self.particles) + keyframe_size_bytes) as u64,
            particle_count: u32::try_from(self.particles.len()).unwrap_or(u32::MAX),
            contents: self.contents() as u32,
        }
    }

    /// Returns a byte of the payload.
    pub fn byte(&self, index: usize) -> u8 {
        let particles: &[u8] = bytemuck::cast_slice(self.particles);
        match (particles.get(index), self.keyframe) {
            (Some(byte), _) => *byte,
            (None, keyframe) => keyframe.map_or(0, |bytes| bytes[index - particles.len()]),
        }
    }

    /// Returns the contents of the message: a complete state, or positions and velocities.
    pub fn contents(&self) -> RestoreContents {
        match self.keyframe {
            Some(_) => RestoreContents::State,
            None => RestoreContents::Motion,
        }
    }
}

/// Why the message of a state cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum MalformedState {
    /// The header names another length than the payload has.
    #[error("its header names {named} bytes, but it has {found}")]
    Length {
        /// [`RestoreHeader::size_bytes`].
        named: u64,
        /// Length of the payload.
        found: usize,
    },
    /// The contents have an unknown number.
    #[error("its contents are {contents} (allowed: 1 for a state, 2 for positions and velocities)")]
    Contents {
        /// [`RestoreHeader::contents`].
        contents: u32,
    },
    /// The payload is shorter than its particles.
    #[error("{particle_count} particles do not fit into its {size_bytes} bytes")]
    Particles {
        /// [`RestoreHeader::particle_count`].
        particle_count: u32,
        /// Length of the payload.
        size_bytes: usize,
    },
    /// Bytes follow the particles of a message without a keyframe.
    #[error("{size_bytes} bytes follow its particles, although it has no keyframe")]
    Rest {
        /// Number of these bytes.
        size_bytes: usize,
    },
    /// The message is longer than any state of the load.
    #[error("it has {size_bytes} bytes, but a state of this scene has at most {max}")]
    TooLong {
        /// Length of the payload.
        size_bytes: usize,
        /// Length of the longest state.
        max: usize,
    },
}

/// A state as the owner of the name has received it. A foreign process may have written it, so only its
/// lengths are checked.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceivedState {
    /// Same as in [`RestoreHeader`].
    pub scene_hash: u64,
    /// The particles; `particle_count` entries.
    pub particles: Vec<ParticleState>,
    /// The bytes of the keyframe, unless only positions and velocities were given.
    pub keyframe: Option<Vec<u8>>,
}

impl ReceivedState {
    /// Copies a message.
    ///
    /// # Errors
    /// The message contradicts itself, or is longer than `size_bytes_max`. It is not copied.
    pub fn from_message(
        header: &RestoreHeader,
        payload: &[u8],
        size_bytes_max: usize,
    ) -> Result<Self, MalformedState> {
        let RestoreHeader { scene_hash, size_bytes: named, particle_count, contents, .. } = *header;
        let size_bytes = payload.len();
        if named != size_bytes as u64 {
            return Err(MalformedState::Length { named, found: size_bytes });
        }
        let contents =
            RestoreContents::from_number(contents).ok_or(MalformedState::Contents { contents })?;
        let (particles, rest) = usize::try_from(particle_count)
            .ok()
            .and_then(|count| count.checked_mul(size_of::<ParticleState>()))
            .and_then(|length| payload.split_at_checked(length))
            .ok_or(MalformedState::Particles { particle_count, size_bytes })?;
        if contents == RestoreContents::Motion && !rest.is_empty() {
            return Err(MalformedState::Rest { size_bytes: rest.len() });
        }
        if size_bytes > size_bytes_max {
            return Err(MalformedState::TooLong { size_bytes, max: size_bytes_max });
        }
        // The payload has no alignment.
        let chunks = particles.chunks_exact(size_of::<ParticleState>());
        let particles = chunks.map(bytemuck::pod_read_unaligned).collect();
        let keyframe = (contents == RestoreContents::State).then(|| rest.to_vec());
        Ok(Self { scene_hash, particles, keyframe })
    }
}

impl RestoreHeader {
    /// Returns the command that the outcome answers. Unknown contents count as a state.
    pub fn command(&self) -> Command {
        let contents = RestoreContents::from_number(self.contents);
        let contents = contents.unwrap_or(RestoreContents::State);
        let action = Action::Restore { contents, state_hash: 0 };
        Command::new(self.client_id, self.sequence, action)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_split_by_its_header_and_refused_if_its_lengths_differ() {
        let state = ParticleState { position: [1.0, 2.0, 3.0], ..ParticleState::default() };
        let mut payload = bytemuck::bytes_of(&state).to_vec();
        let header = |contents: RestoreContents, particle_count| RestoreHeader {
            particle_count,
            contents: contents as u32,
            ..RestoreHeader::default()
        };
        let read = |header, payload: &[u8]| {
            let header = RestoreHeader { size_bytes: payload.len() as u64, ..header };
            ReceivedState::from_message(&header, payload, 34)
        };
        let motion = read(header(RestoreContents::Motion, 1), &payload).unwrap();
        assert_eq!((motion.particles, motion.keyframe), (vec![state], None));
        payload.extend([7, 8]);
        let complete = read(header(RestoreContents::State, 1), &payload).unwrap();
        assert_eq!((complete.particles, complete.keyframe), (vec![state], Some(vec![7, 8])));
        let error = |header, payload: &[u8]| read(header, payload).unwrap_err().to_string();
        let unnamed = header(RestoreContents::State, 1);
        assert_eq!(
            ReceivedState::from_message(&unnamed, &payload, 34),
            Err(MalformedState::Length { named: 0, found: 34 })
        );
        assert_eq!(
            error(header(RestoreContents::Motion, 1), &payload),
            "2 bytes follow its particles, although it has no keyframe"
        );
        assert_eq!(
            error(header(RestoreContents::State, 2), &payload),
            "2 particles do not fit into its 34 bytes"
        );
        let unknown = RestoreHeader { contents: 3, ..header(RestoreContents::State, 1) };
        assert_eq!(read(unknown, &payload), Err(MalformedState::Contents { contents: 3 }));
        payload.push(9);
        assert_eq!(
            error(header(RestoreContents::State, 1), &payload),
            "it has 35 bytes, but a state of this scene has at most 34"
        );
    }
}
