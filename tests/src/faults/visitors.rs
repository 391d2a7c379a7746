//! Actions on the bridge, and connections to it that are cut off.

use std::io::{Read, Write};
use std::net::TcpStream;

use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

use crate::faults::action::{Ending, Visit};
use crate::faults::actor::{Actor, Ends};
use crate::faults::world::World;
use crate::programs::Program;
use crate::wait::DEADLINE;

const BRIDGE_ENDS: Ends = Ends { codes: &[0], errors: &[], needs_no_signal: false };

impl World {
    /// Starts a bridge, with a node or without.
    pub(super) fn start_bridge(&mut self) {
        if self.bridge.is_none() {
            let args = ["--listen", "127.0.0.1:0"];
            let mut bridge = Actor::start(Program::ViewerBridge, &self.sandbox, &args, BRIDGE_ENDS);
            bridge.wait_until_ready();
            self.bridge = Some(bridge);
        }
    }

    pub(super) fn end_bridge(&mut self, ending: Ending) {
        if let Some(bridge) = self.bridge.take() {
            bridge.end(ending, &self.files, &mut self.journal);
        }
    }

    /// Connects to the bridge and vanishes without a farewell.
    pub(super) fn visit(&mut self, visit: Visit) {
        let Some(bridge) = &mut self.bridge else { return };
        let line = bridge.wait_for_line("ready http://");
        let host = line.trim_start_matches("ready http://").trim_end_matches('/');
        let mut stream = TcpStream::connect(host).expect("a bridge that listens");
        stream.set_read_timeout(Some(DEADLINE)).expect("a socket");
        match visit {
            Visit::Silent => {}
            Visit::HalfRequest => stream.write_all(b"GET / HTT").expect("a bridge that reads"),
            Visit::Download => download(stream, host),
            Visit::Page => drop(open_page(stream, host)),
            Visit::GrabbingPage => {
                let grab = json!({ "kind": "grab", "particle": 20, "target": [0.5, 0.2, 0.3] });
                send(&mut open_page(stream, host), &grab);
            }
            Visit::Nonsense => {
                let mut page = open_page(stream, host);
                send(&mut page, &json!({ "type": "nonsense" }));
                while !matches!(page.read(), Ok(Message::Close(_)) | Err(_)) {}
            }
        }
    }
}

fn download(mut stream: TcpStream, host: &str) {
    let request = format!("GET / HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).expect("a bridge that reads");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("a page");
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
}

/// Connects as a page does, and waits for the answer to its hello.
fn open_page(stream: TcpStream, host: &str) -> WebSocket<TcpStream> {
    let connected = tungstenite::client(format!("ws://{host}/socket"), stream);
    let (mut page, _) = connected.expect("a bridge that accepts pages");
    send(&mut page, &json!({ "type": "hello", "protocol": 3, "format": "f32" }));
    let answer = loop {
        if let Message::Text(text) = page.read().expect("an answer") {
            break serde_json::from_str::<Value>(&text).expect("an object");
        }
    };
    assert_eq!(answer["type"], "hello");
    page
}

fn send(page: &mut WebSocket<TcpStream>, message: &Value) {
    page.send(Message::text(message.to_string())).expect("a bridge that reads");
}
