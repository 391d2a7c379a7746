//! The client processes of a measurement.

use std::io::{BufRead, BufReader};
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdout, Command, Stdio};

use anyhow::{Context, bail};
use clap::ValueEnum;
use sim_contract::ScratchDomain;

use super::client::{ClientResult, READY};
use crate::args::ClientRole;

/// This program, also if a new version has replaced its file meanwhile.
const THIS_PROGRAM: &str = "/proc/self/exe";

/// Client processes. Dropping them ends them.
#[derive(Debug)]
pub(super) struct Children(Vec<ClientProcess>);

#[derive(Debug)]
struct ClientProcess {
    child: Child,
    stdout: BufReader<ChildStdout>,
}

impl Children {
    /// Starts a process for each role, and waits until all are connected.
    pub(super) fn start(domain: &ScratchDomain, roles: &[ClientRole]) -> anyhow::Result<Self> {
        let mut children = Self(Vec::new());
        for role in roles {
            children.0.push(ClientProcess::start(domain, *role)?);
        }
        for process in &mut children.0 {
            let line = process.read_line()?;
            if line != READY {
                bail!("a client process has failed");
            }
        }
        Ok(children)
    }

    /// Ends the measurement of all processes, and returns their results.
    pub(super) fn finish(mut self) -> anyhow::Result<Vec<ClientResult>> {
        for process in &mut self.0 {
            drop(process.child.stdin.take());
        }
        let result = |process: &mut ClientProcess| {
            let line = process.read_line()?;
            process.child.wait().context("waiting for a client process")?;
            serde_json::from_str(&line).context("a client process has failed")
        };
        self.0.iter_mut().map(result).collect()
    }
}

impl ClientProcess {
    #[allow(
        clippy::disallowed_methods,
        reason = "`bench` starts this program again as its clients"
    )]
    fn start(domain: &ScratchDomain, role: ClientRole) -> anyhow::Result<Self> {
        let role = role.to_possible_value().context("a role has a name")?;
        let mut child = Command::new(THIS_PROGRAM)
            .args(["bench-client", role.get_name(), "--domain", domain.name()])
            // Ctrl-C reaches `bench` alone, which ends its clients in order.
            .process_group(0)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .context("starting a client process")?;
        let stdout = child.stdout.take().context("a client process has an output")?;
        Ok(Self { child, stdout: BufReader::new(stdout) })
    }

    fn read_line(&mut self) -> anyhow::Result<String> {
        let mut line = String::new();
        self.stdout.read_line(&mut line).context("reading from a client process")?;
        Ok(line)
    }
}

impl Drop for ClientProcess {
    fn drop(&mut self) {
        // Errors mean that it has already ended.
        let _ended = self.child.kill();
        let _ended = self.child.wait();
    }
}
