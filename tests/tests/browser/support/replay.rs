//! A bridge that shows a recording, and a page of it: no node runs.

use std::rc::Rc;

use integration_tests::{Process, Sandbox};

use super::chromium::Turn;
use super::stage::{ANY_PORT, address, start_bridge};
use super::tab::Tab;

/// What a test of a recording drives. It ends in the order of the fields.
pub(crate) struct Replay {
    pub(crate) tab: Tab,
    _bridge: Process,
    _sandbox: Sandbox,
}

impl Replay {
    /// `file`: the recording. `look`: what stands behind the "#" of the address.
    pub(crate) fn open(sandbox: Sandbox, file: &str, look: &str) -> Self {
        let turn = Rc::new(Turn::take());
        let args = ["--listen", ANY_PORT, "--replay", file];
        let (bridge, url) = start_bridge(&sandbox, &args);
        let tab = Tab::open(&turn, &address(&url, look));
        Self { tab, _bridge: bridge, _sandbox: sandbox }
    }
}
