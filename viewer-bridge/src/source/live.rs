//! A live node as a source. It searches for a node, shows it, and searches again when it is gone.

mod actions;
mod carrier;
mod dispatch;
mod link;
mod newest_state;
mod outcomes;
mod status;
#[cfg(test)]
mod tests;
mod undo;

use std::sync::Arc;
use std::time::Duration;

use sim_contract::{AttachError, Endpoint};
use sim_host::clock::monotonic_ns;
use sim_host::console::note;

use super::Source;
use crate::message::{Mode, Node, NodeState, OutcomeText, ParametersText, Refusal};
use crate::request::{RequestKind, Requests};
use crate::scene::catalog::{Catalog, SceneEntry};
use crate::sink::{Sinks, Update};
use crate::source::shown_state::ShownState;
use link::{Link, LinkEnd};
use undo::Undo;

/// Time between two searches for a node.
const SEARCH_PERIOD: Duration = Duration::from_millis(300);
/// Time between two checks for the end of the program during a search.
const SHUTDOWN_CHECK_PERIOD: Duration = Duration::from_millis(50);

/// A live node, or another owner of its services.
#[derive(Debug)]
pub struct Live {
    endpoint: Endpoint,
    catalog: Arc<Catalog>,
    shown: ShownState,
    /// The state of the node that was published last.
    node: Node,
    /// Changes that pages can undo, kept between two links.
    undo: Undo,
}

impl Live {
    /// Shows the node at this endpoint, which pages can let load the scenes of the catalog.
    pub fn new(endpoint: Endpoint, catalog: Catalog) -> Self {
        let catalog = Arc::new(catalog);
        Self {
            endpoint,
            catalog,
            shown: ShownState::default(),
            node: Node::default(),
            undo: Undo::default(),
        }
    }

    /// Waits for a node. Returns `None` if the program ends first.
    fn search(&mut self, sinks: &Sinks, requests: &Requests) -> Option<Link> {
        while !sinks.is_shutting_down() {
            match Link::attach(&self.endpoint, &self.catalog) {
                Ok(link) => return Some(link),
                Err(error) => self.publish_absence(sinks, &error),
            }
            refuse_requests(sinks, requests);
        }
        None
    }

    fn publish_absence(&mut self, sinks: &Sinks, error: &AttachError) {
        let state = match self.node.state {
            NodeState::None => NodeState::None,
            NodeState::Alive | NodeState::Lost => NodeState::Lost,
        };
        let text = error.to_string();
        if text != self.node.text {
            match (error, state) {
                // The user may wait for a picture. A node that ends later is no problem of the bridge.
                (AttachError::NoNode { .. }, NodeState::None) => note(&format!("waiting: {text}")),
                (AttachError::NoNode { .. }, _) => {}
                _ => note(&format!("warning: {text}")),
            }
        }
        self.publish_node(sinks, Node { state, text, ..Node::default() });
    }

    fn publish_node(&mut self, sinks: &Sinks, node: Node) {
        if node != self.node {
            sinks.publish(&Update::Node(&node));
            self.node = node;
        }
    }

    /// Shows the node until the link ends.
    fn show(&mut self, link: &mut Link, sinks: &Sinks, requests: &Requests) -> LinkEnd {
        loop {
            match link.exchange(&mut self.shown, sinks, requests) {
                Ok(()) => self.publish_node(sinks, link.node()),
                Err(end) => return end,
            }
        }
    }
}

impl Source for Live {
    fn mode(&self) -> Mode {
        Mode::Live
    }

    fn scenes(&self) -> Vec<SceneEntry> {
        self.catalog.entries().to_vec()
    }

    fn run(&mut self, sinks: &Sinks, requests: &Requests) -> anyhow::Result<()> {
        sinks.publish(&Update::Node(&self.node));
        sinks.publish(&Update::Parameters(&ParametersText::UNKNOWN));
        while let Some(mut link) = self.search(sinks, requests) {
            link.undo = std::mem::take(&mut self.undo);
            let end = self.show(&mut link, sinks, requests);
            self.undo = link.close(sinks, end);
            match end {
                LinkEnd::ShuttingDown => break,
                // The search finds the new run at once.
                LinkEnd::NewRun => {}
                LinkEnd::Lost => {
                    let text = "the node has ended".to_owned();
                    self.publish_node(
                        sinks,
                        Node { state: NodeState::Lost, text, ..Node::default() },
                    );
                }
            }
        }
        Ok(())
    }
}

/// Refuses commands until the next search.
fn refuse_requests(sinks: &Sinks, requests: &Requests) {
    let end_ns = monotonic_ns() + u64::try_from(SEARCH_PERIOD.as_nanos()).unwrap_or(u64::MAX);
    while monotonic_ns() < end_ns && !sinks.is_shutting_down() {
        let Some(request) = requests.next(SHUTDOWN_CHECK_PERIOD) else { continue };
        match request.kind {
            RequestKind::State => sinks.publish(&Update::SameState),
            RequestKind::Command(command) => {
                let kind = command.kind.name();
                let outcome = OutcomeText::refused(command.id, kind, Refusal::NoNode);
                sinks.publish(&Update::Answer { client: request.client, outcome: &outcome });
            }
            RequestKind::Credit | RequestKind::Left => {}
        }
    }
}
