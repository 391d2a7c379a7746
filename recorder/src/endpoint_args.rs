//! Which simulation.

use sim_contract::{Endpoint, EndpointError, NAME_DEFAULT};

/// Where a simulation is found.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct EndpointArgs {
    /// Name of the simulation: its services are NAME/particles, NAME/commands, ...
    #[arg(long, default_value = NAME_DEFAULT, value_name = "NAME", value_parser = name)]
    name: String,
    /// Domain that keeps services apart from others on this host [default: that of iceoryx2]
    #[arg(long, env = "CATENARY_DOMAIN", value_name = "DOMAIN", value_parser = domain)]
    domain: Option<String>,
}

impl EndpointArgs {
    pub(crate) fn endpoint(&self) -> Result<Endpoint, EndpointError> {
        // An empty variable counts as absent.
        let domain = self.domain.as_deref().filter(|domain| !domain.is_empty());
        Endpoint::new(domain, &self.name)
    }
}

fn name(text: &str) -> Result<String, EndpointError> {
    Endpoint::new(None, text).map(|_| text.to_owned())
}

fn domain(text: &str) -> Result<String, EndpointError> {
    if !text.is_empty() {
        Endpoint::new(Some(text), NAME_DEFAULT)?;
    }
    Ok(text.to_owned())
}
