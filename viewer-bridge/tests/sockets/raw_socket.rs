//! A WebSocket whose frames the test writes byte by byte, and which accepts everything.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Once;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use crate::sockets::support::wait_for;

/// Opcodes of frames.
pub(crate) const CONTINUATION: u8 = 0;
pub(crate) const TEXT: u8 = 1;
pub(crate) const BINARY: u8 = 2;
pub(crate) const CLOSE: u8 = 8;
pub(crate) const PING: u8 = 9;
/// First bit of the last frame of a message.
pub(crate) const FIN: u8 = 0x80;

/// A socket after its handshake.
pub(crate) struct RawSocket {
    stream: TcpStream,
    /// Head of the server's answer to the handshake, in lower case.
    pub(crate) answer: String,
}

impl RawSocket {
    /// Opens a socket at a path, with additional lines in the head of the request. Waits while all places
    /// are taken, because the server needs a moment to notice that clients have left.
    pub(crate) fn open(address: SocketAddr, path: &str, lines: &[&str]) -> Self {
        let mut request = format!(
            "GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
             Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
        );
        for line in lines {
            request.extend([line, "\r\n"]);
        }
        request.push_str("\r\n");
        wait_for("a socket", || {
            let mut stream = TcpStream::connect(address).unwrap();
            stream.set_read_timeout(Some(Duration::from_mins(1))).unwrap();
            stream.write_all(request.as_bytes()).unwrap();
            let answer = read_head(&mut stream);
            (!answer.starts_with("http/1.1 503")).then(|| {
                assert!(answer.starts_with("http/1.1 101"), "{answer}");
                Self { stream, answer }
            })
        })
    }

    /// Writes bytes. The server may have closed the connection.
    pub(crate) fn write(&mut self, bytes: &[u8]) {
        let _closed = self.stream.write_all(bytes);
    }

    /// Writes a frame with a payload.
    pub(crate) fn frame(&mut self, first: u8, payload: &[u8]) {
        self.write(&frame(first, payload));
    }

    /// Reads until `wanted` occurs in the bytes. Returns false at the end of the connection.
    pub(crate) fn receives(&mut self, wanted: &[u8]) -> bool {
        let mut bytes = Vec::new();
        let mut buffer = [0; 4096];
        while !bytes.windows(wanted.len()).any(|window| window == wanted) {
            match self.stream.read(&mut buffer) {
                Ok(0) => return false,
                Ok(count) => bytes.extend_from_slice(&buffer[..count]),
                Err(error) => {
                    assert_ne!(
                        error.kind(),
                        std::io::ErrorKind::WouldBlock,
                        "no end of the connection"
                    );
                    return false;
                }
            }
        }
        true
    }

    /// Reads to the end of the connection.
    pub(crate) fn read_to_end(&mut self) {
        // No byte sequence is that long.
        let never = vec![0; 1 << 24];
        assert!(!self.receives(&never));
    }
}

/// Reads the head of an answer, in lower case.
fn read_head(stream: &mut TcpStream) -> String {
    let mut answer = Vec::new();
    while !answer.ends_with(b"\r\n\r\n") {
        let mut byte = [0];
        stream.read_exact(&mut byte).unwrap();
        answer.extend(byte);
    }
    String::from_utf8(answer).unwrap().to_lowercase()
}

/// Returns a masked frame. The mask is 0, which leaves the payload as it is.
pub(crate) fn frame(first: u8, payload: &[u8]) -> Vec<u8> {
    let mut bytes = vec![first];
    match u16::try_from(payload.len()) {
        Ok(length @ 0..126) => bytes.push(0x80 | length.to_le_bytes()[0]),
        Ok(length) => {
            bytes.push(0x80 | 0x7e);
            bytes.extend(length.to_be_bytes());
        }
        Err(_) => {
            bytes.push(0x80 | 0x7f);
            bytes.extend((payload.len() as u64).to_be_bytes());
        }
    }
    bytes.extend([0; 4]);
    bytes.extend(payload);
    bytes
}

static PANIC_COUNT: AtomicUsize = AtomicUsize::new(0);

/// Counts panics of the server's threads from now on. A panic there ends only one task, unseen.
pub(crate) fn watch_panics() {
    static WATCH: Once = Once::new();
    WATCH.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            // The threads of tests have the names of the tests.
            if !std::thread::current().name().is_some_and(|name| name.contains("::")) {
                PANIC_COUNT.fetch_add(1, Ordering::Relaxed);
            }
            before(panic);
        }));
    });
}

/// Number of panics since [`watch_panics`].
pub(crate) fn panic_count() -> usize {
    PANIC_COUNT.load(Ordering::Relaxed)
}
