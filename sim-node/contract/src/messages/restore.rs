//! The messages of the service `restore`: states that clients give to the node.

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;
use sim_types::RestoreContents;
use xxhash_rust::xxh3::xxh3_64;

use crate::messages::command::Command;
use crate::messages::snapshot::ParticleState;
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
    pub(crate) fn header(&self, client_id: u64, sequence: u64) -> RestoreHeader {
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
    pub(crate) fn byte(&self, index: usize) -> u8 {
        let particles: &[u8] = bytemuck::cast_slice(self.particles);
        match (particles.get(index), self.keyframe) {
            (Some(byte), _) => *byte,
            (None, keyframe) => keyframe.map_or(0, |bytes| bytes[index - particles.len()]),
        }
    }

    pub(crate) fn contents(&self) -> RestoreContents {
        match self.keyframe {
            Some(_) => RestoreContents::State,
            None => RestoreContents::Motion,
        }
    }
}

/// A state as the owner of the name has received it. A foreign process may have written it, so only its
/// lengths are checked.
#[derive(Debug, Clone)]
pub struct ReceivedState {
    /// Same as in [`RestoreHeader`].
    pub scene_hash: u64,
    /// The particles; `particle_count` entries.
    pub particles: Vec<ParticleState>,
    /// The bytes of the keyframe, unless only positions and velocities were given.
    pub keyframe: Option<Vec<u8>>,
}

impl ReceivedState {
    /// Copies a message, unless it is longer than `size_bytes_max`. Returns `None` if its header and its
    /// length contradict each other.
    pub(crate) fn from_message(
        header: &RestoreHeader,
        payload: &[u8],
        size_bytes_max: usize,
    ) -> Option<Self> {
        if header.size_bytes != payload.len() as u64 {
            return None;
        }
        let contents = RestoreContents::from_number(header.contents)?;
        let particle_count = usize::try_from(header.particle_count).ok()?;
        let particles_size_bytes = particle_count.checked_mul(size_of::<ParticleState>())?;
        let (particles, keyframe) = payload.split_at_checked(particles_size_bytes)?;
        let is_copied = payload.len() <= size_bytes_max;
        let (particles, keyframe) =
            if is_copied { (particles, keyframe) } else { (&[][..], &[][..]) };
        let keyframe = match contents {
            RestoreContents::State => Some(keyframe.to_vec()),
            RestoreContents::Motion if keyframe.is_empty() => None,
            RestoreContents::Motion => return None,
        };
        // The payload has no alignment.
        let chunks = particles.chunks_exact(size_of::<ParticleState>());
        let particles = chunks.map(bytemuck::pod_read_unaligned).collect();
        Some(Self { scene_hash: header.scene_hash, particles, keyframe })
    }
}

impl RestoreHeader {
    /// Returns the command that the outcome answers.
    pub(crate) fn command(&self) -> Option<Command> {
        let contents = RestoreContents::from_number(self.contents)?;
        let action = Action::Restore { contents, state_hash: 0 };
        Some(Command::new(self.client_id, self.sequence, action))
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
        let wrong_length = header(RestoreContents::State, 1);
        assert!(ReceivedState::from_message(&wrong_length, &payload, 34).is_none());
        assert!(read(header(RestoreContents::Motion, 1), &payload).is_none());
        assert!(read(header(RestoreContents::State, 2), &payload).is_none());
        assert!(
            read(RestoreHeader { contents: 3, ..header(RestoreContents::State, 1) }, &payload)
                .is_none()
        );
        // Too long for this load.
        payload.push(9);
        let long = read(header(RestoreContents::State, 1), &payload).unwrap();
        assert_eq!((long.particles, long.keyframe), (vec![], Some(vec![])));
    }
}
