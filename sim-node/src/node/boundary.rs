//! The boundary before a step: applies commands, releases the grabs of lost clients, loads scenes.

use anyhow::Context;
use sim_contract::clock::monotonic_ns;
use sim_contract::{
    Action, COMMANDS_PER_STEP_MAX, Command, OwnerError, Reason, ReceivedCommand, Stop,
};
use sim_solver::{Applied, Control};

use super::Node;
use super::loading::{Refusal, load_scene};

impl Node {
    /// Applies the commands that have arrived, at the boundary before the next step.
    ///
    /// If the node pauses here, the state before these commands must be published. A boundary of a
    /// step that is not due has further polls, and one of them may bring the pause.
    pub(super) fn apply_commands(&mut self, is_step_due: bool, stop: &Stop) -> anyhow::Result<()> {
        if self.inbox.has_room() {
            self.publisher.receive_commands(&mut self.arrived);
            self.inbox.add(self.arrived.drain(..));
        }
        let lost =
            self.grab_connections.remove_lost(monotonic_ns(), || self.publisher.connections());
        // Together they are at most one turn, so that readers can keep up with the outcomes.
        let turn = self.inbox.next_turn(COMMANDS_PER_STEP_MAX - lost.len());
        let has_pause = turn.iter().any(|received| received.command.action() == Action::Pause);
        let has_any = !turn.is_empty() || !lost.is_empty();
        if has_pause || (has_any && !is_step_due) {
            self.publisher.publish_left_out(&self.solver, self.position())?;
        }
        // The releases come first, so that none of them ends a grab of this turn.
        for release in lost {
            self.release_lost(release);
        }
        if !turn.is_empty() {
            self.polling.on_commands(monotonic_ns());
        }
        for received in turn {
            self.apply(&received, stop)?;
        }
        self.solver.finish_boundary();
        let time_scale = self.progress.time_scale;
        self.pace.set_time_scale(time_scale, monotonic_ns());
        self.publisher.publish_parameters(&self.solver, self.step + 1, time_scale)
    }

    fn apply(&mut self, received: &ReceivedCommand, stop: &Stop) -> anyhow::Result<()> {
        // A fresh status follows, so that `ctl status` shows the effect.
        self.next_status_ns = 0;
        let command = received.command;
        let result = match self.solver.apply(command.client_id, &command.action()) {
            Ok(Applied::Control(Control::Load { scene })) => {
                self.load(scene.as_str(), stop)?.map(|()| Applied::Reset)
            }
            Ok(applied) => self.progress.apply(applied).map(|()| applied),
            Err(reason) => Err(reason),
        };
        if result.is_ok() {
            self.grab_connections.on_applied(received);
        }
        self.publisher.add_outcome(self.step + 1, command, result);
        Ok(())
    }

    /// Releases a particle whose client is gone. A frozen particle has nothing to release, and no
    /// client waits for an answer.
    fn release_lost(&mut self, release: Command) {
        if self.solver.apply(release.client_id, &release.action()).is_ok() {
            self.publisher.add_disconnection(self.step + 1, release);
        }
    }

    /// Replaces the scene; the next step shows the initial state of the new one. The rate must stay.
    /// The inner result is the outcome. An outer error leaves neither scene able to continue.
    fn load(&mut self, source: &str, stop: &Stop) -> anyhow::Result<Result<(), Reason>> {
        let rate_hz = self.scene.solver.rate_hz;
        let (scene, solver) = match load_scene(source, self.options, rate_hz, &self.cpus, stop) {
            Some(Ok(loaded)) => loaded,
            Some(Err(Refusal { problem, reason })) => {
                self.warnings.print(&format!("load {source}: {problem}"));
                return Ok(Err(reason));
            }
            // This node ends.
            None => return Ok(Err(Reason::NoEffectHere)),
        };
        match self.publisher.load(&scene, &solver, self.step + 1, self.progress.time_scale) {
            Err(error @ OwnerError::Publish(_)) => {
                Err(error).context("publishing the loaded scene")
            }
            Err(error) => {
                self.warnings.print(&format!("load {source}: {error}"));
                Ok(Err(Reason::NoEffectHere))
            }
            Ok(()) => {
                (self.scene, self.solver) = (scene, solver);
                self.progress.is_reset_due = true;
                Ok(Ok(()))
            }
        }
    }
}
