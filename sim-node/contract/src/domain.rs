//! A domain seen from outside: its nodes.

pub(crate) mod nodes;

use std::time::Duration;

use iceoryx2::prelude::Config;

use crate::domain::nodes::ListedNode;
use crate::endpoint::Endpoint;
use crate::ports::domain;
use crate::ports::service::ServiceError;

/// A domain, to look at its nodes. Creating it joins nothing and writes no file.
#[derive(Debug)]
pub struct Domain {
    endpoint: Endpoint,
    config: Config,
}

impl Domain {
    /// Returns the domain of an endpoint, whose name does not matter.
    ///
    /// # Errors
    /// iceoryx2 refuses the paths of the domain.
    pub fn new(endpoint: &Endpoint) -> Result<Self, ServiceError> {
        let config = domain::configuration(endpoint.domain()).map_err(|error| {
            ServiceError::Domain { endpoint: endpoint.clone(), cause: format!("{error:?}") }
        })?;
        Ok(Self { endpoint: endpoint.clone(), config })
    }

    /// Returns the living owners of names in this domain, nodes and replays, by name. Asks all of them for
    /// their status at the same time, and waits for the answers at most for `timeout`. A domain without
    /// nodes stays as it is; otherwise, like every client, this removes what dead processes left.
    ///
    /// # Errors
    /// The root directory of the domain is not this user's own.
    pub fn nodes(&self, timeout: Duration) -> Result<Vec<ListedNode>, ServiceError> {
        nodes::list(&self.config, &self.endpoint, timeout)
    }
}
