//! Everything that an owner publishes, for a recorder.

use std::time::Duration;

use crate::reader::{ReadError, SliceReader, ValueReader};
use crate::service::{
    KEYFRAME, OUTCOMES, PARTICLES, SCENE, STATUS, SURFACE, ServiceError, TEARS, TOPOLOGY,
};
use crate::services::{AttachError, Attachment};
use crate::session::Session;
use crate::wake::WakeListener;
use crate::watch::listen;
use crate::{
    ConstraintState, Endpoint, KeyframeHeader, LoadHeader, NodeStatus, Outcome, ParticleState,
    SnapshotHeader, TearsHeader, Triangle,
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
    tears: SliceReader<u32, TearsHeader>,
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
    /// All constraints torn since the load.
    Tears(&'a TearsHeader, &'a [u32]),
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
            tears: SliceReader::create(&services.tears, &TEARS)?,
            scene: SliceReader::create(&services.scene, &SCENE)?,
            topology: SliceReader::create(&services.topology, &TOPOLOGY)?,
            surface: SliceReader::create(&services.surface, &SURFACE)?,
            keyframe: SliceReader::create(&services.keyframe, &KEYFRAME)?,
            particles: SliceReader::create(&services.particles, &PARTICLES)?,
            attachment,
        })
    }

    /// Shows the snapshots that have come to `sink`, oldest first, at most
    /// [`crate::SNAPSHOTS_BUFFERED`]; returns how many.
    ///
    /// # Errors
    /// A malformed message, which was dropped: those after it are read by the next call.
    pub fn drain_particles(
        &mut self,
        sink: impl FnMut(&SnapshotHeader, &[ParticleState]),
    ) -> Result<usize, ReadError> {
        self.particles.drain(sink)
    }

    /// Shows everything else that has come to `sink`, each kind oldest first and at most one buffer
    /// of it; returns how many.
    ///
    /// # Errors
    /// As [`Tap::drain_particles`].
    pub fn drain_updates(&mut self, mut sink: impl FnMut(Update<'_>)) -> Result<usize, ReadError> {
        let mut count = 0;
        count += self.scene.drain(|header, bytes| sink(Update::Scene(header, bytes)))?;
        count += self.topology.drain(|header, all| sink(Update::Topology(header, all)))?;
        count += self.surface.drain(|header, all| sink(Update::Surface(header, all)))?;
        count += self.tears.drain(|header, all| sink(Update::Tears(header, all)))?;
        count += self.keyframe.drain(|header, bytes| sink(Update::Keyframe(header, bytes)))?;
        count += self.outcomes.drain(|outcome| sink(Update::Outcome(outcome)))?;
        count += self.status.drain(|status| sink(Update::Status(status)))?;
        Ok(count)
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
