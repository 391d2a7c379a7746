//! A page in Rust: what a browser would be told, and say.

use std::collections::VecDeque;
use std::net::TcpStream;

use integration_tests::{DEADLINE, Deadline, Process, Program, Sandbox};
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};
use viewer_bridge::wire::{self, Frame, Pins, Scene, Statistics, Tear, decode};

/// A bridge, and where it listens.
pub(crate) struct Bridge {
    pub(crate) process: Process,
    /// Its address and port.
    pub(crate) host: String,
}

/// A page of it.
pub(crate) struct Page {
    socket: WebSocket<TcpStream>,
    /// What came while something else was waited for.
    texts: VecDeque<Value>,
    last_id: u32,
}

impl Bridge {
    pub(crate) fn start(sandbox: &Sandbox) -> Self {
        Self::start_with(sandbox, &[])
    }

    /// With more arguments.
    pub(crate) fn start_with(sandbox: &Sandbox, more: &[&str]) -> Self {
        let args: Vec<_> = ["--listen", "127.0.0.1:0"].iter().chain(more).copied().collect();
        let mut process = Process::start(Program::ViewerBridge, sandbox, &args);
        let line = process.wait_for_line("ready http://");
        let host = line.trim_start_matches("ready http://").trim_end_matches('/').to_owned();
        Self { process, host }
    }

    /// Opens a page, with positions as the node has them.
    pub(crate) fn page(&self) -> Page {
        let stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(DEADLINE)).unwrap();
        let url = format!("ws://{}/socket", self.host);
        let (socket, _) = tungstenite::client(url, stream).unwrap();
        let mut page = Page { socket, texts: VecDeque::new(), last_id: 0 };
        page.say(&json!({ "type": "hello", "protocol": 1, "format": "f32" }));
        assert_eq!(page.text(|text| text["type"] == "hello")["protocol"], 1);
        page
    }
}

impl Page {
    fn say(&mut self, message: &Value) {
        self.socket.send(Message::text(message.to_string())).unwrap();
    }

    /// The next binary message of which something is to be had; texts are kept, frames acknowledged.
    pub(crate) fn find<T>(
        &mut self,
        what: &str,
        mut take: impl FnMut(wire::Message) -> Option<T>,
    ) -> T {
        let deadline = Deadline::start();
        loop {
            deadline.check(what);
            match self.socket.read().unwrap() {
                Message::Binary(bytes) => {
                    let message = decode(&bytes).unwrap();
                    if let wire::Message::Frame(frame) = &message {
                        self.say(&json!({ "type": "ack", "frame": frame.head.number }));
                    }
                    if let Some(found) = take(message) {
                        return found;
                    }
                }
                Message::Text(text) => self.texts.push_back(serde_json::from_str(&text).unwrap()),
                _ => {}
            }
        }
    }

    /// The next text like that, out of those that came or will come; those before it are dropped.
    pub(crate) fn text(&mut self, is_meant: impl Fn(&Value) -> bool) -> Value {
        let deadline = Deadline::start();
        loop {
            deadline.check("a text");
            while let Some(text) = self.texts.pop_front() {
                if is_meant(&text) {
                    return text;
                }
            }
            match self.socket.read().unwrap() {
                Message::Text(text) => self.texts.push_back(serde_json::from_str(&text).unwrap()),
                Message::Binary(bytes) => {
                    if let Ok(wire::Message::Frame(frame)) = decode(&bytes) {
                        self.say(&json!({ "type": "ack", "frame": frame.head.number }));
                    }
                }
                _ => {}
            }
        }
    }

    /// The next text of that type in which a field has that value.
    pub(crate) fn told(&mut self, kind: &str, field: &str, value: &Value) -> Value {
        self.text(|text| text["type"] == kind && text[field] == *value)
    }

    pub(crate) fn scene(&mut self) -> Scene {
        self.find("a scene", |message| match message {
            wire::Message::Scene(scene) => Some(scene),
            _ => None,
        })
    }

    pub(crate) fn pins(&mut self) -> Pins {
        self.find("pins", |message| match message {
            wire::Message::Pins(pins) => Some(pins),
            _ => None,
        })
    }

    pub(crate) fn tear(&mut self) -> Tear {
        self.find("a tear", |message| match message {
            wire::Message::Tear(tear) => Some(tear),
            _ => None,
        })
    }

    /// The next statistics like that.
    pub(crate) fn statistics(&mut self, is_meant: impl Fn(&Statistics) -> bool) -> Statistics {
        self.find("statistics", |message| match message {
            wire::Message::Statistics(statistics) => Some(*statistics).filter(&is_meant),
            _ => None,
        })
    }

    /// The next frame like that.
    pub(crate) fn frame(&mut self, is_meant: impl Fn(&Frame) -> bool) -> Frame {
        self.find("a frame", |message| match message {
            wire::Message::Frame(frame) => Some(frame).filter(&is_meant),
            _ => None,
        })
    }

    /// Sends a command without waiting for what becomes of it.
    pub(crate) fn send(&mut self, message: &Value) {
        self.say(message);
    }

    /// Sends a command and returns its outcome.
    pub(crate) fn command(&mut self, mut message: Value) -> Value {
        self.last_id += 1;
        let id = json!(self.last_id);
        message["id"] = id.clone();
        self.say(&message);
        self.told("outcome", "id", &id)
    }

    /// Sends a command that has to be applied; the step that shows it.
    pub(crate) fn applied(&mut self, message: Value) -> u64 {
        let outcome = self.command(message);
        assert_eq!(outcome["status"], "applied", "{outcome}");
        outcome["step"].as_u64().unwrap()
    }

    /// Sends a command that has to be rejected; why.
    pub(crate) fn rejected(&mut self, message: Value) -> String {
        let outcome = self.command(message);
        assert_eq!(outcome["status"], "rejected", "{outcome}");
        assert!(outcome["text"].as_str().is_some_and(|text| !text.is_empty()), "{outcome}");
        outcome["reason"].as_str().unwrap().to_owned()
    }
}
