//! The browser: Debian's Chromium, driven by the `DevTools` protocol over a WebSocket on loopback.

use std::cell::RefCell;
use std::env;
use std::fmt::Display;
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Child, ChildStderr, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;

use integration_tests::DEADLINE;
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

/// A shell stands between, so that the browser ends with the process of the tests, in whatever way
/// that ends: its end closes the shell's input. Then the profile, which is `$0`, goes too.
const LAUNCH: &str = r#""$@" & read -r _; kill "$!"; wait "$!"; rm -rf -- "$0""#;

/// What Chromium writes before its address.
const LISTENING: &str = "DevTools listening on ";

/// No sandbox: tests run as root in containers, and open only a page of our own. Software drawing
/// of WebGL has to be asked for. Containers have little shared memory, and the node needs it. The last three keep a page at work that nobody looks at.
const FLAGS: [&str; 19] = [
    "--headless",
    "--remote-debugging-port=0",
    "--no-sandbox",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-dev-shm-usage",
    "--disable-quic",
    "--disable-sync",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--force-device-scale-factor=1",
    "--hide-scrollbars",
    "--mute-audio",
    "--disable-background-timer-throttling",
    "--disable-backgrounding-occluded-windows",
    "--disable-renderer-backgrounding",
];

/// The one browser of this process, for one test at a time: drawing in software takes all cores.
static BROWSER: Mutex<Option<Chromium>> = Mutex::new(None);

/// A running browser.
struct Chromium {
    /// Its input stays open for as long as the browser is wanted.
    _shell: Child,
    socket: WebSocket<TcpStream>,
    last_id: u64,
    /// What sessions were told, until they end.
    events: Vec<Value>,
}

/// The browser while it is this test's.
pub(crate) struct Turn(RefCell<MutexGuard<'static, Option<Chromium>>>);

impl Turn {
    /// Waits until no other test has the browser; starts it if need be.
    pub(crate) fn take() -> Self {
        let mut browser = BROWSER.lock().unwrap_or_else(PoisonError::into_inner);
        if !browser.as_mut().is_some_and(Chromium::is_running) {
            *browser = Some(Chromium::start());
        }
        Self(RefCell::new(browser))
    }

    /// Calls a method of the browser, or of one of its sessions.
    pub(crate) fn call(
        &self,
        session: Option<&str>,
        method: &str,
        params: Value,
    ) -> Result<Value, String> {
        let mut browser = self.0.borrow_mut();
        let browser = browser.as_mut().ok_or("no browser")?;
        browser.call(session, method, params).map_err(|error| format!("{method}: {error}"))
    }

    /// The same without waiting for the answer.
    pub(crate) fn post(&self, session: &str, method: &str, params: Value) {
        let mut browser = self.0.borrow_mut();
        browser.as_mut().unwrap().send(Some(session), method, params).unwrap();
    }

    /// What a session was told so far, oldest first.
    pub(crate) fn events(&self, session: &str) -> Vec<Value> {
        let browser = self.0.borrow();
        let events = browser.iter().flat_map(|browser| &browser.events);
        events.filter(|event| event["sessionId"] == session).cloned().collect()
    }

    pub(crate) fn forget(&self, session: &str) {
        if let Some(browser) = self.0.borrow_mut().as_mut() {
            browser.events.retain(|event| event["sessionId"] != session);
        }
    }
}

impl Chromium {
    #[allow(clippy::disallowed_methods, reason = "the harness starts processes")]
    fn start() -> Self {
        let program = program();
        let profile = env::temp_dir().join(format!("catenary-browser-{}", std::process::id()));
        let profile_flag = format!("--user-data-dir={}", profile.display());
        let mut command = Command::new("sh");
        command.args(["-c", LAUNCH]).arg(&profile).arg(program).args(FLAGS).arg(profile_flag);
        command.arg("about:blank").process_group(0);
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut shell = command.spawn().unwrap();
        let url = address(&lines(shell.stderr.take().unwrap()));
        let host = url.trim_start_matches("ws://").split('/').next().unwrap();
        let stream = TcpStream::connect(host).unwrap();
        stream.set_read_timeout(Some(DEADLINE)).unwrap();
        stream.set_nodelay(true).unwrap();
        let (socket, _) = tungstenite::client(&url, stream).unwrap();
        Self { _shell: shell, socket, last_id: 0, events: Vec::new() }
    }

    fn is_running(&mut self) -> bool {
        self.call(None, "Browser.getVersion", json!({})).is_ok()
    }

    /// Sends a message, and returns the number of its answer.
    fn send(&mut self, session: Option<&str>, method: &str, params: Value) -> Result<u64, String> {
        self.last_id += 1;
        let mut message = json!({ "id": self.last_id, "method": method });
        message["params"] = params;
        if let Some(session) = session {
            message["sessionId"] = session.into();
        }
        self.socket.send(Message::text(message.to_string())).map_err(text)?;
        Ok(self.last_id)
    }

    fn call(
        &mut self,
        session: Option<&str>,
        method: &str,
        params: Value,
    ) -> Result<Value, String> {
        let id = self.send(session, method, params)?;
        loop {
            let Message::Text(answer) = self.socket.read().map_err(text)? else { continue };
            let mut answer: Value = serde_json::from_str(&answer).map_err(text)?;
            if answer["method"].is_string() {
                self.events.push(answer);
            } else if answer["id"] == id {
                let error = &answer["error"];
                return if error.is_null() {
                    Ok(answer["result"].take())
                } else {
                    Err(text(error))
                };
            }
        }
    }
}

fn text(error: impl Display) -> String {
    error.to_string()
}

/// Reads lines in a thread of its own, to the end, so that the browser never waits for us.
fn lines(output: ChildStderr) -> Receiver<String> {
    let (sender, lines) = channel();
    thread::spawn(move || {
        for line in BufReader::new(output).lines().map_while(Result::ok) {
            // Nobody listens once the address is known.
            let _heard = sender.send(line);
        }
    });
    lines
}

/// Where the browser listens: it says so once it does.
fn address(lines: &Receiver<String>) -> String {
    let mut said = String::new();
    loop {
        let Ok(line) = lines.recv_timeout(DEADLINE) else { panic!("no Chromium: {said}") };
        if let Some(address) = line.strip_prefix(LISTENING) {
            return address.to_owned();
        }
        said += &line;
        said.push('\n');
    }
}

/// The path of the browser. Without one the tests fail: a check that is passed over is none.
fn program() -> PathBuf {
    let folders = env::var_os("PATH").unwrap_or_default();
    let found = env::split_paths(&folders).map(|folder| folder.join("chromium"));
    found
        .into_iter()
        .find(|path| path.is_file())
        .expect("these tests drive Chromium, which is not there; Debian: apt-get install chromium")
}
