//! The HTTP server: the page's files, and a WebSocket for each page.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;

use axum::Router;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Path, Request, State};
use axum::http::{HeaderMap, StatusCode};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use thiserror::Error;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};

use crate::limits::{
    ACCEPT_PAUSE, CLIENTS_MAX, CONNECTION_TIMEOUT, CONNECTIONS_MAX, FAREWELL_TIMEOUT,
    HELLO_TIMEOUT, MESSAGE_SIZE_BYTES_MAX, WAITING_MAX,
};
use crate::pages::assets::Assets;
use crate::pages::hub::Hub;
use crate::pages::session;
use crate::socket::guard::{Guard, HEADERS};

/// What a server is told.
#[derive(Debug)]
pub struct ServerOptions {
    /// Where it listens; port 0 is any that is free.
    pub listen: SocketAddr,
    /// Names by which it may be called beside its addresses.
    pub names: Vec<String>,
    /// The page's files.
    pub assets: Assets,
}

/// Why a server does not start.
#[derive(Debug, Error)]
pub enum ServerError {
    /// The address cannot be listened at.
    #[error("cannot listen at {address}: {cause}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// What the system says.
        cause: io::Error,
    },
    /// There is no token without it.
    #[error("the system gives no random number for a token: {0}")]
    NoRandomNumber(getrandom::Error),
}

/// A server that listens.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    guard: Guard,
    assets: Assets,
}

/// What the handlers share.
#[derive(Debug)]
pub(crate) struct Site {
    pub(crate) hub: Arc<Hub>,
    pub(crate) guard: Guard,
    assets: Assets,
    /// A permit for each page.
    pub(crate) places: Arc<Semaphore>,
    /// A permit for each socket that has not said who it is: whoever has no token takes no place.
    waiting: Arc<Semaphore>,
}

impl Server {
    /// Takes the address.
    ///
    /// # Errors
    /// It is taken, or not of this host.
    pub async fn bind(options: ServerOptions) -> Result<Self, ServerError> {
        let listen = |cause| ServerError::Listen { address: options.listen, cause };
        let listener = TcpListener::bind(options.listen).await.map_err(listen)?;
        let address = listener.local_addr().map_err(listen)?;
        let guard = Guard::new(address, options.names).map_err(ServerError::NoRandomNumber)?;
        Ok(Self { listener, address, guard, assets: options.assets })
    }

    /// What to open in a browser. The token is behind the `#`, which no browser sends.
    pub fn url(&self) -> String {
        let token = self.guard.token().map(|token| format!("#token={token}"));
        format!("http://{}/{}", self.address, token.unwrap_or_default())
    }

    /// Serves until the hub is closed, and then until every page was told.
    pub async fn serve(self, hub: Arc<Hub>) {
        let places = Arc::new(Semaphore::new(CLIENTS_MAX));
        let site = Site {
            hub: Arc::clone(&hub),
            guard: self.guard,
            assets: self.assets,
            places: Arc::clone(&places),
            waiting: Arc::new(Semaphore::new(WAITING_MAX)),
        };
        let router = router(Arc::new(site));
        tokio::select! {
            () = accept(&self.listener, &router) => {}
            () = hub.closed() => {}
        }
        // The last permit comes back when the last page has gone.
        let all = u32::try_from(CLIENTS_MAX).unwrap_or(u32::MAX);
        let _gone = timeout(FAREWELL_TIMEOUT, places.acquire_many(all)).await;
    }
}

fn router(site: Arc<Site>) -> Router {
    Router::new()
        .route("/", get(page))
        .route("/socket", get(socket))
        .route("/{*path}", get(file))
        .layer(middleware::from_fn_with_state(Arc::clone(&site), guarded))
        .with_state(site)
}

/// Takes connections as long as it is polled.
async fn accept(listener: &TcpListener, router: &Router) {
    let connections = Arc::new(Semaphore::new(CONNECTIONS_MAX));
    // The semaphore is never closed.
    while let Ok(permit) = Arc::clone(&connections).acquire_owned().await {
        let Ok((stream, _)) = listener.accept().await else {
            // A connection that broke before it was taken, or no file handle is left.
            sleep(ACCEPT_PAUSE).await;
            continue;
        };
        let router = router.clone();
        tokio::spawn(async move {
            converse(stream, router).await;
            drop(permit);
        });
    }
}

/// Serves one connection.
async fn converse(stream: TcpStream, router: Router) {
    // Small messages go at once; where the system refuses, they go a little later.
    let _set = stream.set_nodelay(true);
    let service = TowerToHyperService::new(router);
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HELLO_TIMEOUT)
        .serve_connection(TokioIo::new(stream), service)
        .with_upgrades();
    // Whoever breaks off in the middle is gone; nobody is left to be told. A socket has ended this
    // connection, and is served beside it.
    let _ended = timeout(CONNECTION_TIMEOUT, connection).await;
}

/// Checks every request, known path or not, and gives every answer the headers of the site.
async fn guarded(State(site): State<Arc<Site>>, request: Request, next: Next) -> Response {
    let mut response = if site.guard.admits(request.headers()) {
        next.run(request).await
    } else {
        (StatusCode::FORBIDDEN, "this host or origin is not allowed here\n").into_response()
    };
    response.headers_mut().extend(HEADERS);
    response
}

async fn page(State(site): State<Arc<Site>>, headers: HeaderMap) -> Response {
    site.assets.answer("", &headers)
}

async fn file(
    State(site): State<Arc<Site>>,
    Path(path): Path<String>,
    headers: HeaderMap,
) -> Response {
    site.assets.answer(&path, &headers)
}

async fn socket(State(site): State<Arc<Site>>, upgrade: WebSocketUpgrade) -> Response {
    let waiting = Arc::clone(&site.waiting).try_acquire_owned();
    let is_full = site.places.available_permits() == 0;
    let Some(waiting) = waiting.ok().filter(|_| !is_full) else {
        let text = format!("{CLIENTS_MAX} pages are open already; close one\n");
        return (StatusCode::SERVICE_UNAVAILABLE, text).into_response();
    };
    upgrade
        .max_message_size(MESSAGE_SIZE_BYTES_MAX)
        .max_frame_size(MESSAGE_SIZE_BYTES_MAX)
        .write_buffer_size(0)
        .on_upgrade(async move |socket| session::serve(socket, &site, waiting).await)
}
