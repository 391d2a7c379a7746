//! The sink of the Foxglove clients: hands each update to the publisher or to the request bridge.

use std::sync::Arc;

use super::publisher::{Publisher, SceneNeed};
use super::request_bridge::{ANY_CLIENT, RequestBridge};
use crate::request::{ClientId, RequestKind, RequestSender};
use crate::sink::{Demand, Sink, Update};

/// The sink of the Foxglove clients.
#[derive(Debug)]
pub(super) struct FoxgloveSink {
    publisher: Arc<Publisher>,
    bridge: Arc<RequestBridge>,
    requests: RequestSender,
}

impl FoxgloveSink {
    pub(super) fn new(
        publisher: Arc<Publisher>,
        bridge: Arc<RequestBridge>,
        requests: RequestSender,
    ) -> Self {
        Self { publisher, bridge, requests }
    }

    /// Requests another state after the scene came to rest: the last `/scene` may show an older one.
    fn redraw_scene(&self) {
        if self.publisher.redraw_scene() == SceneNeed::State {
            // Only commands are refused.
            let _sent = self.requests.send(ANY_CLIENT, RequestKind::State);
        }
    }
}

impl Sink for FoxgloveSink {
    fn has_demand(&self, demand: Demand) -> bool {
        match demand {
            Demand::State => self.publisher.is_state_awaited(),
            Demand::Statistics | Demand::Forces => false,
        }
    }

    fn publish(&self, update: &Update<'_>) {
        match *update {
            Update::Load(scene) => self.publisher.begin_load(scene),
            Update::Topology(topology) => self.publisher.publish_topology(&topology),
            Update::Colliders(colliders) => self.publisher.publish_colliders(colliders),
            Update::Torn(torn) => self.publisher.publish_torn(&torn),
            Update::State(state) => self.publisher.publish_state(&state),
            Update::Status(row) => self.publisher.publish_status(row),
            Update::Outcome(row) => self.publisher.publish_outcome(row),
            Update::Parameters(text) => self.bridge.set_parameters(text.values.clone()),
            Update::Node(node) if node.is_paused => self.redraw_scene(),
            Update::Playback(playback) => {
                self.bridge.set_playback(*playback);
                if !playback.is_playing {
                    self.redraw_scene();
                }
            }
            Update::Answer {
                client: ClientId::FoxgloveCaller(_) | ClientId::FoxglovePublisher(_),
                outcome,
            } => self.bridge.answer(outcome),
            // The protocol has no messages for these, or they are for pages.
            Update::LoadRefused { .. }
            | Update::Pins(_)
            | Update::Ghost(_)
            | Update::SameState
            | Update::Statistics(_)
            | Update::Node(_)
            | Update::Timeline(_)
            | Update::Answer { .. }
            | Update::Reset { .. }
            | Update::Undoable { .. }
            | Update::Notice { .. } => {}
        }
    }
}
