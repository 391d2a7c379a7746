//! The frames of a client's WebSocket, as far as to count them: the sizes in their heads.

use crate::limits::MESSAGE_SIZE_BYTES_MAX;
use crate::socket::rate_limit::RateLimit;

/// Longest head of a frame: two bytes, eight of a length, four of a mask.
const HEAD_SIZE_BYTES_MAX: usize = 14;

/// Follows the frames of one client.
#[derive(Debug)]
pub(super) struct ClientFrames {
    head: [u8; HEAD_SIZE_BYTES_MAX],
    /// How much of the next head has come.
    head_count: usize,
    /// What is still to come of the frame.
    payload_left: u64,
    /// Bytes of the message so far: it may come in several frames.
    message_bytes: u64,
    limit: RateLimit,
}

impl ClientFrames {
    pub(super) fn new(now_ns: u64) -> Self {
        let limit = RateLimit::new(now_ns);
        let head = [0; HEAD_SIZE_BYTES_MAX];
        Self { head, head_count: 0, payload_left: 0, message_bytes: 0, limit }
    }

    /// Takes what came next; whether it is within the limits on size and number.
    pub(super) fn allow(&mut self, mut bytes: &[u8], now_ns: u64) -> bool {
        while let [first, rest @ ..] = bytes {
            if self.payload_left > 0 {
                let count = usize::try_from(self.payload_left).unwrap_or(usize::MAX);
                let count = count.min(bytes.len());
                self.payload_left -= count as u64;
                bytes = &bytes[count..];
                continue;
            }
            self.head[self.head_count] = *first;
            self.head_count += 1;
            bytes = rest;
            if self.head_count >= 2 && self.head_count == self.head_size() && !self.begin(now_ns) {
                return false;
            }
        }
        true
    }

    /// Size of the head, of which two bytes have come.
    fn head_size(&self) -> usize {
        let length = match self.head[1] & 0x7f {
            126 => 2,
            127 => 8,
            _ => 0,
        };
        let mask = if self.head[1] & 0x80 == 0 { 0 } else { 4 };
        2 + length + mask
    }

    /// Begins a frame whose head is complete; whether it is within the limits.
    fn begin(&mut self, now_ns: u64) -> bool {
        self.head_count = 0;
        let size = match self.head[1] & 0x7f {
            126 => u64::from(u16::from_be_bytes([self.head[2], self.head[3]])),
            127 => {
                let mut size = [0; 8];
                size.copy_from_slice(&self.head[2..10]);
                u64::from_be_bytes(size)
            }
            small => u64::from(small),
        };
        self.payload_left = size;
        let opcode = self.head[0] & 0x0f;
        // Control frames come between those of a message; the library bounds their size.
        let is_control = opcode & 0x08 != 0;
        if !is_control {
            let before = if opcode == 0 { self.message_bytes } else { 0 };
            self.message_bytes = before.saturating_add(size);
        }
        self.message_bytes <= MESSAGE_SIZE_BYTES_MAX as u64
            && size <= MESSAGE_SIZE_BYTES_MAX as u64
            && self.limit.allows(now_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::MESSAGES_BURST_MAX;

    /// A masked frame.
    fn frame(first: u8, size: usize) -> Vec<u8> {
        let mut bytes = vec![first];
        match size {
            0..126 => bytes.push(0x80 | u8::try_from(size).unwrap()),
            126..65_536 => {
                bytes.push(0x80 | 0x7e);
                bytes.extend(u16::try_from(size).unwrap().to_be_bytes());
            }
            _ => {
                bytes.push(0x80 | 0x7f);
                bytes.extend((size as u64).to_be_bytes());
            }
        }
        bytes.extend([0; 4]);
        bytes.resize(bytes.len() + size, 0xff);
        bytes
    }

    const FIRST: u8 = 0x01;
    const NEXT: u8 = 0x00;
    const WHOLE: u8 = 0x81;
    const PING: u8 = 0x89;

    #[test]
    fn frames_up_to_the_limit_pass_however_they_are_cut() {
        let sizes = [0, 1, 125, 126, 127, 65_535, MESSAGE_SIZE_BYTES_MAX];
        let stream: Vec<_> = sizes.iter().flat_map(|size| frame(WHOLE, *size)).collect();
        for cut in [1, 2, 3, 7, 1000, stream.len()] {
            let mut frames = ClientFrames::new(0);
            assert!(stream.chunks(cut).all(|bytes| frames.allow(bytes, 0)), "{cut}");
            assert_eq!((frames.head_count, frames.payload_left), (0, 0));
        }
    }

    #[test]
    fn a_message_that_is_too_long_is_refused_before_it_has_come() {
        let mut frames = ClientFrames::new(0);
        assert!(!frames.allow(&frame(WHOLE, MESSAGE_SIZE_BYTES_MAX + 1)[..14], 0));
        let mut frames = ClientFrames::new(0);
        assert!(frames.allow(&frame(FIRST, MESSAGE_SIZE_BYTES_MAX), 0));
        assert!(frames.allow(&frame(PING, 4), 0));
        assert!(!frames.allow(&frame(NEXT, 1), 0));
    }

    #[test]
    fn a_flood_is_refused() {
        let mut frames = ClientFrames::new(0);
        assert!((0..MESSAGES_BURST_MAX).all(|_| frames.allow(&frame(WHOLE, 3), 0)));
        assert!(!frames.allow(&frame(PING, 0), 0));
    }
}
