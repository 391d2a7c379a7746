//! PART: a piece of a long message. A page on a slow line shows how much of a scene has arrived, and the server
//! knows that the line is alive.

use std::io::Write as _;

use bytes::Bytes;
use flate2::Compression;
use flate2::write::DeflateEncoder;

use super::writer::{Kind, Stamp, Writer, count_u32};
use crate::limits::PART_SIZE_BYTES;

/// A piece of a binary message.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Part {
    /// Load and step of the whole message.
    pub stamp: Stamp,
    /// Kind of the whole message.
    pub kind: u32,
    /// Place of the piece.
    pub offset: u32,
    /// Size of all pieces.
    pub size: u32,
    /// Size of the message if its pieces are its raw deflate stream; 0 if they are the message.
    pub unpacked_size: u32,
    /// The piece.
    pub bytes: Bytes,
}

impl Part {
    /// Divides a message into pieces of at most [`PART_SIZE_BYTES`]. A scene is compressed: most of what its shapes
    /// generate repeats itself.
    pub(crate) fn divide(message: &Bytes) -> Vec<Self> {
        let head = |range: std::ops::Range<usize>| -> u32 {
            let bytes = message.get(range).unwrap_or_default();
            bytes.iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
        };
        let step = u64::from(head(8..12)) | u64::from(head(12..16)) << 32;
        let (kind, stamp) = (head(0..2), Stamp { epoch: head(4..8), step });
        let packed = if kind == Kind::Scene as u32 { pack(message) } else { None };
        let unpacked_size = if packed.is_some() { count_u32(message.len()) } else { 0 };
        let whole = packed.unwrap_or_else(|| message.clone());
        let piece = |offset: usize| Self {
            stamp,
            kind,
            offset: count_u32(offset),
            size: count_u32(whole.len()),
            unpacked_size,
            bytes: whole.slice(offset..whole.len().min(offset + PART_SIZE_BYTES)),
        };
        (0..whole.len()).step_by(PART_SIZE_BYTES).map(piece).collect()
    }

    /// Encodes the message.
    pub fn encode(&self) -> Bytes {
        let mut writer = Writer::new(Kind::Part, self.stamp, 36 + self.bytes.len());
        for number in [self.kind, self.offset, self.size, self.unpacked_size] {
            writer.u32(number);
        }
        writer.count(&self.bytes);
        writer.bytes(&self.bytes);
        writer.pad();
        writer.finish()
    }
}

/// Compresses a message. Returns `None` if that does not make it smaller.
fn pack(message: &Bytes) -> Option<Bytes> {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(message).ok()?;
    let packed = encoder.finish().ok()?;
    (packed.len() < message.len()).then(|| packed.into())
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use flate2::read::DeflateDecoder;

    use super::*;
    use crate::wire::Scene;
    use crate::wire_decoder::{Message, decode};

    fn joined(parts: &[Part]) -> Vec<u8> {
        parts.iter().flat_map(|part| part.bytes.to_vec()).collect()
    }

    #[test]
    fn the_pieces_of_a_message_are_the_message() {
        let mut message = vec![3; 2 * PART_SIZE_BYTES + 5];
        message[..2].copy_from_slice(&(Kind::FrameF32 as u16).to_le_bytes());
        let parts = Part::divide(&message.clone().into());
        assert_eq!(parts.len(), 3);
        assert_eq!(joined(&parts), message);
        assert_eq!((parts[2].offset, parts[2].bytes.len()), (count_u32(2 * PART_SIZE_BYTES), 5));
        for part in parts {
            assert_eq!((part.kind, part.unpacked_size), (2, 0));
            assert_eq!(part.stamp, Stamp { epoch: 0x0303_0303, step: 0x0303_0303_0303_0303 });
            assert_eq!(decode(&part.encode()), Ok(Message::Part(part)));
        }
    }

    #[test]
    fn a_generated_scene_becomes_much_smaller() {
        // A sheet of 100 x 100: the constraints to the right and down.
        let index = |c: u32, r: u32| r * 100 + c;
        let cells = (0..99).flat_map(|r| (0..99).map(move |c| (c, r)));
        let mut scene = Scene { stamp: Stamp { epoch: 7, step: 9 }, ..Scene::default() };
        for (c, r) in cells {
            scene.positions.push([c as f32 * 0.1, r as f32 * -0.1, 0.0]);
            scene.ends.extend([[index(c, r), index(c + 1, r)], [index(c, r), index(c, r + 1)]]);
            scene.rest_lengths.extend([0.1; 2]);
            scene.kinds.extend([0; 2]);
            scene.compliances.extend([0.0; 2]);
            scene.triangles.push([index(c, r), index(c, r + 1), index(c + 1, r + 1)]);
        }
        let message = scene.encode();
        let parts = Part::divide(&message);
        let packed = joined(&parts);
        assert!(packed.len() * 3 < message.len(), "{} of {}", packed.len(), message.len());
        assert_eq!(parts[0].stamp, scene.stamp);
        assert_eq!(parts[0].unpacked_size as usize, message.len());
        let mut unpacked = Vec::new();
        DeflateDecoder::new(packed.as_slice()).read_to_end(&mut unpacked).unwrap();
        assert_eq!(unpacked, message);
    }
}
