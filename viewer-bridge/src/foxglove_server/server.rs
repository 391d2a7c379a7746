//! The server for Foxglove clients.
//!
//! The foxglove library listens on TCP by itself. It accepts any connection from any web page, and
//! messages of any size and number. Therefore the library listens at a secret address of the loopback
//! network, and the public address belongs to the same HTTP server as that of the pages, with the same
//! limits. A [`Proxy`] forwards the messages between the two.

use std::net::Ipv4Addr;
use std::sync::Arc;

use foxglove::websocket::Capability;
use foxglove::{Context, WebSocketServer};
use tokio::time::timeout;

use super::callbacks::{ClientEvents, ParameterRequests, services};
use super::options::{FoxgloveOptions, FoxglovePermission, FoxgloveServerError};
use super::proxy::Proxy;
use super::publisher::Publisher;
use super::request_bridge::RequestBridge;
use super::sink::FoxgloveSink;
use crate::limits::{FOXGLOVE_QUEUED_MAX, SHUTDOWN_TIMEOUT};
use crate::request::RequestSender;
use crate::shutdown::Shutdown;
use crate::sink::Sink;
use crate::socket::guard::{Guard, guarded};
use crate::socket::listen::{HttpListener, client_permits};

/// A Foxglove server that listens.
#[derive(Debug)]
pub struct FoxgloveServer {
    listener: HttpListener,
    guard: Guard,
    proxy: Proxy,
    sink: Arc<FoxgloveSink>,
    bridge: Arc<RequestBridge>,
    /// Owner of the channels and subscriptions.
    context: Arc<Context>,
}

impl FoxgloveServer {
    /// Binds the address and starts the library. The requests of clients go to `requests`.
    ///
    /// # Errors
    /// The address is in use, does not belong to this host, or is not on loopback.
    pub async fn start(
        options: FoxgloveOptions,
        requests: RequestSender,
    ) -> Result<Self, FoxgloveServerError> {
        let address = options.listen;
        FoxgloveOptions::check_address(address)?;
        let listener = HttpListener::bind(address)
            .await
            .map_err(|cause| FoxgloveServerError::Listen { address, cause })?;
        let context = Context::new();
        let bridge = Arc::new(RequestBridge::new(requests.clone(), options.recording));
        let publisher = Arc::new(Publisher::new(&context, options.recording)?);
        let events = ClientEvents {
            requests: requests.clone(),
            publisher: Arc::clone(&publisher),
            bridge: Arc::clone(&bridge),
        };
        let secret = secret_address().map_err(FoxgloveServerError::NoRandomNumber)?;
        let library = library(&context, &options, &bridge)
            .bind(secret.to_string(), 0)
            .listener(Arc::new(events))
            .start()
            .await?;
        let proxy = Proxy::new((secret, library.port()).into());
        bridge.set_library(library);
        let sink = Arc::new(FoxgloveSink::new(publisher, Arc::clone(&bridge), requests));
        let guard = Guard::for_origins(listener.address(), options.origins);
        Ok(Self { listener, guard, proxy, sink, bridge, context })
    }

    /// The sink that feeds the clients.
    pub fn sink(&self) -> Arc<dyn Sink> {
        Arc::<FoxgloveSink>::clone(&self.sink)
    }

    /// Address to open in a viewer.
    pub fn url(&self) -> String {
        format!("ws://{}", self.listener.address())
    }

    /// Serves until the shutdown begins and every client has been informed.
    pub async fn serve(self, shutdown: Shutdown) {
        let clients = client_permits();
        let router = self.proxy.into_router(Arc::clone(&clients));
        let router = guarded(router, Arc::new(self.guard));
        let stop_library = async {
            shutdown.begun().await;
            if let Some(library) = self.bridge.take_library() {
                let _timed_out = timeout(SHUTDOWN_TIMEOUT, library.stop().wait()).await;
            }
        };
        tokio::join!(self.listener.serve(router, clients, &shutdown), stop_library);
        drop(self.context);
    }
}

/// Configures the library's server, except for its address and listener.
fn library(
    context: &Arc<Context>,
    options: &FoxgloveOptions,
    bridge: &Arc<RequestBridge>,
) -> WebSocketServer {
    let (publish, services) = match options.permission {
        FoxglovePermission::Commands => (Some(Capability::ClientPublish), services(bridge)),
        FoxglovePermission::ReadOnly => (None, Vec::new()),
    };
    let parameters = ParameterRequests::new(Arc::clone(bridge), options.permission);
    let library = context
        .websocket_server()
        .name("catenary")
        .message_backlog_size(FOXGLOVE_QUEUED_MAX)
        .supported_encodings(["json"])
        .capabilities(publish)
        .parameter_handler(Arc::new(parameters))
        .services(services);
    match options.recording {
        Some(times) => library.playback_time_range(times.first_ns(), times.last_ns()),
        None => library,
    }
}

/// Chooses an address of the loopback network. Together with the port it has 38 random bits, which no
/// web page can guess. Programs on this host can look it up, but the public address admits them too.
fn secret_address() -> Result<Ipv4Addr, getrandom::Error> {
    let [_, b, c, d] = getrandom::u32()?.to_le_bytes();
    // The last byte excludes the address of the network and its broadcast address.
    Ok(Ipv4Addr::new(127, b, c, d.clamp(1, 254)))
}
