//! Frames that no browser sends: fragments, false lengths, floods of pings, invalid UTF-8, reserved bits
//! and garbage. Each ends its own connection at most, no task panics, and clients do not notice.

use std::net::SocketAddr;
use std::time::Duration;

use serde_json::json;
use viewer_bridge::limits::MESSAGE_SIZE_BYTES_MAX;
use viewer_bridge::request::RequestKind;
use viewer_bridge::sink::Update;

use crate::sockets::foxglove::{FoxgloveSite, options};
use crate::sockets::foxglove_client::{Client, connect};
use crate::sockets::raw_socket::{
    BINARY, CLOSE, CONTINUATION, FIN, PING, RawSocket, TEXT, frame, panic_count, watch_panics,
};
use crate::sockets::support::{Site, wait_for};

const HELLO: &[u8] = br#"{"type":"hello","protocol":3}"#;
const FOXGLOVE: &[&str] = &["Sec-WebSocket-Protocol: foxglove.sdk.v1"];

/// Numbers that look random and are the same in every run (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn bytes(&mut self, count_max: u64) -> Vec<u8> {
        (0..self.next() % count_max).map(|_| self.next().to_le_bytes()[0]).collect()
    }
}

/// Sequences of bytes after which the server closes the connection at once.
fn violations() -> Vec<(&'static str, Vec<u8>)> {
    let with_length = |length: u64| {
        let mut bytes = vec![FIN | TEXT, 0x80 | 0x7f];
        bytes.extend(length.to_be_bytes());
        bytes.extend([0; 4]);
        bytes
    };
    let half = vec![b' '; MESSAGE_SIZE_BYTES_MAX / 2 + 1];
    vec![
        ("a frame of 2^63 bytes", with_length(1 << 63)),
        ("a frame of 2^40 bytes", with_length(1 << 40)),
        ("fragments of a long message", [frame(TEXT, &half), frame(CONTINUATION, &half)].concat()),
        ("a flood of pings", frame(FIN | PING, &[7; 125]).repeat(1000)),
        ("a long ping", frame(FIN | PING, &[7; 126])),
        ("a fragment of a ping", frame(PING, &[7; 3])),
        ("a frame without a mask", vec![FIN | TEXT, 2, b'{', b'}']),
        ("a continuation of nothing", frame(FIN | CONTINUATION, b"{}")),
        ("a message within another", [frame(TEXT, b"{"), frame(FIN | TEXT, b"{}")].concat()),
        ("invalid UTF-8", frame(FIN | TEXT, &[b'"', 0xff, b'"'])),
        ("UTF-8 that ends early", [frame(TEXT, &[0xc3]), frame(FIN | CONTINUATION, b"")].concat()),
        ("a reserved opcode", frame(FIN | 3, b"{}")),
        ("a reserved control opcode", frame(FIN | 0xb, b"{}")),
        ("a compressed frame", frame(FIN | 0x40 | TEXT, b"{}")),
        ("half a close code", frame(FIN | CLOSE, &[3])),
        ("a reserved close code", frame(FIN | CLOSE, &[3, 238])),
        ("a close reason that is no UTF-8", frame(FIN | CLOSE, &[3, 232, 0xff])),
    ]
}

#[test]
fn frames_that_violate_the_protocol_end_only_their_connection() {
    watch_panics();
    let site = Site::start();
    let mut page = site.page();
    for (what, bytes) in violations() {
        for greeting in [None, Some(HELLO)] {
            let mut socket = RawSocket::open(site.address, "/socket", &[]);
            if let Some(hello) = greeting {
                socket.frame(FIN | TEXT, hello);
            }
            socket.write(&bytes);
            socket.read_to_end();
            assert_eq!(panic_count(), 0, "{what}");
        }
    }
    site.wait_for_clients(1);
    site.publish(&Update::Reset { step: 9 });
    assert_eq!(page.text_with_type("reset")["step"], 9);
}

#[test]
fn a_message_in_fragments_between_pings_is_one_message() {
    let site = Site::start();
    let mut socket = RawSocket::open(site.address, "/socket", &[]);
    let (last, first) = HELLO.split_last().unwrap();
    for (index, byte) in first.iter().enumerate() {
        socket.frame(if index == 0 { TEXT } else { CONTINUATION }, &[*byte]);
        socket.frame(FIN | PING, b"ping");
    }
    socket.frame(FIN | CONTINUATION, &[*last]);
    assert!(socket.receives(br#""type":"hello""#));
}

#[test]
fn a_message_that_never_ends_counts_as_silence() {
    let site = Site::start();
    let mut socket = RawSocket::open(site.address, "/socket", &[]);
    socket.frame(FIN | TEXT, HELLO);
    assert!(socket.receives(br#""type":"hello""#));
    socket.frame(TEXT, b"{");
    // The server closes the connection, and not because of the number of frames.
    socket.write(&frame(CONTINUATION, b"").repeat(10_000));
    let too_slow = 4408_u16.to_be_bytes();
    assert!(socket.receives(&too_slow));
    socket.read_to_end();
    site.wait_for_clients(0);
}

#[test]
fn offers_of_compression_are_declined() {
    let site = Site::start();
    for offer in ["permessage-deflate", "permessage-deflate; client_max_window_bits, x-unknown"] {
        let line = format!("Sec-WebSocket-Extensions: {offer}");
        let mut socket = RawSocket::open(site.address, "/socket", &[&line]);
        assert!(!socket.answer.contains("sec-websocket-extensions"), "{}", socket.answer);
        socket.frame(FIN | TEXT, HELLO);
        assert!(socket.receives(br#""type":"hello""#));
    }
}

/// Opens sockets and writes random bytes, half of them as the payload of frames.
fn write_garbage(address: SocketAddr, path: &str, lines: &[&str], first_message: &[u8]) {
    let mut random = Random(1);
    for round in 0..100 {
        let mut socket = RawSocket::open(address, path, lines);
        if round % 4 < 2 {
            socket.frame(FIN | TEXT, first_message);
        }
        for _ in 0..8 {
            let bytes = random.bytes(300);
            match round % 2 {
                0 => socket.write(&bytes),
                _ => socket.frame(FIN | BINARY, &bytes),
            }
        }
    }
}

#[test]
fn garbage_does_not_disturb_pages() {
    watch_panics();
    let site = Site::start();
    let mut page = site.page();
    write_garbage(site.address, "/socket", &[], HELLO);
    site.wait_for_clients(1);
    site.publish(&Update::Reset { step: 9 });
    assert_eq!(page.text_with_type("reset")["step"], 9);
    assert_eq!(panic_count(), 0);
}

#[test]
fn garbage_does_not_disturb_foxglove_clients() {
    watch_panics();
    let mut site = FoxgloveSite::start(options());
    let mut client = site.subscriber();
    let address = site.url.trim_start_matches("ws://").parse().unwrap();
    let subscribe = br#"{"op":"unsubscribe","subscriptionIds":[]}"#;
    write_garbage(address, "/", FOXGLOVE, subscribe);
    for (_, bytes) in violations() {
        let mut socket = RawSocket::open(address, "/", FOXGLOVE);
        socket.write(&bytes);
        socket.read_to_end();
    }
    for bytes in truncated_requests() {
        let mut other = wait_for("a free slot", || connect(&site.url, None).ok());
        other.send_bytes(bytes);
        other.send(&json!({ "op": "getParameters", "parameterNames": [], "id": "end" }));
        // The library answers the broken request before this one.
        assert_eq!(other.text("parameterValues")["id"], "end");
    }
    assert_eq!(panic_count(), 0);
    site.begin(2);
    site.show(1, &[sim_contract::ParticleState::default(); 2]);
    client.message(1);
}

#[test]
fn channels_without_commands_cause_no_requests() {
    let site = FoxgloveSite::start(options());
    let (mut client, _) = Client::start(&site.url);
    for channel in 0..100 {
        client.advertise(channel, "/commands");
        client.unadvertise(channel);
    }
    client.advertise(100, "/commands");
    client.publish(100, &json!({ "kind": "pause" }));
    let first = wait_for("a request", || site.requests.next(Duration::ZERO));
    assert!(matches!(first.kind, RequestKind::Command(_)), "{first:?}");
}

/// Binary messages that end within each of their fields, or whose lengths are false.
fn truncated_requests() -> Vec<Vec<u8>> {
    let mut call = vec![2];
    call.extend([1, 0, 0, 0, 2, 0, 0, 0, 4, 0, 0, 0]);
    call.extend(b"json{}");
    let mut playback = vec![3, 0];
    playback.extend(1_f32.to_le_bytes());
    playback.extend([1; 9]);
    playback.extend([4, 0, 0, 0]);
    playback.extend(b"name");
    let data = vec![1, 1, 0, 0, 0, b'{', b'}'];
    let mut requests = Vec::new();
    for request in [call, playback, data] {
        requests.extend((0..request.len()).map(|end| request[..end].to_vec()));
        // A field of 2^32 - 1 bytes.
        let mut long = request.clone();
        long.iter_mut().skip(9).take(4).for_each(|byte| *byte = 0xff);
        requests.push(long);
    }
    requests
}
