//! The programs of a replay test: a bridge with a recording, and a page. No node runs at first.

use std::rc::Rc;

use integration_tests::{Process, Sandbox, Signal};

use super::chromium::BrowserLock;
use super::rig::{ANY_PORT, address, start_bridge, start_bridge_at, start_node};
use super::tab::Tab;

/// The programs of a replay test. They end in the order of the fields.
pub(crate) struct ReplayRig {
    pub(crate) tab: Tab,
    bridge: Process,
    /// The node of the live bridge, once started.
    node: Option<Process>,
    sandbox: Sandbox,
    url: String,
}

impl ReplayRig {
    /// Opens a recording in a page. `fragment` is the part of the address after "#".
    pub(crate) fn open(sandbox: Sandbox, file: &str, fragment: &str) -> Self {
        let browser = Rc::new(BrowserLock::acquire());
        let args = ["--listen", ANY_PORT, "--replay", file];
        let (bridge, url) = start_bridge(&sandbox, &args);
        let tab = Tab::open(&browser, &address(&url, fragment));
        Self { tab, bridge, node: None, sandbox, url }
    }

    /// Kills the bridge, and waits until the page has failed to reconnect.
    pub(crate) fn end(&self) {
        self.bridge.signal(Signal::KILL);
        // The browser logs the failed attempt.
        self.tab.expect_error("ERR_CONNECTION_REFUSED");
    }

    /// Starts a node, and a live bridge at the address of the killed one.
    pub(crate) fn go_live(&mut self, scene: &str) {
        self.node = Some(start_node(&self.sandbox, &[scene]));
        self.bridge = start_bridge_at(&self.sandbox, &self.url);
    }
}
