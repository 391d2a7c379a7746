//! The WebSocket of one client, with the limits on size, rate and silence.

use std::collections::VecDeque;
use std::time::Duration;

use axum::Error;
use axum::extract::ws::{CloseFrame, Message, WebSocket, WebSocketUpgrade};
use bytes::Bytes;
use sim_host::clock::monotonic_ns;
use tokio::task::spawn_blocking;
use tokio::time::{Interval, MissedTickBehavior, interval, timeout};
use tokio_tungstenite::tungstenite;

use super::rate_limit::{Rate, RateLimit};
use crate::limits::{
    ARRIVED_MAX, MESSAGE_SIZE_BYTES_MAX, MESSAGES_BURST_MAX, MESSAGES_PER_SECOND_MAX,
    PART_SIZE_BYTES, PARTS_UNANSWERED_MAX, PING_PERIOD, SILENCE_MAX,
};
use crate::wire::Part;

/// The server ends.
pub(crate) const GOING_AWAY: u16 = 1001;
/// All clients are connected, or the connection made room for another one.
pub(crate) const FULL: u16 = 1013;
/// A message is too long.
const MESSAGE_TOO_LONG: u16 = 1009;
/// The client was silent, or too slow.
pub(crate) const TOO_SLOW: u16 = 4408;
/// The client sent too many messages.
const TOO_MANY_MESSAGES: u16 = 4429;

const MESSAGES: Rate = Rate { per_second: MESSAGES_PER_SECOND_MAX, burst: MESSAGES_BURST_MAX };
/// Time for a client to read the close frame.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(1);
/// Size of the buffer that each socket reads into. Messages of clients have a few hundred bytes.
const READ_BUFFER_SIZE_BYTES: usize = 8 << 10;
/// Longest reason in a close frame, in bytes.
const REASON_SIZE_BYTES_MAX: usize = 123;

/// The end of a conversation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum End {
    /// The client has left, or its connection is broken.
    Gone,
    /// The server closes the connection.
    Closed {
        /// Close code, as in `PROTOCOL.md`.
        code: u16,
        /// Reason for the user.
        reason: String,
    },
}

impl End {
    pub(crate) fn closed(code: u16, reason: impl Into<String>) -> Self {
        Self::Closed { code, reason: reason.into() }
    }

    /// The end of a connection that made room for another one.
    pub(crate) fn evicted() -> Self {
        Self::closed(FULL, "too many connections wait; try again")
    }

    /// The end after a failed read. A message that is too long can be answered; a broken connection
    /// cannot.
    fn from_error(error: Error) -> Self {
        match error.into_inner().downcast_ref() {
            Some(tungstenite::Error::Capacity(_)) => {
                let limit_kib = MESSAGE_SIZE_BYTES_MAX >> 10;
                Self::closed(MESSAGE_TOO_LONG, format!("a message is longer than {limit_kib} KiB"))
            }
            _ => Self::Gone,
        }
    }
}

/// The WebSocket of one client.
#[derive(Debug)]
pub(crate) struct Peer {
    socket: WebSocket,
    rate: RateLimit,
    last_message_ns: u64,
    ping: Interval,
    /// The client puts long messages together from their pieces.
    takes_parts: bool,
    /// Messages that have arrived while pieces were sent, at most [`ARRIVED_MAX`].
    arrived: VecDeque<Message>,
    /// Pieces sent. The ping behind a piece carries its number.
    sent_parts: u64,
    /// The newest piece whose ping the client has answered. A client may answer only the newest of several pings.
    answered_parts: u64,
}

/// The end of a client that does not even answer a ping.
fn silent() -> End {
    End::closed(TOO_SLOW, "the client does not answer")
}

/// The end of a client that sends more than it may.
fn too_many() -> End {
    End::closed(TOO_MANY_MESSAGES, "too many messages a second")
}

/// Sets the limits of a WebSocket before the upgrade.
pub(crate) fn limit(upgrade: WebSocketUpgrade) -> WebSocketUpgrade {
    upgrade
        .max_message_size(MESSAGE_SIZE_BYTES_MAX)
        .max_frame_size(MESSAGE_SIZE_BYTES_MAX)
        .read_buffer_size(READ_BUFFER_SIZE_BYTES)
        .write_buffer_size(0)
}

impl Peer {
    pub(crate) fn new(socket: WebSocket) -> Self {
        let now_ns = monotonic_ns();
        let mut ping = interval(PING_PERIOD);
        ping.set_missed_tick_behavior(MissedTickBehavior::Delay);
        Self {
            socket,
            rate: RateLimit::new(MESSAGES, now_ns),
            last_message_ns: now_ns,
            ping,
            takes_parts: false,
            arrived: VecDeque::new(),
            sent_parts: 0,
            answered_parts: 0,
        }
    }

    /// Sends long messages in pieces from now on.
    pub(crate) fn send_in_parts(&mut self) {
        self.takes_parts = true;
    }

    /// Returns the next text or binary message, and pings the client while it waits. Dropping the
    /// future loses no message.
    pub(crate) async fn receive(&mut self) -> Result<Message, End> {
        if let Some(message) = self.arrived.pop_front() {
            return Ok(message);
        }
        loop {
            tokio::select! {
                biased;
                incoming = self.socket.recv() => match self.checked(incoming)? {
                    Message::Ping(_) | Message::Pong(_) => self.count()?,
                    message => {
                        self.count()?;
                        return Ok(message);
                    }
                },
                _ = self.ping.tick() => {
                    let silence_ns = monotonic_ns().saturating_sub(self.last_message_ns);
                    if Duration::from_nanos(silence_ns) > SILENCE_MAX {
                        return Err(silent());
                    }
                    self.send_whole(Message::Ping(Bytes::new())).await?;
                }
            }
        }
    }

    /// Notes that a message has arrived, and which piece it answers. Returns the message, or the end of the connection.
    fn checked(&mut self, incoming: Option<Result<Message, Error>>) -> Result<Message, End> {
        self.last_message_ns = monotonic_ns();
        if let Some(Ok(Message::Pong(payload))) = &incoming
            && let Ok(number) = payload.as_ref().try_into().map(u64::from_le_bytes)
            && number <= self.sent_parts
        {
            self.answered_parts = self.answered_parts.max(number);
        }
        match incoming {
            None | Some(Ok(Message::Close(_))) => Err(End::Gone),
            Some(Err(error)) => Err(End::from_error(error)),
            Some(Ok(message)) => Ok(message),
        }
    }

    /// Counts a message that has arrived against the limit.
    fn count(&mut self) -> Result<(), End> {
        if self.rate.count(1, self.last_message_ns).is_zero() {
            return Ok(());
        }
        Err(too_many())
    }

    /// Sends a message, a long one in pieces if the client takes them.
    pub(crate) async fn send(&mut self, message: Message) -> Result<(), End> {
        match message {
            Message::Binary(bytes) if self.takes_parts && bytes.len() > PART_SIZE_BYTES => {
                self.send_parts(bytes).await
            }
            message => self.send_whole(message).await,
        }
    }

    /// Sends a message in pieces. The client's network answers the ping behind each piece once that has arrived:
    /// however slow the line is, it is alive, and its buffers stay short.
    async fn send_parts(&mut self, message: Bytes) -> Result<(), End> {
        let divided = spawn_blocking(move || Part::divide(&message)).await;
        for part in divided.map_err(|_| End::Gone)? {
            self.send_whole(Message::Binary(part.encode())).await?;
            self.sent_parts += 1;
            let number = Bytes::copy_from_slice(&self.sent_parts.to_le_bytes());
            self.send_whole(Message::Ping(number)).await?;
            while self.sent_parts - self.answered_parts > u64::from(PARTS_UNANSWERED_MAX) {
                self.await_answer().await?;
            }
        }
        Ok(())
    }

    /// Waits for a message, which may answer a ping. Text and binary messages are kept for `receive`.
    async fn await_answer(&mut self) -> Result<(), End> {
        let incoming = timeout(SILENCE_MAX, self.socket.recv()).await.map_err(|_| silent())?;
        match self.checked(incoming)? {
            Message::Pong(_) => return Ok(()),
            Message::Ping(_) => {}
            _ if self.arrived.len() == ARRIVED_MAX => return Err(too_many()),
            message => self.arrived.push_back(message),
        }
        self.count()
    }

    /// Sends a message. A client that does not accept it within [`SILENCE_MAX`] is given up.
    async fn send_whole(&mut self, message: Message) -> Result<(), End> {
        match timeout(SILENCE_MAX, self.socket.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) | Err(_) => Err(End::Gone),
        }
    }

    /// Sends the reason of the end and gives the client a moment to read it.
    pub(crate) async fn close(mut self, end: End) {
        let End::Closed { code, reason } = end else { return };
        let reason = reason[..reason.floor_char_boundary(REASON_SIZE_BYTES_MAX)].into();
        let farewell = async {
            let frame = Message::Close(Some(CloseFrame { code, reason }));
            if self.socket.send(frame).await.is_ok() {
                // Unread messages would make the system reset the connection, and the client would
                // never see the reason.
                while self.socket.recv().await.is_some_and(|message| message.is_ok()) {}
            }
        };
        let _timed_out = timeout(CLOSE_TIMEOUT, farewell).await;
    }
}
