//! A client of the Foxglove protocol on a plain WebSocket. It is written from the protocol
//! specification and does not use the library of the server.

use std::collections::VecDeque;
use std::net::TcpStream;
use std::time::Duration;

use serde_json::{Value, json};
use sim_host::clock::monotonic_ns;
use tungstenite::client::IntoClientRequest;
use tungstenite::http::{HeaderValue, header};
use tungstenite::{Message, WebSocket};

/// Limit on the wait for a message.
const DEADLINE: Duration = Duration::from_mins(1);

/// A binary message from the server.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Binary {
    /// A message on a topic.
    Message { subscription: u32, log_time_ns: u64, payload: Vec<u8> },
    /// The response of a service.
    Response { call: u32, payload: Value },
    /// The state of playback: 0 playing, 1 paused, 3 ended.
    Playback { status: u8, time_ns: u64, speed: f32, did_seek: bool, request: String },
}

/// A wait for one message. Pings and other messages do not extend it.
#[derive(Debug, Clone, Copy)]
struct Wait {
    start_ns: u64,
}

impl Wait {
    fn start() -> Self {
        Self { start_ns: monotonic_ns() }
    }

    fn check(self, what: &str) {
        let waited = Duration::from_nanos(monotonic_ns() - self.start_ns);
        assert!(waited < DEADLINE, "{what} did not come within {DEADLINE:?}");
    }
}

/// A connected client.
pub(crate) struct Client {
    socket: WebSocket<TcpStream>,
    /// Messages received while waiting for others.
    texts: VecDeque<Value>,
    binaries: VecDeque<Binary>,
    channels: Vec<Value>,
}

/// Connects as a page of `origin`, or as a program without an origin. Returns the HTTP status if the
/// server refuses, or 0 if it closes the connection.
pub(crate) fn connect(url: &str, origin: Option<&str>) -> Result<Client, u16> {
    let host = url.trim_start_matches("ws://");
    let stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(DEADLINE)).unwrap();
    let mut request = url.into_client_request().unwrap();
    let protocol = HeaderValue::from_static("foxglove.sdk.v1");
    request.headers_mut().insert(header::SEC_WEBSOCKET_PROTOCOL, protocol);
    if let Some(origin) = origin {
        request.headers_mut().insert(header::ORIGIN, HeaderValue::from_str(origin).unwrap());
    }
    match tungstenite::client(request, stream) {
        Ok((socket, answer)) => {
            assert_eq!(answer.headers()[header::SEC_WEBSOCKET_PROTOCOL], "foxglove.sdk.v1");
            let (texts, binaries) = (VecDeque::new(), VecDeque::new());
            Ok(Client { socket, texts, binaries, channels: Vec::new() })
        }
        Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(response))) => {
            Err(response.status().as_u16())
        }
        // The server closed the connection without an answer.
        Err(_) => Err(0),
    }
}

impl Client {
    /// Connects as a program, and returns the server info.
    pub(crate) fn start(url: &str) -> (Self, Value) {
        let mut client = connect(url, None).unwrap();
        let server = client.text("serverInfo");
        let channels = client.text("advertise")["channels"].take();
        client.channels = serde_json::from_value(channels).unwrap();
        (client, server)
    }

    /// Resets the connection: the system does so if bytes of a closed connection are unread.
    #[allow(dead_code, reason = "only the tests with a node reset connections")]
    pub(crate) fn reset(self) {
        assert_eq!(self.socket.get_ref().peek(&mut [0]).unwrap(), 1);
    }

    /// Returns the advertisement of a topic.
    pub(crate) fn channel(&self, topic: &str) -> &Value {
        self.channels.iter().find(|channel| channel["topic"] == topic).unwrap()
    }

    pub(crate) fn topics(&self) -> Vec<&str> {
        self.channels.iter().map(|channel| channel["topic"].as_str().unwrap()).collect()
    }

    pub(crate) fn send(&mut self, message: &Value) {
        self.socket.send(Message::text(message.to_string())).unwrap();
    }

    pub(crate) fn send_bytes(&mut self, bytes: Vec<u8>) {
        self.socket.send(Message::binary(bytes)).unwrap();
    }

    /// Subscribes to a topic with a subscription id.
    pub(crate) fn subscribe(&mut self, subscription: u32, topic: &str) {
        let channel = self.channel(topic)["id"].clone();
        let subscriptions = json!([{ "id": subscription, "channelId": channel }]);
        self.send(&json!({ "op": "subscribe", "subscriptions": subscriptions }));
    }

    pub(crate) fn unsubscribe(&mut self, subscription: u32) {
        self.send(&json!({ "op": "unsubscribe", "subscriptionIds": [subscription] }));
    }

    /// Advertises a topic with a channel id.
    pub(crate) fn advertise(&mut self, channel: u32, topic: &str) {
        let channels = json!([
            { "id": channel, "topic": topic, "encoding": "json", "schemaName": "catenary.Command" }
        ]);
        self.send(&json!({ "op": "advertise", "channels": channels }));
    }

    pub(crate) fn unadvertise(&mut self, channel: u32) {
        self.send(&json!({ "op": "unadvertise", "channelIds": [channel] }));
    }

    pub(crate) fn publish(&mut self, channel: u32, message: &Value) {
        let mut bytes = vec![1];
        bytes.extend(channel.to_le_bytes());
        bytes.extend(message.to_string().into_bytes());
        self.send_bytes(bytes);
    }

    /// Calls a service without waiting for the response.
    pub(crate) fn call(&mut self, service: u32, call: u32, request: &Value) {
        let mut bytes = vec![2];
        bytes.extend(service.to_le_bytes());
        bytes.extend(call.to_le_bytes());
        bytes.extend(4_u32.to_le_bytes());
        bytes.extend(b"json");
        bytes.extend(request.to_string().into_bytes());
        self.send_bytes(bytes);
    }

    /// Controls playback. `command` is 0 to play, 1 to pause.
    pub(crate) fn play(&mut self, command: u8, speed: f32, seek_ns: Option<u64>, request: &str) {
        let mut bytes = vec![3, command];
        bytes.extend(speed.to_le_bytes());
        bytes.push(u8::from(seek_ns.is_some()));
        bytes.extend(seek_ns.unwrap_or(0).to_le_bytes());
        bytes.extend(u32::try_from(request.len()).unwrap().to_le_bytes());
        bytes.extend(request.as_bytes());
        self.send_bytes(bytes);
    }

    /// Reads one message into the queues. Returns false at the end of the connection.
    fn read(&mut self) -> bool {
        match self.socket.read() {
            Ok(Message::Text(text)) => self.texts.push_back(serde_json::from_str(&text).unwrap()),
            Ok(Message::Binary(bytes)) => self.binaries.push_back(parse(&bytes)),
            Ok(Message::Close(_)) | Err(_) => return false,
            Ok(_) => {}
        }
        true
    }

    /// Sends a message `count` times, or until the server closes the connection.
    pub(crate) fn flood(&mut self, message: &Value, count: usize) {
        let text = message.to_string();
        // An error means that the server has closed the connection.
        let _closed = (0..count).try_for_each(|_| self.socket.send(Message::text(text.clone())));
    }

    /// Reads to the end of the connection.
    pub(crate) fn read_to_end(&mut self) {
        while self.read() {}
    }

    /// Waits for the next text with an operation, and drops the texts before it.
    pub(crate) fn text(&mut self, op: &str) -> Value {
        let wait = Wait::start();
        loop {
            while let Some(text) = self.texts.pop_front() {
                if text["op"] == op {
                    return text;
                }
            }
            wait.check(op);
            assert!(self.read(), "the connection ended before {op}");
        }
    }

    /// Waits for the next binary message that `accept` maps to a value, and drops the messages before it.
    pub(crate) fn binary<T>(&mut self, accept: impl Fn(Binary) -> Option<T>) -> T {
        let wait = Wait::start();
        loop {
            while let Some(binary) = self.binaries.pop_front() {
                if let Some(value) = accept(binary) {
                    return value;
                }
            }
            wait.check("a message");
            assert!(self.read(), "the connection ended before a message");
        }
    }

    /// Waits for the next message of a subscription, and returns its log time and payload.
    pub(crate) fn message(&mut self, id: u32) -> (u64, Vec<u8>) {
        self.binary(|binary| match binary {
            Binary::Message { subscription, log_time_ns, payload } if subscription == id => {
                Some((log_time_ns, payload))
            }
            _ => None,
        })
    }

    /// Waits for the next message of a subscription, and parses it as JSON.
    pub(crate) fn json(&mut self, id: u32) -> Value {
        serde_json::from_slice(&self.message(id).1).unwrap()
    }

    /// Waits for the response to a call.
    pub(crate) fn response(&mut self, id: u32) -> Value {
        self.binary(|binary| match binary {
            Binary::Response { call, payload } if call == id => Some(payload),
            _ => None,
        })
    }
}

/// Splits `N` bytes off the front of a slice.
fn split_front<const N: usize>(bytes: &mut &[u8]) -> [u8; N] {
    let (front, rest) = bytes.split_first_chunk().unwrap();
    *bytes = rest;
    *front
}

fn parse(bytes: &[u8]) -> Binary {
    let mut rest = bytes;
    let [opcode] = split_front(&mut rest);
    match opcode {
        1 => Binary::Message {
            subscription: u32::from_le_bytes(split_front(&mut rest)),
            log_time_ns: u64::from_le_bytes(split_front(&mut rest)),
            payload: rest.to_vec(),
        },
        3 => {
            let _service = u32::from_le_bytes(split_front(&mut rest));
            let call = u32::from_le_bytes(split_front(&mut rest));
            let encoding = u32::from_le_bytes(split_front(&mut rest)) as usize;
            assert_eq!(&rest[..encoding], b"json");
            Binary::Response { call, payload: serde_json::from_slice(&rest[encoding..]).unwrap() }
        }
        5 => {
            let [status] = split_front(&mut rest);
            let time_ns = u64::from_le_bytes(split_front(&mut rest));
            let speed = f32::from_le_bytes(split_front(&mut rest));
            let [did_seek] = split_front(&mut rest);
            let _size = u32::from_le_bytes(split_front(&mut rest));
            let request = String::from_utf8(rest.to_vec()).unwrap();
            Binary::Playback { status, time_ns, speed, did_seek: did_seek != 0, request }
        }
        other => panic!("a message with the opcode {other}"),
    }
}
