//! Events of the clients that the library reports: subscriptions, publications and playback control.

use std::sync::Arc;

use foxglove::websocket::{
    ChannelView, Client, ClientChannel, PlaybackControlRequest, PlaybackState, ServerListener,
};

use super::publisher::Publisher;
use super::request_bridge::{ANY_CLIENT, RequestBridge};
use crate::request::{RequestKind, RequestSender};

/// Topic of the actions that clients publish, one JSON object per message.
const TOPIC: &str = "/commands";

/// Handles the events of the clients. The library calls it from their tasks; it must not block.
pub(super) struct ClientEvents {
    pub(super) requests: RequestSender,
    pub(super) publisher: Arc<Publisher>,
    pub(super) bridge: Arc<RequestBridge>,
}

impl ServerListener for ClientEvents {
    /// Requests a state, which the client needs even if nothing moves.
    fn on_subscribe(&self, client: Client, channel: ChannelView<'_>) {
        self.publisher.add_subscription(channel.topic(), client.sink_id());
        // Only commands are refused.
        let _sent = self.requests.send(ANY_CLIENT, RequestKind::State);
    }

    /// A foreign topic is an error only when something is published on it: viewers advertise topics of their own,
    /// such as the goals of a 3D panel.
    fn on_message_data(&self, client: Client, channel: &ClientChannel, payload: &[u8]) {
        if channel.topic == TOPIC {
            self.bridge.accept_published(client, payload);
        } else {
            let text = format!("this server only accepts {TOPIC}, not {}", channel.topic);
            self.bridge.complain(&client, text);
        }
    }

    fn on_playback_control_request(
        &self,
        request: PlaybackControlRequest,
    ) -> Option<PlaybackState> {
        self.bridge.control_playback(&request)
    }

    fn on_client_unadvertise(&self, client: Client, channel: &ClientChannel) {
        if channel.topic == TOPIC {
            self.bridge.remove_publisher(client.id());
        }
    }
}
