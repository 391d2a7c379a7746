//! Chromium, driven through the `DevTools` protocol over a WebSocket on loopback.

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

/// A shell that ends the browser when the test process ends for any reason, because that closes the
/// shell's input. Then it removes the profile, `$0`.
const LAUNCH: &str = r#""$@" & read -r _; kill "$!"; wait "$!"; rm -rf -- "$0""#;

/// Prefix of the line in which Chromium prints its address.
const LISTENING: &str = "DevTools listening on ";

/// Command-line flags.
///
/// - No sandbox: the tests run as root in containers, and open only our own page.
/// - Software WebGL is off by default.
/// - No /dev/shm: containers have little shared memory, and the node needs it.
/// - The last three keep pages in the background running.
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

/// The browser of this process. One test uses it at a time, because software drawing needs all cores.
static BROWSER: Mutex<Option<Chromium>> = Mutex::new(None);

/// A running browser.
struct Chromium {
    /// Its open stdin keeps the browser running.
    _shell: Child,
    socket: WebSocket<TcpStream>,
    last_id: u64,
    /// Events of all open sessions.
    events: Vec<Value>,
}

/// Exclusive access to the browser.
pub(crate) struct BrowserLock(RefCell<MutexGuard<'static, Option<Chromium>>>);

impl BrowserLock {
    /// Waits until no other test uses the browser. Starts it if it is not running.
    pub(crate) fn acquire() -> Self {
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

    /// Calls a method of a session without waiting for the answer.
    pub(crate) fn post(&self, session: &str, method: &str, params: Value) {
        let mut browser = self.0.borrow_mut();
        browser.as_mut().unwrap().send(Some(session), method, params).unwrap();
    }

    /// Returns the events of a session so far, oldest first.
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

    /// Sends a message, and returns its id, which the answer repeats.
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

/// Reads lines in a separate thread, so that the browser never blocks on a full pipe.
fn lines(output: ChildStderr) -> Receiver<String> {
    let (sender, lines) = channel();
    thread::spawn(move || {
        for line in BufReader::new(output).lines().map_while(Result::ok) {
            // The receiver is dropped once the address is known.
            let _dropped = sender.send(line);
        }
    });
    lines
}

/// Waits for the line with the address of the browser.
fn address(lines: &Receiver<String>) -> String {
    let mut output = String::new();
    loop {
        let Ok(line) = lines.recv_timeout(DEADLINE) else {
            panic!("Chromium did not start: {output}")
        };
        if let Some(address) = line.strip_prefix(LISTENING) {
            return address.to_owned();
        }
        output += &line;
        output.push('\n');
    }
}

/// Returns the path of the browser. The tests fail without one: a skipped test would prove nothing.
fn program() -> PathBuf {
    let folders = env::var_os("PATH").unwrap_or_default();
    env::split_paths(&folders)
        .map(|folder| folder.join("chromium"))
        .find(|path| path.is_file())
        .expect("these tests need Chromium; on Debian: apt-get install chromium")
}
