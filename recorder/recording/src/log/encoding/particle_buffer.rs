//! Particles that are written without another copy.

use sim_messages::ParticleState;

use super::protobuf::encode_cloud_head;

/// Room before the particles, in particles of 32 bytes. The head of a message has about 250 bytes.
const HEAD_ROOM: usize = 16;

/// Particles with room for the head of their message before them, so that the bytes of the message lie
/// side by side.
#[derive(Debug, Clone, Default)]
pub struct ParticleBuffer {
    /// The room, and behind it the particles. Empty if there are none.
    states: Vec<ParticleState>,
    head: Vec<u8>,
}

impl ParticleBuffer {
    /// Replaces the particles, and reuses the memory.
    pub fn copy_from(&mut self, particles: &[ParticleState]) {
        self.states.resize(HEAD_ROOM, ParticleState::default());
        self.states.truncate(HEAD_ROOM);
        self.states.extend_from_slice(particles);
    }

    /// Returns the particles.
    pub fn particles(&self) -> &[ParticleState] {
        self.states.get(HEAD_ROOM..).unwrap_or_default()
    }

    /// Puts the head of the message on `/particles` before the particles. `time_ns` is the time of its step,
    /// in nanoseconds since 1970.
    pub(in crate::log) fn encode_head(&mut self, time_ns: u64) {
        encode_cloud_head(
            time_ns,
            self.states.get(HEAD_ROOM..).unwrap_or_default(),
            &mut self.head,
        );
        if !self.particles().is_empty() {
            let (begin, end) = (self.head_begin(), HEAD_ROOM * size_of::<ParticleState>());
            let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut self.states);
            bytes[begin..end].copy_from_slice(&self.head);
        }
    }

    /// Returns the message, after [`ParticleBuffer::encode_head`].
    pub(in crate::log) fn message(&self) -> &[u8] {
        if self.particles().is_empty() {
            return &self.head;
        }
        &bytemuck::cast_slice(&self.states)[self.head_begin()..]
    }

    /// Returns the place of the head, in bytes.
    fn head_begin(&self) -> usize {
        HEAD_ROOM * size_of::<ParticleState>() - self.head.len()
    }
}

impl From<&[ParticleState]> for ParticleBuffer {
    fn from(particles: &[ParticleState]) -> Self {
        let mut buffer = Self::default();
        buffer.copy_from(particles);
        buffer
    }
}

impl PartialEq for ParticleBuffer {
    fn eq(&self, other: &Self) -> bool {
        self.particles() == other.particles()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::encoding::MessageEncoder;

    #[test]
    fn a_reused_buffer_has_the_bytes_of_the_encoder() {
        let mut buffer = ParticleBuffer::default();
        for (count, time_ns) in [(0, 0), (3, 7), (1, u64::MAX), (1000, 1_700_000_000_999_999_999)] {
            let state = |index| ParticleState { flags: index, ..ParticleState::default() };
            let particles: Vec<_> = (1..=count).map(state).collect();
            buffer.copy_from(&particles);
            assert_eq!(buffer.particles(), particles);
            let mut encoder = MessageEncoder::default();
            buffer.encode_head(time_ns);
            assert_eq!(buffer.message(), encoder.encode_particles(&particles, time_ns));
            assert_eq!(buffer.particles(), particles, "the head overwrites none");
        }
    }
}
