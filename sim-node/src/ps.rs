//! `ps`: the nodes of a domain.

use std::time::Duration;

use serde::Serialize;
use sim_contract::{Domain, ListedNode, NodeAnswer, NodeStatus};

use crate::args::PsArgs;
use crate::ctl::status::{MemberRow, StatusRow};
use crate::output;
use crate::output::{Align, Table};

/// A node in JSON. A node that does not answer has none of the fields of its status.
#[derive(Serialize)]
struct NodeRow {
    name: String,
    state: &'static str,
    process_id: Option<u32>,
    contract_version: Option<u32>,
    scene: Option<String>,
    run_id: Option<String>,
    step: Option<u64>,
    paused: Option<bool>,
    replay: Option<bool>,
    rate_hz: Option<u32>,
    real_time_factor: Option<f64>,
    late_steps: Option<u64>,
    readers: Option<u32>,
    lockstep: Option<Vec<MemberRow>>,
    problem: Option<String>,
}

/// Lists the nodes.
pub(crate) fn ps(args: &PsArgs) -> anyhow::Result<()> {
    let endpoint = args.domain.endpoint()?;
    let nodes = Domain::new(&endpoint)?.nodes(args.timeout)?;
    if nodes.is_empty() {
        let domain = endpoint
            .domain()
            .map_or("the default domain".to_owned(), |domain| format!("domain '{domain}'"));
        output::note(&format!("no node runs in {domain}"));
    }
    let rows: Vec<_> = nodes.into_iter().map(|node| NodeRow::new(node, args.timeout)).collect();
    for row in &rows {
        if let Some(problem) = &row.problem {
            output::note(&format!("note: '{}': {problem}", row.name));
        }
    }
    if args.json {
        return output::json(&rows);
    }
    if rows.is_empty() { Ok(()) } else { output::text(&table(&rows)) }
}

impl NodeRow {
    fn new(node: ListedNode, timeout: Duration) -> Self {
        let ListedNode { name, process_id, answer } = node;
        let row = Self::unanswered(name, process_id);
        match answer {
            NodeAnswer::Status(status) => row.with_status(&status),
            NodeAnswer::Silent => Self {
                state: "silent",
                problem: Some(format!(
                    "it has not answered within {timeout:?} (is it stopped, or busy with a long step?)"
                )),
                ..row
            },
            NodeAnswer::OtherVersion { actual, expected } => Self {
                state: "other_version",
                contract_version: actual.parse().ok(),
                problem: Some(format!(
                    "it has contract version {actual}, but this program has {expected}: use the \
                     programs that were built with it"
                )),
                ..row
            },
            NodeAnswer::Unreachable(problem) => Self { problem: Some(problem), ..row },
            _ => row,
        }
    }

    fn unanswered(name: String, process_id: Option<u32>) -> Self {
        Self {
            name,
            state: "unreachable",
            process_id,
            contract_version: None,
            scene: None,
            run_id: None,
            step: None,
            paused: None,
            replay: None,
            rate_hz: None,
            real_time_factor: None,
            late_steps: None,
            readers: None,
            lockstep: None,
            problem: None,
        }
    }

    fn with_status(self, status: &NodeStatus) -> Self {
        let row = StatusRow::new(status);
        Self {
            state: if row.paused { "paused" } else { "running" },
            contract_version: Some(status.contract_version),
            scene: Some(row.scene),
            run_id: Some(row.run_id),
            step: Some(row.step),
            paused: Some(row.paused),
            replay: Some(row.replay),
            rate_hz: Some(row.rate_hz),
            real_time_factor: row.real_time_factor,
            late_steps: Some(row.late_steps),
            readers: Some(row.readers),
            lockstep: Some(row.lockstep),
            ..self
        }
    }

    /// Cells for people. A cell without a value is a dash.
    fn cells(&self) -> [String; 10] {
        let dash = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
        let state = match (self.state, self.replay) {
            ("paused", Some(true)) => "replay, paused".to_owned(),
            ("running", Some(true)) => "replay".to_owned(),
            (state, _) => state.replace('_', " "),
        };
        [
            self.name.clone(),
            dash(self.process_id.map(|id| id.to_string())),
            state,
            dash(self.step.map(|step| step.to_string())),
            dash(self.rate_hz.map(|rate| format!("{rate} Hz"))),
            dash(self.real_time_factor.map(|factor| format!("x{factor:.3}"))),
            dash(self.late_steps.map(|count| count.to_string())),
            dash(self.readers.map(|count| count.to_string())),
            dash(self.lockstep.as_ref().map(|members| members.len().to_string())),
            dash(self.scene.clone()),
        ]
    }
}

fn table(rows: &[NodeRow]) -> String {
    let mut table = Table::new([
        ("name", Align::Left),
        ("process", Align::Right),
        ("state", Align::Left),
        ("step", Align::Right),
        ("rate", Align::Right),
        ("real time", Align::Right),
        ("late", Align::Right),
        ("readers", Align::Right),
        ("lockstep", Align::Right),
        ("scene", Align::Left),
    ]);
    for row in rows {
        table.add(row.cells());
    }
    table.text()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim_contract::StatusFlags;

    fn row(answer: NodeAnswer) -> NodeRow {
        let node = ListedNode { name: "left".to_owned(), process_id: Some(7), answer };
        NodeRow::new(node, Duration::from_secs(1))
    }

    #[test]
    fn replays_and_nodes_that_do_not_answer_are_told_apart() {
        let status = |flags| {
            let status = NodeStatus { flags, step: 12, rate_hz: 240, ..NodeStatus::default() };
            row(NodeAnswer::Status(Box::new(status)))
        };
        let replay = StatusFlags::REPLAY;
        let version = NodeAnswer::OtherVersion { actual: "3".to_owned(), expected: 4 };
        let unreachable = NodeAnswer::Unreachable("no place".to_owned());
        for (row, state, step, text) in [
            (status(0), "running", "12", None),
            (status(StatusFlags::PAUSED), "paused", "12", None),
            (status(replay), "replay", "12", None),
            (status(replay | StatusFlags::PAUSED), "replay, paused", "12", None),
            (row(NodeAnswer::Silent), "silent", "-", Some("within 1s")),
            (row(version), "other version", "-", Some("version 3, but this program has 4")),
            (row(unreachable), "unreachable", "-", Some("no place")),
        ] {
            let cells = row.cells();
            assert_eq!([&cells[1], &cells[2], &cells[3]], ["7", state, step]);
            let problem = row.problem.unwrap_or_default();
            assert!(problem.contains(text.unwrap_or_default()), "{problem}");
            assert_eq!(problem.is_empty(), text.is_none());
        }
    }
}
