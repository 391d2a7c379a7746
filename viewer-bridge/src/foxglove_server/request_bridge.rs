//! The bridge between the clients' requests and the source: service calls, published commands and
//! parameters become commands, and the answers return to the client that asked.
//!
//! The library calls it from the tasks of the clients. It only queues and never blocks.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, MutexGuard, PoisonError};

use foxglove::WebSocketServerHandle;
use foxglove::websocket::service::Responder;
use foxglove::websocket::{
    AnyClient, Client, ClientId as LibraryClientId, Parameter, PlaybackControlRequest,
    PlaybackState, SetParametersResponder, Status as LibraryStatus,
};
use sim_contract::{Action, Parameter as Name, ParameterValues, Reason};
use sim_host::clock::{SECOND_NS, monotonic_ns};

use super::{parameters, playback};
use crate::message::{Command, OutcomeText, Playback, Refusal, Status, parse_published};
use crate::request::{ClientId, RequestKind, RequestSender};
use crate::source::recording_times::RecordingTimes;

/// The sender of requests that belong to no client. The library numbers its clients from 1.
pub(super) const ANY_CLIENT: ClientId = ClientId::FoxgloveCaller(0);

/// Time between two complaints about a client's published commands. The library disconnects a client
/// for which more than [`crate::limits::FOXGLOVE_QUEUED_MAX`] answers and complaints wait, and a client
/// can publish hundreds of commands per second. Each rejected command is on `/outcomes` as well.
const COMPLAINT_PERIOD_NS: u64 = SECOND_NS / 10;

/// The bridge between the clients' requests and the source.
#[derive(Debug)]
pub(super) struct RequestBridge {
    requests: RequestSender,
    recording: Option<RecordingTimes>,
    /// The library's server while it runs, for messages that no client asked for.
    library: Mutex<Option<WebSocketServerHandle>>,
    state: Mutex<BridgeState>,
}

#[derive(Debug, Default)]
struct BridgeState {
    /// Receivers of the outcomes, by the number of the command.
    waiting: BTreeMap<u32, Waiting>,
    last_command: u32,
    /// Requests to set parameters that are not complete.
    parameter_requests: BTreeMap<u32, ParameterRequest>,
    last_parameter_request: u32,
    /// Clients that have published a command, and may therefore have grabs.
    publishers: BTreeSet<u32>,
    /// Earliest time of the next complaint to a client.
    next_complaint_ns: BTreeMap<u32, u64>,
    parameters: Option<ParameterValues>,
    playback: Option<Playback>,
}

/// The receiver of an outcome.
#[derive(Debug)]
enum Waiting {
    Service(Responder),
    /// A parameter of a request.
    Parameter {
        request: u32,
        parameter: Parameter,
    },
    Publisher(Client),
}

/// Parameters that one client sets at once.
#[derive(Debug)]
struct ParameterRequest {
    client: AnyClient,
    responder: SetParametersResponder,
    open_count: usize,
    /// Present values of the parameters.
    values: Vec<Parameter>,
    /// Rejected parameters with the reasons.
    refusals: Vec<String>,
}

impl RequestBridge {
    pub(super) fn new(requests: RequestSender, recording: Option<RecordingTimes>) -> Self {
        Self { requests, recording, library: Mutex::default(), state: Mutex::default() }
    }

    fn state(&self) -> MutexGuard<'_, BridgeState> {
        // Every change under this lock is complete wherever a panic could occur.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn library(&self) -> MutexGuard<'_, Option<WebSocketServerHandle>> {
        self.library.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sets the library's server once it runs.
    pub(super) fn set_library(&self, library: WebSocketServerHandle) {
        *self.library() = Some(library);
    }

    /// Returns the library's server, to stop it.
    pub(super) fn take_library(&self) -> Option<WebSocketServerHandle> {
        self.library().take()
    }

    /// Sets the present parameters and sends the changes to the clients that follow them.
    pub(super) fn set_parameters(&self, new: Option<ParameterValues>) {
        let old = std::mem::replace(&mut self.state().parameters, new.clone());
        let library = self.library();
        let (Some(new), Some(library)) = (new, library.as_ref()) else { return };
        let mut changed = parameters::list(&new);
        if let Some(old) = old {
            let listed = parameters::list(&old);
            changed.retain(|parameter| !listed.contains(parameter));
            changed.extend(parameters::ended_blocks(&old, &new));
        }
        if !changed.is_empty() {
            library.publish_parameter_values(changed);
        }
    }

    /// Sets the playback of the recording and sends it to every client.
    pub(super) fn set_playback(&self, playback: Playback) {
        let before = self.state().playback.replace(playback);
        if let (Some(times), Some(library)) = (self.recording, self.library().as_ref()) {
            library.broadcast_playback_state(playback::present_state(&times, before, playback));
        }
    }

    /// Handles a request to change the playback. Returns `None` without a recording.
    pub(super) fn control_playback(
        &self,
        request: &PlaybackControlRequest,
    ) -> Option<PlaybackState> {
        let times = self.recording?;
        let playback = self.state().playback;
        for kind in playback::commands(&times, request, playback) {
            // A client whose request is lost sees the playback state that follows.
            let _sent = self.requests.send(ANY_CLIENT, RequestKind::Command(Command::new(kind)));
        }
        Some(playback::requested_state(&times, request, playback))
    }

    /// Returns the present values of the parameters with these names; of all without names.
    pub(super) fn present_parameters(&self, names: &[String]) -> Vec<Parameter> {
        let mut all = self.state().parameters.as_ref().map(parameters::list).unwrap_or_default();
        all.retain(|parameter| names.is_empty() || names.contains(&parameter.name));
        all
    }

    /// Calls a service. The answer is the outcome.
    pub(super) fn call(&self, client: LibraryClientId, action: Action, responder: Responder) {
        let client = ClientId::FoxgloveCaller(client.into());
        self.submit(client, action, Waiting::Service(responder));
    }

    /// Handles a command that a client published.
    pub(super) fn accept_published(&self, client: Client, payload: &[u8]) {
        match parse_published(payload) {
            Ok(action) => {
                self.state().publishers.insert(client.id().into());
                let sender = ClientId::FoxglovePublisher(client.id().into());
                self.submit(sender, action, Waiting::Publisher(client));
            }
            Err(error) => self.complain(&client, format!("not a command: {error}")),
        }
    }

    /// Sends a client an error about its published commands, unless it has just received one.
    pub(super) fn complain(&self, client: &Client, text: String) {
        let now_ns = monotonic_ns();
        let is_due = {
            let mut state = self.state();
            state.next_complaint_ns.retain(|_, due_ns| *due_ns > now_ns);
            let due_ns = now_ns + COMPLAINT_PERIOD_NS;
            state.next_complaint_ns.insert(client.id().into(), due_ns).is_none()
        };
        if is_due {
            client.send_status(LibraryStatus::error(text));
        }
    }

    /// Releases the grabs of a client that publishes no more commands. One message can end hundreds of
    /// channels, so those without a command cause no request.
    pub(super) fn remove_publisher(&self, client: LibraryClientId) {
        if !self.state().publishers.remove(&client.into()) {
            return;
        }
        // Only commands are refused.
        let _sent =
            self.requests.send(ClientId::FoxglovePublisher(client.into()), RequestKind::Left);
        self.state().waiting.retain(
            |_, waiting| !matches!(waiting, Waiting::Publisher(other) if other.id() == client),
        );
    }

    /// Sets parameters. The request is answered once each of them has its outcome.
    pub(super) fn set_all(
        &self,
        client: AnyClient,
        parameters: Vec<Parameter>,
        responder: SetParametersResponder,
    ) {
        let sender = ClientId::FoxgloveCaller(client.id().into());
        let request = self.open_request(client, parameters.len(), responder);
        for parameter in parameters {
            match parameters::action(&parameter) {
                Ok(action) => {
                    self.submit(sender, action, Waiting::Parameter { request, parameter });
                }
                Err(reason) => {
                    let refused = refused_set(&parameter.name, reason);
                    self.close_parameter(request, parameter, &refused);
                }
            }
        }
    }

    fn open_request(
        &self,
        client: AnyClient,
        open_count: usize,
        responder: SetParametersResponder,
    ) -> u32 {
        let (values, refusals) = (Vec::new(), Vec::new());
        let request = ParameterRequest { client, responder, open_count, values, refusals };
        let mut state = self.state();
        state.last_parameter_request = state.last_parameter_request.wrapping_add(1);
        let number = state.last_parameter_request;
        state.parameter_requests.insert(number, request);
        number
    }

    /// Sends an action to the source, or refuses it.
    fn submit(&self, client: ClientId, action: Action, waiting: Waiting) {
        let id = {
            let mut state = self.state();
            state.last_command = state.last_command.wrapping_add(1);
            let id = state.last_command;
            state.waiting.insert(id, waiting);
            id
        };
        let command = Command { id: Some(id), ..Command::new(action) };
        let submitted = command.kind.check().and_then(|()| {
            self.requests.send(client, RequestKind::Command(command)).map_err(|_| Refusal::Busy)
        });
        if let Err(reason) = submitted {
            self.answer(&OutcomeText::refused(Some(id), action.kind_name(), reason));
        }
    }

    /// Delivers an outcome to the client that waits for it.
    pub(super) fn answer(&self, outcome: &OutcomeText) {
        let Some(id) = outcome.id else { return };
        let waiting = self.state().waiting.remove(&id);
        match waiting {
            Some(Waiting::Service(responder)) => respond(responder, outcome),
            Some(Waiting::Parameter { request, parameter }) => {
                self.close_parameter(request, parameter, outcome);
            }
            Some(Waiting::Publisher(client)) if outcome.status != Status::Applied => {
                self.complain(&client, refusal_text(outcome.kind, outcome));
            }
            Some(Waiting::Publisher(_)) | None => {}
        }
    }

    /// Notes the outcome of one parameter. Answers the request after the last one.
    fn close_parameter(&self, number: u32, parameter: Parameter, outcome: &OutcomeText) {
        let mut state = self.state();
        let present = state.parameters.clone();
        let Some(request) = state.parameter_requests.get_mut(&number) else { return };
        if outcome.status == Status::Applied {
            request.values.push(parameter);
        } else {
            request.refusals.push(parameter_text(&parameter.name, outcome));
            let mut present = present.iter().flat_map(parameters::list);
            request.values.extend(present.find(|one| one.name == parameter.name));
        }
        request.open_count -= 1;
        if request.open_count == 0
            && let Some(request) = state.parameter_requests.remove(&number)
        {
            if !request.refusals.is_empty() {
                request.client.send_error(request.refusals.join("; "));
            }
            request.responder.respond(request.values);
        }
    }
}

/// The answer to a parameter that becomes no command.
fn refused_set(name: &str, reason: Reason) -> OutcomeText {
    let mut outcome = OutcomeText::refused(None, "set", reason.into());
    if let Err(allowed) = Name::from_path(name) {
        outcome.text = format!("{reason} (allowed: {allowed})");
    }
    outcome
}

/// The reason of a refusal for the user.
fn refusal_text(name: &str, outcome: &OutcomeText) -> String {
    let text = if outcome.text.is_empty() { "unknown reason" } else { &outcome.text };
    format!("{name}: {text}")
}

/// The reason of a refused value. It names the parameter once: most reasons begin with the name, without a part such as
/// `.shear`.
fn parameter_text(name: &str, outcome: &OutcomeText) -> String {
    let base = Name::from_path(name).map_or(name, |(parameter, _)| parameter.name());
    match outcome.text.strip_prefix(base).filter(|rest| rest.starts_with(" accepts ")) {
        Some(range) => format!("{name}{range}"),
        None => refusal_text(name, outcome),
    }
}

fn respond(responder: Responder, outcome: &OutcomeText) {
    match (outcome.status, serde_json::to_vec(outcome)) {
        (Status::Applied, Ok(json)) => responder.respond_ok(json),
        _ => responder.respond_err(refusal_text(outcome.kind, outcome)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refused_parameter_is_named_once() {
        let text = |name: &str, reason: Refusal| {
            parameter_text(name, &OutcomeText::refused(None, "set", reason))
        };
        let range = Refusal::OutsideRange(Name::TearForce);
        assert_eq!(text("tear_force", range), "tear_force accepts a number > 0");
        let of_kind = text("compliance.shear", Refusal::OutsideRange(Name::Compliance));
        assert!(of_kind.starts_with("compliance.shear accepts "), "{of_kind}");
        let of_block = text("bending.7", Refusal::OutsideBlocks(Name::Bending));
        assert!(of_block.starts_with("bending.7: bending of a block accepts "), "{of_block}");
        let renamed = refused_set("wind_drag", Reason::UnknownParameter).text;
        assert!(renamed.contains("'wind_drag' is now called 'wind.drag'"), "{renamed}");
        assert!(text("damping", Refusal::NoNode).starts_with("damping: no node is running"));
    }
}
