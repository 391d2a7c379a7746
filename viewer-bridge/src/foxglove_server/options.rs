//! Options of the Foxglove server, and the reasons for which it does not start.

use std::net::SocketAddr;

use foxglove::FoxgloveError;
use thiserror::Error;

use crate::socket::listen::remedy;
use crate::source::recording_times::RecordingTimes;

/// Options of a Foxglove server.
#[derive(Debug, Clone)]
pub struct FoxgloveOptions {
    /// Address; port 0 is any free port.
    pub listen: SocketAddr,
    /// Origins of web pages that may connect, as browsers write them.
    pub origins: Vec<String>,
    /// Rights of the clients.
    pub permission: FoxglovePermission,
    /// Times of the recording on show, if the source is one.
    pub recording: Option<RecordingTimes>,
}

/// Rights of Foxglove clients.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FoxglovePermission {
    /// Clients only read.
    ReadOnly,
    /// Clients may publish commands, call services and set parameters.
    Commands,
}

impl FoxgloveOptions {
    /// Checks that only this host can reach an address.
    ///
    /// # Errors
    /// Other machines can reach the address.
    pub fn check_address(address: SocketAddr) -> Result<(), FoxgloveServerError> {
        if address.ip().is_loopback() {
            Ok(())
        } else {
            Err(FoxgloveServerError::NotLoopback { address })
        }
    }
}

/// The reason for which a Foxglove server does not start.
#[derive(Debug, Error)]
pub enum FoxgloveServerError {
    /// Other machines can reach the address.
    #[error(
        "{address} can be reached from other machines, and the Foxglove protocol cannot \
         authenticate clients; listen on loopback and forward the port, as in \
         `ssh -L {port}:127.0.0.1:{port} HOST`",
        port = address.port()
    )]
    NotLoopback {
        /// The address.
        address: SocketAddr,
    },
    /// The address cannot be used.
    #[error("cannot listen at {address}: {cause}{}", remedy(cause, "--foxglove", address))]
    Listen {
        /// The address.
        address: SocketAddr,
        /// Error of the system.
        cause: std::io::Error,
    },
    /// The secret address needs a random number.
    #[error("the system provides no random number: {0}")]
    NoRandomNumber(getrandom::Error),
    /// The library cannot start.
    #[error("starting the Foxglove server: {0}")]
    Library(#[from] FoxgloveError),
}
