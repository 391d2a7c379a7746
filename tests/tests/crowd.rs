//! Crowds of connections that never become clients: they keep no newcomer out and disturb no client,
//! even if the bridge has few file descriptors.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use integration_tests::{Process, Program, Sandbox, allow_many_open_files, wait_for};
use tungstenite::WebSocket;
use viewer_bridge::limits::{HEAD_SIZE_BYTES_MAX, MESSAGE_SIZE_BYTES_MAX, VISITORS_MAX};

use crate::foxglove_client::{Client, connect};
use crate::viewer::page::{Bridge, Page};

/// A node, and a bridge for pages and Foxglove clients.
struct Setup {
    bridge: Bridge,
    foxglove: String,
    _node: Process,
}

/// The tests run one after the other, because each opens several hundred sockets.
static TURN: Mutex<()> = Mutex::new(());

const BRIDGE_ARGS: [&str; 4] = ["--listen", "127.0.0.1:0", "--foxglove", "127.0.0.1:0"];

impl Setup {
    fn start(sandbox: &Sandbox, mut bridge: Process) -> Self {
        allow_many_open_files();
        let node = Process::start_ready(Program::SimNode, sandbox, &["run", "curtain"]);
        let foxglove = bridge.wait_for_line("foxglove ws://").replace("foxglove ", "");
        Self { bridge: Bridge::ready(bridge), foxglove, _node: node }
    }

    /// Connects a page and a Foxglove client.
    fn clients(&self) -> Clients {
        Clients { page: self.bridge.page(), foxglove: self.foxglove_client() }
    }

    /// Connects a Foxglove client that has received a step.
    fn foxglove_client(&self) -> Client {
        let (mut client, _) = Client::start(&self.foxglove);
        assert_eq!(client.topics().len(), 10);
        client.subscribe(1, "/steps");
        client.json(1);
        client
    }

    /// Opens connections that send the beginning of a request.
    fn half_open(&self, count: usize) -> Vec<TcpStream> {
        let open = |_| {
            let mut stream = TcpStream::connect(&self.bridge.host).unwrap();
            stream.write_all(b"GET / HTTP/1.1\r\nHost:").unwrap();
            stream
        };
        (0..count).map(open).collect()
    }

    /// Opens sockets of pages that never send a message. The server can close them during the handshake.
    fn silent_sockets(&self, count: usize) -> Vec<WebSocket<TcpStream>> {
        let open = |_| {
            let stream = TcpStream::connect(&self.bridge.host).unwrap();
            let url = format!("ws://{}/socket", self.bridge.host);
            Some(tungstenite::client(url, stream).ok()?.0)
        };
        (0..count).filter_map(open).collect()
    }
}

/// Connections that request the page again and again. Dropping it closes them.
struct KeptAlive {
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl KeptAlive {
    fn start(host: &str, count: usize) -> Self {
        let request = format!("GET / HTTP/1.1\r\nHost: {host}\r\n\r\n").into_bytes();
        let open = |_| {
            let mut stream = TcpStream::connect(host).unwrap();
            stream.write_all(&request).unwrap();
            stream.set_nonblocking(true).unwrap();
            stream
        };
        let streams: Vec<_> = (0..count).map(open).collect();
        let is_over = Arc::new(AtomicBool::new(false));
        let end = Arc::clone(&is_over);
        let thread = thread::spawn(move || {
            let mut buffer = vec![0; 1 << 16];
            let mut turns = streams.iter().cycle();
            wait_for("the end of the test", || {
                // Each connection has its turn several times a second.
                turns.by_ref().take(8).for_each(|stream| renew(stream, &request, &mut buffer));
                end.load(Ordering::Relaxed).then_some(())
            });
        });
        Self { is_over, thread: Some(thread) }
    }
}

/// Repeats a request once it is answered. The server may have closed the connection.
fn renew(mut stream: &TcpStream, request: &[u8], buffer: &mut [u8]) {
    if stream.read(buffer).is_ok_and(|size| size > 0) {
        let _closed = stream.write(request);
    }
}

impl Drop for KeptAlive {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        let _panicked = self.thread.take().map(JoinHandle::join);
    }
}

/// Clients that were there before the crowd. They must read again and again, because the server
/// disconnects a client that answers no pings.
struct Clients {
    page: Page,
    foxglove: Client,
}

impl Clients {
    /// Waits for a frame after those that the page has received, and for its step at the other client.
    fn receive(&mut self) {
        let step = next_frame(&mut self.page);
        while self.foxglove.json(1)["step"].as_u64().unwrap() < step {}
    }
}

/// Waits for a frame after those that the page has received, and returns its step.
fn next_frame(page: &mut Page) -> u64 {
    let step = page.frame(|_| true).head.stamp.step;
    page.frame(|frame| frame.head.stamp.step > step).head.stamp.step
}

#[test]
fn a_crowd_keeps_no_newcomer_out_and_disturbs_no_client() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let sandbox = Sandbox::new();
    let bridge = Process::start(Program::ViewerBridge, &sandbox, &BRIDGE_ARGS);
    let setup = Setup::start(&sandbox, bridge);
    let mut clients = setup.clients();
    let _kept_alive = KeptAlive::start(&setup.bridge.host, 300);
    clients.receive();
    let _half_open = setup.half_open(300);
    clients.receive();
    let idle: Vec<_> = (0..64).map(|_| connect(&setup.foxglove, None)).collect();
    assert_eq!(idle.iter().filter(|client| client.is_ok()).count(), 64);
    clients.receive();
    let _silent = setup.silent_sockets(80);
    let mut newcomer = setup.bridge.page();
    assert_eq!(newcomer.scene().positions.len(), 168);
    next_frame(&mut newcomer);
    let _foxglove_newcomer = setup.foxglove_client();
    // A page that loads its files gets all of them.
    assert!(get(&setup.bridge.host, "/js/main.js").contains("import"));
    clients.receive();
}

#[test]
fn a_bridge_with_few_file_descriptors_serves_its_clients_and_newcomers() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let sandbox = Sandbox::new();
    // The link to the node needs about a hundred.
    let mut bridge =
        Process::start_limited(("-n", 256), Program::ViewerBridge, &sandbox, &BRIDGE_ARGS);
    assert!(bridge.wait_for_line("warning: ").contains("ulimit -n"));
    let setup = Setup::start(&sandbox, bridge);
    let mut clients = setup.clients();
    for _ in 0..2 {
        let _half_open = setup.half_open(150);
        let _idle: Vec<_> = (0..16).map(|_| connect(&setup.foxglove, None)).collect();
        clients.receive();
        assert_eq!(setup.bridge.page().scene().positions.len(), 168);
        setup.foxglove_client();
        clients.receive();
    }
}

#[test]
fn heads_and_messages_that_never_end_use_little_memory() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let sandbox = Sandbox::new();
    let bridge = Process::start(Program::ViewerBridge, &sandbox, &BRIDGE_ARGS);
    let setup = Setup::start(&sandbox, bridge);
    let mut clients = setup.clients();
    let before_bytes = setup.bridge.process.memory_peak_bytes();
    let foxglove = setup.foxglove.trim_start_matches("ws://").to_owned();
    let (mut sent_bytes, mut open) = (0, Vec::new());
    for host in [&setup.bridge.host, &foxglove] {
        for round in 0..256 {
            let mut stream = TcpStream::connect(host).unwrap();
            stream.set_nonblocking(true).unwrap();
            let endless = if round % 2 == 0 { endless_head() } else { endless_message(host) };
            // The server may have closed the connection, or read no more of it.
            sent_bytes += stream.write(&endless).unwrap_or(0) as u64;
            open.push(stream);
            if round % 64 == 0 {
                clients.receive();
            }
        }
    }
    let used_bytes = setup.bridge.process.memory_peak_bytes() - before_bytes;
    // A head and a message for each visitor of both servers, and the same again for the copies while
    // they grow.
    let visitor_bytes = (HEAD_SIZE_BYTES_MAX + MESSAGE_SIZE_BYTES_MAX) as u64;
    let limit_bytes = 2 * 2 * VISITORS_MAX as u64 * visitor_bytes;
    assert!(sent_bytes > limit_bytes, "{sent_bytes} bytes were sent, not {limit_bytes}");
    assert!(used_bytes < limit_bytes, "{used_bytes} bytes, not {limit_bytes}");
}

/// The head of a request, without an end.
fn endless_head() -> Vec<u8> {
    [b"GET / HTTP/1.1\r\nHost: ".to_vec(), vec![b'x'; 1 << 20]].concat()
}

/// A handshake, and a message in fragments without an end.
fn endless_message(host: &str) -> Vec<u8> {
    let mut bytes = format!(
        "GET /socket HTTP/1.1\r\nHost: {host}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\
         Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n"
    )
    .into_bytes();
    // 500 masked fragments of a text, and pings.
    for first in std::iter::once(0x01).chain(std::iter::repeat_n(0x00, 499)) {
        bytes.extend([first, 0x80 | 0x64, 0, 0, 0, 0]);
        bytes.extend([b' '; 100]);
    }
    bytes.extend([0x89, 0x80, 0, 0, 0, 0].repeat(1 << 17));
    bytes
}

/// Requests a file and returns the answer.
fn get(host: &str, path: &str) -> String {
    let mut stream = TcpStream::connect(host).unwrap();
    let request = format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}
