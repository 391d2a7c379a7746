//! The services: pause, resume, step and reset.

use std::sync::Arc;

use foxglove::Schema;
use foxglove::websocket::service::{Handler, Request, Responder, Service, ServiceSchema};
use serde::Deserialize;
use sim_contract::Action;

use super::request_bridge::RequestBridge;
use crate::limits::STEPS_AT_ONCE_MAX;

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
