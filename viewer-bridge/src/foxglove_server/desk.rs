//! Where clients ask: they set parameters, call services and publish commands, all of which become
//! commands to the source; and what it answers goes back to whoever asked.
//!
//! The callbacks run in the tasks of the clients and must not block: they queue, no more.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use foxglove::WebSocketServerHandle;
use foxglove::websocket::service::Responder;
use foxglove::websocket::{
    AnyClient, Client, ClientId, GetParametersResponder, Parameter, ParameterHandler,
    PlaybackControlRequest, PlaybackState, SetParametersResponder, Status,
};
use sim_contract::clock::{SECOND_NS, monotonic_ns};

use super::playback::Recording;
use super::{FoxgloveOptions, published, settable};
use crate::message::check::check;
use crate::message::parameters::Parameters;
use crate::message::reason;
use crate::message::{Command, OutcomeText, Playback, Status as Fate};
use crate::pages::hub::Hub;
use crate::source::Ask;

/// Numbers of pages are below it; those of our clients are not.
pub(crate) const CLIENT_FIRST: u32 = 1 << 30;

/// Most parameters of one request.
const PARAMETERS_PER_REQUEST_MAX: usize = 64;
/// Time from a complaint about what a client publishes to the next. Whoever leaves more than a few
/// answers unread is disconnected by the library, and commands may come in hundreds; each rejected
/// one is on `/outcomes` all the same.
const COMPLAINT_PERIOD_NS: u64 = SECOND_NS / 10;

/// Why nothing can be changed.
const NO_COMMANDS: &str = "this server changes nothing; it was started without --allow-commands";

/// The two senders that a client is to the source: one leaves, and lets go what it holds, when the
/// client stops to publish; the other has its answers all the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sender {
    Publisher,
    Caller,
}

fn number_of(client: ClientId, sender: Sender) -> u32 {
    CLIENT_FIRST | (u32::from(client) << 1) & (CLIENT_FIRST - 1) | (sender as u32)
}

/// Where clients ask.
#[derive(Debug)]
pub(super) struct Desk {
    hub: Weak<Hub>,
    takes_commands: bool,
    recording: Option<Recording>,
    /// For news that nobody asked for; set once the server runs.
    handle: Mutex<Option<WebSocketServerHandle>>,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    /// Whoever waits for an outcome, by the number of the command.
    waiting: BTreeMap<u32, Waiting>,
    last_command: u32,
    /// Requests to set parameters, until each of them has its outcome.
    requests: BTreeMap<u32, Request>,
    last_request: u32,
    /// When a client may be told the next time what is wrong with what it publishes.
    next_complaint_ns: BTreeMap<u32, u64>,
    parameters: Option<Parameters>,
    /// How the recording is played, as the source said last.
    playback: Option<Playback>,
    /// The load on show.
    epoch: u32,
}

/// Who waits for an outcome.
#[derive(Debug)]
enum Waiting {
    Service(Responder),
    /// A parameter of a request.
    Parameter {
        request: u32,
        asked: Parameter,
    },
    Publisher(Client),
}

/// Parameters that one client sets at once.
#[derive(Debug)]
struct Request {
    client: AnyClient,
    responder: SetParametersResponder,
    open_count: usize,
    /// What they are now.
    values: Vec<Parameter>,
    /// What was refused, and why.
    refusals: Vec<String>,
}

impl Desk {
    pub(super) fn new(hub: Weak<Hub>, options: &FoxgloveOptions) -> Self {
        let (takes_commands, recording) = (options.takes_commands, options.recording);
        Self { hub, takes_commands, recording, handle: Mutex::default(), state: Mutex::default() }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Every change of the state is complete at every point where a panic could come.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The server runs: news can go out.
    pub(super) fn open(&self, handle: WebSocketServerHandle) {
        *self.handle() = Some(handle);
    }

    /// The server ends: hands it back, if it ran.
    pub(super) fn close(&self) -> Option<WebSocketServerHandle> {
        self.handle().take()
    }

    fn handle(&self) -> MutexGuard<'_, Option<WebSocketServerHandle>> {
        self.handle.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the number of the load on show.
    pub(super) fn set_epoch(&self, epoch: u32) {
        self.state().epoch = epoch;
    }

    /// Takes the parameters as they are, and tells those who follow them what has changed.
    pub(super) fn set_parameters(&self, parameters: Option<Parameters>) {
        let before = std::mem::replace(&mut self.state().parameters, parameters);
        let handle = self.handle();
        let (Some(parameters), Some(handle)) = (parameters, handle.as_ref()) else { return };
        let old = before.as_ref().map(settable::list).unwrap_or_default();
        let changed = settable::list(&parameters);
        let changed: Vec<_> = changed.into_iter().filter(|one| !old.contains(one)).collect();
        if !changed.is_empty() {
            handle.publish_parameter_values(changed);
        }
    }

    /// Takes how the recording is played, and tells everyone.
    pub(super) fn set_playback(&self, playback: Playback) {
        let before = self.state().playback.replace(playback);
        if let (Some(recording), Some(handle)) = (self.recording, self.handle().as_ref()) {
            handle.broadcast_playback_state(recording.state(before, playback));
        }
    }

    /// Takes a request to play the recording in another way. None: there is no recording.
    pub(super) fn control_playback(
        &self,
        request: &PlaybackControlRequest,
    ) -> Option<PlaybackState> {
        let (recording, hub) = (self.recording?, self.hub.upgrade()?);
        let playback = self.state().playback;
        for command in recording.commands(request, playback) {
            hub.request(CLIENT_FIRST, Ask::Command { id: None, command });
        }
        Some(recording.answer(request, playback))
    }

    /// The parameters of these names, as they are.
    fn present(&self, is_meant: impl Fn(&str) -> bool) -> Vec<Parameter> {
        let parameters = self.state().parameters;
        let mut all = parameters.as_ref().map(settable::list).unwrap_or_default();
        all.retain(|one| is_meant(&one.name));
        all
    }

    /// Calls a service: it is answered with the outcome.
    pub(super) fn call(&self, client: ClientId, command: Command, responder: Responder) {
        self.submit(number_of(client, Sender::Caller), command, Waiting::Service(responder));
    }

    /// Takes what a client published.
    pub(super) fn publish(&self, client: Client, payload: &[u8]) {
        let epoch = self.state().epoch;
        match published::command(payload, epoch) {
            Ok(command) => {
                let number = number_of(client.id(), Sender::Publisher);
                self.submit(number, command, Waiting::Publisher(client));
            }
            Err(error) => self.complain(&client, format!("no command: {error}")),
        }
    }

    /// Tells a client what is wrong with what it publishes, unless it was told something just now.
    pub(super) fn complain(&self, client: &Client, text: String) {
        let now_ns = monotonic_ns();
        let is_due = {
            let mut state = self.state();
            state.next_complaint_ns.retain(|_, due_ns| *due_ns > now_ns);
            let due_ns = now_ns + COMPLAINT_PERIOD_NS;
            state.next_complaint_ns.insert(client.id().into(), due_ns).is_none()
        };
        if is_due {
            client.send_status(Status::error(text));
        }
    }

    /// A client publishes no more: what it holds is let go.
    pub(super) fn leave(&self, client: ClientId) {
        if let Some(hub) = self.hub.upgrade() {
            hub.request(number_of(client, Sender::Publisher), Ask::Left);
        }
        let mut state = self.state();
        // Nobody answers these any more.
        state.waiting.retain(
            |_, waiting| !matches!(waiting, Waiting::Publisher(other) if other.id() == client),
        );
    }

    /// Hands a command to the source, or refuses it.
    fn submit(&self, number: u32, command: Command, waiting: Waiting) {
        let refused = check(&command).err();
        let id = {
            let mut state = self.state();
            state.last_command = state.last_command.wrapping_add(1);
            let id = state.last_command;
            state.waiting.insert(id, waiting);
            id
        };
        let kind = command.name();
        let refused = refused.or_else(|| match self.hub.upgrade() {
            None => Some(reason::NO_NODE),
            Some(hub) => {
                let is_taken = hub.request(number, Ask::Command { id: Some(id), command });
                (!is_taken).then_some(reason::BUSY)
            }
        });
        if let Some(reason) = refused {
            self.answer(&OutcomeText::refused(Some(id), kind, reason));
        }
    }

    /// Gives an outcome to whoever waits for it.
    pub(super) fn answer(&self, outcome: &OutcomeText) {
        let Some(id) = outcome.id else { return };
        let waiting = self.state().waiting.remove(&id);
        match waiting {
            Some(Waiting::Service(responder)) => respond(responder, outcome),
            Some(Waiting::Parameter { request, asked }) => {
                self.close_part(request, asked, outcome);
            }
            Some(Waiting::Publisher(client)) if outcome.status != Fate::Applied => {
                self.complain(&client, refusal(outcome.kind, outcome));
            }
            Some(Waiting::Publisher(_)) | None => {}
        }
    }

    /// Takes the outcome of one parameter; the request is answered with the last one.
    fn close_part(&self, number: u32, asked: Parameter, outcome: &OutcomeText) {
        let mut state = self.state();
        let present = state.parameters;
        let Some(request) = state.requests.get_mut(&number) else { return };
        let name = asked.name.clone();
        if outcome.status == Fate::Applied {
            request.values.push(asked);
        } else {
            request.refusals.push(refusal(&name, outcome));
            let present = present.iter().flat_map(settable::list).find(|one| one.name == name);
            request.values.extend(present);
        }
        request.open_count -= 1;
        if request.open_count == 0
            && let Some(request) = state.requests.remove(&number)
        {
            if !request.refusals.is_empty() {
                request.client.send_error(request.refusals.join("; "));
            }
            request.responder.respond(request.values);
        }
    }
}

/// Why something was not done, for the user.
fn refusal(what: &str, outcome: &OutcomeText) -> String {
    format!("{what}: {}", if outcome.text.is_empty() { outcome.reason } else { &outcome.text })
}

fn respond(responder: Responder, outcome: &OutcomeText) {
    match (outcome.status, serde_json::to_vec(outcome)) {
        (Fate::Applied, Ok(json)) => responder.respond_ok(json),
        _ => responder.respond_err(refusal(outcome.kind, outcome)),
    }
}

/// The parameters of a server; the trait wants a type of its own that outlives everything.
#[derive(Debug, Clone)]
pub(super) struct ParameterDesk(pub(super) Arc<Desk>);

impl ParameterHandler for ParameterDesk {
    fn get(
        &self,
        _client: AnyClient,
        names: Vec<String>,
        _request_id: Option<String>,
        responder: GetParametersResponder,
    ) {
        responder.respond(
            self.0.present(|name| names.is_empty() || names.iter().any(|one| one == name)),
        );
    }

    fn set(
        &self,
        client: AnyClient,
        parameters: Vec<Parameter>,
        _request_id: Option<String>,
        responder: SetParametersResponder,
    ) {
        let desk = &self.0;
        if !desk.takes_commands {
            client.send_error(NO_COMMANDS.to_owned());
            let is_asked = |name: &str| parameters.iter().any(|one| one.name == name);
            return responder.respond(desk.present(is_asked));
        }
        if parameters.is_empty() || parameters.len() > PARAMETERS_PER_REQUEST_MAX {
            client.send_error(format!("1 to {PARAMETERS_PER_REQUEST_MAX} parameters at once"));
            return responder.respond(Vec::new());
        }
        let sender = number_of(client.id(), Sender::Caller);
        let open_count = parameters.len();
        let request = {
            let mut state = desk.state();
            state.last_request = state.last_request.wrapping_add(1);
            let number = state.last_request;
            let request =
                Request { client, responder, open_count, values: Vec::new(), refusals: Vec::new() };
            state.requests.insert(number, request);
            number
        };
        for asked in parameters {
            match settable::command(&asked) {
                Ok(command) => {
                    desk.submit(sender, command, Waiting::Parameter { request, asked });
                }
                Err(reason) => {
                    desk.close_part(request, asked, &OutcomeText::refused(None, "set", reason));
                }
            }
        }
    }
}
