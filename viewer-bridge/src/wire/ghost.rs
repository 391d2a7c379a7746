//! GHOST: a state of another recording, in the picture of the first.

use bytes::Bytes;

use super::header::{Kind, Stamp};
use super::writer::Writer;

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
