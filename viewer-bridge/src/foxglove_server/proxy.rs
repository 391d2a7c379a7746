//! Forwards messages between a client's WebSocket and the library's server on the loopback network.

use std::net::SocketAddr;
use std::sync::Arc;

use axum::Router;
use axum::extract::State;
use axum::extract::ws::{self, WebSocket, WebSocketUpgrade};
use axum::http::header::SEC_WEBSOCKET_PROTOCOL;
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::routing::any;
use futures_util::{SinkExt, StreamExt};
use tokio::net::TcpStream;
use tokio::sync::OwnedSemaphorePermit;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{WebSocketStream, client_async_with_config};

use crate::limits::CLIENTS_MAX;
use crate::socket::listen::ClientPermits;
use crate::socket::peer::{End, GOING_AWAY, Peer, limit};

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

/// A connection to the library for one client.
struct LibraryConnection {
    socket: WebSocketStream<TcpStream>,
    /// The subprotocol that the library chose.
    subprotocol: String,
}

impl Proxy {
    pub(super) fn new(library: SocketAddr) -> Self {
        Self { library }
    }

    /// Routes every path to the library. Each client holds a permit.
    pub(super) fn into_router(self, clients: ClientPermits) -> Router {
        let state = ProxyState { library: self.library, clients };
        Router::new().fallback(any(upgrade)).with_state(Arc::new(state))
    }
}

/// Connects to the library first, so that the client receives the library's choice of subprotocol.
async fn upgrade(
    State(state): State<Arc<ProxyState>>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    let Ok(permit) = Arc::clone(&state.clients).try_acquire_owned() else {
        let text = format!("{CLIENTS_MAX} viewers are already connected; close one\n");
        return (StatusCode::SERVICE_UNAVAILABLE, text).into_response();
    };
    match connect(state.library, &headers).await {
        Ok(LibraryConnection { socket: library, subprotocol }) => limit(upgrade)
            .protocols([subprotocol])
            .on_upgrade(async move |client| forward(client, library, permit).await),
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

/// Forwards messages in both directions until one side ends.
async fn forward(
    client: WebSocket,
    mut library: WebSocketStream<TcpStream>,
    permit: OwnedSemaphorePermit,
) {
    let mut client = Peer::new(client);
    let end = loop {
        let result = tokio::select! {
            message = client.receive() => match message {
                Ok(message) => to_library(&mut library, message).await,
                Err(end) => Err(end),
            },
            message = library.next() => match message {
                Some(Ok(message)) => to_client(&mut client, message).await,
                Some(Err(_)) | None => Err(server_ended()),
            },
        };
        if let Err(end) = result {
            break end;
        }
    };
    // The library releases the client's grabs at once, however slowly the client closes.
    drop(library);
    client.close(end).await;
    drop(permit);
}

async fn to_library(
    library: &mut WebSocketStream<TcpStream>,
    message: ws::Message,
) -> Result<(), End> {
    let message = match message {
        ws::Message::Text(text) => Message::text(text.as_str()),
        ws::Message::Binary(bytes) => Message::Binary(bytes),
        // `Peer` handles the other kinds.
        ws::Message::Ping(_) | ws::Message::Pong(_) | ws::Message::Close(_) => return Ok(()),
    };
    library.send(message).await.map_err(|_| server_ended())
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
