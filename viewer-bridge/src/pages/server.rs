//! The HTTP server of the pages: their files, and a WebSocket for each.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;

use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Path, State};
use axum::http::HeaderMap;
use axum::response::Response;
use axum::routing::get;
use axum::{Extension, Router};
use thiserror::Error;

use super::assets::Assets;
use super::hub::Hub;
use super::recordings::Recordings;
use super::replays::Replays;
use super::session::{self, Sessions};
use crate::shutdown::Shutdown;
use crate::socket::guard::{Guard, TokenDemand, guarded};
use crate::socket::listen::{HttpListener, client_permits, remedy};
use crate::socket::peer::limit;
use crate::socket::pending_connections::PendingConnection;

/// Options of a server.
#[derive(Debug)]
pub struct ServerOptions {
    /// Address; port 0 is any free port.
    pub listen: SocketAddr,
    /// Names of this host besides its addresses.
    pub names: Vec<String>,
    /// Servers whose pages need a token.
    pub token: TokenDemand,
    /// Files of the page.
    pub assets: Assets,
}

/// The reason for which a server does not start.
#[derive(Debug, Error)]
pub enum ServerError {
    /// The address cannot be used.
    #[error("cannot listen at {address}: {cause}{}", remedy(cause, "--listen", address))]
    Listen {
        /// The address.
        address: SocketAddr,
        /// Error of the system.
        cause: io::Error,
    },
    /// A token needs a random number.
    #[error("the system provides no random number for a token: {0}")]
    NoRandomNumber(getrandom::Error),
}

/// A server that listens.
#[derive(Debug)]
pub struct Server {
    listener: HttpListener,
    guard: Arc<Guard>,
    assets: Assets,
}

/// State that the handlers share.
#[derive(Debug)]
struct ServerState {
    sessions: Sessions,
    assets: Assets,
}

impl Server {
    /// Binds the address.
    ///
    /// # Errors
    /// The address is in use, or does not belong to this host.
    pub async fn bind(options: ServerOptions) -> Result<Self, ServerError> {
        let address = options.listen;
        let listener = HttpListener::bind(address)
            .await
            .map_err(|cause| ServerError::Listen { address, cause })?;
        let guard = Guard::new(listener.address(), options.names, options.token);
        let guard = Arc::new(guard.map_err(ServerError::NoRandomNumber)?);
        Ok(Self { listener, guard, assets: options.assets })
    }

    /// Address to open in a browser. The token follows the `#`, which no browser sends.
    pub fn url(&self) -> String {
        let token = self.guard.token().map(|token| format!("#token={token}"));
        format!("http://{}/{}", self.guard.reachable_authority(), token.unwrap_or_default())
    }

    /// Returns whether only programs of this host can connect.
    pub fn is_local(&self) -> bool {
        self.guard.is_local()
    }

    /// Serves until the shutdown begins and every page has been informed. Pages can start `recordings`, if
    /// there are any, and open `replays`.
    pub async fn serve(
        self,
        hub: Arc<Hub>,
        recordings: Option<Arc<Recordings>>,
        replays: Replays,
        shutdown: Shutdown,
    ) {
        let pages = client_permits();
        let sessions = Sessions {
            hub,
            recordings,
            replays,
            guard: Arc::clone(&self.guard),
            shutdown: shutdown.clone(),
            pages: Arc::clone(&pages),
        };
        let state = Arc::new(ServerState { sessions, assets: self.assets });
        let router = guarded(router(Arc::clone(&state)), self.guard);
        self.listener.serve(router, pages, &shutdown).await;
        state.sessions.replays.end();
    }
}

fn router(state: Arc<ServerState>) -> Router {
    Router::new()
        .route("/", get(page))
        .route("/socket", get(socket))
        // The page of a recording, at an address of its own: its files and its socket lie below that.
        .route("/replay/{name}/", get(page))
        .route("/replay/{name}/socket", get(replay_socket))
        .route("/replay/{name}/{*path}", get(replay_file))
        .route("/{*path}", get(file))
        .with_state(state)
}

async fn page(State(state): State<Arc<ServerState>>, headers: HeaderMap) -> Response {
    state.assets.answer("", &headers)
}

async fn file(
    State(state): State<Arc<ServerState>>,
    Path(path): Path<String>,
    headers: HeaderMap,
) -> Response {
    state.assets.answer(&path, &headers)
}

async fn replay_file(
    State(state): State<Arc<ServerState>>,
    Path((_name, path)): Path<(String, String)>,
    headers: HeaderMap,
) -> Response {
    state.assets.answer(&path, &headers)
}

async fn socket(
    State(state): State<Arc<ServerState>>,
    Extension(place): Extension<Arc<PendingConnection>>,
    upgrade: WebSocketUpgrade,
) -> Response {
    limit(upgrade)
        .on_upgrade(async move |socket| session::serve(socket, &state.sessions, place, None).await)
}

async fn replay_socket(
    State(state): State<Arc<ServerState>>,
    Extension(place): Extension<Arc<PendingConnection>>,
    Path(name): Path<String>,
    upgrade: WebSocketUpgrade,
) -> Response {
    limit(upgrade).on_upgrade(async move |socket| {
        session::serve(socket, &state.sessions, place, Some(&name)).await;
    })
}
