//! Calls of the library for its clients: subscriptions, published commands, playback control, parameters, and the
//! services pause, resume, step and reset.

use std::sync::Arc;

use foxglove::Schema;
use foxglove::websocket::service::{Handler, Request, Responder, Service, ServiceSchema};
use foxglove::websocket::{
    AnyClient, ChannelView, Client, ClientChannel, GetParametersResponder, Parameter,
    ParameterHandler, PlaybackControlRequest, PlaybackState, ServerListener,
    SetParametersResponder,
};
use serde::Deserialize;
use sim_contract::Action;

use super::options::FoxglovePermission;
use super::publisher::Publisher;
use super::request_bridge::{ANY_CLIENT, RequestBridge};
use crate::limits::STEPS_AT_ONCE_MAX;
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

/// Parameters in one request.
const PARAMETERS_PER_REQUEST_MAX: usize = 64;

/// Handles the clients' requests to get and set parameters.
#[derive(Debug)]
pub(super) struct ParameterRequests {
    bridge: Arc<RequestBridge>,
    permission: FoxglovePermission,
}

impl ParameterRequests {
    pub(super) fn new(bridge: Arc<RequestBridge>, permission: FoxglovePermission) -> Self {
        Self { bridge, permission }
    }
}

impl ParameterHandler for ParameterRequests {
    fn get(
        &self,
        _client: AnyClient,
        names: Vec<String>,
        _request_id: Option<String>,
        responder: GetParametersResponder,
    ) {
        responder.respond(self.bridge.present_parameters(&names));
    }

    fn set(
        &self,
        client: AnyClient,
        parameters: Vec<Parameter>,
        _request_id: Option<String>,
        responder: SetParametersResponder,
    ) {
        if parameters.is_empty() || parameters.len() > PARAMETERS_PER_REQUEST_MAX {
            client.send_error(format!("set 1 to {PARAMETERS_PER_REQUEST_MAX} parameters at once"));
            return responder.respond(Vec::new());
        }
        match self.permission {
            FoxglovePermission::Commands => self.bridge.set_all(client, parameters, responder),
            FoxglovePermission::ReadOnly => {
                let text = "this server is read-only; start it with --allow-commands";
                client.send_error(text.to_owned());
                let names: Vec<_> = parameters.into_iter().map(|one| one.name).collect();
                responder.respond(self.bridge.present_parameters(&names));
            }
        }
    }
}

/// Names of the services: those of the commands.
const NAMES: [&str; 4] = ["pause", "resume", "step", "reset"];

const STEP_SCHEMA: &str = r#"{"type":"object","additionalProperties":false,"properties":{"count":{"type":"integer","minimum":1,"maximum":10000,"default":1}}}"#;
const EMPTY_SCHEMA: &str = r#"{"type":"object","additionalProperties":false,"properties":{}}"#;
/// The schema of the outcome of an applied command, which always has an id and a step. A failure is a
/// message of the protocol. Viewers accept one type for each property.
const OUTCOME_SCHEMA: &str = r#"{"type":"object","properties":{"kind":{"type":"string"},"id":{"type":"integer"},"status":{"type":"string"},"step":{"type":"integer"},"applied":{"type":"integer"},"rejected":{"type":"integer"},"reason":{"type":"string"},"text":{"type":"string"}}}"#;

/// Creates all services.
pub(super) fn services(bridge: &Arc<RequestBridge>) -> Vec<Service> {
    let service = |name| {
        let request = if name == "step" { STEP_SCHEMA } else { EMPTY_SCHEMA };
        let schema = ServiceSchema::new(format!("catenary.{name}"))
            .with_request("json", json_schema(&format!("catenary.{name}.Request"), request))
            .with_response("json", json_schema("catenary.Answer", OUTCOME_SCHEMA));
        Service::builder(name, schema).handler(ServiceHandler(Arc::clone(bridge)))
    };
    NAMES.map(service).into()
}

fn json_schema(name: &str, schema: &'static str) -> Schema {
    Schema::new(name, "jsonschema", schema.as_bytes())
}

struct ServiceHandler(Arc<RequestBridge>);

impl Handler for ServiceHandler {
    fn call(&self, request: Request, responder: Responder) {
        match parse(request.service_name(), request.payload()) {
            Ok(action) => self.0.call(request.client_id(), action, responder),
            Err(error) => responder.respond_err(error),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StepRequest {
    /// Wide enough that a number out of range is named with its range.
    #[serde(default = "one")]
    count: i64,
}

impl StepRequest {
    fn action(&self) -> Result<Action, String> {
        match u32::try_from(self.count) {
            Ok(count @ 1..=STEPS_AT_ONCE_MAX) => Ok(Action::Step { count }),
            _ => Err(format!("step: count accepts an integer from 1 to {STEPS_AT_ONCE_MAX}")),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EmptyRequest {}

fn one() -> i64 {
    1
}

/// Parses the request of a call. An empty request has the defaults.
fn parse(name: &str, payload: &[u8]) -> Result<Action, String> {
    let payload = if payload.is_empty() { b"{}" } else { payload };
    if name == "step" {
        let request: StepRequest =
            serde_json::from_slice(payload).map_err(|error| malformed(&error))?;
        return request.action();
    }
    let EmptyRequest {} = serde_json::from_slice(payload).map_err(|error| malformed(&error))?;
    match name {
        "pause" => Ok(Action::Pause),
        "resume" => Ok(Action::Resume),
        "reset" => Ok(Action::Reset),
        _ => Err("no such service".to_owned()),
    }
}

fn malformed(error: &serde_json::Error) -> String {
    format!("malformed request: {error}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_service_has_an_action() {
        for name in NAMES {
            assert_eq!(parse(name, b"").map(|action| action.kind_name()), Ok(name));
            assert!(parse(name, br#"{"colour":1}"#).is_err(), "{name}");
        }
        assert_eq!(parse("step", br#"{"count":5}"#), Ok(Action::Step { count: 5 }));
        assert!(parse("step", br#"{"count":1.5}"#).is_err());
    }

    #[test]
    fn a_number_of_steps_out_of_range_is_refused_with_the_range() {
        let range = "step: count accepts an integer from 1 to 10000";
        assert!(STEP_SCHEMA.contains(r#""minimum":1,"maximum":10000"#));
        for count in ["-3", "0", "10001", "4294967297", "-9223372036854775808"] {
            let request = format!("{{\"count\":{count}}}");
            assert_eq!(parse("step", request.as_bytes()), Err(range.to_owned()), "{count}");
        }
        assert!(parse("step", br#"{"count":10000}"#).is_ok());
    }
}
