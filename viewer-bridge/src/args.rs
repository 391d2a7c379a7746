//! The command line. Help texts are the doc comments here.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::Parser;
use sim_contract::{Endpoint, EndpointError, NAME_DEFAULT};
use viewer_bridge::{FoxgloveOptions, Recording};

/// Show a running simulation in a browser, and let it be touched.
///
/// Open the address that is printed: the particles of the node can be dragged, pinned, pushed and
/// cut there, its parameters changed, its pace watched. The node may come later, go, and come back.
/// With --replay, a recording is shown there instead, with a timeline to play and scrub.
#[derive(Debug, Parser)]
#[command(
    name = "viewer-bridge",
    version,
    after_help = "Ends cleanly with Ctrl-C or SIGTERM.\n\n\
        Exit codes: 0 done, 1 failed, 2 wrong option.\n\nExamples:\n  \
        viewer-bridge                               show the node `sim` at http://127.0.0.1:8080/\n  \
        viewer-bridge --listen 127.0.0.1:0          on any free port; the address is printed\n  \
        viewer-bridge --name left --domain lab      show another node\n  \
        viewer-bridge --replay run.mcap             show a recording; no node is needed\n  \
        viewer-bridge --listen 0.0.0.0:8080         for other machines; the address has a token\n  \
        viewer-bridge --foxglove                    also for Foxglove viewers, at ws://127.0.0.1:8765\n  \
        viewer-bridge --foxglove --allow-commands   they may also pause, step, reset and set"
)]
pub(crate) struct Args {
    /// Address and port to listen at; port 0 is any free one. Elsewhere than on loopback, pages need
    /// the token that is printed with the address. Nothing is encrypted
    #[arg(long, value_name = "ADDR:PORT", default_value = "127.0.0.1:8080")]
    pub(crate) listen: SocketAddr,
    /// Name by which browsers may call this host, beside its addresses and `localhost`; may be given
    /// more than once
    #[arg(long = "host", value_name = "HOST")]
    pub(crate) hosts: Vec<String>,
    /// Recording to show instead of a node, as `recorder record` and `recorder simulate` write it;
    /// one that was cut off is shown as far as it goes
    #[arg(long, value_name = "FILE.mcap", conflicts_with = "name")]
    pub(crate) replay: Option<PathBuf>,
    /// Also serve viewers that speak the Foxglove protocol (foxglove.sdk.v1), at this address; port 0
    /// is any free one. Only on loopback: the protocol has no way to prove who connects
    #[arg(
        long,
        value_name = "ADDR:PORT",
        num_args = 0..=1,
        default_missing_value = "127.0.0.1:8765",
        value_parser = foxglove_address
    )]
    foxglove: Option<SocketAddr>,
    /// Origin of a web page that may connect to the Foxglove address, as in `https://viewer.example`;
    /// may be given more than once. Programs have none, and may
    #[arg(long = "foxglove-origin", value_name = "ORIGIN", requires = "foxglove")]
    foxglove_origins: Vec<String>,
    /// Let Foxglove clients change things: services (pause, resume, step, reset), parameters, and
    /// commands that they publish. Pages always may
    #[arg(long, requires = "foxglove")]
    allow_commands: bool,
    /// Name of the node: its services are NAME/particles, NAME/commands, ...
    #[arg(long, default_value = NAME_DEFAULT, value_name = "NAME", value_parser = Endpoint::parse_name)]
    name: String,
    /// Domain that keeps services apart from others on this host [env: CATENARY_DOMAIN]
    /// [default: that of iceoryx2]
    #[arg(long, value_name = "DOMAIN", value_parser = Endpoint::parse_domain)]
    domain: Option<String>,
    /// Folder to read the page's files from, for who works on them [default: those built in]
    #[arg(long, value_name = "DIR")]
    pub(crate) assets: Option<PathBuf>,
}

impl Args {
    pub(crate) fn endpoint(&self) -> Result<Endpoint, EndpointError> {
        Endpoint::from_options(self.domain.as_deref(), Some(&self.name))
    }

    /// What the Foxglove server is told, where there is to be one.
    pub(crate) fn foxglove(&self, recording: Option<Recording>) -> Option<FoxgloveOptions> {
        self.foxglove.map(|listen| FoxgloveOptions {
            listen,
            origins: self.foxglove_origins.clone(),
            takes_commands: self.allow_commands,
            recording,
        })
    }
}

fn foxglove_address(text: &str) -> Result<SocketAddr, String> {
    let address = text.parse().map_err(|_| "an address and a port, as in 127.0.0.1:8765")?;
    FoxgloveOptions::check_address(address).map_err(|error| error.to_string())?;
    Ok(address)
}
