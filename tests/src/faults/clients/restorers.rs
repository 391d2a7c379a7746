//! Actions that put states in place, and a foreign process that writes noise into the services.

use crate::faults::action::Ending;
use crate::faults::actor::{Actor, Ends};
use crate::faults::clients::CLIENT_ENDS;
use crate::faults::world::World;
use crate::programs::Program;

/// Most stopped clients at the same time.
const STOPPED_MAX: usize = 2;
/// Client id of the first client that gives states. Each one has another.
const RESTORER_ID: u64 = 4000;
/// Particles in the states of a foreign process: those of the curtain.
const PARTICLE_COUNT: &str = "168";

/// Ends of a client that gives states. One that was stopped while it attached finds no node later.
const RESTORER_ENDS: Ends =
    Ends { codes: &[0], errors: &["no node runs as"], needs_no_signal: false };
/// Ends of `recorder restore`: the node runs another scene, has gone, or is not there, or the recording is
/// later than the time.
const RESTORE_ENDS: Ends = Ends {
    codes: &[0],
    errors: &[
        "no node runs as",
        "but the node runs a scene with the hash",
        "has no complete state",
    ],
    needs_no_signal: true,
};

impl World {
    pub(in crate::faults) fn kill_restorer(&mut self, contents: &str, changes: u32) {
        let restorer = self.create_restorer(contents);
        restorer.kill_after(changes, &self.files, &mut self.journal);
    }

    /// Starts a client that gives states, and stops it somewhere on its way.
    pub(in crate::faults) fn stop_restorer(&mut self, contents: &str, changes: u32) {
        if self.node.is_none() || self.restorers.len() == STOPPED_MAX {
            return;
        }
        let mut restorer = self.create_restorer(contents);
        self.files.wait_for_changes(changes, || !restorer.is_running());
        restorer.set_stopped(true);
        self.restorers.push(restorer);
        self.wait_for_steps(1);
    }

    /// Continues the client that was stopped first, and ends it.
    pub(in crate::faults) fn end_restorer(&mut self, ending: Ending) {
        if !self.restorers.is_empty() {
            self.restorers.remove(0).end(ending, &self.files, &mut self.journal);
        }
    }

    fn create_restorer(&mut self, contents: &str) -> Actor {
        let client_id = (RESTORER_ID + self.restorer_count).to_string();
        self.restorer_count += 1;
        let args = [client_id.as_str(), contents];
        Actor::start(Program::Restorer, &self.sandbox, &args, RESTORER_ENDS)
    }

    /// Gives a state of the newest kept recording to the node.
    pub(in crate::faults) fn restore(&mut self, time_ms: u32, changes: Option<u32>) {
        let Some(file) = self.kept.newest() else { return };
        let time = format!("{time_ms}ms");
        let args = ["restore", &file, "--time", &time, "--timeout", "180s"];
        let restore = Actor::start(Program::Recorder, &self.sandbox, &args, RESTORE_ENDS);
        match changes {
            None => restore.wait(&mut self.journal),
            Some(changes) => restore.kill_after(changes, &self.files, &mut self.journal),
        };
    }

    /// Lets a foreign process write random bytes into `ready` and `restore` without a pause. The node makes
    /// its steps meanwhile, and counts what it refuses.
    pub(in crate::faults) fn write_noise(&mut self, steps: u64, ending: Ending) {
        if self.node.is_none() {
            return;
        }
        let before = self.node_status();
        let prefix = format!("{}_", self.sandbox.domain());
        let root = self.sandbox.root().to_string_lossy().into_owned();
        let args = [prefix.as_str(), &root, PARTICLE_COUNT];
        let mut writer = Actor::start(Program::ForeignWriter, &self.sandbox, &args, CLIENT_ENDS);
        assert!(writer.wait_until_ready(), "a foreign process did not start");
        self.wait_for_steps(steps);
        crate::wait::wait_for("a node that counts what it refuses", || {
            let status = self.node_status();
            let is_counted = status.rejected_count > before.rejected_count + steps;
            (is_counted || status.run_id != before.run_id).then_some(())
        });
        writer.end(ending, &self.files, &mut self.journal);
    }
}
