//! Forwards messages between a client's WebSocket and the library's server on the loopback network.

use std::net::SocketAddr;
use std::sync::Arc;

use axum::extract::State;
use axum::extract::ws::{self, WebSocketUpgrade};
use axum::http::header::SEC_WEBSOCKET_PROTOCOL;
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::routing::any;
use axum::{Extension, Router};
use foxglove::ws_protocol::client::ClientMessage;
use futures_util::{SinkExt, StreamExt};
use tokio::net::TcpStream;
use tokio::sync::{SemaphorePermit, TryAcquireError};
use tokio::time::{sleep, timeout};
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{WebSocketStream, client_async_with_config};

use crate::limits::{CLIENTS_MAX, CONNECTION_TIMEOUT, SILENCE_MAX};
use crate::socket::listen::ClientPermits;
use crate::socket::peer::{End, FULL, GOING_AWAY, Peer, TOO_SLOW, limit};
use crate::socket::pending_connections::PendingConnection;

/// Forwards messages between clients and the library.
#[derive(Debug)]
pub(super) struct Proxy {
    /// Address of the library's server.
    library: SocketAddr,
}

/// State that the handlers share.
#[derive(Debug)]
struct ProxyState {
    library: SocketAddr,
    clients: ClientPermits,
}

type LibrarySocket = WebSocketStream<TcpStream>;

/// A connection to the library for one client.
struct LibraryConnection {
    socket: LibrarySocket,
    /// The subprotocol that the library chose.
    subprotocol: String,
}

impl Proxy {
    pub(super) fn new(library: SocketAddr) -> Self {
        Self { library }
    }

    /// Routes every path to the library. Each client holds a permit once it has proved itself.
    pub(super) fn into_router(self, clients: ClientPermits) -> Router {
        let state = ProxyState { library: self.library, clients };
        Router::new().fallback(any(upgrade)).with_state(Arc::new(state))
    }
}

/// Connects to the library first, so that the client receives the library's choice of subprotocol.
async fn upgrade(
    State(state): State<Arc<ProxyState>>,
    Extension(place): Extension<Arc<PendingConnection>>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    if state.clients.available_permits() == 0 {
        let text = format!("{CLIENTS_MAX} viewers are already connected; close one\n");
        return (StatusCode::SERVICE_UNAVAILABLE, text).into_response();
    }
    match connect(state.library, &headers).await {
        Ok(LibraryConnection { socket: library, subprotocol }) => {
            limit(upgrade).protocols([subprotocol]).on_upgrade(async move |client| {
                let client = Peer::new(client);
                Forwarding { client, library }.run(place, &state.clients).await;
            })
        }
        Err(Error::Http(response)) => {
            let text = "the client must offer the subprotocol foxglove.sdk.v1\n";
            (response.status(), text).into_response()
        }
        Err(error) => (StatusCode::BAD_GATEWAY, format!("{error}\n")).into_response(),
    }
}

/// Connects to the library and offers the client's subprotocols.
async fn connect(library: SocketAddr, headers: &HeaderMap) -> Result<LibraryConnection, Error> {
    let stream = TcpStream::connect(library).await?;
    stream.set_nodelay(true)?;
    let mut request = format!("ws://{library}/").into_client_request()?;
    for offered in headers.get_all(SEC_WEBSOCKET_PROTOCOL) {
        request.headers_mut().append(SEC_WEBSOCKET_PROTOCOL, offered.clone());
    }
    // The library's messages are as long as the scene is large.
    let config = WebSocketConfig::default().max_message_size(None).max_frame_size(None);
    let (socket, response) = client_async_with_config(request, stream, Some(config)).await?;
    let subprotocol = response.headers().get(SEC_WEBSOCKET_PROTOCOL);
    let subprotocol = subprotocol.and_then(|name| name.to_str().ok()).unwrap_or_default();
    Ok(LibraryConnection { socket, subprotocol: subprotocol.to_owned() })
}

/// The two sides of a client's connection.
struct Forwarding {
    client: Peer,
    library: LibrarySocket,
}

impl Forwarding {
    /// Forwards messages in both directions until one side ends. The connection keeps its place in the
    /// pending connections until it is a client.
    async fn run(mut self, place: Arc<PendingConnection>, clients: &ClientPermits) {
        match place.while_held(self.admit(clients)).await {
            Some(Ok(_permit)) => {
                drop(place);
                let end = self.serve().await;
                self.close(end).await;
            }
            Some(Err(end)) => {
                place.while_held(self.close(end)).await;
            }
            None => {
                place.while_held(self.close(End::evicted())).await;
            }
        }
    }

    /// Forwards messages up to the first valid one of the client, which makes it a client.
    async fn admit<'a>(&mut self, clients: &'a ClientPermits) -> Result<SemaphorePermit<'a>, End> {
        let end = sleep(CONNECTION_TIMEOUT);
        tokio::pin!(end);
        loop {
            let message = tokio::select! {
                message = self.receive() => message?,
                () = &mut end => return Err(no_valid_message()),
            };
            let permit = is_valid(&message).then(|| clients.try_acquire().map_err(full));
            let permit = permit.transpose()?;
            to_library(&mut self.library, message).await?;
            if let Some(permit) = permit {
                return Ok(permit);
            }
        }
    }

    /// Forwards messages until one side ends.
    async fn serve(&mut self) -> End {
        loop {
            let forwarded = match self.receive().await {
                Ok(message) => to_library(&mut self.library, message).await,
                Err(end) => Err(end),
            };
            if let Err(end) = forwarded {
                return end;
            }
        }
    }

    /// Returns the next message of the client, and forwards those of the library while it waits.
    async fn receive(&mut self) -> Result<ws::Message, End> {
        loop {
            tokio::select! {
                message = self.client.receive() => return message,
                message = self.library.next() => match message {
                    Some(Ok(message)) => to_client(&mut self.client, message).await?,
                    Some(Err(_)) | None => return Err(server_ended()),
                },
            }
        }
    }

    /// Ends both sides. The library releases the client's grabs at once, however slowly the client
    /// closes.
    async fn close(self, end: End) {
        drop(self.library);
        self.client.close(end).await;
    }
}

/// Returns whether a message is one of the protocol.
fn is_valid(message: &ws::Message) -> bool {
    match message {
        ws::Message::Text(text) => ClientMessage::parse_json(text).is_ok(),
        ws::Message::Binary(bytes) => ClientMessage::parse_binary(bytes).is_ok(),
        ws::Message::Ping(_) | ws::Message::Pong(_) | ws::Message::Close(_) => false,
    }
}

fn no_valid_message() -> End {
    let limit_s = CONNECTION_TIMEOUT.as_secs();
    End::closed(TOO_SLOW, format!("no valid message within {limit_s} s; subscribe to a topic"))
}

fn full(_: TryAcquireError) -> End {
    End::closed(FULL, format!("{CLIENTS_MAX} viewers are already connected; close one"))
}

/// Sends a message to the library. The library reads at once; one that does not is given up like a
/// client, so that its client is not left without pings.
async fn to_library(library: &mut LibrarySocket, message: ws::Message) -> Result<(), End> {
    let message = match message {
        ws::Message::Text(text) => Message::text(text.as_str()),
        ws::Message::Binary(bytes) => Message::Binary(bytes),
        // `Peer` handles the other kinds.
        ws::Message::Ping(_) | ws::Message::Pong(_) | ws::Message::Close(_) => return Ok(()),
    };
    match timeout(SILENCE_MAX, library.send(message)).await {
        Ok(Ok(())) => Ok(()),
        Ok(Err(_)) | Err(_) => Err(server_ended()),
    }
}

async fn to_client(client: &mut Peer, message: Message) -> Result<(), End> {
    match message {
        Message::Text(text) => client.send(ws::Message::Text(text.as_str().into())).await,
        Message::Binary(bytes) => client.send(ws::Message::Binary(bytes)).await,
        Message::Close(Some(frame)) => {
            Err(End::closed(frame.code.into(), frame.reason.to_string()))
        }
        Message::Close(None) => Err(server_ended()),
        Message::Ping(_) | Message::Pong(_) | Message::Frame(_) => Ok(()),
    }
}

fn server_ended() -> End {
    End::closed(GOING_AWAY, "the server has ended the connection")
}
