//! A client in Rust that speaks the protocol of the page.

use std::collections::VecDeque;
use std::net::TcpStream;

use integration_tests::{DEADLINE, Deadline, Process, Program, Sandbox};
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};
use viewer_bridge::wire::{Pins, Scene, Statistics, Tear};

use crate::wire_decoder::{Frame, Message as Binary, decode};

/// A bridge and its address.
pub(crate) struct Bridge {
    pub(crate) process: Process,
    /// Address and port.
    pub(crate) host: String,
}

/// A connection to a bridge.
pub(crate) struct Page {
    socket: WebSocket<TcpStream>,
    /// The first message of the server.
    pub(crate) hello: Value,
    /// Texts received while waiting for another message.
    texts: VecDeque<Value>,
    last_id: u32,
}

impl Bridge {
    pub(crate) fn start(sandbox: &Sandbox) -> Self {
        Self::start_with(sandbox, &[])
    }

    /// Starts a bridge with additional arguments.
    pub(crate) fn start_with(sandbox: &Sandbox, more: &[&str]) -> Self {
        let args: Vec<_> = ["--listen", "127.0.0.1:0"].iter().chain(more).copied().collect();
        Self::ready(Process::start(Program::ViewerBridge, sandbox, &args))
    }

    /// Waits until a bridge serves pages.
    pub(crate) fn ready(mut process: Process) -> Self {
        let line = process.wait_for_line("ready http://");
        let host = line.trim_start_matches("ready http://").trim_end_matches('/').to_owned();
        Self { process, host }
    }

    /// Opens a page that receives unquantised positions.
    pub(crate) fn page(&self) -> Page {
        self.page_at("/socket")
    }

    /// Opens the page of a socket.
    pub(crate) fn page_at(&self, path: &str) -> Page {
        let mut page = self.greet(path, &json!({}));
        page.hello = page.text(|text| text["type"] == "hello");
        assert_eq!(page.hello["protocol"], 3);
        page
    }

    /// Opens the page of a socket with further fields of `hello`.
    pub(crate) fn page_with(&self, path: &str, fields: &Value) -> Page {
        let mut page = self.greet(path, fields);
        page.hello = page.text(|text| text["type"] == "hello");
        page
    }

    /// Sends `hello`, with further fields, to a server that refuses it. Returns the close code and the
    /// reason.
    pub(crate) fn refusal_at(&self, path: &str, fields: &Value) -> (u16, String) {
        let mut page = self.greet(path, fields);
        loop {
            if let Message::Close(Some(frame)) = page.socket.read().unwrap() {
                return (frame.code.into(), frame.reason.to_string());
            }
        }
    }

    fn greet(&self, path: &str, fields: &Value) -> Page {
        let host = self.host.split('/').next().unwrap();
        let stream = TcpStream::connect(host).unwrap();
        stream.set_read_timeout(Some(DEADLINE)).unwrap();
        let (socket, _) = tungstenite::client(format!("ws://{host}{path}"), stream).unwrap();
        let mut page = Page { socket, hello: Value::Null, texts: VecDeque::new(), last_id: 0 };
        let mut hello = json!({ "type": "hello", "protocol": 3, "format": "f32" });
        hello.as_object_mut().unwrap().extend(fields.as_object().unwrap().clone());
        page.send(&hello);
        page
    }
}

impl Page {
    /// Resets the connection: the system does so if bytes of a closed connection are unread.
    pub(crate) fn reset(self) {
        assert_eq!(self.socket.get_ref().peek(&mut [0]).unwrap(), 1);
    }

    /// Sends a message without waiting for an outcome.
    pub(crate) fn send(&mut self, message: &Value) {
        self.socket.send(Message::text(message.to_string())).unwrap();
    }

    /// Waits for the next binary message that `accept` maps to a value. Keeps texts, and acknowledges frames.
    pub(crate) fn receive<T>(
        &mut self,
        what: &str,
        mut accept: impl FnMut(Binary) -> Option<T>,
    ) -> T {
        let deadline = Deadline::start();
        loop {
            deadline.check(what);
            match self.socket.read().unwrap() {
                Message::Binary(bytes) => {
                    let message = decode(&bytes).unwrap();
                    if let Binary::Frame(frame) = &message {
                        self.send(&json!({ "type": "ack", "frame": frame.head.number }));
                    }
                    if let Some(value) = accept(message) {
                        return value;
                    }
                }
                Message::Text(text) => self.texts.push_back(serde_json::from_str(&text).unwrap()),
                _ => {}
            }
        }
    }

    /// Waits for the next text that matches, and drops the texts before it.
    pub(crate) fn text(&mut self, matches: impl Fn(&Value) -> bool) -> Value {
        let deadline = Deadline::start();
        loop {
            deadline.check("a text");
            while let Some(text) = self.texts.pop_front() {
                if matches(&text) {
                    return text;
                }
            }
            match self.socket.read().unwrap() {
                Message::Text(text) => self.texts.push_back(serde_json::from_str(&text).unwrap()),
                Message::Binary(bytes) => {
                    if let Ok(Binary::Frame(frame)) = decode(&bytes) {
                        self.send(&json!({ "type": "ack", "frame": frame.head.number }));
                    }
                }
                _ => {}
            }
        }
    }

    /// Waits for the next text of a type in which a field has a value.
    pub(crate) fn text_with(&mut self, kind: &str, field: &str, value: &Value) -> Value {
        self.text(|text| text["type"] == kind && text[field] == *value)
    }

    pub(crate) fn scene(&mut self) -> Scene {
        self.receive("a scene", |message| match message {
            Binary::Scene(scene) => Some(*scene),
            _ => None,
        })
    }

    pub(crate) fn pins(&mut self) -> Pins {
        self.receive("pins", |message| match message {
            Binary::Pins(pins) => Some(pins),
            _ => None,
        })
    }

    pub(crate) fn tear(&mut self) -> Tear {
        self.receive("a tear", |message| match message {
            Binary::Tear(tear) => Some(tear),
            _ => None,
        })
    }

    /// Waits for the next statistics that match.
    pub(crate) fn statistics(&mut self, matches: impl Fn(&Statistics) -> bool) -> Statistics {
        self.receive("statistics", |message| match message {
            Binary::Statistics(statistics) => Some(*statistics).filter(&matches),
            _ => None,
        })
    }

    /// Waits for the next frame that matches.
    pub(crate) fn frame(&mut self, matches: impl Fn(&Frame) -> bool) -> Frame {
        self.receive("a frame", |message| match message {
            Binary::Frame(frame) => Some(frame).filter(&matches),
            _ => None,
        })
    }

    /// Sends a command and returns its outcome. Drops the frames before the outcome.
    pub(crate) fn command(&mut self, message: Value) -> Value {
        let id = self.send_with_id(message);
        self.text_with("outcome", "id", &id)
    }

    /// Sends a command that must be applied, and returns a frame that matches. The frame can come before
    /// the outcome, and may be the last one.
    pub(crate) fn frame_after(
        &mut self,
        message: Value,
        matches: impl Fn(&Frame) -> bool,
    ) -> Frame {
        let id = self.send_with_id(message);
        let frame = self.frame(matches);
        let outcome = self.text_with("outcome", "id", &id);
        assert_eq!(outcome["status"], "applied", "{outcome}");
        frame
    }

    fn send_with_id(&mut self, mut message: Value) -> Value {
        self.last_id += 1;
        message["id"] = json!(self.last_id);
        self.send(&message);
        message["id"].take()
    }

    /// Sends a command that must be applied, and returns the step that shows it.
    pub(crate) fn applied(&mut self, message: Value) -> u64 {
        let outcome = self.command(message);
        assert_eq!(outcome["status"], "applied", "{outcome}");
        outcome["step"].as_u64().unwrap()
    }

    /// Sends a command that must be rejected, and returns the reason.
    pub(crate) fn rejected(&mut self, message: Value) -> String {
        let outcome = self.command(message);
        assert_eq!(outcome["status"], "rejected", "{outcome}");
        assert!(outcome["text"].as_str().is_some_and(|text| !text.is_empty()), "{outcome}");
        outcome["reason"].as_str().unwrap().to_owned()
    }
}
