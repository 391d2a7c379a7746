//! A live node as a source: it looks for one, shows it, and looks again when it has gone.

mod actions;
mod brush;
mod dispatch;
mod link;
mod load;
mod news;
mod waiting;

use std::time::Duration;

use sim_contract::clock::monotonic_ns;
use sim_contract::{AttachError, Endpoint};

use crate::message::reason;
use crate::message::{Mode, Node, NodeState, OutcomeText, ParametersText, ToPage};
use crate::pages::hub::Hub;
use crate::pages::hub::Slot;
use crate::shown_state::Stage;
use crate::source::{Ask, Requests, Source};
use link::{Link, LinkEnd};

/// How often a node is looked for.
const SEARCH_PERIOD: Duration = Duration::from_millis(300);
/// How often the end of the server is looked for meanwhile.
const LOOK_PERIOD: Duration = Duration::from_millis(50);

/// A live node, or whatever else owns its name.
#[derive(Debug)]
pub struct Live {
    endpoint: Endpoint,
    stage: Stage,
    /// What pages were told last.
    node: Node,
}

impl Live {
    /// The node of that name.
    pub fn new(endpoint: Endpoint) -> Self {
        Self { endpoint, stage: Stage::default(), node: Node::default() }
    }

    /// Waits for a node; none if the server ends before.
    fn search(&mut self, hub: &Hub, requests: &Requests) -> Option<Link> {
        while !hub.is_closed() {
            match Link::attach(&self.endpoint) {
                Ok(link) => return Some(link),
                Err(error) => self.tell_absence(hub, &error),
            }
            refuse_for_a_while(hub, requests);
        }
        None
    }

    fn tell_absence(&mut self, hub: &Hub, error: &AttachError) {
        let state = match self.node.state {
            NodeState::None => NodeState::None,
            NodeState::Alive | NodeState::Lost => NodeState::Lost,
        };
        self.tell(hub, Node { state, text: error.to_string(), ..Node::default() });
    }

    fn tell(&mut self, hub: &Hub, node: Node) {
        if node != self.node {
            hub.latch(Slot::Node, &ToPage::Node(node.clone()));
            self.node = node;
        }
    }
}

impl Source for Live {
    fn mode(&self) -> Mode {
        Mode::Live
    }

    fn run(&mut self, hub: &Hub, requests: &Requests) -> anyhow::Result<()> {
        hub.latch(Slot::Node, &ToPage::Node(self.node.clone()));
        let unknown = ParametersText { is_complete: false, values: None, initial: None };
        hub.latch(Slot::Parameters, &ToPage::Parameters(Box::new(unknown)));
        while let Some(mut link) = self.search(hub, requests) {
            let end = loop {
                match link.round(&mut self.stage, hub, requests) {
                    Ok(()) => self.tell(hub, link.node()),
                    Err(end) => break end,
                }
            };
            link.leave(hub, &end);
            match end {
                LinkEnd::Closed => break,
                // Found again at once, under its new number.
                LinkEnd::NewRun => {}
                LinkEnd::Lost(text) => {
                    let text = text.unwrap_or_else(|| "the node has ended".to_owned());
                    self.tell(hub, Node { state: NodeState::Lost, text, ..Node::default() });
                }
            }
        }
        Ok(())
    }
}

/// Answers what pages ask for while there is nobody to ask.
fn refuse_for_a_while(hub: &Hub, requests: &Requests) {
    let end_ns = monotonic_ns() + u64::try_from(SEARCH_PERIOD.as_nanos()).unwrap_or(u64::MAX);
    while monotonic_ns() < end_ns && !hub.is_closed() {
        let Some(request) = requests.next(LOOK_PERIOD) else { continue };
        if request.ask == Ask::Frame {
            hub.show_again();
        }
        if let Ask::Command { id, command } = request.ask {
            let outcome = OutcomeText::refused(id, command.name(), reason::NO_NODE);
            hub.send(request.client, &ToPage::Outcome(outcome));
        }
    }
}
