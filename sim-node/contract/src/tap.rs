//! Everything that an owner publishes, for a recorder.

use std::time::Duration;

use crate::parameters::to_values;
use crate::reader::{Drained, ReadError, SliceReader, ValueReader};
use crate::service::{
    COLLIDERS, KEYFRAME, OUTCOMES, PARAMETERS, PARTICLES, SCENE, STATUS, SURFACE, ServiceError,
    TEARS, TOPOLOGY,
};
use crate::services::{AttachError, Attachment};
use crate::session::Session;
use crate::wake::WakeListener;
use crate::watch::listen;
use crate::{
    ColliderState, CollidersHeader, ConstraintState, Endpoint, KeyframeHeader, LoadHeader,
    NodeStatus, Outcome, ParameterState, ParameterValues, ParametersHeader, ParticleState,
    Snapshot, SnapshotHeader, TearsHeader, TornConstraint, Triangle,
};

/// Reads everything that an owner publishes, without a copy.
///
/// An owner publishes the particles of a step last. So drain the particles first and the updates
/// after them: then all that belongs to those snapshots has been seen.
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
    // Services and node go last.
    attachment: Attachment,
}

/// A message that is not a snapshot, in shared memory.
#[derive(Debug, Clone, Copy)]
pub enum Update<'a> {
    /// The scene of a load, as TOML.
    Scene(&'a LoadHeader, &'a [u8]),
    /// The constraints of a load.
    Topology(&'a LoadHeader, &'a [ConstraintState]),
    /// The triangles of a load; may be none.
    Surface(&'a LoadHeader, &'a [Triangle]),
    /// All colliders in their poses at the end of a step.
    Colliders(&'a CollidersHeader, &'a [ColliderState]),
    /// All constraints torn since the load or the last reset.
    Tears(&'a TearsHeader, &'a [TornConstraint]),
    /// The values of all parameters.
    Parameters(&'a ParametersHeader, &'a ParameterValues),
    /// What completes a snapshot.
    Keyframe(&'a KeyframeHeader, &'a [u8]),
    /// What became of a command.
    Outcome(&'a Outcome),
    /// How the node is doing.
    Status(&'a NodeStatus),
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
            attachment,
        })
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
