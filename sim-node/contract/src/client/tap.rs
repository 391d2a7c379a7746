//! The tap: reads everything that an owner publishes.

use std::time::Duration;

use crate::client::change::LostChanges;
use crate::client::state::{State, StateAssembler};
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

/// Most reads of every service for one state. Each read receives at most one buffer.
const READS_MAX: usize = 8;

/// Reads everything that an owner publishes, as a sequence of coherent states. The particles are not
/// copied.
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
    // Dropped last: the ports belong to its services and its node.
    attachment: Attachment,
}

impl Tap {
    /// Attaches to a running simulation. Subscribes to the outcomes first and to the particles last, so
    /// that it misses no message that belongs to a snapshot.
    ///
    /// # Errors
    /// No simulation runs there, it has another version of the contract, or a service has no place for
    /// another reader.
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

    /// Returns the oldest unread state with everything that belongs to it; `None` if all were read. A
    /// reader more than [`crate::SNAPSHOTS_BUFFERED`] states behind misses some.
    ///
    /// `on_message` receives every other message as it arrives. A message can arrive before its state
    /// is published, such as an outcome of a paused node.
    pub fn next_state(&mut self, on_message: impl FnMut(&Update<'_>)) -> Option<State<'_>> {
        let arrived = self.particles.next();
        self.assemble(arrived, on_message)
    }

    /// Returns the newest unread state and skips those before it; `None` if all were read. Its changes
    /// are all changes since the last returned state. `on_message` is the same as in
    /// [`Tap::next_state`].
    pub fn latest_state(&mut self, on_message: impl FnMut(&Update<'_>)) -> Option<State<'_>> {
        let arrived = self.particles.newest();
        self.assemble(arrived, on_message)
    }

    /// Reads the messages up to a snapshot and assembles its state. An owner publishes the particles of
    /// a step last, so the messages that belong to a snapshot have arrived before it.
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

    /// Removes and returns the errors of messages that could not be read.
    pub fn drain_errors(&mut self) -> Vec<ReadError> {
        std::mem::take(&mut self.errors)
    }

    /// Returns the numbers of changes that were dropped because their state did not arrive.
    pub fn lost_changes(&self) -> LostChanges {
        self.assembler.lost_changes()
    }

    /// Passes the unread messages of all services except `particles` to `sink`: at most one buffer of
    /// each service, oldest first. Drops malformed messages and returns their errors.
    fn drain_updates(&mut self, mut sink: impl FnMut(Update<'_>)) -> Drained {
        let mut drained = Drained::default();
        let result = &mut drained;
        self.scene.drain(result, |header, bytes| sink(Update::Scene(header, bytes)));
        self.topology.drain(result, |header, items| sink(Update::Topology(header, items)));
        self.surface.drain(result, |header, items| sink(Update::Surface(header, items)));
        self.colliders.drain(result, |header, items| sink(Update::Colliders(header, items)));
        self.tears.drain(result, |header, items| sink(Update::Tears(header, items)));
        self.parameters.drain(result, |header, states| {
            sink(Update::Parameters(header, &to_values(states)));
        });
        self.keyframe.drain(result, |header, bytes| sink(Update::Keyframe(header, bytes)));
        self.outcomes.drain(result, |outcome| sink(Update::Outcome(outcome)));
        self.status.drain(result, |status| sink(Update::Status(status)));
        drained
    }

    /// Waits until the owner wakes its readers, a signal arrives, or `timeout` has passed. An event since
    /// the last wait ends it at once.
    pub fn wait(&self, timeout: Duration) {
        self.listener.wait(timeout);
    }

    /// Returns `true` if the process that owns the name is alive. Reads the file system: call it a few
    /// times per second at most.
    pub fn is_owner_alive(&self) -> bool {
        self.attachment.owner().is_some()
    }
}
