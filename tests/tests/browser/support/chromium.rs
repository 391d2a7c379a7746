//! The browser: Debian's Chromium, driven by the DevTools protocol over a pair of pipes.
//!
//! Pipes rather than a port: nobody else reaches the browser, and it ends when the process of the
//! tests ends, in whatever way that ends. The shell that starts it then removes its profile.

use std::cell::RefCell;
use std::env;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;

use integration_tests::DEADLINE;
use serde_json::{Value, json};

/// The DevTools pipes are descriptors 3 and 4 of the browser. A shell puts them there: in Rust it
/// would take unsafe code between fork and exec.
const LAUNCH: &str = r#"profile=$0; "$@" 3<&0 4>&1 >/dev/null; rm -rf -- "$profile""#;

/// No sandbox: tests run as root in containers, and open only a page of our own. Software drawing
/// of WebGL has to be asked for. The last three keep a page at work that nobody looks at.
const FLAGS: [&str; 18] = [
    "--headless",
    "--remote-debugging-pipe",
    "--no-sandbox",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
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
    child: Child,
    input: ChildStdin,
    messages: Receiver<Value>,
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
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().unwrap();
        let input = child.stdin.take().unwrap();
        let messages = receive(child.stdout.take().unwrap());
        let mut browser = Self { child, input, messages, last_id: 0, events: Vec::new() };
        browser.call(None, "Browser.getVersion", json!({})).unwrap();
        browser
    }

    fn is_running(&mut self) -> bool {
        self.child.try_wait().unwrap().is_none()
    }

    fn call(
        &mut self,
        session: Option<&str>,
        method: &str,
        params: Value,
    ) -> Result<Value, String> {
        self.last_id += 1;
        let id = json!(self.last_id);
        let mut message = json!({ "id": id, "method": method, "params": params });
        if let Some(session) = session {
            message["sessionId"] = session.into();
        }
        self.input
            .write_all(format!("{message}\0").as_bytes())
            .map_err(|error| error.to_string())?;
        loop {
            let answer = self.messages.recv_timeout(DEADLINE);
            let mut answer = answer.map_err(|error| format!("no answer: {error}"))?;
            if answer["method"].is_string() {
                self.events.push(answer);
            } else if answer["id"] == id {
                let error = &answer["error"];
                return if error.is_null() {
                    Ok(answer["result"].take())
                } else {
                    Err(error.to_string())
                };
            }
        }
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

/// Reads messages, each ended by a zero byte, in a thread of its own: so waiting has a deadline.
fn receive(output: ChildStdout) -> Receiver<Value> {
    let (sender, messages) = channel();
    thread::spawn(move || {
        let mut output = BufReader::new(output);
        let mut message = Vec::new();
        while output.read_until(0, &mut message).is_ok_and(|length| length > 0) {
            message.pop();
            let Ok(value) = serde_json::from_slice(&message) else { break };
            if sender.send(value).is_err() {
                break;
            }
            message.clear();
        }
    });
    messages
}
