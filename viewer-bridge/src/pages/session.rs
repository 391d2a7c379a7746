//! The task of one page.

use std::time::Duration;

use axum::Error;
use axum::extract::ws::{CloseFrame, Message, WebSocket};
use bytes::Bytes;
use sim_contract::clock::monotonic_ns;
use tokio::sync::OwnedSemaphorePermit;
use tokio::time::{MissedTickBehavior, interval, timeout};

use crate::limits::{HELLO_TIMEOUT, PING_PERIOD, PROTOCOL, SILENCE_MAX};
use crate::message::check::check;
use crate::message::reason;
use crate::message::{Command, FromPage, Hello, OutcomeText, ToPage};
use crate::pages::hub::{Connection, Hub, Shown, Taken};
use crate::pages::server::Site;
use crate::socket::rate_limit::RateLimit;
use crate::source::Ask;

/// How a conversation ends: a code of PROTOCOL.md, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
struct End {
    code: u16,
    reason: String,
}

/// How long a page has to take its leave.
const FAREWELL_TIMEOUT: Duration = Duration::from_secs(1);
/// Longest reason in a close frame, in bytes.
const REASON_SIZE_BYTES_MAX: usize = 123;

const SERVER_ENDS: u16 = 1001;
const TOO_BIG: u16 = 1009;
const FULL: u16 = 1013;
const MALFORMED: u16 = 4400;
const NO_TOKEN: u16 = 4401;
const TOO_SLOW: u16 = 4408;
const OTHER_PROTOCOL: u16 = 4426;
const FLOOD: u16 = 4429;

fn end(code: u16, reason: impl Into<String>) -> End {
    End { code, reason: reason.into() }
}

/// Serves a page until it goes, or breaks the rules. Until it has said who it is, it only waits.
pub(crate) async fn serve(mut socket: WebSocket, site: &Site, waiting: OwnedSemaphorePermit) {
    let ended = match timeout(HELLO_TIMEOUT, greet(&mut socket, site)).await {
        Ok(Ok(hello)) => match site.places.try_acquire() {
            Ok(_place) => {
                drop(waiting);
                return take_in(socket, &site.hub, &hello).await;
            }
            Err(_) => Some(end(FULL, "too many pages are open already; close one")),
        },
        Ok(Err(ended)) => ended,
        Err(_) => Some(end(TOO_SLOW, "no hello came")),
    };
    close(&mut socket, ended).await;
}

async fn take_in(mut socket: WebSocket, hub: &Hub, hello: &Hello) {
    let connection = hub.join(hello.format);
    let client = connection.client;
    let ended = converse(&mut socket, hub, connection).await;
    hub.leave(client);
    close(&mut socket, ended).await;
}

/// Waits for the first message, and checks it. `None` as an error: the page has gone.
async fn greet(socket: &mut WebSocket, site: &Site) -> Result<Hello, Option<End>> {
    let text = loop {
        match socket.recv().await {
            Some(Ok(Message::Text(text))) => break text,
            Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
            Some(Ok(Message::Binary(_))) => {
                return Err(Some(end(MALFORMED, "binary messages are not taken")));
            }
            Some(Err(error)) => return Err(broken(&error)),
            Some(Ok(Message::Close(_))) | None => return Err(None),
        }
    };
    let hello = match FromPage::parse(&text) {
        Ok(FromPage::Hello(hello)) => hello,
        Ok(_) => return Err(Some(end(MALFORMED, "the first message has to be hello"))),
        Err(error) => return Err(Some(end(MALFORMED, error.to_string()))),
    };
    if !site.guard.accepts(hello.token.as_deref()) {
        return Err(Some(end(NO_TOKEN, "the token is missing or wrong; open the printed address")));
    }
    if hello.protocol != PROTOCOL {
        return Err(Some(end(OTHER_PROTOCOL, format!("this server speaks protocol {PROTOCOL}"))));
    }
    Ok(hello)
}

/// Talks with a page that was taken in. Gives what to tell it at the end; nothing if it has gone.
async fn converse(socket: &mut WebSocket, hub: &Hub, mut connection: Connection) -> Option<End> {
    let mut shown = Shown::default();
    let mut limit = RateLimit::new(monotonic_ns());
    let mut heard_ns = monotonic_ns();
    let mut ping = interval(PING_PERIOD);
    ping.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        let has_credit = connection.credit.is_left();
        let sent = tokio::select! {
            biased;
            message = connection.queue.recv() => match message {
                Some(message) => send(socket, message).await,
                None => return Some(given_up(hub)),
            },
            incoming = socket.recv() => {
                heard_ns = monotonic_ns();
                match incoming {
                    None | Some(Ok(Message::Close(_))) => return None,
                    Some(Err(error)) => return broken(&error),
                    Some(Ok(_)) if !limit.allows(heard_ns) => {
                        return Some(end(FLOOD, "too many messages a second"));
                    }
                    Some(Ok(message)) => take(message, hub, &connection, &mut shown),
                }
            }
            changed = connection.frames.changed(), if has_credit => match changed {
                Ok(()) => send_frame(socket, hub, &mut connection, &mut shown).await,
                Err(_) => return Some(given_up(hub)),
            },
            _ = ping.tick() => {
                let silence_ns = monotonic_ns().saturating_sub(heard_ns);
                if Duration::from_nanos(silence_ns) > SILENCE_MAX {
                    return Some(end(TOO_SLOW, "nothing was heard of this page"));
                }
                send(socket, Message::Ping(Bytes::new())).await
            }
        };
        if let Err(ended) = sent {
            return ended;
        }
    }
}

/// Sends the newest frame, after everything reliable that it builds on.
async fn send_frame(
    socket: &mut WebSocket,
    hub: &Hub,
    connection: &mut Connection,
    shown: &mut Shown,
) -> Result<(), Option<End>> {
    let frame = match connection.take_frame(shown) {
        Taken::Frame(frame) => frame,
        Taken::Nothing => return Ok(()),
        Taken::Missed => {
            hub.request(connection.client, Ask::Frame);
            return Ok(());
        }
    };
    while let Ok(message) = connection.queue.try_recv() {
        send(socket, message).await?;
    }
    for bytes in frame {
        send(socket, Message::Binary(bytes)).await?;
    }
    Ok(())
}

/// Sends one message; a page that takes none for so long is given up.
async fn send(socket: &mut WebSocket, message: Message) -> Result<(), Option<End>> {
    match timeout(SILENCE_MAX, socket.send(message)).await {
        Ok(Ok(())) => Ok(()),
        Ok(Err(_)) | Err(_) => Err(None),
    }
}

/// Takes a message of the page.
fn take(
    message: Message,
    hub: &Hub,
    connection: &Connection,
    shown: &mut Shown,
) -> Result<(), Option<End>> {
    let text = match message {
        Message::Text(text) => text,
        Message::Ping(_) | Message::Pong(_) | Message::Close(_) => return Ok(()),
        Message::Binary(_) => return Err(Some(end(MALFORMED, "binary messages are not taken"))),
    };
    match FromPage::parse(&text) {
        Ok(FromPage::Ack { frame }) => {
            if connection.acknowledge(frame, shown) {
                hub.request(connection.client, Ask::Credit);
            }
        }
        Ok(FromPage::Command { id, command }) => hand_over(hub, connection.client, id, command),
        Ok(FromPage::Hello(_)) => return Err(Some(end(MALFORMED, "a second hello"))),
        Err(error) => return Err(Some(end(MALFORMED, error.to_string()))),
    }
    Ok(())
}

/// Checks a command and hands it to the source, or answers it with a refusal.
fn hand_over(hub: &Hub, client: u32, id: Option<u32>, command: Command) {
    let kind = command.name();
    let refused = check(&command).err().or_else(|| {
        let is_taken = hub.request(client, Ask::Command { id, command });
        (!is_taken).then_some(reason::BUSY)
    });
    if let Some(reason) = refused {
        let outcome = OutcomeText::refused(id, kind, reason);
        hub.send(client, &ToPage::Outcome(outcome));
    }
}

/// Why the hub let go of the page.
fn given_up(hub: &Hub) -> End {
    if hub.is_closed() {
        end(SERVER_ENDS, "the server ends")
    } else {
        end(TOO_SLOW, "too many messages were left unread")
    }
}

/// What a failed read means: a message too long is answered, a broken connection cannot be.
fn broken(error: &Error) -> Option<End> {
    // axum hides the kind of error; its text is that of the library below.
    let is_too_long = error.to_string().contains("too long");
    is_too_long.then(|| end(TOO_BIG, "a message is longer than 64 KiB"))
}

/// Says why, and gives the page a moment to read it.
async fn close(socket: &mut WebSocket, ended: Option<End>) {
    let Some(ended) = ended else { return };
    let cut = ended.reason.floor_char_boundary(REASON_SIZE_BYTES_MAX);
    let reason = ended.reason[..cut].into();
    let frame = Message::Close(Some(CloseFrame { code: ended.code, reason }));
    let farewell = async {
        if socket.send(frame).await.is_ok() {
            // What it had sent meanwhile is read and dropped: a reset would take the reason with it.
            while socket.recv().await.is_some_and(|message| message.is_ok()) {}
        }
    };
    let _late = timeout(FAREWELL_TIMEOUT, farewell).await;
}
