//! Publishes a recording as the node did that was recorded.

use anyhow::{Context, bail};
use recorder::{CollidersRow, Frame, Message, RunDescription, StatusRow, SurfaceRow, TopologyRow};
use sim_contract::clock::monotonic_ns;
use sim_contract::{
    CONTRACT_VERSION, CollidersHeader, Command, Endpoint, KeyframeHeader, Load, LoadHeader,
    NodeStatus, Outcome, Owner, SnapshotFlags, SnapshotHeader, StatusFlags, TearsHeader, Wake,
};

use super::control::Control;
use super::position::{Happening, Position, happenings};

/// What a recording has at its head: enough to take a name.
#[derive(Debug)]
pub(crate) struct Recorded<'a> {
    pub(crate) run: &'a RunDescription,
    pub(crate) scene: &'a [u8],
    pub(crate) topology: &'a TopologyRow,
    pub(crate) surface: &'a SurfaceRow,
    pub(crate) collider_count: usize,
    /// The longest keyframe of its scene.
    pub(crate) keyframe_size_bytes_max: usize,
}

/// One pass of a recording: a run of its own.
#[derive(Debug)]
pub(crate) struct Replay {
    owner: Owner,
    run: RunDescription,
    run_id: u64,
    pub(crate) control: Control,
    /// Simulated time per wall-clock time.
    rate: f64,
    position: Position,
    /// The last step that was published.
    step: u64,
    /// The node's last status in the recording.
    status: Option<StatusRow>,
    /// Reused by every look for commands.
    arrived: Vec<Command>,
}

impl Replay {
    /// Takes the name and publishes the scene.
    pub(crate) fn new(
        endpoint: &Endpoint,
        recorded: &Recorded<'_>,
        position: Position,
        rate: f64,
    ) -> anyhow::Result<Self> {
        let Recorded { run, scene, topology, surface, .. } = *recorded;
        let run_id = getrandom::u64().context("no random number for the run")?;
        let constraints = topology.constraints().context("/topology has unequal columns")?;
        let triangles = surface.triangles().context("/surface has half a triangle")?;
        let header = LoadHeader { run_id, ..run.load_header(topology) };
        let load = Load {
            header,
            scene,
            constraints: &constraints,
            triangles: &triangles,
            collider_count: recorded.collider_count,
            keyframe_size_bytes_max: recorded.keyframe_size_bytes_max,
            parameters: position.parameters,
        };
        let owner = Owner::create(endpoint, &load)?;
        let run = run.clone();
        let control = Control::new(false);
        let (step, status, arrived) = (0, None, Vec::new());
        Ok(Self { owner, run, run_id, control, rate, position, step, status, arrived })
    }

    /// Publishes what a late joiner of the live node would have found before the first snapshot of
    /// this pass: the colliders, what tore, and the newest keyframe.
    pub(crate) fn publish_latched(&mut self, step: u64) -> anyhow::Result<()> {
        if let Some(row) = self.position.latched_colliders.take() {
            self.publish_colliders(&row)?;
        }
        if !self.position.torn.is_empty() {
            self.publish_tears(step, 0)?;
        }
        if let Some(bytes) = self.position.latched_keyframe.take() {
            self.publish_keyframe(self.position.keyframe_step, &bytes)?;
        }
        Ok(())
    }

    /// Publishes a snapshot and all that belongs to it, in the recorded order.
    pub(crate) fn publish(&mut self, frame: &Frame) -> anyhow::Result<()> {
        for happening in happenings(&frame.updates) {
            self.position.follow(happening);
            match happening {
                Happening::Reset(step) => self.publish_tears(step, 0)?,
                Happening::Update(update) => self.publish_update(update)?,
            }
        }
        if frame.particles.len() != self.run.particle_count as usize {
            let (step, count) = (frame.row.step, frame.particles.len());
            bail!("step {step} has {count} particles, the scene {}", self.run.particle_count);
        }
        self.owner.publish_particles(&self.header(frame), |index| frame.particles[index])?;
        self.owner.wake(Wake::Frame);
        self.step = frame.row.step;
        self.control.count_step();
        Ok(())
    }

    fn publish_update(&mut self, update: &Message) -> anyhow::Result<()> {
        match update {
            Message::Keyframe { step, bytes } => {
                self.publish_keyframe(*step, bytes)?;
                self.owner.publish_parameters(self.run_id, *step, &self.position.parameters)?;
            }
            Message::Outcome(row) => {
                self.owner.publish_outcome(&Outcome::from(row))?;
                self.owner.wake(Wake::Outcome);
            }
            Message::Colliders(row) => self.publish_colliders(row)?,
            Message::Tears(row) => {
                let new_count = u32::try_from(row.constraints.len()).unwrap_or(u32::MAX);
                self.publish_tears(row.step, new_count)?;
            }
            Message::Status(row) => self.status = Some(row.clone()),
            // The load is published already, and there is no service for the others.
            _ => {}
        }
        Ok(())
    }

    fn publish_keyframe(&self, step: u64, bytes: &[u8]) -> anyhow::Result<()> {
        let size_bytes = bytes.len() as u64;
        let header = KeyframeHeader { run_id: self.run_id, step, size_bytes };
        Ok(self.owner.publish_keyframe(header, bytes)?)
    }

    fn publish_tears(&self, step: u64, new_count: u32) -> anyhow::Result<()> {
        let since_step = self.position.since_step;
        let header = TearsHeader { run_id: self.run_id, step, since_step, new_count, count: 0 };
        self.owner.publish_tears(header, &self.position.torn)?;
        self.owner.wake(Wake::Tears);
        Ok(())
    }

    fn publish_colliders(&self, row: &CollidersRow) -> anyhow::Result<()> {
        let header = CollidersHeader { run_id: self.run_id, step: row.step, count: 0, spare: 0 };
        Ok(self.owner.publish_colliders(header, &row.states())?)
    }

    fn header(&self, frame: &Frame) -> SnapshotHeader {
        let row = &frame.row;
        let paused = if self.position.is_paused { SnapshotFlags::PAUSED } else { 0 };
        SnapshotHeader {
            contract_version: CONTRACT_VERSION,
            solver_version: self.run.solver_version,
            run_id: self.run_id,
            step: row.step,
            scene_step: row.scene_step,
            keyframe_step: self.position.keyframe_step,
            sim_time_ns: self.run.time_of_step_ns(row.step) - self.run.epoch_ns,
            publish_monotonic_ns: monotonic_ns(),
            state_hash: row.state_hash,
            outcome_count: row.outcome_count,
            wake_late_ns: row.wake_late_ns,
            solve_ns: row.solve_ns,
            topology_revision: row.topology_revision,
            torn_count: row.torn_count,
            particle_count: self.run.particle_count,
            flags: SnapshotFlags::REPLAY | paused,
            stride: 1,
            spare: 0,
        }
    }

    /// Takes commands and answers them; the answers are not part of the recorded run. `next_step`
    /// is the first that can show an effect.
    pub(crate) fn answer_commands(&mut self, next_step: u64) -> anyhow::Result<bool> {
        self.owner.refresh();
        self.owner.receive_commands(&mut self.arrived);
        let has_any = !self.arrived.is_empty();
        for command in self.arrived.drain(..) {
            let result = self.control.obey(command.action());
            let index = self.position.outcome_count;
            let mut outcome = Outcome::new(index, next_step, command, result);
            outcome.flags = sim_contract::OUTCOME_FLAG_CONTROL;
            self.owner.publish_outcome(&outcome)?;
            self.owner.wake(Wake::Outcome);
        }
        Ok(has_any)
    }

    /// Readers of the snapshots.
    pub(crate) fn reader_count(&self) -> usize {
        self.owner.reader_count()
    }

    /// Says how the replay does, with what the node said of itself.
    pub(crate) fn publish_status(&self) -> anyhow::Result<()> {
        let mut status = NodeStatus {
            contract_version: CONTRACT_VERSION,
            solver_version: self.run.solver_version,
            run_id: self.run_id,
            step: self.step,
            real_time_factor: if self.control.is_moving() { self.rate } else { 0.0 },
            time_scale: self.rate,
            outcome_count: self.position.outcome_count,
            rejected_count: self.position.rejected_count,
            rate_hz: self.run.rate_hz,
            particle_count: self.run.particle_count,
            constraint_count: self.run.constraint_count,
            torn_count: u32::try_from(self.position.torn.len()).unwrap_or(u32::MAX),
            reader_count: u32::try_from(self.reader_count()).unwrap_or(u32::MAX),
            process_id: std::process::id(),
            flags: StatusFlags::REPLAY
                | if self.control.is_paused { StatusFlags::PAUSED } else { 0 },
            ..NodeStatus::default()
        };
        if let Some(row) = &self.status {
            status.wake_late_ns_p50 = row.wake_late_ns_p50;
            status.wake_late_ns_p99 = row.wake_late_ns_p99;
            status.solve_ns_p50 = row.solve_ns_p50;
            status.solve_ns_p99 = row.solve_ns_p99;
            status.late_steps = row.late_steps;
            status.skipped_periods = row.skipped_periods;
            status.frozen_count = row.frozen_count;
        }
        status.set_scene_name(&self.run.scene_name);
        self.owner.publish_status(&status)?;
        self.owner.wake(Wake::Status);
        Ok(())
    }
}
