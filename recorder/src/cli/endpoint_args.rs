//! The options that select a node.

use sim_contract::{Endpoint, EndpointError, NAME_DEFAULT};

/// The name and the domain of a node.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct EndpointArgs {
    /// Name of the node: its services are NAME/particles, NAME/commands, ...
    #[arg(long, default_value = NAME_DEFAULT, value_name = "NAME", allow_hyphen_values = true,
        value_parser = Endpoint::parse_name)]
    name: String,
    /// Domain that separates these services from others on this host [env: `CATENARY_DOMAIN`]
    /// [default: iceoryx2's own domain]
    #[arg(long, value_name = "DOMAIN", allow_hyphen_values = true,
        value_parser = Endpoint::parse_domain)]
    domain: Option<String>,
}

impl EndpointArgs {
    /// Returns the endpoint. Without `--domain`, the variable `CATENARY_DOMAIN` gives the domain.
    pub(crate) fn endpoint(&self) -> Result<Endpoint, EndpointError> {
        Endpoint::from_options(self.domain.as_deref(), Some(&self.name))
    }
}
