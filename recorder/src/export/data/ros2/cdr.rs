//! CDR, the encoding of ROS 2 messages: little-endian numbers, each aligned to its size.

/// Identifies little-endian CDR. Alignment counts from its end.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// A message that is being encoded.
pub(super) struct CdrMessage(Vec<u8>);

impl CdrMessage {
    pub(super) fn new() -> Self {
        Self(ENCAPSULATION.to_vec())
    }

    pub(super) fn add_u8(&mut self, number: u8) {
        self.0.push(number);
    }

    pub(super) fn add_u32(&mut self, number: u32) {
        self.add_aligned(number.to_le_bytes());
    }

    pub(super) fn add_f64(&mut self, number: f64) {
        self.add_aligned(number.to_le_bytes());
    }

    /// Adds a text with its length and the zero at its end.
    pub(super) fn add_text(&mut self, text: &str) {
        self.add_count(text.len() + 1);
        self.0.extend_from_slice(text.as_bytes());
        self.0.push(0);
    }

    /// Adds a list of bytes with its length.
    pub(super) fn add_bytes(&mut self, bytes: &[u8]) {
        self.add_count(bytes.len());
        self.0.extend_from_slice(bytes);
    }

    /// Adds the number of elements of a list. A payload of 2^24 particles has 2^29 bytes.
    pub(super) fn add_count(&mut self, count: usize) {
        self.add_u32(u32::try_from(count).unwrap_or(u32::MAX));
    }

    pub(super) fn finish(self) -> Vec<u8> {
        self.0
    }

    fn add_aligned<const N: usize>(&mut self, bytes: [u8; N]) {
        let content_size_bytes = self.0.len() - ENCAPSULATION.len();
        let size_bytes = content_size_bytes.next_multiple_of(N) + ENCAPSULATION.len();
        self.0.resize(size_bytes, 0);
        self.0.extend_from_slice(&bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of a string before a number: padding follows it.
    #[test]
    fn numbers_are_aligned_to_their_size() {
        let mut message = CdrMessage::new();
        message.add_text("map");
        message.add_u8(7);
        message.add_u32(1);
        message.add_f64(1.0);
        let expected = [
            &[0, 1, 0, 0][..],
            &[4, 0, 0, 0, b'm', b'a', b'p', 0],
            &[7, 0, 0, 0, 1, 0, 0, 0],
            &1.0_f64.to_le_bytes(),
        ];
        assert_eq!(message.finish(), expected.concat());
    }
}
