//! The command line. The doc comments are the help texts.

use std::ffi::OsString;
use std::net::{IpAddr, SocketAddr};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, Parser};
use sim_cli::DocumentVerb;
use sim_contract::{Endpoint, EndpointError, NAME_DEFAULT};
use viewer_bridge::source::replay::{GhostChoice, InitialPlayback};
use viewer_bridge::{FoxgloveOptions, FoxglovePermission, RecordingTimes, TokenDemand};

/// Show a running simulation in a browser, and interact with it there.
///
/// Open the printed address to drag, pin, push and cut the particles of a node, to change its
/// parameters and to watch its timing. The node may start later, end, and start again.
/// With --replay, the page shows a recording with a timeline instead.
#[derive(Debug, Parser)]
#[command(
    name = "viewer-bridge",
    version,
    args_conflicts_with_subcommands = true,
    after_help = "Stop it with Ctrl-C, SIGTERM or SIGHUP.\n\n\
        Limits: 16 pages and 16 Foxglove clients at a time. Other connections make \
        room for newcomers.\n\n\
        Exit codes: 0 success, 1 failure, 2 usage error.\n\nExamples:\n  \
        viewer-bridge                               show the node `sim` at http://127.0.0.1:8080/\n  \
        viewer-bridge --listen 127.0.0.1:0          use any free port; the address is printed\n  \
        viewer-bridge --name left --domain lab      show another node\n  \
        viewer-bridge --replay run.mcap             show a recording; needs no node\n  \
        viewer-bridge --replay recordings           show the newest recording of a folder\n  \
        viewer-bridge --replay a.mcap --ghost b.mcap   compare two recordings of a scene\n  \
        viewer-bridge --listen 0.0.0.0:8080         serve other machines; the address has a token\n  \
        viewer-bridge --token                       keep other users of this machine out\n  \
        viewer-bridge --recordings runs             pages record into this folder\n  \
        viewer-bridge --foxglove                    also serve Foxglove viewers at ws://127.0.0.1:8765\n  \
        viewer-bridge --foxglove --allow-commands   let them pause, step, reset and set as well\n  \
        viewer-bridge --foxglove --replay run.mcap --play   show them a recording, again and again"
)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) document: Option<DocumentVerb>,
    /// Address and port to listen on; port 0 is any free port. Beyond loopback, pages need the token
    /// in the printed address. The connection is not encrypted
    #[arg(
        long,
        value_name = "ADDR:PORT",
        default_value = "127.0.0.1:8080",
        value_parser = page_address
    )]
    pub(crate) listen: SocketAddr,
    /// Name by which browsers reach this host, besides its addresses and `localhost`; can be
    /// repeated
    #[arg(long = "host", value_name = "HOST", value_parser = host_name)]
    pub(crate) hosts: Vec<String>,
    /// Require the token in the printed address on loopback too, so that other users of this machine
    /// cannot command the node
    #[arg(long)]
    token: bool,
    /// Recording to show instead of a node, written by `recorder record` or `recorder simulate`; an
    /// incomplete file is shown as far as it goes. For a folder, the newest recording is shown, and pages can open the others
    #[arg(long, value_name = "FILE.mcap or DIR", conflicts_with_all = ["name", "domain"])]
    pub(crate) replay: Option<PathBuf>,
    /// Play the recording at once, again and again, for viewers that cannot control the playback. Pages
    /// can pause it and turn the repetition off [default: paused at its first step]
    #[arg(long, requires = "replay")]
    play: bool,
    /// Recording to show as a ghost in the one of --replay, at the same steps. Both must have the same particles
    /// and constraints. The page says at which step they differ first
    #[arg(long, value_name = "FILE.mcap", requires = "replay")]
    ghost: Option<PathBuf>,
    /// Also serve viewers that speak the Foxglove protocol (foxglove.sdk.v1) at this address; port 0
    /// is any free port. Loopback only: the protocol cannot authenticate clients
    #[arg(
        long,
        value_name = "ADDR:PORT",
        num_args = 0..=1,
        default_missing_value = "127.0.0.1:8765",
        value_parser = foxglove_address
    )]
    foxglove: Option<SocketAddr>,
    /// Origin of a web page that may connect to the Foxglove address, as in `https://viewer.example`;
    /// can be repeated. Programs send no origin and may always connect
    #[arg(long = "foxglove-origin", value_name = "ORIGIN", requires = "foxglove")]
    foxglove_origins: Vec<String>,
    /// Let Foxglove clients call services (pause, resume, step, reset), set parameters and publish
    /// commands. Pages always may
    #[arg(long, requires = "foxglove")]
    allow_commands: bool,
    /// Scene file that pages can load beside the built-in scenes; can be repeated. The node reads it by its
    /// absolute path
    #[arg(long = "scene", value_name = "FILE.toml", conflicts_with = "replay")]
    pub(crate) scenes: Vec<PathBuf>,
    /// Folder for the recordings that pages start; it is created with the first one. Beyond loopback, pages
    /// cannot record without this option [default: recordings, in the working directory]
    #[arg(long, value_name = "DIR", conflicts_with = "replay")]
    recordings: Option<PathBuf>,
    /// Name of the node: its services are NAME/particles, NAME/commands, ...
    #[arg(long, default_value = NAME_DEFAULT, value_name = "NAME", value_parser = Endpoint::parse_name)]
    name: String,
    /// Domain that separates these services from others on this host [env: CATENARY_DOMAIN]
    /// [default: iceoryx2's own domain]
    #[arg(long, value_name = "DOMAIN", value_parser = Endpoint::parse_domain)]
    domain: Option<String>,
    /// Folder with the files of the page, for development [default: the built-in files]
    #[arg(long, value_name = "DIR")]
    pub(crate) assets: Option<PathBuf>,
}

/// Folder of the recordings without `--recordings`.
const RECORDINGS_DEFAULT: &str = "recordings";

/// The recordings that pages can start.
#[derive(Debug)]
pub(crate) struct RecordingPlan {
    pub(crate) endpoint: Endpoint,
    pub(crate) folder: RecordingFolder,
}

/// The folder for recordings.
#[derive(Debug)]
pub(crate) struct RecordingFolder {
    path: PathBuf,
    /// It was chosen on the command line.
    is_given: bool,
}

impl RecordingFolder {
    /// Returns the folder that pages may record into. Other machines write files only where somebody has
    /// chosen the place.
    pub(crate) fn folder(self, is_local: bool) -> Option<PathBuf> {
        (is_local || self.is_given).then_some(self.path)
    }
}

/// Reads the command line.
pub(crate) fn parse(
    words: impl IntoIterator<Item = impl Into<OsString>>,
) -> Result<Args, clap::Error> {
    let words: Vec<OsString> = words.into_iter().map(Into::into).collect();
    Args::try_parse_from(&words)
        .map_err(|error| with_replay(sim_cli::explain(error, &Args::command(), &words)))
}

/// Adds to the error of a stray recording that it is shown by `--replay`.
fn with_replay(mut error: clap::Error) -> clap::Error {
    let word = error.get(ContextKind::InvalidArg).or(error.get(ContextKind::InvalidSubcommand));
    let word = word.map(ToString::to_string).unwrap_or_default();
    if Path::new(&word).extension().is_some_and(|extension| extension == "mcap") {
        let tip = StyledStr::from(format!("to show a recording, use --replay {word}"));
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip]));
    }
    error
}

impl Args {
    pub(crate) fn endpoint(&self) -> Result<Endpoint, EndpointError> {
        Endpoint::from_options(self.domain.as_deref(), Some(&self.name))
    }

    /// The servers whose pages need a token.
    pub(crate) fn token_demand(&self) -> TokenDemand {
        if self.token { TokenDemand::Always } else { TokenDemand::BeyondLoopback }
    }

    /// The recordings that pages can start. A replay has none.
    ///
    /// # Errors
    /// The endpoint is not valid, or the working directory is gone.
    pub(crate) fn recording_plan(&self) -> anyhow::Result<Option<RecordingPlan>> {
        if self.replay.is_some() {
            return Ok(None);
        }
        let is_given = self.recordings.is_some();
        let folder = self.recordings.as_deref().unwrap_or(Path::new(RECORDINGS_DEFAULT));
        let path = std::path::absolute(folder).context("finding the folder of the recordings")?;
        let folder = RecordingFolder { path, is_given };
        Ok(Some(RecordingPlan { endpoint: self.endpoint()?, folder }))
    }

    /// Playback of the recording before the first request.
    pub(crate) fn start(&self) -> InitialPlayback {
        if self.play { InitialPlayback::Looping } else { InitialPlayback::Paused }
    }

    /// The recordings that can be the ghost of the one on show.
    ///
    /// # Errors
    /// The recording of the command line does not exist.
    pub(crate) fn ghosts(&self) -> anyhow::Result<GhostChoice> {
        if let Some(path) = self.ghost.as_deref().filter(|path| !path.is_file()) {
            bail!(
                "{}: no such file; give --ghost a file written by `recorder record` or `recorder simulate`",
                path.display()
            );
        }
        let folder = self.replay.clone().filter(|path| path.is_dir());
        Ok(GhostChoice { folder, given: self.ghost.clone() })
    }

    /// Options of the Foxglove server, if one is requested.
    pub(crate) fn foxglove(&self, recording: Option<RecordingTimes>) -> Option<FoxgloveOptions> {
        self.foxglove.map(|listen| FoxgloveOptions {
            listen,
            origins: self.foxglove_origins.clone(),
            permission: if self.allow_commands {
                FoxglovePermission::Commands
            } else {
                FoxglovePermission::ReadOnly
            },
            recording,
        })
    }
}

fn page_address(text: &str) -> Result<SocketAddr, String> {
    address(text, "127.0.0.1:8080")
}

fn foxglove_address(text: &str) -> Result<SocketAddr, String> {
    let address = address(text, "127.0.0.1:8765")?;
    FoxgloveOptions::check_address(address).map_err(|error| error.to_string())?;
    Ok(address)
}

fn address(text: &str, example: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| format!("it must be an address with a port, such as {example}"))
}

/// Accepts the host part of an address as browsers send it, without a scheme and a port.
fn host_name(text: &str) -> Result<String, String> {
    if text.trim_matches(['[', ']']).parse::<IpAddr>().is_ok() {
        return Err("addresses need no --host; to serve other machines at this one, use \
                    --listen ADDR:PORT"
            .to_owned());
    }
    let is_allowed = |letter: char| letter.is_ascii_alphanumeric() || "-._".contains(letter);
    if text.is_empty() || !text.chars().all(is_allowed) {
        return Err(
            "it must be a name of letters, digits, '-' and '.', as in lab.example; the port \
                    is that of --listen"
                .to_owned(),
        );
    }
    Ok(text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(args: &[&str]) -> String {
        let args = ["viewer-bridge"].iter().chain(args);
        parse(args).unwrap_err().to_string()
    }

    #[test]
    fn a_recording_has_no_node() {
        for option in ["--name", "--domain"] {
            let error = error(&["--replay", "run.mcap", option, "lab"]);
            assert!(error.contains("cannot be used with") && error.contains(option), "{error}");
        }
    }

    #[test]
    fn unknown_options_and_stray_arguments_are_refused_with_a_remedy() {
        for (argument, problem) in [
            ("--bogus", "unexpected argument '--bogus' found"),
            (
                "--lisen",
                "unexpected argument '--lisen' found\n\n  tip: a similar argument exists: '--listen'",
            ),
            ("curtain", "unrecognized subcommand 'curtain'"),
            (
                "completion",
                "unrecognized subcommand 'completion'\n\n  tip: a similar subcommand exists: 'completions'",
            ),
            (
                "run.mcap",
                "unrecognized subcommand 'run.mcap'\n\n  tip: to show a recording, use --replay run.mcap",
            ),
        ] {
            let error = error(&[argument]);
            assert!(error.starts_with(&format!("error: {problem}\n")), "{error}");
            assert!(error.contains("--help") && !error.contains("-- "), "{error}");
        }
    }

    #[test]
    fn an_address_has_a_port() {
        for (option, example) in [("--listen", "127.0.0.1:8080"), ("--foxglove", "127.0.0.1:8765")]
        {
            for address in ["8080", "foo", "127.0.0.1", "127.0.0.1:99999", "localhost:8080"] {
                let error = error(&[option, address]);
                let expected = format!("it must be an address with a port, such as {example}\n");
                assert!(error.contains(&expected), "{error}");
            }
        }
    }

    #[test]
    fn a_host_is_a_name_without_a_port() {
        let args = ["viewer-bridge", "--host", "lab.example", "--host", "my_host-1"];
        let args = Args::try_parse_from(args).unwrap();
        assert_eq!(args.hosts, ["lab.example", "my_host-1"]);
        for host in ["lab:8080", "http://lab", "lab/", "", "lab example"] {
            let error = error(&["--host", host]);
            assert!(error.contains("the port is that of --listen"), "{error}");
        }
        for host in ["10.0.0.7", "[::1]", "::1"] {
            let error = error(&["--host", host]);
            assert!(error.contains("--listen ADDR:PORT"), "{error}");
        }
    }
}
