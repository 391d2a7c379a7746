//! The clients' requests to get and set parameters.

use std::sync::Arc;

use foxglove::websocket::{
    AnyClient, GetParametersResponder, Parameter, ParameterHandler, SetParametersResponder,
};

use super::options::FoxglovePermission;
use super::request_bridge::RequestBridge;

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
