//! Publishes a recording like the recorded node.

use std::collections::VecDeque;

use anyhow::{Context, bail};
use recording::{
    CollidersRow, ForcesRow, Frame, Message, RecordedState, RunDescription, SurfaceRow, TopologyRow,
};
use sim_contract::{
    BendState, CONTRACT_VERSION, CollidersHeader, Command, Endpoint, ForcesHeader, KeyframeHeader,
    Load, LoadHeader, NodeStatus, OUTCOME_FLAG_CONTROL, Outcome, Owner, OwnerError,
    ParameterValues, Reason, ReceivedCommand, SnapshotFlags, SnapshotHeader, StatusFlags,
    TearsHeader, Torn, Wake,
};
use sim_host::clock::monotonic_ns;

use super::control::Control;
use super::lockstep::{Lockstep, Published};

/// The part of a recording that the owner of a name needs.
#[derive(Debug)]
pub(crate) struct Recorded<'a> {
    pub(crate) run: &'a RunDescription,
    pub(crate) scene: &'a [u8],
    pub(crate) topology: &'a TopologyRow,
    pub(crate) bends: &'a [BendState],
    pub(crate) surface: &'a SurfaceRow,
    pub(crate) collider_count: usize,
    /// Size of the longest keyframe of the scene.
    pub(crate) keyframe_size_bytes_max: usize,
}

/// The playback, for the status.
#[derive(Debug, Clone, Copy)]
pub(super) struct Playback<'a> {
    pub(super) control: Control,
    /// The last published step, or the first one of the run.
    pub(super) step: u64,
    /// Simulated time per wall-clock time, as measured.
    pub(super) real_time_factor: f64,
    pub(super) lockstep: &'a Lockstep,
    /// The last snapshot of the run is published.
    pub(super) is_at_end: bool,
}

/// A run of recorded snapshots, with its own run id.
#[derive(Debug)]
pub(crate) struct Replay {
    owner: Owner,
    run: RunDescription,
    run_id: u64,
    /// The state after the last published snapshot, without its particles.
    state: RecordedState,
    /// The last published list of torn constraints.
    published_torn: Torn,
    /// The last published parameters.
    published_parameters: ParameterValues,
    /// The last published step; `None` before the first.
    step: Option<u64>,
    /// The index of the next snapshot. A run counts from 0, so that readers know when they miss its start.
    next_index: u32,
    /// Readers of keyframes at the last check.
    keyframe_reader_count: usize,
    /// A reader has joined the keyframes since the newest one.
    is_keyframe_wanted: bool,
    /// Reused for each batch of commands.
    commands: Vec<ReceivedCommand>,
}

impl Replay {
    /// Publishes the scene, as the owner of the name. `owner` is that of the run before, whose readers stay
    /// connected.
    pub(crate) fn new(
        endpoint: &Endpoint,
        owner: Option<Owner>,
        recorded: &Recorded<'_>,
        state: RecordedState,
    ) -> anyhow::Result<Self> {
        let Recorded { run, scene, topology, bends, surface, .. } = *recorded;
        let run_id = getrandom::u64().context("cannot get a random run id")?;
        let constraints =
            topology.constraints().context("the columns of /topology differ in length")?;
        let triangles = surface
            .triangles()
            .context("the number of indices in /surface is not a multiple of three")?;
        let header = LoadHeader { run_id, ..run.load_header(topology) };
        let load = Load {
            header,
            scene,
            constraints: &constraints,
            bends,
            triangles: &triangles,
            collider_count: recorded.collider_count,
            keyframe_size_bytes_max: recorded.keyframe_size_bytes_max,
            parameters: state.parameter_values(),
        };
        let owner = own(endpoint, owner, &load)?;
        let run = run.clone();
        Ok(Self {
            owner,
            run,
            run_id,
            published_torn: Torn::default(),
            published_parameters: state.parameter_values(),
            state,
            step: None,
            next_index: 0,
            keyframe_reader_count: 0,
            is_keyframe_wanted: false,
            commands: Vec::new(),
        })
    }

    /// Returns the owner of the name.
    pub(super) fn owner(&self) -> &Owner {
        &self.owner
    }

    /// Returns the state after the last published snapshot, without its particles.
    pub(super) fn state(&self) -> &RecordedState {
        &self.state
    }

    /// Returns the last published step, or step 0 of the run before the first.
    pub(super) fn published(&self) -> Published {
        Published { run_id: self.run_id, step: self.step.unwrap_or_default() }
    }

    /// Ends the run. The name stays owned.
    pub(crate) fn into_owner(self) -> Owner {
        self.owner
    }

    /// Publishes the latched messages before the first snapshot: the colliders, the torn constraints
    /// and the newest keyframe. A late subscriber of the node would have received them.
    pub(crate) fn publish_latched(&mut self) -> anyhow::Result<()> {
        if let Some(row) = &self.state.colliders {
            self.publish_colliders(row)?;
        }
        self.publish_tears()?;
        if let Some((step, bytes)) = &self.state.keyframe {
            self.publish_keyframe(*step, bytes)?;
            self.is_keyframe_wanted = false;
        }
        Ok(())
    }

    /// Publishes a snapshot and the messages that belong to it, in the order of a node.
    pub(crate) fn publish(&mut self, frame: &Frame) -> anyhow::Result<()> {
        let particles = frame.payload();
        if particles.len() != self.run.particle_count as usize {
            let (step, count) = (frame.row.step, particles.len());
            bail!(
                "the snapshot of step {step} has {count} particles, but the scene has {}",
                self.run.particle_count
            );
        }
        for update in &frame.updates {
            self.state.apply(update);
            if let Message::Colliders(row) = update {
                self.publish_colliders(row)?;
            }
        }
        self.publish_tears()?;
        self.publish_parameters(frame.row.step)?;
        for update in &frame.updates {
            self.publish_update(update)?;
        }
        self.state.apply(&Message::Step(frame.row));
        let header = self.header();
        self.owner.publish_particles(&header, |index| particles[index])?;
        self.next_index = self.next_index.wrapping_add(1);
        self.owner.wake(Wake::Frame);
        self.step = Some(frame.row.step);
        Ok(())
    }

    fn publish_update(&mut self, update: &Message) -> anyhow::Result<()> {
        match update {
            Message::Forces(row) => self.publish_forces(row)?,
            Message::Keyframe { step, bytes } => {
                self.publish_keyframe(*step, bytes)?;
                self.is_keyframe_wanted = false;
            }
            Message::Outcome(row) => {
                let outcome = Outcome { run_id: self.run_id, ..Outcome::from(row) };
                self.owner.publish_outcome(&outcome)?;
                self.owner.wake(Wake::Outcome);
            }
            // The other messages are published already, or have no service.
            _ => {}
        }
        Ok(())
    }

    /// Publishes the forces of a step while a client reads them.
    fn publish_forces(&self, row: &ForcesRow) -> anyhow::Result<()> {
        if self.owner.forces_reader_count() > 0 {
            let header = ForcesHeader {
                run_id: self.run_id,
                step: row.step,
                rate_hz: self.run.rate_hz,
                ..ForcesHeader::default()
            };
            self.owner.publish_forces(header, &row.rows())?;
        }
        Ok(())
    }

    fn publish_keyframe(&self, step: u64, bytes: &[u8]) -> anyhow::Result<()> {
        let header = KeyframeHeader { run_id: self.run_id, step, ..KeyframeHeader::default() };
        Ok(self.owner.publish_keyframe(header, bytes)?)
    }

    /// Returns the last published step once after a reader has joined the keyframes, if it has none yet.
    pub(super) fn take_step_to_complete(&mut self) -> Option<u64> {
        let before =
            std::mem::replace(&mut self.keyframe_reader_count, self.owner.keyframe_reader_count());
        self.is_keyframe_wanted |= self.keyframe_reader_count > before;
        let step = self.step.filter(|step| self.state.keyframe_step() != *step)?;
        std::mem::take(&mut self.is_keyframe_wanted).then_some(step)
    }

    /// Publishes the keyframe of the last snapshot after it.
    pub(super) fn complete(&mut self, step: u64, bytes: Vec<u8>) -> anyhow::Result<()> {
        self.publish_keyframe(step, &bytes)?;
        self.state.keyframe = Some((step, bytes));
        self.owner.wake(Wake::Frame);
        Ok(())
    }

    /// Publishes the torn constraints, if they have changed.
    fn publish_tears(&mut self) -> anyhow::Result<()> {
        let torn = &self.state.torn;
        if *torn == self.published_torn {
            return Ok(());
        }
        self.published_torn.clone_from(torn);
        let header = TearsHeader { run_id: self.run_id, ..torn.header };
        self.owner.publish_tears(header, &torn.constraints)?;
        self.owner.wake(Wake::Tears);
        Ok(())
    }

    /// Publishes the parameters, if they have changed.
    fn publish_parameters(&mut self, step: u64) -> anyhow::Result<()> {
        let parameters = self.state.parameters.as_ref().map(|row| &row.values);
        if let Some(values) = parameters.filter(|values| **values != self.published_parameters) {
            self.published_parameters = values.clone();
            self.owner.publish_parameters(self.run_id, step, &self.published_parameters)?;
        }
        Ok(())
    }

    fn publish_colliders(&self, row: &CollidersRow) -> anyhow::Result<()> {
        let header =
            CollidersHeader { run_id: self.run_id, step: row.step, ..CollidersHeader::default() };
        self.owner.publish_colliders(header, &row.states())?;
        Ok(())
    }

    fn header(&self) -> SnapshotHeader {
        let row = &self.state.row;
        let paused = if self.state.is_paused { SnapshotFlags::PAUSED } else { 0 };
        SnapshotHeader {
            contract_version: CONTRACT_VERSION,
            run_id: self.run_id,
            keyframe_step: self.state.keyframe_step(),
            publish_monotonic_ns: monotonic_ns(),
            flags: SnapshotFlags::REPLAY | paused,
            stride: self.stride(row.step),
            snapshot_index: self.next_index,
            ..self.run.snapshot_header(row)
        }
    }

    /// Returns the distance of a step from the last published step, because a file does not contain the
    /// stride of its node.
    fn stride(&self, step: u64) -> u32 {
        let distance = step.saturating_sub(self.step.unwrap_or(step));
        u32::try_from(distance).unwrap_or(u32::MAX).max(1)
    }

    /// Returns the last published step; `None` before the first.
    pub(super) fn step(&self) -> Option<u64> {
        self.step
    }

    /// Serves late subscribers, and appends the commands that have arrived.
    pub(crate) fn receive_commands(&mut self, commands: &mut VecDeque<ReceivedCommand>) {
        self.owner.refresh();
        self.owner.receive_commands(&mut self.commands);
        // A replay refuses states, but answers the clients that give them.
        let mut states = Vec::new();
        self.owner.receive_states(&mut states);
        commands.extend(self.commands.drain(..));
        commands.extend(states.into_iter().map(|(command, _)| command));
    }

    /// Answers a command. The answer is not part of the recorded run. `step` is the first one that can
    /// show an effect.
    pub(crate) fn answer(
        &self,
        command: Command,
        step: u64,
        result: Result<(), Reason>,
    ) -> anyhow::Result<()> {
        let mut outcome = Outcome::new(self.state.row.outcome_count, step, command, result);
        outcome.run_id = self.run_id;
        outcome.flags = OUTCOME_FLAG_CONTROL;
        self.owner.publish_outcome(&outcome)?;
        self.owner.wake(Wake::Outcome);
        Ok(())
    }

    /// Returns the number of readers of snapshots.
    pub(crate) fn reader_count(&self) -> usize {
        self.owner.reader_count()
    }

    /// Publishes the status of the replay, with the recorded timing of the node.
    pub(super) fn publish_status(&self, playback: &Playback<'_>) -> anyhow::Result<()> {
        let Playback { control, step, real_time_factor, lockstep, is_at_end } = *playback;
        let mut status = NodeStatus {
            contract_version: CONTRACT_VERSION,
            solver_version: self.run.solver_version,
            run_id: self.run_id,
            step,
            real_time_factor,
            // As for a node without deadlines.
            time_scale: if control.rate.is_finite() { control.rate } else { 1.0 },
            outcome_count: self.state.row.outcome_count,
            rejected_count: self.state.rejected_count,
            rate_hz: self.run.rate_hz,
            particle_count: self.run.particle_count,
            constraint_count: self.run.constraint_count,
            torn_count: self.published_torn.header.count,
            reader_count: u32::try_from(self.reader_count()).unwrap_or(u32::MAX),
            process_id: std::process::id(),
            flags: StatusFlags::REPLAY
                | if control.is_paused { StatusFlags::PAUSED } else { 0 }
                | if is_at_end { StatusFlags::AT_END } else { 0 },
            ..NodeStatus::default()
        };
        for (entry, member) in status.members.iter_mut().zip(lockstep.members(step)) {
            *entry = member;
            status.member_count += 1;
        }
        if let Some(row) = &self.state.status {
            status.wake_late_ns_p50 = row.wake_late_ns_p50;
            status.wake_late_ns_p99 = row.wake_late_ns_p99;
            status.solve_ns_p50 = row.solve_ns_p50;
            status.solve_ns_p99 = row.solve_ns_p99;
            status.late_steps = row.late_steps;
            status.skipped_periods = row.skipped_periods;
            status.frozen_count = row.frozen_count;
            status.standing_body_steps = row.standing_body_steps;
        }
        status.set_scene_name(&self.run.scene_name);
        self.owner.publish_status(&status)?;
        self.owner.wake(Wake::Status);
        Ok(())
    }
}

/// Publishes a load as the owner of the name. Where memory lacks room for two loads, the name is free for
/// a moment between them.
fn own(endpoint: &Endpoint, owner: Option<Owner>, load: &Load<'_>) -> Result<Owner, OwnerError> {
    if let Some(mut owner) = owner {
        match owner.load(load) {
            Ok(()) => return Ok(owner),
            Err(OwnerError::NotEnoughSharedMemory { .. }) => drop(owner),
            Err(error) => return Err(error),
        }
    }
    Owner::create(endpoint, load)
}
