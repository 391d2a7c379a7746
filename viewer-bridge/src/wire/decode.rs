//! Reading what a server sends: for tests, and for clients in Rust.

use thiserror::Error;

use super::cursor::Cursor;
use super::frame;
use super::{Colliders, Format, Frame, KIND_VERSION, Kind, Pins, Scene, Stamp, Statistics, Tear};

/// A binary message.
#[derive(Debug, Clone, PartialEq)]
pub enum Message {
    /// A load.
    Scene(Scene),
    /// The positions of a step.
    Frame(Frame),
    /// A change of the list of torn constraints.
    Tear(Tear),
    /// All particles that are not free.
    Pins(Pins),
    /// How node and simulation do.
    Statistics(Box<Statistics>),
    /// All colliders.
    Colliders(Colliders),
}

/// Why bytes are not a message.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum DecodeError {
    /// They end too early.
    #[error("the message ends at byte {at}, where {needed} more are needed")]
    TooShort {
        /// Where.
        at: usize,
        /// What the next field takes.
        needed: usize,
    },
    /// They go on behind the end.
    #[error("{extra} bytes follow the end of the message")]
    TooLong {
        /// How many.
        extra: usize,
    },
    /// Kind or version is unknown.
    #[error("kind {kind} of version {version} is not known")]
    Unknown {
        /// The kind.
        kind: u16,
        /// Its version.
        version: u16,
    },
    /// The JSON of a scene is none.
    #[error("the scene's text: {detail}")]
    Json {
        /// What is wrong with it.
        detail: String,
    },
}

/// Reads one message.
///
/// # Errors
/// An unknown kind, or bytes that are too few or too many for it.
pub fn decode(bytes: &[u8]) -> Result<Message, DecodeError> {
    let mut cursor = Cursor::new(bytes);
    let (kind, version) = (cursor.u16()?, cursor.u16()?);
    let stamp = Stamp { epoch: cursor.u32()?, step: cursor.u64()? };
    let unknown = DecodeError::Unknown { kind, version };
    if version != KIND_VERSION {
        return Err(unknown);
    }
    let is = |known: Kind| kind == known as u16;
    let message = if is(Kind::Scene) {
        Message::Scene(Scene::decode(stamp, &mut cursor)?)
    } else if is(Kind::FrameF32) {
        Message::Frame(frame::decode(Format::F32, stamp, &mut cursor)?)
    } else if is(Kind::FrameU16) {
        Message::Frame(frame::decode(Format::U16, stamp, &mut cursor)?)
    } else if is(Kind::Tear) {
        Message::Tear(Tear::decode(stamp, &mut cursor)?)
    } else if is(Kind::Pins) {
        Message::Pins(Pins::decode(stamp, &mut cursor)?)
    } else if is(Kind::Stats) {
        Message::Statistics(Box::new(Statistics::decode(stamp, &mut cursor)?))
    } else if is(Kind::Colliders) {
        Message::Colliders(Colliders::decode(stamp, &mut cursor)?)
    } else {
        return Err(unknown);
    };
    cursor.end()?;
    Ok(message)
}
