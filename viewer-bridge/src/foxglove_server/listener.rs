//! What clients do beside setting parameters: they subscribe, publish and call services.

use std::sync::{Arc, Weak};

use foxglove::Schema;
use foxglove::websocket::service::{Handler, Request, Responder, Service, ServiceSchema};
use foxglove::websocket::{
    ChannelView, Client, ClientChannel, PlaybackControlRequest, PlaybackState, ServerListener,
};
use serde::Deserialize;

use super::desk::{CLIENT_FIRST, Desk};
use super::published;
use super::publisher::Publisher;
use crate::message::Command;
use crate::pages::hub::Hub;
use crate::source::Ask;

/// Hears what clients do. Its calls come from their tasks and must not block.
pub(super) struct Listener {
    pub(super) hub: Weak<Hub>,
    pub(super) publisher: Arc<Publisher>,
    pub(super) desk: Arc<Desk>,
}

impl ServerListener for Listener {
    fn on_subscribe(&self, client: Client, channel: ChannelView<'_>) {
        self.publisher.greet(channel.topic(), client.sink_id());
        if let Some(hub) = self.hub.upgrade() {
            // It needs a state even if nothing moves.
            hub.request(CLIENT_FIRST, Ask::Frame);
        }
    }

    fn on_client_advertise(&self, client: Client, channel: &ClientChannel) {
        if channel.topic != published::TOPIC {
            let text = format!("only {} is taken, not {}", published::TOPIC, channel.topic);
            self.desk.complain(&client, text);
        }
    }

    fn on_message_data(&self, client: Client, channel: &ClientChannel, payload: &[u8]) {
        if channel.topic == published::TOPIC {
            self.desk.publish(client, payload);
        }
    }

    fn on_playback_control_request(
        &self,
        request: PlaybackControlRequest,
    ) -> Option<PlaybackState> {
        self.desk.control_playback(&request)
    }

    fn on_client_unadvertise(&self, client: Client, channel: &ClientChannel) {
        if channel.topic == published::TOPIC {
            self.desk.leave(client.id());
        }
    }
}

/// The services, by the name of the command.
const NAMES: [&str; 4] = ["pause", "resume", "step", "reset"];

const STEP_SCHEMA: &str = r#"{"type":"object","additionalProperties":false,"properties":{"count":{"type":"integer","minimum":1,"maximum":10000,"default":1}}}"#;
const EMPTY_SCHEMA: &str = r#"{"type":"object","additionalProperties":false,"properties":{}}"#;
const OUTCOME_SCHEMA: &str = r#"{"type":"object","properties":{"kind":{"type":"string"},"status":{"type":"string"},"step":{"type":["integer","null"]},"applied":{"type":"integer"},"rejected":{"type":"integer"},"reason":{"type":"string"},"text":{"type":"string"}}}"#;

/// All services.
pub(super) fn services(desk: &Arc<Desk>) -> Vec<Service> {
    let service = |name| {
        let request = if name == "step" { STEP_SCHEMA } else { EMPTY_SCHEMA };
        let schema = ServiceSchema::new(format!("catenary.{name}"))
            .with_request("json", json_schema(&format!("catenary.{name}.Request"), request))
            .with_response("json", json_schema("catenary.Answer", OUTCOME_SCHEMA));
        Service::builder(name, schema).handler(ServiceDesk(Arc::clone(desk)))
    };
    NAMES.map(service).into()
}

fn json_schema(name: &str, schema: &'static str) -> Schema {
    Schema::new(name, "jsonschema", schema.as_bytes())
}

struct ServiceDesk(Arc<Desk>);

impl Handler for ServiceDesk {
    fn call(&self, request: Request, responder: Responder) {
        match command(request.service_name(), request.payload()) {
            Ok(command) => self.0.call(request.client_id(), command, responder),
            Err(error) => responder.respond_err(error),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StepRequest {
    #[serde(default = "one")]
    count: i32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EmptyRequest {}

fn one() -> i32 {
    1
}

/// The command of a call. An empty request is one with the defaults.
fn command(name: &str, payload: &[u8]) -> Result<Command, String> {
    let payload = if payload.is_empty() { b"{}" } else { payload };
    if name == "step" {
        let request: StepRequest =
            serde_json::from_slice(payload).map_err(|error| wrong(&error))?;
        return Ok(Command::Step { count: request.count });
    }
    let EmptyRequest {} = serde_json::from_slice(payload).map_err(|error| wrong(&error))?;
    match name {
        "pause" => Ok(Command::Pause {}),
        "resume" => Ok(Command::Resume {}),
        "reset" => Ok(Command::Reset {}),
        _ => Err("there is no such service".to_owned()),
    }
}

fn wrong(error: &serde_json::Error) -> String {
    format!("not what this service takes: {error}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_service_has_a_command() {
        for name in NAMES {
            assert_eq!(command(name, b"").map(|command| command.name()), Ok(name));
            assert!(command(name, br#"{"colour":1}"#).is_err(), "{name}");
        }
        assert_eq!(command("step", br#"{"count":5}"#), Ok(Command::Step { count: 5 }));
        assert!(command("step", br#"{"count":1.5}"#).is_err());
    }
}
