//! `ctl watch`: the state of the node, line by line.

use std::time::Duration;

use anyhow::{Context, bail};
use sim_contract::{AttachError, CONSOLE_CLIENT_ID, Client, Endpoint, MemberChanges, NodeStatus};
use sim_host::clock::{monotonic_ns, sleep_until};
use sim_host::{Stop, console};

use crate::args::{CtlArgs, WatchArgs};
use crate::ctl::status::StatusRow;
use crate::output;

/// Longest sleep between two looks at the node and at requests to stop.
const SLICE: Duration = Duration::from_millis(250);
/// Number of attempts to attach that fail for one reason before it is printed. A node that is just starting
/// is out of reach for a moment.
const FAILURES_MAX: u32 = 8;

/// Prints a line per period, until a signal, the last line, or the reader's end.
pub(super) fn watch(args: &CtlArgs, options: &WatchArgs) -> anyhow::Result<()> {
    let endpoint = args.endpoint.endpoint()?;
    let stop = Stop::install()?;
    let mut client = Client::attach_as(&endpoint, CONSOLE_CLIENT_ID)?;
    let Some(status) = first_status(&mut client, &stop, args.timeout())? else {
        if stop.is_requested() {
            return Ok(());
        }
        bail!("the node published no status within {:?}; is it stopped?", args.timeout());
    };
    let printer = Printer {
        as_json: args.json,
        left: options.count,
        run_id: status.run_id,
        member_change_count: status.member_changes.count,
    };
    let mut watch = Watch { endpoint, stop, period: options.period, printer };
    watch.printer.print_header()?;
    let mut attached = Some((client, status));
    while let Some((client, status)) = attached {
        if watch.follow(client, &status)? == Flow::End {
            break;
        }
        attached = watch.wait_for_node();
    }
    Ok(())
}

/// Continuation after a line or a wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Flow {
    /// Goes on.
    Continue,
    /// The node is gone.
    Gone,
    /// The program ends.
    End,
}

struct Watch {
    endpoint: Endpoint,
    stop: Stop,
    period: Duration,
    printer: Printer,
}

impl Watch {
    /// Prints a line per period while the node lives. Never returns [`Flow::Continue`].
    fn follow(&mut self, mut client: Client, first: &NodeStatus) -> anyhow::Result<Flow> {
        let mut flow = self.printer.print(first)?;
        let mut due_ns = monotonic_ns();
        let mut is_silent = false;
        while flow == Flow::Continue {
            // After a suspension, there is one line, not one for each missed period.
            due_ns = (due_ns + nanoseconds(self.period)).max(monotonic_ns());
            flow = self.sleep(due_ns, || client.is_owner_alive());
            if flow != Flow::Continue {
                break;
            }
            let status = client.status(SLICE)?;
            flow = match &status {
                Some(status) => self.printer.print(status)?,
                None if client.is_owner_alive() => Flow::Continue,
                None => Flow::Gone,
            };
            if status.is_none() && flow == Flow::Continue && !is_silent {
                output::note(&format!(
                    "note: {} has published no status (is it stopped, or busy with a long step?)",
                    self.endpoint
                ));
            }
            is_silent = status.is_none();
        }
        if flow == Flow::Gone {
            let end = if client.was_owner_killed() { "was killed" } else { "has ended" };
            output::note(&format!("note: {} {end}; waiting for the next node", self.endpoint));
        }
        Ok(flow)
    }

    /// Waits for a node that answers; `None` on a request to stop. It attaches anew, so that it finds a
    /// node that has created new services after a cleaner of `/tmp`, and keeps none of another version.
    fn wait_for_node(&self) -> Option<(Client, NodeStatus)> {
        let mut failures = Failures::default();
        while self.sleep(monotonic_ns() + nanoseconds(SLICE), || true) == Flow::Continue {
            match self.attach() {
                Ok(Some(found)) => return Some(found),
                Ok(None) => failures = Failures::default(),
                Err(error) => failures.add(error.to_string()),
            }
        }
        None
    }

    /// Attaches to the node; `None` if there is none, or if it does not answer.
    fn attach(&self) -> anyhow::Result<Option<(Client, NodeStatus)>> {
        let mut client = match Client::attach_as(&self.endpoint, CONSOLE_CLIENT_ID) {
            Err(AttachError::NoNode { .. }) => return Ok(None),
            client => client?,
        };
        let status = client.status(SLICE)?;
        Ok(status.map(|status| (client, status)))
    }

    /// Sleeps until a time while the node lives, in slices.
    fn sleep(&self, end_ns: u64, is_alive: impl Fn() -> bool) -> Flow {
        loop {
            let now_ns = monotonic_ns();
            if self.stop.is_requested() || console::is_reader_gone() {
                return Flow::End;
            }
            if now_ns >= end_ns {
                return Flow::Continue;
            }
            sleep_until(end_ns.min(now_ns + nanoseconds(SLICE)));
            if !is_alive() {
                return Flow::Gone;
            }
        }
    }
}

/// Waits for the first status of a node; `None` after the timeout, or on a request to stop.
fn first_status(
    client: &mut Client,
    stop: &Stop,
    timeout: Duration,
) -> anyhow::Result<Option<NodeStatus>> {
    let end_ns = monotonic_ns().saturating_add(nanoseconds(timeout));
    loop {
        let left = Duration::from_nanos(end_ns.saturating_sub(monotonic_ns()));
        let status = client.status(left.min(SLICE))?;
        if status.is_some() || left.is_zero() || stop.is_requested() {
            return Ok(status);
        }
    }
}

fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}

/// Attempts to attach that fail in a row for the same reason.
#[derive(Debug, Default)]
struct Failures {
    text: String,
    count: u32,
}

impl Failures {
    /// Prints the reason once it has lasted.
    fn add(&mut self, text: String) {
        if text != self.text {
            *self = Self { text, count: 0 };
        }
        self.count = self.count.saturating_add(1);
        if self.count == FAILURES_MAX {
            output::note(&format!("warning: {}", self.text));
        }
    }
}

/// Titles of the columns with their widths. Words are on the left, numbers on the right.
const COLUMNS: [(&str, usize); 10] = [
    ("step", 10),
    ("state", 14),
    ("rate", 9),
    ("real time", 9),
    ("step time", 10),
    ("99%", 10),
    ("late", 6),
    ("torn", 6),
    ("readers", 7),
    ("scene", 0),
];
/// Columns of words.
const WORDS: [&str; 2] = ["state", "scene"];

/// Prints lines until there are enough, or the reader has gone.
#[derive(Debug)]
struct Printer {
    as_json: bool,
    /// Number of lines that are left to print; `None` without a limit.
    left: Option<u64>,
    /// Run of the last line.
    run_id: u64,
    /// Number of changes of the lockstep in this run that are printed, or precede the first line.
    member_change_count: u64,
}

impl Printer {
    fn print_header(&self) -> anyhow::Result<()> {
        if self.as_json {
            return Ok(());
        }
        output::line(&aligned(&COLUMNS.map(|(title, _)| title.to_owned())))
    }

    fn print(&mut self, status: &NodeStatus) -> anyhow::Result<Flow> {
        let row = StatusRow::new(status);
        if status.run_id != self.run_id {
            (self.run_id, self.member_change_count) = (status.run_id, 0);
            output::note(&format!("note: a new run: {}, process {}", row.run_id, row.process_id));
        }
        self.note_member_changes(&status.member_changes);
        let line = if self.as_json {
            serde_json::to_string(&row).context("encoding the status")?
        } else {
            aligned(&cells(&row))
        };
        let is_read = output::part(&line)?;
        self.left = self.left.map(|left| left - 1);
        Ok(if is_read && self.left != Some(0) { Flow::Continue } else { Flow::End })
    }

    /// Prints who joined the lockstep, left it, or was dropped since the line before.
    fn note_member_changes(&mut self, changes: &MemberChanges) {
        let missing_count = changes.oldest().saturating_sub(self.member_change_count);
        if missing_count > 0 {
            output::note(&format!("note: {missing_count} more changes of the lockstep"));
        }
        for change in changes.iter_from(self.member_change_count) {
            output::note(&format!("note: step {}: {change}", change.step));
        }
        self.member_change_count = changes.count;
    }
}

fn cells(row: &StatusRow) -> [String; COLUMNS.len()] {
    let micros = |ns: u64| format!("{:.1} µs", ns as f64 / 1000.0);
    [
        row.step.to_string(),
        row.state().to_owned(),
        format!("{} Hz", row.rate_hz),
        row.real_time().unwrap_or_else(|| "-".to_owned()),
        micros(row.solve_ns_p50),
        micros(row.solve_ns_p99),
        row.late_steps.to_string(),
        row.torn_constraints.to_string(),
        row.readers.to_string(),
        row.scene.clone(),
    ]
}

/// Returns a line of aligned cells. A cell that is too wide moves those behind it.
fn aligned(cells: &[String; COLUMNS.len()]) -> String {
    let padded = cells.iter().zip(COLUMNS).map(|(cell, (title, width))| {
        if WORDS.contains(&title) { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
    });
    padded.collect::<Vec<_>>().join("  ").trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_columns_of_a_line_stand_under_their_titles() {
        let mut status = NodeStatus { step: 123_456, rate_hz: 240, ..NodeStatus::default() };
        (status.solve_ns_p50, status.solve_ns_p99) = (12_345, 99_999);
        (status.real_time_factor, status.torn_count, status.reader_count) = (0.9996, 3, 2);
        status.set_scene_name("curtain");
        let line = aligned(&cells(&StatusRow::new(&status)));
        let header = aligned(&COLUMNS.map(|(title, _)| title.to_owned()));
        let expected = [
            "      step  state                rate  real time   step time         99%    late    torn  readers  scene",
            "    123456  running            240 Hz     x1.000     12.3 µs    100.0 µs       0       3        2  curtain",
        ];
        assert_eq!([header.as_str(), line.as_str()], expected);
    }
}
