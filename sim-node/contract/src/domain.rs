//! A domain seen from outside: its nodes, and what dead processes have left in it.

pub(crate) mod config_file;
pub(crate) mod nodes;

use std::path::PathBuf;
use std::time::Duration;

use iceoryx2::prelude::Config;

use crate::domain::nodes::ListedNode;
use crate::endpoint::Endpoint;
use crate::ports::domain::root::RootError;
use crate::ports::domain::{self, files, root};
use crate::ports::leftovers::on_request::{self, Leftover};
use crate::ports::leftovers::unfinished;
use crate::ports::memory;
use crate::ports::service::ServiceError;
use crate::ports::session::Session;

/// A domain, to look at its nodes and files. Creating it joins nothing and writes no file.
#[derive(Debug)]
pub struct Domain {
    endpoint: Endpoint,
    config: Config,
}

impl Domain {
    /// Longest root and prefix together, in bytes: a waiting process binds a Unix socket under them, and the
    /// path of a socket has at most 107 bytes.
    pub const PATH_LENGTH_MAX: usize = domain::DIRECTORY_AND_PREFIX_MAX;

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

    /// Returns the root directory of the domain.
    pub fn root(&self) -> PathBuf {
        root::path(&self.config)
    }

    /// Returns the prefix of the domain's files.
    pub fn prefix(&self) -> String {
        self.config.global.prefix.to_string()
    }

    /// Checks that the root directory, if it exists, and the files that every program opens belong to this
    /// user alone, as each program does when it joins. Returns `false` if there is no root yet.
    ///
    /// # Errors
    /// Programs refuse the domain.
    pub fn check_root(&self) -> Result<bool, RootError> {
        let exists = root::exists(&self.root())?;
        if self.endpoint.domain().is_some() {
            files::check_counter(&self.config)?;
        }
        Ok(exists)
    }

    /// Returns the number of bytes by which root and prefix together exceed [`Domain::PATH_LENGTH_MAX`].
    pub fn path_excess(&self) -> usize {
        let length = self.root().as_os_str().len() + self.prefix().len();
        length.saturating_sub(Self::PATH_LENGTH_MAX)
    }

    /// Returns an `iceoryx2.toml` with which other programs of iceoryx2, such as `iox2`, see the services of
    /// this domain.
    pub fn iceoryx2_toml(&self) -> String {
        config_file::to_text(&self.config)
    }

    /// Returns the free shared memory of this host in bytes; `None` if `/dev/shm` cannot be read.
    pub fn free_memory_bytes() -> Option<u64> {
        memory::available_bytes()
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

    /// Returns the files of this user that dead processes have left in this domain. Changes nothing.
    pub fn leftovers(&self) -> Vec<Leftover> {
        on_request::find(&self.config)
    }

    /// Removes the leftovers. Files of living processes stay, of stopped ones too, and so do those of other
    /// users and other domains. Some leftovers may stay; see [`Domain::leftovers`].
    ///
    /// # Errors
    /// This process cannot join the domain.
    pub fn remove_leftovers(&self) -> Result<(), ServiceError> {
        // First, because they may be all that keeps this process from joining.
        on_request::remove_segments(&self.config);
        let session = Session::join(&self.endpoint)?;
        unfinished::remove_nodes(&self.config);
        on_request::remove_names(&self.config);
        on_request::remove_segments(&self.config);
        drop(session);
        Ok(())
    }
}
