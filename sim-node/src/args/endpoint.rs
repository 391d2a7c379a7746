//! Options that select a node or a domain, and the subcommands that look at a whole domain.

use std::time::Duration;

use clap::Args as ClapArgs;
use sim_contract::{Endpoint, EndpointError};

use super::value::time;

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

#[derive(Debug, ClapArgs)]
#[command(
    after_help = "A replay (`recorder play`) owns a name like a node. A node that does not answer is listed as \
    silent:\nit is stopped, or computes a long step. Killed nodes are not listed.\n\n\
    Examples:\n  \
    sim-node ps\n  \
    sim-node ps --domain lab\n  \
    sim-node ps --json    list them for a program: a JSON array, [] without nodes"
)]
pub(crate) struct PsArgs {
    /// Wait at most this long for the answers
    #[arg(long, value_name = "TIME", default_value = "1s", value_parser = time)]
    pub(crate) timeout: Duration,
    /// Print a JSON array with one object for each node; its fields are named as in `ctl status`
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) domain: DomainArgs,
}

#[derive(Debug, ClapArgs)]
#[command(
    after_help = "Each finding is ok, a note or a problem; many have a cure. Notes do not change the exit code.\n\n\
    `--fix` removes files of killed processes of this user in this domain, and nothing else: files of\n\
    living processes, stopped ones included, stay.\n\n\
    Exit codes: 0 no problem, 1 a problem, or failure, 2 usage error.\n\n\
    Examples:\n  \
    sim-node doctor\n  \
    sim-node doctor my.toml --json    check whether this scene fits, for a program\n  \
    sim-node doctor --domain lab --fix\n  \
    mkdir -p config && sim-node doctor --domain lab --iox2-config > config/iceoryx2.toml\n  \
    iox2 service list                 list the services of the domain lab, from this folder"
)]
pub(crate) struct DoctorArgs {
    /// Scene whose memory is compared with the free memory: built-in scene, or TOML file
    #[arg(default_value = "curtain")]
    pub(crate) scene: String,
    /// Remove what killed processes have left in the domain, then check
    #[arg(long)]
    pub(crate) fix: bool,
    /// Print an iceoryx2.toml with which `iox2` and other programs see the domain, and check nothing
    #[arg(long, conflicts_with_all = ["fix", "json", "scene"])]
    pub(crate) iox2_config: bool,
    /// Print one JSON object with all findings
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) domain: DomainArgs,
}
