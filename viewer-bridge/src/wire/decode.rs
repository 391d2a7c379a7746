//! The decoder of the binary messages, for tests and for clients in Rust.

use super::cursor::Cursor;
use super::decode_error::DecodeError;
use super::forces::Forces;
use super::frame::{self, Format, Frame};
use super::ghost::Ghost;
use super::header::{KIND_VERSION, Kind, Stamp};
use super::part::Part;
use super::past::Past;
use super::scene::Scene;
use super::selected::{Inspected, Speeds};
use super::small::{Colliders, Pins, Tear};
use super::statistics::Statistics;

/// A binary message.
#[derive(Debug, Clone, PartialEq)]
pub enum Message {
    /// A load.
    Scene(Box<Scene>),
    /// The positions of a step.
    Frame(Frame),
    /// A change of the list of torn constraints.
    Tear(Tear),
    /// All particles that are not free.
    Pins(Pins),
    /// Statistics of the node and the scene.
    Statistics(Box<Statistics>),
    /// All colliders.
    Colliders(Colliders),
    /// The impulses of a step.
    Forces(Forces),
    /// The speeds of all particles.
    Speeds(Speeds),
    /// The exact states of some particles.
    Inspected(Inspected),
    /// The head of an earlier state.
    Past(Past),
    /// A state of another recording.
    Ghost(Ghost),
    /// A piece of a long message.
    Part(Part),
}

/// Decodes one message.
///
/// # Errors
/// The kind is unknown, or the message has too few or too many bytes.
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
        Message::Scene(Box::new(Scene::decode(stamp, &mut cursor)?))
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
    } else if is(Kind::Forces) {
        Message::Forces(Forces::decode(stamp, &mut cursor)?)
    } else if is(Kind::Speeds) {
        Message::Speeds(Speeds::decode(stamp, &mut cursor)?)
    } else if is(Kind::Inspected) {
        Message::Inspected(Inspected::decode(stamp, &mut cursor)?)
    } else if is(Kind::Past) {
        Message::Past(Past::decode(stamp, &mut cursor)?)
    } else if is(Kind::Ghost) {
        Message::Ghost(Ghost::decode(stamp, &mut cursor)?)
    } else if is(Kind::Part) {
        Message::Part(Part::decode(stamp, &mut cursor)?)
    } else {
        return Err(unknown);
    };
    cursor.end()?;
    Ok(message)
}
