//! Everything that an owner publishes, for a recorder.

use std::time::Duration;

use crate::client::state::{Change, State, StateAssembler};
use crate::client::views::Snapshot;
use crate::client::watch::listen;
use crate::endpoint::Endpoint;
use crate::messages::collider::{ColliderState, CollidersHeader};
use crate::messages::outcome::Outcome;
use crate::messages::parameters::to_values;
use crate::messages::parameters::{ParameterState, ParametersHeader};
use crate::messages::snapshot::{ParticleState, SnapshotHeader};
use crate::messages::status::NodeStatus;
use crate::messages::tears::{TearsHeader, TornConstraint};
use crate::messages::topology::{ConstraintState, KeyframeHeader, LoadHeader, Triangle};
use crate::messages::update::Update;
use crate::ports::reader::{Drained, ReadError, SliceReader, SliceSample, ValueReader};
use crate::ports::service::{
    COLLIDERS, KEYFRAME, OUTCOMES, PARAMETERS, PARTICLES, SCENE, STATUS, SURFACE, ServiceError,
    TEARS, TOPOLOGY,
};
use crate::ports::services::{AttachError, Attachment};
use crate::ports::session::Session;
use crate::ports::wake::WakeListener;

/// Times that every service is read for one state: each read takes at most one buffer.
const READS_MAX: usize = 8;

/// Reads everything that an owner publishes. The particles are not copied.
#[derive(Debug)]
pub struct Tap {
    listener: WakeListener,
    outcomes: ValueReader<Outcome>,
    status: ValueReader<NodeStatus>,
    colliders: SliceReader<ColliderState, CollidersHeader>,
    tears: SliceReader<TornConstraint, TearsHeader>,
    parameters: SliceReader<ParameterState, ParametersHeader>,
    scene: SliceReader<u8, LoadHeader>,
    topology: SliceReader<ConstraintState, LoadHeader>,
    surface: SliceReader<Triangle, LoadHeader>,
    keyframe: SliceReader<u8, KeyframeHeader>,
    particles: SliceReader<ParticleState, SnapshotHeader>,
    assembler: StateAssembler,
    /// The snapshot of the newest state.
    held: Option<SliceSample<ParticleState, SnapshotHeader>>,
    errors: Vec<ReadError>,
    // Services and node go last.
    attachment: Attachment,
}

impl Tap {
    /// Attaches to a running simulation. It subscribes to the outcomes first and to the particles
    /// last, so that nothing which a snapshot builds on is missed.
    ///
    /// # Errors
    /// No simulation runs there, one of another version of the contract, or no place is left.
    pub fn attach(endpoint: &Endpoint) -> Result<Self, AttachError> {
        let attachment = Attachment::open(Session::join(endpoint)?)?;
        Ok(Self::subscribe(attachment)?)
    }

    fn subscribe(attachment: Attachment) -> Result<Self, ServiceError> {
        let services = &attachment.services;
        // Fields are evaluated in the order written here.
        Ok(Self {
            listener: listen(&services.wake)?,
            outcomes: ValueReader::create(&services.outcomes, &OUTCOMES)?,
            status: ValueReader::create(&attachment.status, &STATUS)?,
            colliders: SliceReader::create(&services.colliders, &COLLIDERS)?,
            tears: SliceReader::create(&services.tears, &TEARS)?,
            parameters: SliceReader::create(&services.parameters, &PARAMETERS)?,
            scene: SliceReader::create(&services.scene, &SCENE)?,
            topology: SliceReader::create(&services.topology, &TOPOLOGY)?,
            surface: SliceReader::create(&services.surface, &SURFACE)?,
            keyframe: SliceReader::create(&services.keyframe, &KEYFRAME)?,
            particles: SliceReader::create(&services.particles, &PARTICLES)?,
            assembler: StateAssembler::default(),
            held: None,
            errors: Vec::new(),
            attachment,
        })
    }

    /// Returns the oldest state that was not read, with everything that belongs to it; `None` if all
    /// were read. A reader more than [`crate::SNAPSHOTS_BUFFERED`] states behind misses some.
    ///
    /// `on_message` receives every other message as it arrives, before its state if that has not
    /// been published: outcomes and statuses of a paused node, for example.
    pub fn next_state(&mut self, on_message: impl FnMut(&Update<'_>)) -> Option<State<'_>> {
        let arrived = self.particles.next();
        self.assemble(arrived, on_message)
    }

    /// Returns the newest state and skips those before it; `None` if all were read. The changes are
    /// those since the last state that was returned. `on_message` as in [`Tap::next_state`].
    pub fn latest_state(&mut self, on_message: impl FnMut(&Update<'_>)) -> Option<State<'_>> {
        let arrived = self.particles.newest();
        self.assemble(arrived, on_message)
    }

    /// An owner publishes the particles of a step last. So once a snapshot is there, the messages
    /// that belong to it can be read.
    fn assemble(
        &mut self,
        arrived: Result<Option<SliceSample<ParticleState, SnapshotHeader>>, ReadError>,
        mut on_message: impl FnMut(&Update<'_>),
    ) -> Option<State<'_>> {
        let mut assembler = std::mem::take(&mut self.assembler);
        for _ in 0..READS_MAX {
            let drained = self.drain_updates(|update| {
                on_message(&update);
                assembler.add(&update);
            });
            self.errors.extend(drained.errors);
            if drained.count == 0 {
                break;
            }
        }
        self.assembler = assembler;
        match arrived {
            Ok(sample) => self.held = sample,
            Err(error) => {
                self.held = None;
                self.errors.push(error);
            }
        }
        let sample = self.held.as_ref()?;
        self.assembler.assemble(sample.user_header(), sample.payload())
    }

    /// Changes that have arrived and belong to no state yet, such as those of a paused node. They
    /// are not returned again.
    pub fn drain_pending_changes(&mut self) -> Vec<Change> {
        self.assembler.take_waiting()
    }

    /// Errors of messages that were dropped since the last call.
    pub fn drain_errors(&mut self) -> Vec<ReadError> {
        std::mem::take(&mut self.errors)
    }

    /// Number of changes that were dropped because their state did not arrive.
    pub fn lost_change_count(&self) -> u64 {
        self.assembler.lost_count()
    }

    /// Shows the snapshots that have come to `sink`, oldest first, at most
    /// [`crate::SNAPSHOTS_BUFFERED`]. A malformed one is dropped, and named in the result.
    pub fn drain_particles(
        &mut self,
        sink: impl FnMut(&SnapshotHeader, &[ParticleState]),
    ) -> Drained {
        let mut drained = Drained::default();
        self.particles.drain(&mut drained, sink);
        drained
    }

    /// The newest snapshot that has come, if any has since the last call; those before it are
    /// skipped. For those who cannot use every one; beside [`Tap::drain_particles`], each snapshot
    /// goes to the one that is called first.
    ///
    /// # Errors
    /// More than [`crate::BORROWED_SAMPLES_MAX`] snapshots are held, or a malformed one came.
    pub fn latest_snapshot(&mut self) -> Result<Option<Snapshot>, ReadError> {
        Ok(self.particles.newest()?.map(Snapshot))
    }

    /// Shows everything else that has come to `sink`, each kind oldest first and at most one buffer
    /// of it. Malformed messages are dropped, and named in the result.
    pub fn drain_updates(&mut self, mut sink: impl FnMut(Update<'_>)) -> Drained {
        let mut drained = Drained::default();
        let all = &mut drained;
        self.scene.drain(all, |header, bytes| sink(Update::Scene(header, bytes)));
        self.topology.drain(all, |header, items| sink(Update::Topology(header, items)));
        self.surface.drain(all, |header, items| sink(Update::Surface(header, items)));
        self.colliders.drain(all, |header, items| sink(Update::Colliders(header, items)));
        self.tears.drain(all, |header, items| sink(Update::Tears(header, items)));
        self.parameters.drain(all, |header, states| {
            sink(Update::Parameters(header, &to_values(states)));
        });
        self.keyframe.drain(all, |header, bytes| sink(Update::Keyframe(header, bytes)));
        self.outcomes.drain(all, |outcome| sink(Update::Outcome(outcome)));
        self.status.drain(all, |status| sink(Update::Status(status)));
        drained
    }

    /// Waits until the owner wakes its readers, a signal comes, or `timeout` has passed. What
    /// happened since the last wait ends it at once.
    pub fn wait(&self, timeout: Duration) {
        self.listener.wait(timeout);
    }

    /// Whether the process that owns the name is alive. Looks into the file system: meant for a
    /// few calls per second.
    pub fn is_owner_alive(&self) -> bool {
        self.attachment.owner().is_some()
    }
}
