//! Options that select a node.

use clap::Args as ClapArgs;
use sim_contract::{Endpoint, EndpointError};

/// Options that select a node. Main command and subcommand both accept them.
#[derive(Debug, Default, Clone, ClapArgs)]
pub(crate) struct EndpointArgs {
    /// Name of the node: its services are NAME/particles, NAME/commands, ... [default: sim]
    #[arg(long, value_name = "NAME", value_parser = Endpoint::parse_name)]
    name: Option<String>,
    /// Domain that separates these services from others on this host [env: CATENARY_DOMAIN]
    /// [default: iceoryx2's own domain]
    #[arg(long, value_name = "DOMAIN", value_parser = Endpoint::parse_domain)]
    domain: Option<String>,
}

/// Option that selects a domain. Main command and subcommand both accept it.
#[derive(Debug, Default, Clone, ClapArgs)]
pub(crate) struct DomainArgs {
    /// Domain of the nodes [env: CATENARY_DOMAIN] [default: iceoryx2's own domain]
    #[arg(long, value_name = "DOMAIN", value_parser = Endpoint::parse_domain)]
    domain: Option<String>,
}

impl DomainArgs {
    /// Fills what is absent with the option before the subcommand.
    pub(super) fn inherit(&mut self, before: &EndpointArgs) {
        self.domain = self.domain.take().or_else(|| before.domain.clone());
    }

    /// Returns an endpoint in the domain; its name does not matter.
    pub(crate) fn endpoint(&self) -> Result<Endpoint, EndpointError> {
        Endpoint::from_options(self.domain.as_deref(), None)
    }
}

impl EndpointArgs {
    /// Names of the arguments above.
    pub(super) const IDS: [&str; 2] = ["name", "domain"];

    /// Fills what is absent with the options before the subcommand.
    pub(super) fn inherit(&mut self, before: &Self) {
        self.name = self.name.take().or_else(|| before.name.clone());
        self.domain = self.domain.take().or_else(|| before.domain.clone());
    }

    pub(crate) fn endpoint(&self) -> Result<Endpoint, EndpointError> {
        Endpoint::from_options(self.domain.as_deref(), self.name.as_deref())
    }
}
