//! Accepts HTTP connections and hands them to a router, within the limits on time and number.
//!
//! Visitors have a share of the file descriptors of the process. A missing descriptor does
//! harm elsewhere: the link to a node that starts needs about a hundred, and the Foxglove library accepts
//! no client again after one failure.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;

use axum::Router;
use hyper::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use rustix::io::Errno;
use rustix::process::{Resource, getrlimit};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};

use super::pending_connections::{PendingConnection, PendingConnections};
use super::rate_limit::{BYTES, Throttled};
use crate::limits::{
    ACCEPT_PAUSE, CLIENTS_MAX, CONNECTION_TIMEOUT, DESCRIPTORS_PER_VISITOR, DESCRIPTORS_RESERVED,
    HEAD_SIZE_BYTES_MAX, HELLO_TIMEOUT, SHUTDOWN_TIMEOUT, VISITORS_MAX, VISITORS_MIN,
};
use crate::shutdown::Shutdown;

/// A listener for HTTP connections.
#[derive(Debug)]
pub(crate) struct HttpListener {
    listener: TcpListener,
    address: SocketAddr,
}

/// The permits of the clients of one server: [`CLIENTS_MAX`] at a time.
pub(crate) type ClientPermits = Arc<Semaphore>;

/// Creates the permits of a server.
pub(crate) fn client_permits() -> ClientPermits {
    Arc::new(Semaphore::new(CLIENTS_MAX))
}

/// Returns the remedy for an address in use, to append to the error. `option` sets the address.
pub(crate) fn remedy(cause: &io::Error, option: &str, address: &SocketAddr) -> String {
    match cause.kind() {
        io::ErrorKind::AddrInUse => {
            let free = SocketAddr::new(address.ip(), 0);
            format!("; choose another port, or any free one with {option} {free}")
        }
        _ => String::new(),
    }
}

impl HttpListener {
    /// Binds an address; port 0 is any free port.
    pub(crate) async fn bind(address: SocketAddr) -> io::Result<Self> {
        let listener = TcpListener::bind(address).await?;
        let address = listener.local_addr()?;
        Ok(Self { listener, address })
    }

    /// The address, with the real port.
    pub(crate) fn address(&self) -> SocketAddr {
        self.address
    }

    /// Serves until the shutdown begins. Then waits until every client has returned its permit, but
    /// not longer than [`SHUTDOWN_TIMEOUT`].
    pub(crate) async fn serve(self, router: Router, clients: ClientPermits, shutdown: &Shutdown) {
        accept(&self.listener, &router, shutdown).await;
        let all = u32::try_from(CLIENTS_MAX).unwrap_or(u32::MAX);
        let _all_returned = timeout(SHUTDOWN_TIMEOUT, clients.acquire_many(all)).await;
    }
}

/// Accepts connections until the shutdown begins.
async fn accept(listener: &TcpListener, router: &Router, shutdown: &Shutdown) {
    let pending = PendingConnections::new(visitor_count_max());
    loop {
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            () = shutdown.begun() => return,
        };
        let (stream, address) = match accepted {
            Ok(accepted) => accepted,
            Err(error) => {
                // Otherwise the connection broke before it was accepted.
                if are_exhausted(&error) {
                    pending.make_room();
                }
                sleep(ACCEPT_PAUSE).await;
                continue;
            }
        };
        let place = pending.admit(address.ip()).await;
        tokio::spawn(serve_connection(stream, router.clone(), place));
    }
}

/// Serves the requests of one connection. Each of them carries its place among the pending connections, which a request
/// for a socket keeps until the socket belongs to a client.
async fn serve_connection(stream: TcpStream, router: Router, place: PendingConnection) {
    // Without the option, small messages are only delayed.
    let _set = stream.set_nodelay(true);
    let place = Arc::new(place);
    let place_of_requests = Arc::clone(&place);
    let router = TowerToHyperService::new(router);
    let service = service_fn(move |mut request: Request<Incoming>| {
        place_of_requests.note_activity();
        request.extensions_mut().insert(Arc::clone(&place_of_requests));
        router.call(request)
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HELLO_TIMEOUT)
        .max_buf_size(HEAD_SIZE_BYTES_MAX)
        .serve_connection(TokioIo::new(Throttled::new(stream, BYTES)), service)
        .with_upgrades();
    // A broken connection needs no report. A WebSocket is served by its own task after the upgrade.
    let _ended = place.while_held(timeout(CONNECTION_TIMEOUT, connection)).await;
}

/// Number of open files with which connections never fail for lack of a descriptor.
const OPEN_FILES_MIN: usize = DESCRIPTORS_RESERVED + VISITORS_MIN * DESCRIPTORS_PER_VISITOR;

/// Returns the number of visitors that each server can have under the limit of the system.
pub(super) fn visitor_count_max() -> usize {
    open_file_limit().map_or(VISITORS_MAX, visitor_count_for)
}

/// Returns a warning for the user if the system allows too few open files for all clients.
pub fn open_files_warning() -> Option<String> {
    let limit = open_file_limit().filter(|limit| *limit < OPEN_FILES_MIN)?;
    Some(format!(
        "warning: the system allows only {limit} open files, too few for all clients; raise the limit \
         with `ulimit -n {OPEN_FILES_MIN}`"
    ))
}

fn open_file_limit() -> Option<usize> {
    getrlimit(Resource::Nofile).current.and_then(|limit| usize::try_from(limit).ok())
}

fn visitor_count_for(limit: usize) -> usize {
    let available = limit.saturating_sub(DESCRIPTORS_RESERVED);
    (available / DESCRIPTORS_PER_VISITOR).clamp(VISITORS_MIN, VISITORS_MAX)
}

/// Returns whether the process or the system has no descriptor or memory left for a socket.
pub(super) fn are_exhausted(error: &io::Error) -> bool {
    matches!(
        Errno::from_io_error(error),
        Some(Errno::MFILE | Errno::NFILE | Errno::NOBUFS | Errno::NOMEM)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn visitors_and_everything_else_stay_within_the_limit() {
        for limit in [512, 700, 1024, 1 << 20] {
            let count = visitor_count_for(limit);
            assert!(count * DESCRIPTORS_PER_VISITOR + DESCRIPTORS_RESERVED <= limit, "{limit}");
        }
        assert_eq!(visitor_count_for(1024), VISITORS_MAX);
        assert_eq!(visitor_count_for(OPEN_FILES_MIN), VISITORS_MIN);
        assert_eq!(visitor_count_for(0), VISITORS_MIN);
    }
}
