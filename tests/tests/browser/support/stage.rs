//! A node, a bridge and a page of it in a domain of their own.

use std::rc::Rc;
use std::time::Duration;

use integration_tests::{DEADLINE, Process, Program, Sandbox, ctl, wait_for};
use sim_contract::{Client, ParticleState};

use super::chromium::Turn;
use super::tab::Tab;

pub(super) const ANY_PORT: &str = "127.0.0.1:0";

/// What the node published last, read from its shared memory and not through the bridge.
#[derive(Debug, Clone, Default)]
pub(crate) struct State {
    pub(crate) step: u64,
    pub(crate) particles: Vec<ParticleState>,
}

/// Everything that a test drives. It ends in the order of the fields.
pub(crate) struct Stage {
    pub(crate) tab: Tab,
    client: Client,
    state: State,
    pub(crate) bridge: Process,
    pub(crate) node: Process,
    pub(crate) sandbox: Sandbox,
    url: String,
    turn: Rc<Turn>,
}

impl Stage {
    /// `args`: of the node, the scene first. `look`: what stands behind the "#" of the address.
    pub(crate) fn new(args: &[&str], look: &str) -> Self {
        Self::within(Sandbox::new(), args, look)
    }

    /// The same with the text of a scene.
    pub(crate) fn with_scene(text: &str, args: &[&str], look: &str) -> Self {
        let sandbox = Sandbox::new();
        let file = sandbox.write("scene.toml", text);
        Self::within(sandbox, &[&[file.as_str()], args].concat(), look)
    }

    fn within(sandbox: Sandbox, args: &[&str], look: &str) -> Self {
        let turn = Rc::new(Turn::take());
        let node = start_node(&sandbox, args);
        let (bridge, url) = start_bridge(&sandbox, &["--listen", ANY_PORT]);
        let tab = Tab::open(&turn, &address(&url, look));
        let client = Client::attach(&sandbox.endpoint()).unwrap();
        Self { tab, client, state: State::default(), bridge, node, sandbox, url, turn }
    }

    /// One more page of the same bridge.
    pub(crate) fn another_tab(&self, look: &str) -> Tab {
        Tab::open(&self.turn, &address(&self.url, look))
    }

    /// The newest state of the node.
    pub(crate) fn state(&mut self) -> &State {
        // While it is paused nothing new comes, and the last one holds.
        let patience = if self.state.particles.is_empty() { DEADLINE } else { Duration::ZERO };
        if let Some(snapshot) = self.client.latest_snapshot(patience).unwrap() {
            let particles = snapshot.particles().to_vec();
            self.state = State { step: snapshot.header().step, particles };
        }
        &self.state
    }

    /// Waits for a state of the node.
    pub(crate) fn wait_for_state(&mut self, what: &str, is_so: impl Fn(&State) -> bool) -> State {
        wait_for(what, || {
            let state = self.state();
            is_so(state).then(|| state.clone())
        })
    }

    /// Waits until the page shows the newest state of a paused node, and returns that state.
    pub(crate) fn settled(&mut self) -> State {
        wait_for("the page to show the state of the paused node", || {
            let state = self.state().clone();
            (self.tab.number("viewer.step") == state.step as f64).then_some(state)
        })
    }

    /// Pauses by the page, and returns the state that both then have.
    pub(crate) fn pause(&mut self) -> State {
        self.tab.pause();
        self.settled()
    }

    /// Lets the paused node make steps, by another program than the page.
    pub(crate) fn step(&mut self, count: u64) -> State {
        let step = self.state().step + count;
        ctl(&self.sandbox, &["step", &count.to_string()]);
        self.wait_for_state("the steps", |state| state.step == step)
    }

    pub(crate) fn client(&mut self) -> &mut Client {
        &mut self.client
    }

    /// Starts another node in the place of one that has ended.
    pub(crate) fn restart_node(&mut self, args: &[&str]) {
        self.node = start_node(&self.sandbox, args);
    }

    /// Starts another bridge at the address of one that has ended.
    pub(crate) fn restart_bridge(&mut self) {
        self.bridge = start_bridge_at(&self.sandbox, &self.url);
    }
}

pub(super) fn start_node(sandbox: &Sandbox, args: &[&str]) -> Process {
    Process::start_ready(Program::SimNode, sandbox, &[&["run"], args].concat())
}

/// Starts a bridge, and returns it with its address.
pub(super) fn start_bridge(sandbox: &Sandbox, args: &[&str]) -> (Process, String) {
    let mut bridge = Process::start(Program::ViewerBridge, sandbox, args);
    let url = bridge.wait_for_line("ready http://").trim_start_matches("ready ").to_owned();
    (bridge, url)
}

/// Starts a live bridge at the address of one that has ended.
pub(super) fn start_bridge_at(sandbox: &Sandbox, url: &str) -> Process {
    let address = url.trim_start_matches("http://").trim_end_matches('/');
    start_bridge(sandbox, &["--listen", address]).0
}

/// Without smoothed edges: in software they cost more than all the rest.
pub(super) fn address(url: &str, look: &str) -> String {
    format!("{url}?aa=0#{look}")
}
