//! The boundary before a step: applies commands, and releases the grabs of lost clients.

use bytemuck::cast_slice;
use sim_contract::{
    Action, CLIENT_ID_END, COMMANDS_PER_STEP_MAX, Command, Reason, ReceivedState, RestoreContents,
};
use sim_host::Stop;
use sim_host::clock::monotonic_ns;
use sim_solver::{Applied, Control, Keyframe, Particle};

use super::history::Target;
use super::inbox::{Given, Request};
use super::job::Done;
use super::{Boundary, Node};

impl Node {
    /// Applies the commands that have arrived, at the boundary before the next step.
    ///
    /// If the node pauses here, the state before these commands must be published. A boundary of a
    /// step that is not due has further polls, and one of them may bring the pause.
    pub(super) fn apply_commands(&mut self, is_step_due: bool, stop: &Stop) -> anyhow::Result<()> {
        self.receive();
        if self.boundary == Boundary::Closed {
            // The next step shows it without further changes.
            return Ok(());
        }
        let prepared = match self.finish_job(stop) {
            None => Vec::new(),
            Some((requests, Done::Scene(loaded))) => {
                self.publisher.publish_left_out(&self.solver, self.position())?;
                return requests.first().map_or(Ok(()), |load| self.answer_load(load, loaded));
            }
            Some((requests, Done::Constraints(prepared))) => {
                self.solver.offer(*prepared);
                requests
            }
            Some((requests, Done::Nothing)) => requests,
        };
        let prepared_count = prepared.len();
        let lost =
            self.grab_connections.remove_lost(monotonic_ns(), || self.publisher.connections());
        // Together they are at most one turn, so that readers can keep up with the outcomes.
        let turn = self.inbox.next_turn(COMMANDS_PER_STEP_MAX - lost.len(), prepared);
        let has_pause =
            turn.iter().any(|request| request.received.command.action() == Action::Pause);
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
        let mut turn = turn.into_iter();
        for request in turn.by_ref().take(prepared_count) {
            self.apply(&request);
        }
        for request in turn {
            self.process(request, stop)?;
        }
        self.publisher.switch_forces(&mut self.solver);
        self.solver.finish_boundary();
        if let Some(spare) = self.solver.withdraw() {
            self.spare = Some(spare);
        }
        self.begin_next_job();
        let time_scale = self.progress.time_scale;
        self.pace.set_time_scale(time_scale, monotonic_ns());
        self.publisher.publish_parameters(&self.solver, self.step + 1, time_scale)
    }

    /// Receives the commands and states that have arrived.
    fn receive(&mut self) {
        if self.inbox.has_room() {
            self.publisher.receive_commands(&mut self.arrived);
            self.inbox.add(self.arrived.drain(..));
        }
        if self.inbox.has_room_for_states() {
            self.inbox.add_states(self.publisher.receive_states());
        }
    }

    /// Applies a command, or starts its work beside the loop.
    fn process(&mut self, request: Request, stop: &Stop) -> anyhow::Result<()> {
        if self.inbox.is_held(request.received.command.client_id) {
            // One of its commands in this turn waits.
            self.inbox.put_back(request);
            return Ok(());
        }
        // The solver rejects the commands of a wrong client id.
        if let Action::Load { scene } = request.received.command.action()
            && request.received.command.client_id < CLIENT_ID_END
        {
            return self.load(request, scene, stop);
        }
        if self.is_long(&request) {
            self.put_aside(request);
        } else {
            self.apply(&request);
        }
        Ok(())
    }

    /// Applies a command, and logs its outcome.
    fn apply(&mut self, request: &Request) {
        // A fresh status follows, so that `ctl status` shows the effect.
        self.next_status_ns = 0;
        let mut command = request.received.command;
        let result = match self.solver.apply(command.client_id, &command.action()) {
            Ok(Applied::Control(Control::Rewind { to_step, back_steps })) => {
                self.rewind(Target { to_step, back_steps }, &mut command)
            }
            Ok(Applied::Control(Control::Restore)) => {
                self.restore(request.state.as_deref(), &mut command)
            }
            Ok(applied) => self.progress.apply(applied).map(|()| applied),
            Err(reason) => Err(reason),
        };
        if result.is_ok() {
            self.is_commanded = true;
            self.grab_connections.on_applied(&request.received);
        }
        self.publisher.add_outcome(self.step + 1, command, result);
    }

    /// Puts a kept state in place. Its step replaces the target in the command.
    fn rewind(&mut self, target: Target, command: &mut Command) -> Result<Applied, Reason> {
        let state = self.history.find(self.step, target)?;
        let to_step = state.step;
        let (particles, keyframe) = (self.history.particles(state), self.history.keyframe(state));
        self.solver.put_in_place(&particles, &keyframe).map_err(|error| {
            debug_assert!(
                false,
                "the kept state of step {to_step} does not belong to the scene: {error}"
            );
            Reason::InvalidState
        })?;
        self.history.add_branch(self.step + 1, to_step);
        self.grab_connections.on_rewind(self.solver.grabs());
        self.show_state_in_place();
        let action = Action::Rewind { to_step: Some(to_step), back_steps: None };
        *command = Command::new(command.client_id, command.sequence, action);
        Ok(Applied::InPlace)
    }

    /// Puts a given state in place. Its hash replaces that of the command.
    fn restore(&mut self, given: Option<&Given>, command: &mut Command) -> Result<Applied, Reason> {
        // A command without a state has come through the wrong service.
        let given = given.ok_or(Reason::NoEffectHere)?;
        let state =
            given.as_ref().map_err(|malformed| format!("the message is malformed: {malformed}"));
        let result = state.and_then(|state| self.put_in_place(state).map(|()| state));
        let state = result.map_err(|problem| {
            self.warnings.print(&format!("restore: {problem}"));
            Reason::InvalidState
        })?;
        let contents = match &state.keyframe {
            Some(_) => RestoreContents::State,
            None => RestoreContents::Motion,
        };
        self.show_state_in_place();
        let action = Action::Restore { contents, state_hash: self.solver.hash_in_place() };
        *command = Command::new(command.client_id, command.sequence, action);
        Ok(match contents {
            RestoreContents::State => Applied::InPlace,
            // The torn constraints stay.
            RestoreContents::Motion => Applied::State,
        })
    }

    fn put_in_place(&mut self, state: &ReceivedState) -> Result<(), String> {
        let own_hash = self.publisher.scene_hash();
        if state.scene_hash != own_hash {
            return Err(format!(
                "the state belongs to the scene {:016x}, but this node runs {own_hash:016x}",
                state.scene_hash
            ));
        }
        let particles: &[Particle] = cast_slice(&state.particles);
        let result = match &state.keyframe {
            None => self.solver.put_motion_in_place(particles),
            Some(bytes) => {
                let keyframe = Keyframe::decode(bytes).map_err(|error| error.to_string())?;
                self.solver.put_in_place(particles, &keyframe)
            }
        };
        result.map_err(|error| error.to_string())
    }

    fn show_state_in_place(&mut self) {
        self.progress.is_state_due = true;
        self.boundary = Boundary::Closed;
        self.publisher.show_in_place(self.step + 1);
    }

    /// Releases a particle whose client is gone. A frozen particle has nothing to release, and no
    /// client waits for an answer.
    fn release_lost(&mut self, release: Command) {
        if self.solver.apply(release.client_id, &release.action()).is_ok() {
            self.is_commanded = true;
            self.publisher.add_disconnection(self.step + 1, release);
        }
    }
}
