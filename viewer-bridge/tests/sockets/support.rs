//! A server in this process without a source, and pages that connect to it over real sockets.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::time::Duration;

use recording::StepRow;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use serde_json::Value;
use sim_contract::ParticleState;
use sim_host::Stop;
use sim_host::clock::{SECOND_NS, monotonic_ns, sleep_until};
use tokio::runtime::Runtime;
use tungstenite::client::IntoClientRequest;
use tungstenite::http::{HeaderValue, Request, header};
use tungstenite::protocol::CloseFrame;
use tungstenite::{Message, WebSocket};
use viewer_bridge::message::Mode;
use viewer_bridge::pages::assets::Assets;
use viewer_bridge::pages::hub::Formats;
use viewer_bridge::request::{Requests, requests};
use viewer_bridge::scene::catalog::Catalog;
use viewer_bridge::sink::{State, Update};
use viewer_bridge::source::shown_state::ShownState;
use viewer_bridge::wire::Scene;
use viewer_bridge::{Hub, Replays, Server, ServerOptions, Shutdown, Sinks, TokenDemand};

use crate::wire_decoder::{self, decode};

/// Limit on every wait. It is generous, because the machine may be busy.
const DEADLINE: Duration = Duration::from_mins(1);

/// A running server. Dropping it ends the server.
pub(crate) struct Site {
    pub(crate) hub: Arc<Hub>,
    pub(crate) sinks: Sinks,
    pub(crate) shutdown: Shutdown,
    pub(crate) requests: Requests,
    pub(crate) address: SocketAddr,
    pub(crate) url: String,
    pub(crate) shown: ShownState,
    _runtime: Runtime,
}

/// Lets this process open as many files as the system allows: it has both ends of each connection.
pub(crate) fn allow_many_open_files() {
    let limit = getrlimit(Resource::Nofile);
    let raised = Rlimit { current: limit.maximum, ..limit };
    setrlimit(Resource::Nofile, raised).unwrap();
}

impl Site {
    pub(crate) fn start() -> Self {
        Self::listen("127.0.0.1:0")
    }

    pub(crate) fn listen(address: &str) -> Self {
        Self::with_token(address, TokenDemand::BeyondLoopback)
    }

    /// Starts a server at an address, which may need a token.
    pub(crate) fn with_token(address: &str, token: TokenDemand) -> Self {
        allow_many_open_files();
        let runtime = Runtime::new().unwrap();
        let options = ServerOptions {
            listen: address.parse().unwrap(),
            names: Vec::new(),
            token,
            assets: Assets::Embedded,
        };
        let server = runtime.block_on(Server::bind(options)).unwrap();
        let (sender, requests) = requests();
        let shutdown = Shutdown::default();
        let (hub, url) = (
            Arc::new(Hub::new(Mode::Live, Catalog::default().entries().to_vec(), sender)),
            server.url(),
        );
        let mut sinks = Sinks::new(shutdown.clone());
        sinks.add(Arc::<Hub>::clone(&hub));
        let port = url.rsplit(':').next().unwrap().split('/').next().unwrap();
        let address = SocketAddr::from(([127, 0, 0, 1], port.parse().unwrap()));
        runtime.spawn(server.serve(
            Arc::clone(&hub),
            None,
            Replays::new(None, Stop::default()),
            shutdown.clone(),
        ));
        let shown = ShownState::default();
        Self { hub, sinks, shutdown, requests, address, url, shown, _runtime: runtime }
    }

    /// Returns the request of a browser when a page of `origin` opens a socket.
    pub(crate) fn request(&self, origin: Option<&str>) -> Request<()> {
        let url = format!("ws://{}/socket", self.address);
        let mut request = url.into_client_request().unwrap();
        if let Some(origin) = origin {
            request.headers_mut().insert(header::ORIGIN, HeaderValue::from_str(origin).unwrap());
        }
        request
    }

    /// Opens a socket. Returns the HTTP status if it is refused.
    pub(crate) fn open(&self, request: Request<()>) -> Result<Page, u16> {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(DEADLINE)).unwrap();
        match tungstenite::client(request, stream) {
            Ok((socket, _)) => Ok(Page { socket }),
            Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(response))) => {
                Err(response.status().as_u16())
            }
            Err(error) => panic!("{error}"),
        }
    }

    /// Opens a socket that has sent no message yet.
    pub(crate) fn silent_page(&self) -> Page {
        self.open(self.request(None)).unwrap()
    }

    /// Opens a socket that has sent `hello`.
    pub(crate) fn greeting_page(&self) -> Page {
        let mut page = self.silent_page();
        page.send(r#"{"type":"hello","protocol":3}"#);
        page
    }

    /// Opens a page, and reads the server's `hello`.
    pub(crate) fn page(&self) -> Page {
        let mut page = self.greeting_page();
        assert_eq!(page.text()["type"], "hello");
        page
    }

    /// Sends a raw request, and returns the head of the answer in lower case.
    pub(crate) fn answer(&self, request: &str) -> String {
        let mut stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(DEADLINE)).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = String::new();
        // A connection reset after the answer is fine.
        let _ended = stream.read_to_string(&mut answer);
        answer.split("\r\n\r\n").next().unwrap_or_default().to_lowercase()
    }

    /// Shows a scene with `particle_count` particles.
    pub(crate) fn begin(&mut self, particle_count: usize) {
        let scene = Scene { positions: vec![[0.0; 3]; particle_count], ..Scene::default() };
        self.shown.begin_load(&self.sinks, scene);
    }

    /// Shows a frame of a step.
    pub(crate) fn show(&mut self, step: u64, particle_count: usize) {
        self.show_with(step, particle_count, 0);
    }

    /// Shows a frame of a step with flags.
    pub(crate) fn show_with(&mut self, step: u64, particle_count: usize, flags: u32) {
        let particles = vec![ParticleState::default(); particle_count];
        self.shown.show(&self.sinks, State { flags, ..state(step, &particles) });
    }

    /// The formats in which pages wait for a moving state.
    pub(crate) fn awaited_formats(&self, particle_count: usize) -> Formats {
        let particles = vec![ParticleState::default(); particle_count];
        self.hub.awaited_formats(&state(0, &particles))
    }

    pub(crate) fn publish(&self, update: &Update<'_>) {
        self.sinks.publish(update);
    }

    pub(crate) fn wait_for_clients(&self, count: usize) {
        wait_for(&format!("{count} clients"), || (self.hub.client_count() == count).then_some(()));
    }
}

impl Drop for Site {
    fn drop(&mut self) {
        self.shutdown.begin();
    }
}

/// The state after a step.
pub(crate) fn state(step: u64, particles: &[ParticleState]) -> State<'_> {
    State {
        epoch: 0,
        row: StepRow { step, ..StepRow::default() },
        sim_time_s: 0.0,
        flags: 0,
        publish_monotonic_ns: 0,
        particles,
        forces: None,
        ghost: None,
    }
}

/// A connected page.
pub(crate) struct Page {
    pub(crate) socket: WebSocket<TcpStream>,
}

impl Page {
    pub(crate) fn send(&mut self, text: &str) {
        self.socket.send(Message::text(text)).unwrap();
    }

    /// Returns `true` if bytes have arrived that were not read. Does not wait for them.
    pub(crate) fn has_arrivals(&self) -> bool {
        let stream = self.socket.get_ref();
        stream.set_nonblocking(true).unwrap();
        let peeked = stream.peek(&mut [0]);
        stream.set_nonblocking(false).unwrap();
        peeked.is_ok_and(|count| count > 0)
    }

    /// Waits for the next message, except pings and pongs.
    pub(crate) fn next(&mut self) -> Result<Message, tungstenite::Error> {
        // Pings keep the socket from timing out.
        let end_ns = deadline_ns();
        loop {
            assert!(monotonic_ns() < end_ns, "waited {DEADLINE:?} for a message");
            match self.socket.read()? {
                Message::Ping(_) | Message::Pong(_) => {}
                message => return Ok(message),
            }
        }
    }

    /// Waits for the next message, which must be a text.
    pub(crate) fn text(&mut self) -> Value {
        match self.next().unwrap() {
            Message::Text(text) => serde_json::from_str(&text).unwrap(),
            other => panic!("not a text: {other:?}"),
        }
    }

    /// Waits for the next binary message, and skips texts.
    pub(crate) fn binary(&mut self) -> wire_decoder::Message {
        loop {
            if let Message::Binary(bytes) = self.next().unwrap() {
                return decode(&bytes).unwrap();
            }
        }
    }

    /// Waits for the next frame, and returns its step and number.
    pub(crate) fn frame(&mut self) -> (u64, u32) {
        loop {
            if let wire_decoder::Message::Frame(frame) = self.binary() {
                return (frame.head.stamp.step, frame.head.number);
            }
        }
    }

    /// Waits for the next text of a type.
    pub(crate) fn text_with_type(&mut self, kind: &str) -> Value {
        loop {
            let text = match self.next().unwrap() {
                Message::Text(text) => serde_json::from_str::<Value>(&text).unwrap(),
                _ => continue,
            };
            if text["type"] == kind {
                return text;
            }
        }
    }

    /// Reads to the end of the connection. Returns the close code of the server, if there is one.
    pub(crate) fn close_code(&mut self) -> Option<u16> {
        loop {
            match self.next() {
                Ok(Message::Close(Some(CloseFrame { code, .. }))) => return Some(code.into()),
                Ok(_) => {}
                Err(_) => return None,
            }
        }
    }
}

fn deadline_ns() -> u64 {
    monotonic_ns() + u64::try_from(DEADLINE.as_nanos()).unwrap()
}

/// Polls until the condition returns a value.
pub(crate) fn wait_for<T>(what: &str, mut condition: impl FnMut() -> Option<T>) -> T {
    let end_ns = deadline_ns();
    loop {
        if let Some(value) = condition() {
            return value;
        }
        assert!(monotonic_ns() < end_ns, "waited {DEADLINE:?} for {what}");
        sleep_until(monotonic_ns() + SECOND_NS / 500);
    }
}
