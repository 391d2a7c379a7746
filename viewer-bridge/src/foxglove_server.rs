//! The same simulation for viewers that speak the Foxglove protocol.
//!
//! Topics are those of a recording, with the same bytes, and `/scene` with sticks and surface.
//! Parameters, services and (where that was allowed) published commands take the way of the pages'
//! commands: through the hub, to the source. The hub hands over what the source says; without this
//! server there is nobody to hand it to.

mod client_frames;
mod desk;
mod gate;
mod listener;
mod picture;
mod playback;
mod published;
mod publisher;
mod settable;
#[cfg(test)]
mod tests;

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;

use foxglove::websocket::Capability;
use foxglove::{Context, FoxgloveError};
use thiserror::Error;
use tokio::net::TcpListener;
use tokio::time::timeout;

use crate::limits::{FAREWELL_TIMEOUT, FOXGLOVE_QUEUED_MAX};
use crate::pages::hub::Hub;
use crate::socket::guard::Guard;
use desk::{Desk, ParameterDesk};
use gate::Gate;
use listener::Listener;

pub use playback::Recording;

pub(crate) use desk::CLIENT_FIRST;
pub(crate) use publisher::Publisher;

/// What a Foxglove server is told.
#[derive(Debug, Clone)]
pub struct FoxgloveOptions {
    /// Where it listens; port 0 is any that is free.
    pub listen: SocketAddr,
    /// Origins of web pages that may connect, as browsers write them.
    pub origins: Vec<String>,
    /// Whether clients may change anything: publish commands, call services, set parameters.
    pub takes_commands: bool,
    /// The times of the recording that the hub's source shows, if it shows one.
    pub recording: Option<Recording>,
}

impl FoxgloveOptions {
    /// Whether a server may listen there.
    ///
    /// # Errors
    /// Others than this host could reach it.
    pub fn check_address(address: SocketAddr) -> Result<(), FoxgloveServerError> {
        if address.ip().is_loopback() {
            Ok(())
        } else {
            Err(FoxgloveServerError::NotLoopback { address })
        }
    }
}

/// Why a Foxglove server does not start.
#[derive(Debug, Error)]
pub enum FoxgloveServerError {
    /// Others could reach it.
    #[error(
        "{address} can be reached from other machines, and the Foxglove protocol has no way to \
         prove who connects; listen on loopback and forward the port, as in \
         `ssh -L {port}:127.0.0.1:{port} HOST`",
        port = address.port()
    )]
    NotLoopback {
        /// The address.
        address: SocketAddr,
    },
    /// The address cannot be listened at.
    #[error("cannot listen at {address}: {cause}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// What the system says.
        cause: std::io::Error,
    },
    /// There is no secret address without it.
    #[error("the system gives no random number: {0}")]
    NoRandomNumber(getrandom::Error),
    /// The library refuses.
    #[error("starting the Foxglove server: {0}")]
    Library(#[from] FoxgloveError),
}

/// A Foxglove server that listens.
#[derive(Debug)]
pub struct FoxgloveServer {
    address: SocketAddr,
    gate: Gate,
    desk: Arc<Desk>,
    /// What is subscribed to what; with it go all channels.
    context: Arc<Context>,
}

impl FoxgloveServer {
    /// Takes the address, and what the hub's source says from now on.
    ///
    /// # Errors
    /// The address is taken, not of this host, or not of loopback.
    pub async fn start(
        options: FoxgloveOptions,
        hub: &Arc<Hub>,
    ) -> Result<Self, FoxgloveServerError> {
        let address = options.listen;
        FoxgloveOptions::check_address(address)?;
        let listen = |cause| FoxgloveServerError::Listen { address, cause };
        let listener = TcpListener::bind(address).await.map_err(listen)?;
        let address = listener.local_addr().map_err(listen)?;
        let context = Context::new();
        let desk = Arc::new(Desk::new(Arc::downgrade(hub), &options));
        let publisher = Arc::new(Publisher::new(&context, Arc::clone(&desk), options.recording)?);
        let listener_of_clients = Listener {
            hub: Arc::downgrade(hub),
            publisher: Arc::clone(&publisher),
            desk: Arc::clone(&desk),
        };
        let secret = secret_address().map_err(FoxgloveServerError::NoRandomNumber)?;
        let publish = options.takes_commands.then_some(Capability::ClientPublish);
        let services = if options.takes_commands { listener::services(&desk) } else { Vec::new() };
        let mut server = context
            .websocket_server()
            .name("catenary")
            .bind(secret.to_string(), 0)
            .message_backlog_size(FOXGLOVE_QUEUED_MAX)
            .supported_encodings(["json"])
            .capabilities(publish)
            .parameter_handler(Arc::new(ParameterDesk(Arc::clone(&desk))))
            .services(services)
            .listener(Arc::new(listener_of_clients));
        if let Some((first_ns, last_ns)) = options.recording.map(|recording| recording.range_ns()) {
            server = server.playback_time_range(first_ns, last_ns);
        }
        let handle = server.start().await?;
        let inner = SocketAddr::from((secret, handle.port()));
        desk.open(handle);
        hub.set_publisher(publisher);
        let guard = Guard::for_origins(address, options.origins);
        Ok(Self { address, gate: Gate { listener, guard, inner }, desk, context })
    }

    /// What to open in a viewer.
    pub fn url(&self) -> String {
        format!("ws://{}", self.address)
    }

    /// Serves until the hub is closed, and then until every client was told.
    pub async fn serve(self, hub: Arc<Hub>) {
        tokio::select! {
            () = self.gate.run() => {}
            () = hub.closed() => {}
        }
        if let Some(handle) = self.desk.close() {
            let _told = timeout(FAREWELL_TIMEOUT, handle.stop().wait()).await;
        }
        drop(self.context);
    }
}

/// An address of the loopback network that no web page can guess, together with its port: 38 bits.
/// Programs of this host can look it up; they need no such way, for they have no origin.
fn secret_address() -> Result<Ipv4Addr, getrandom::Error> {
    let [_, b, c, d] = getrandom::u32()?.to_le_bytes();
    // Neither the network's own address, nor its broadcast.
    Ok(Ipv4Addr::new(127, b, c, d.clamp(1, 254)))
}
