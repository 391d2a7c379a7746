//! The programs of a live test: a node, a bridge and a page, in a separate domain.

use std::rc::Rc;
use std::time::Duration;

use integration_tests::{DEADLINE, Process, Program, Sandbox, ctl, wait_for};
use sim_contract::{Client, ParticleState};

use super::chromium::BrowserLock;
use super::tab::Tab;

pub(super) const ANY_PORT: &str = "127.0.0.1:0";

/// The newest state of the node, read from shared memory and not through the bridge.
#[derive(Debug, Clone, Default)]
pub(crate) struct State {
    pub(crate) step: u64,
    pub(crate) particles: Vec<ParticleState>,
}

/// The programs of a live test. They end in the order of the fields.
pub(crate) struct Rig {
    pub(crate) tab: Tab,
    client: Client,
    state: State,
    pub(crate) bridge: Process,
    pub(crate) node: Process,
    pub(crate) sandbox: Sandbox,
    url: String,
    browser: Rc<BrowserLock>,
}

impl Rig {
    /// Starts a node with `args`, a bridge, and a page. The scene is the first argument. `fragment` is
    /// the part of the address after "#".
    pub(crate) fn new(args: &[&str], fragment: &str) -> Self {
        Self::within(Sandbox::new(), args, &[], fragment)
    }

    /// Starts the programs with the text of a scene.
    pub(crate) fn with_scene(text: &str, args: &[&str], fragment: &str) -> Self {
        let sandbox = Sandbox::new();
        let file = sandbox.write("scene.toml", text);
        Self::within(sandbox, &[&[file.as_str()], args].concat(), &[], fragment)
    }

    /// Starts the programs with the curtain, and the text of a scene in the menu.
    pub(crate) fn with_scene_in_menu(text: &str) -> Self {
        let sandbox = Sandbox::new();
        let file = sandbox.write("scene.toml", text);
        Self::within(sandbox, &["curtain"], &["--scene", &file], "")
    }

    fn within(sandbox: Sandbox, args: &[&str], bridge: &[&str], fragment: &str) -> Self {
        let browser = Rc::new(BrowserLock::acquire());
        let node = start_node(&sandbox, args);
        let recordings = sandbox.path("recordings");
        let own = ["--listen", ANY_PORT, "--recordings", &recordings];
        let (bridge, url) = start_bridge(&sandbox, &[&own, bridge].concat());
        let tab = Tab::open(&browser, &address(&url, fragment));
        let client = Client::attach(&sandbox.endpoint()).unwrap();
        Self { tab, client, state: State::default(), bridge, node, sandbox, url, browser }
    }

    /// Opens another page of the bridge.
    pub(crate) fn another_tab(&self, fragment: &str) -> Tab {
        Tab::open(&self.browser, &address(&self.url, fragment))
    }

    /// Opens another page of the bridge, which receives at most this number of bytes per second.
    pub(crate) fn tab_over_slow_line(&self, bytes_per_s: u32) -> Tab {
        Tab::open_slowly(&self.browser, &address(&self.url, ""), bytes_per_s)
    }

    /// Opens another page of the bridge, at a path.
    pub(crate) fn tab_at(&self, path: &str) -> Tab {
        Tab::open(&self.browser, &address(&format!("{}{path}", self.url), ""))
    }

    /// Returns the newest state of the node.
    pub(crate) fn state(&mut self) -> &State {
        // A paused node publishes nothing, so the last state remains the newest.
        let timeout = if self.state.particles.is_empty() { DEADLINE } else { Duration::ZERO };
        if let Some(snapshot) = self.client.latest_snapshot(timeout).unwrap() {
            let particles = snapshot.particles().to_vec();
            self.state = State { step: snapshot.header().step, particles };
        }
        &self.state
    }

    /// Waits for a state of the node that satisfies a condition.
    pub(crate) fn wait_for_state(&mut self, what: &str, matches: impl Fn(&State) -> bool) -> State {
        wait_for(what, || {
            let state = self.state();
            matches(state).then(|| state.clone())
        })
    }

    /// Waits until the page shows the newest state of a paused node, and returns that state.
    pub(crate) fn settled(&mut self) -> State {
        wait_for("the page to show the state of the paused node", || {
            let state = self.state().clone();
            (self.tab.number("viewer.step") == state.step as f64).then_some(state)
        })
    }

    /// Pauses through the page, and returns the state of the node that the page then shows.
    pub(crate) fn pause(&mut self) -> State {
        self.tab.pause();
        self.settled()
    }

    /// Steps the paused node with `ctl`, and returns its state.
    pub(crate) fn step(&mut self, count: u64) -> State {
        let step = self.state().step + count;
        ctl(&self.sandbox, &["step", &count.to_string()]);
        self.wait_for_state("the steps", |state| state.step == step)
    }

    pub(crate) fn client(&mut self) -> &mut Client {
        &mut self.client
    }

    /// Replaces a node that has ended.
    pub(crate) fn restart_node(&mut self, args: &[&str]) {
        self.node = start_node(&self.sandbox, args);
    }

    /// Replaces a bridge that has ended, at the same address.
    pub(crate) fn restart_bridge(&mut self) {
        self.bridge = start_bridge_at(&self.sandbox, &self.url);
    }
}

pub(super) fn start_node(sandbox: &Sandbox, args: &[&str]) -> Process {
    Process::start_ready(Program::SimNode, sandbox, &[&["run"], args].concat())
}

/// Starts a bridge, and returns it with its URL.
pub(super) fn start_bridge(sandbox: &Sandbox, args: &[&str]) -> (Process, String) {
    let mut bridge = Process::start(Program::ViewerBridge, sandbox, args);
    let url = bridge.wait_for_line("ready http://").trim_start_matches("ready ").to_owned();
    (bridge, url)
}

/// Starts a live bridge at the address of a URL.
pub(super) fn start_bridge_at(sandbox: &Sandbox, url: &str) -> Process {
    let address = url.trim_start_matches("http://").trim_end_matches('/');
    start_bridge(sandbox, &["--listen", address]).0
}

/// Returns the address of a page without antialiasing, which dominates the cost of drawing in software.
pub(super) fn address(url: &str, fragment: &str) -> String {
    format!("{url}?aa=0#{fragment}")
}
