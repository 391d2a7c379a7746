//! The conversation with one page.

use std::sync::Arc;

use axum::extract::ws::{Message, WebSocket};
use bytes::Bytes;
use tokio::sync::{Semaphore, SemaphorePermit};
use tokio::time::timeout;

use super::connection::{Acknowledged, Connection, NextFrame, Subscription};
use super::history::PastMessages;
use super::hub::Hub;
use super::recordings::Recordings;
use super::replays::{HeldReplay, Replays};
use crate::limits::{HELLO_TIMEOUT, PROTOCOL};
use crate::message::{Command, CommandKind, FromPage, Hello, OutcomeText, Refusal, ToPage};
use crate::request::{ClientId, RequestKind};
use crate::shutdown::Shutdown;
use crate::socket::guard::Guard;
use crate::socket::peer::{End, FULL, GOING_AWAY, Peer, TOO_SLOW};
use crate::socket::pending_connections::PendingConnection;

/// A message is malformed.
const MALFORMED: u16 = 4400;
/// The token is missing or wrong.
const NO_TOKEN: u16 = 4401;
/// There is no such recording.
const NO_RECORDING: u16 = 4404;
/// The page speaks another version of the protocol.
const OTHER_PROTOCOL: u16 = 4426;

/// State that all conversations share.
#[derive(Debug)]
pub(super) struct Sessions {
    pub(super) hub: Arc<Hub>,
    /// Those that pages can start, if the source is live.
    pub(super) recordings: Option<Arc<Recordings>>,
    /// Those that pages have opened.
    pub(super) replays: Replays,
    pub(super) guard: Arc<Guard>,
    pub(super) shutdown: Shutdown,
    /// A permit for each page.
    pub(super) pages: Arc<Semaphore>,
}

/// The source that a page shows.
struct PageContext {
    hub: Arc<Hub>,
    /// Those that its pages can start.
    recordings: Option<Arc<Recordings>>,
    shutdown: Shutdown,
    /// Keeps the recording open.
    _replay: Option<HeldReplay>,
}

impl Sessions {
    /// Returns the source of the bridge, or opens a recording.
    async fn context(&self, recording: Option<&str>) -> Result<PageContext, End> {
        let Some(name) = recording else {
            let (hub, recordings) = (Arc::clone(&self.hub), self.recordings.clone());
            let shutdown = self.shutdown.clone();
            return Ok(PageContext { hub, recordings, shutdown, _replay: None });
        };
        let opened = self.replays.open(name).await;
        let replay = opened.map_err(|reason| End::closed(NO_RECORDING, reason))?;
        let (hub, shutdown) = (Arc::clone(&replay.hub), replay.shutdown.clone());
        Ok(PageContext { hub, recordings: None, shutdown, _replay: Some(replay) })
    }
}

/// Serves a page until it leaves or breaks the rules. A page counts against the limit once it has sent
/// a valid token; until then it only holds its place among the pending connections. Only then is its recording opened, if
/// it is the page of one.
pub(super) async fn serve(
    socket: WebSocket,
    sessions: &Sessions,
    place: Arc<PendingConnection>,
    recording: Option<&str>,
) {
    let mut peer = Peer::new(socket);
    let end = match place.while_held(greet(&mut peer, sessions)).await {
        Some(Ok(Greeting { hello, _permit })) => {
            drop(place);
            return match sessions.context(recording).await {
                Ok(context) => serve_page(peer, sessions, &context, &hello).await,
                Err(end) => peer.close(end).await,
            };
        }
        Some(Err(end)) => end,
        None => End::evicted(),
    };
    place.while_held(peer.close(end)).await;
}

/// A valid first message of a page, and its permit.
struct Greeting<'a> {
    hello: Hello,
    _permit: SemaphorePermit<'a>,
}

/// Waits for `hello`. A page beyond the limit gets a close code, because browsers hide the status of a
/// refused upgrade from the page.
async fn greet<'a>(peer: &mut Peer, sessions: &'a Sessions) -> Result<Greeting<'a>, End> {
    let hello = timeout(HELLO_TIMEOUT, receive_hello(peer, &sessions.guard)).await;
    let hello = hello.unwrap_or_else(|_| Err(End::closed(TOO_SLOW, "no hello arrived")))?;
    let full = |_| End::closed(FULL, "too many pages are already open; close one");
    let permit = sessions.pages.try_acquire().map_err(full)?;
    Ok(Greeting { hello, _permit: permit })
}

async fn serve_page(mut peer: Peer, sessions: &Sessions, context: &PageContext, hello: &Hello) {
    if hello.parts {
        peer.send_in_parts();
    }
    let connection = context.hub.join(hello.format);
    let membership = Membership { hub: &context.hub, client: connection.client };
    let end = tokio::select! {
        end = converse(&mut peer, context, connection) => end,
        () = sessions.shutdown.begun() => End::closed(GOING_AWAY, "the server shuts down"),
    };
    // The grabs of the page end at once, however slowly it closes.
    drop(membership);
    peer.close(end).await;
}

/// The membership of a page in the hub. It ends even if the task of the page panics, because no other
/// client can end the page's grabs.
struct Membership<'a> {
    hub: &'a Hub,
    client: ClientId,
}

impl Drop for Membership<'_> {
    fn drop(&mut self) {
        self.hub.leave(self.client);
    }
}

/// Waits for the first message of a page and checks it.
async fn receive_hello(peer: &mut Peer, guard: &Guard) -> Result<Hello, End> {
    let FromPage::Hello(hello) = parse(&peer.receive().await?)? else {
        return Err(End::closed(MALFORMED, "the first message must be hello"));
    };
    if !guard.accepts(hello.token.as_deref()) {
        let reason = "the token is missing or wrong; open the printed address";
        return Err(End::closed(NO_TOKEN, reason));
    }
    if hello.protocol != PROTOCOL {
        let reason = format!("this server speaks protocol {PROTOCOL}; reload the page");
        return Err(End::closed(OTHER_PROTOCOL, reason));
    }
    Ok(hello)
}

fn parse(message: &Message) -> Result<FromPage, End> {
    match message {
        Message::Text(text) => {
            FromPage::parse(text).map_err(|error| End::closed(MALFORMED, error.to_string()))
        }
        _ => Err(End::closed(MALFORMED, "binary messages are not accepted")),
    }
}

/// Talks with a page that has joined, until the end.
async fn converse(peer: &mut Peer, context: &PageContext, mut connection: Connection) -> End {
    let hub = &context.hub;
    loop {
        let has_credit = connection.credit.is_left();
        let result = tokio::select! {
            biased;
            message = connection.queue.recv() => match message {
                Some(message) => peer.send(message).await,
                None => Err(End::closed(TOO_SLOW, "too many messages were left unread")),
            },
            message = peer.receive() => match message {
                Ok(message) => accept(&message, peer, context, &mut connection).await,
                Err(end) => Err(end),
            },
            changed = connection.frames.changed(), if has_credit => match changed {
                Ok(()) => send_frame(peer, hub, &mut connection).await,
                Err(_) => Err(End::closed(GOING_AWAY, "the server shuts down")),
            },
            () = context.shutdown.begun() => Err(End::closed(GOING_AWAY, "the server shuts down")),
        };
        if let Err(end) = result {
            return end;
        }
    }
}

/// Sends the newest frame, after the reliable messages that it depends on.
async fn send_frame(peer: &mut Peer, hub: &Hub, connection: &mut Connection) -> Result<(), End> {
    let frame = match connection.next_frame() {
        NextFrame::Frame(frame) => frame,
        NextFrame::Nothing => return Ok(()),
        NextFrame::Missed => {
            hub.request(connection.client, RequestKind::State);
            return Ok(());
        }
    };
    send_queue(peer, connection).await?;
    send_all(peer, frame).await
}

/// Sends the reliable messages.
async fn send_queue(peer: &mut Peer, connection: &mut Connection) -> Result<(), End> {
    while let Ok(message) = connection.queue.try_recv() {
        peer.send(message).await?;
    }
    Ok(())
}

async fn send_all(peer: &mut Peer, messages: Vec<Bytes>) -> Result<(), End> {
    for bytes in messages {
        peer.send(Message::Binary(bytes)).await?;
    }
    Ok(())
}

/// Sends a past state, after the reliable messages that it depends on, and the answer. Nothing waits in
/// a queue: the page's next message is read when all of it is on its way.
async fn show_past(
    peer: &mut Peer,
    connection: &mut Connection,
    id: Option<u32>,
    sought: Result<PastMessages, Refusal>,
) -> Result<(), End> {
    let kind = "look";
    let answer = match sought {
        Err(reason) => OutcomeText::refused(id, kind, reason),
        Ok(past) => {
            send_queue(peer, connection).await?;
            let state_step = Some(past.step);
            send_all(peer, past.messages).await?;
            OutcomeText { state_step, ..OutcomeText::applied(id, kind) }
        }
    };
    peer.send(Message::Text(ToPage::Outcome(answer).to_json().into())).await
}

/// Handles a message of a page that has joined.
async fn accept(
    message: &Message,
    peer: &mut Peer,
    context: &PageContext,
    connection: &mut Connection,
) -> Result<(), End> {
    let hub = &*context.hub;
    match parse(message)? {
        FromPage::Ack { frame } => {
            if connection.acknowledge(frame) == Acknowledged::CreditRestored {
                hub.request(connection.client, RequestKind::Credit);
            }
        }
        FromPage::Forces { is_on } => subscribe(hub, connection, |wanted| wanted.forces = is_on),
        FromPage::Speeds { is_on } => subscribe(hub, connection, |wanted| wanted.speeds = is_on),
        FromPage::Inspect { particles } => {
            subscribe(hub, connection, |wanted| wanted.particles = particles);
        }
        FromPage::Command(command) => match command.kind {
            CommandKind::Look { step, toward } => {
                let sought = hub.look(connection, step, toward);
                return show_past(peer, connection, command.id, sought).await;
            }
            CommandKind::Record {} | CommandKind::StopRecording {} => {
                control_recording(context, connection.client, &command);
            }
            _ => submit(hub, connection.client, command),
        },
        FromPage::Hello(_) => return Err(End::closed(MALFORMED, "hello was sent twice")),
    }
    Ok(())
}

/// Changes what a page receives with each frame.
fn subscribe(hub: &Hub, connection: &Connection, change: impl FnOnce(&mut Subscription)) {
    connection.change_subscription(change);
    // The page has not received this part of the state on show.
    hub.request(connection.client, RequestKind::State);
}

/// Starts or stops a recording, and answers at once: the state of the recording follows as messages of
/// their own.
fn control_recording(context: &PageContext, client: ClientId, command: &Command) {
    let (id, kind) = (command.id, command.kind.name());
    let result = match &context.recordings {
        None => Err(Refusal::OnlyLive),
        Some(recordings) if matches!(command.kind, CommandKind::Record {}) => recordings.start(),
        Some(recordings) => recordings.stop(),
    };
    let answer = match result {
        Ok(()) => OutcomeText::applied(id, kind),
        Err(reason) => OutcomeText::refused(id, kind, reason),
    };
    if id.is_some() || result.is_err() {
        context.hub.send(client, &ToPage::Outcome(answer));
    }
}

/// Checks a command and sends it to the source. Answers it here if it is refused.
fn submit(hub: &Hub, client: ClientId, command: Command) {
    let (id, kind) = (command.id, command.kind.name());
    let submitted = command.kind.check().and_then(|()| {
        hub.requests().send(client, RequestKind::Command(command)).map_err(|_| Refusal::Busy)
    });
    if let Err(reason) = submitted {
        hub.send(client, &ToPage::Outcome(OutcomeText::refused(id, kind, reason)));
    }
}
