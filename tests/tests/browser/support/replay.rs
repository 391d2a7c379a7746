//! A bridge that shows a recording, and a page of it: at first no node runs.

use std::rc::Rc;

use integration_tests::{Process, Sandbox, Signal};

use super::chromium::Turn;
use super::stage::{ANY_PORT, address, start_bridge, start_bridge_at, start_node};
use super::tab::Tab;

/// What a test of a recording drives. It ends in the order of the fields.
pub(crate) struct Replay {
    pub(crate) tab: Tab,
    bridge: Process,
    /// The one that a live bridge shows, once it has come.
    node: Option<Process>,
    sandbox: Sandbox,
    url: String,
}

impl Replay {
    /// `file`: the recording. `look`: what stands behind the "#" of the address.
    pub(crate) fn open(sandbox: Sandbox, file: &str, look: &str) -> Self {
        let turn = Rc::new(Turn::take());
        let args = ["--listen", ANY_PORT, "--replay", file];
        let (bridge, url) = start_bridge(&sandbox, &args);
        let tab = Tab::open(&turn, &address(&url, look));
        Self { tab, bridge, node: None, sandbox, url }
    }

    /// Ends the bridge, and waits until the page has knocked in vain.
    pub(crate) fn end(&self) {
        self.bridge.signal(Signal::KILL);
        // The browser itself says so in the console.
        self.tab.expect_error("ERR_CONNECTION_REFUSED");
    }

    /// Starts a node, and a live bridge of it at the address of the bridge that has ended.
    pub(crate) fn go_live(&mut self, scene: &str) {
        self.node = Some(start_node(&self.sandbox, &[scene]));
        self.bridge = start_bridge_at(&self.sandbox, &self.url);
    }
}
