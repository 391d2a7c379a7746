//! The side of a client process of `bench`: it measures until its standard input closes, and then prints
//! its samples. So it also ends when `bench` is killed.

use std::io::{Read, stdin};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use anyhow::Context;
use serde::{Deserialize, Serialize};
use sim_contract::{Action, Client, RequestError, Snapshot};
use sim_host::clock::{SECOND_NS, monotonic_ns};
use sim_host::{console, report_bus_errors};

use super::times::{SampleList, Samples};
use crate::args::{BenchClientArgs, ClientRole};

/// Line that a client prints when it is connected.
pub(super) const READY: &str = "ready\n";
/// Longest wait before another look at the end of the measurement.
const WAIT: Duration = Duration::from_millis(100);
/// Longest wait for the lockstep, whose node is still starting.
const JOIN_TIMEOUT: Duration = Duration::from_secs(10);

/// Result of a client.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct ClientResult {
    pub(super) samples: SampleList,
    /// Snapshots that a reader did not receive.
    pub(super) missed_count: u64,
    /// Time from the first to the last sample.
    pub(super) elapsed_ns: u64,
}

/// Runs a client until its standard input closes.
pub(crate) fn run(args: &BenchClientArgs) -> anyhow::Result<()> {
    report_bus_errors()?;
    let mut client = Client::attach(&args.endpoint.endpoint()?)?;
    let end = watch_stdin()?;
    let mut measurement = Measurement { samples: Samples::new()?, missed_count: 0, end };
    let elapsed_ns = match args.role {
        ClientRole::Reader => measurement.read(&mut client, WAIT)?,
        ClientRole::PollingReader => measurement.read(&mut client, Duration::ZERO)?,
        ClientRole::Commander => measurement.command(&mut client)?,
        ClientRole::Member => measurement.take_part(&mut client)?,
    };
    let Measurement { samples, missed_count, .. } = measurement;
    let result = ClientResult { samples: samples.list(), missed_count, elapsed_ns };
    print(&serde_json::to_string(&result).context("encoding the samples")?)
}

/// Sets a flag once standard input has closed.
fn watch_stdin() -> anyhow::Result<Arc<AtomicBool>> {
    let end = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&end);
    let watch = move || {
        // Nothing is written to it, so a read returns at its end.
        let _ended = stdin().read(&mut [0]);
        flag.store(true, Ordering::Relaxed);
    };
    thread::Builder::new().spawn(watch).context("starting a thread")?;
    Ok(end)
}

fn print(line: &str) -> anyhow::Result<()> {
    console::write_result(line.as_bytes()).context("cannot write to stdout")
}

struct Measurement {
    samples: Samples,
    missed_count: u64,
    end: Arc<AtomicBool>,
}

impl Measurement {
    fn has_ended(&self) -> bool {
        self.end.load(Ordering::Relaxed)
    }

    /// Reads all snapshots. A sample is the time from the publication of one to its reception.
    fn read(&mut self, client: &mut Client, wait: Duration) -> anyhow::Result<u64> {
        // Connects to the service, and for a wait also to its event.
        let mut last: Option<Snapshot> =
            client.next_snapshot(wait.min(Duration::from_millis(1)))?;
        print(READY)?;
        while !self.has_ended() {
            let Some(snapshot) = client.next_snapshot(wait)? else { continue };
            let now_ns = monotonic_ns();
            let header = *snapshot.header();
            // The first one may have waited for this reader.
            if let Some(last) = last.replace(snapshot) {
                self.samples.record(now_ns.saturating_sub(header.publish_monotonic_ns));
                let step = header.snapshot_index.wrapping_sub(last.header().snapshot_index);
                self.missed_count += u64::from(step.wrapping_sub(1));
            }
        }
        Ok(0)
    }

    /// Sends commands. A sample is the time from the start of a request to its outcome.
    fn command(&mut self, client: &mut Client) -> anyhow::Result<u64> {
        // It is applied, and changes nothing.
        let action = Action::set("time_scale", 1.0);
        print(READY)?;
        // The first command waits for the start of the node.
        self.round_trip(client, action)?;
        while let Some(nanoseconds) = self.round_trip(client, action)? {
            self.samples.record(nanoseconds);
        }
        Ok(0)
    }

    /// Sends a command, and returns the time until its outcome. Returns `None` if the measurement ends before.
    fn round_trip(&self, client: &mut Client, action: Action) -> anyhow::Result<Option<u64>> {
        let start_ns = monotonic_ns();
        let sequence = client.send(action)?;
        while !self.has_ended() {
            match client.outcome(sequence, WAIT) {
                Ok(_) => return Ok(Some(monotonic_ns() - start_ns)),
                Err(RequestError::Timeout { .. }) => {}
                Err(error) => return Err(error.into()),
            }
        }
        Ok(None)
    }

    /// Takes part in the lockstep. A sample is the time from the end of a turn to the next turn.
    fn take_part(&mut self, client: &mut Client) -> anyhow::Result<u64> {
        print(READY)?;
        client.join_lockstep(JOIN_TIMEOUT)?;
        let (mut first_ns, mut last_ns) = (None, 0);
        while !self.has_ended() {
            if client.next_turn(WAIT)?.is_none() {
                continue;
            }
            let now_ns = monotonic_ns();
            if first_ns.is_some() {
                self.samples.record(now_ns - last_ns);
            }
            first_ns.get_or_insert(now_ns);
            last_ns = now_ns;
            client.ready()?;
        }
        Ok(last_ns - first_ns.unwrap_or(last_ns).min(last_ns))
    }
}

impl ClientResult {
    /// Samples per second.
    pub(super) fn rate(&self, count: u64) -> f64 {
        count as f64 / (self.elapsed_ns.max(1) as f64 / SECOND_NS as f64)
    }
}
