//! The owner of a name: the node or replay that publishes everything and takes the commands.

pub(crate) mod error;
pub(crate) mod load;

use std::cell::Cell;

use iceoryx2::port::notifier::NotifierCreateError;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::ipc;

use crate::endpoint::Endpoint;
use crate::limits::{CLIENTS_MAX, COMMANDS_BUFFERED};
use crate::messages::collider::{ColliderState, CollidersHeader};
use crate::messages::command::Command;
use crate::messages::outcome::Outcome;
use crate::messages::snapshot::{ParticleState, SnapshotHeader};
use crate::messages::status::NodeStatus;
use crate::messages::tears::{TearsHeader, TornConstraint};
use crate::messages::topology::KeyframeHeader;
use crate::owner::error::OwnerError;
use crate::owner::load::{Load, LoadWriters, check_limits, check_shared_memory};
use crate::ports::port::{Places, create_port, reader_count};
use crate::ports::reader::subscribe;
use crate::ports::service::{OUTCOMES, STATUS, ServiceError, WAKE};
use crate::ports::services::{Services, owner};
use crate::ports::session::{Access, Events, Session, Values};
use crate::ports::wake::{Wake, WakeSender};
use crate::ports::writer::PublishError;
use crate::ports::writer::ValueWriter;
use sim_types::ParameterValues;

/// The process that owns a name: it publishes everything and takes the commands.
///
/// Nothing here ever waits for a reader. Per step publish colliders, tears, keyframe, outcomes, and
/// the particles last; then [`Owner::wake`] the readers and [`Owner::refresh`] the latched messages.
/// Dropping it frees the name and wakes everyone with [`Wake::OwnerGone`].
#[derive(Debug)]
pub struct Owner {
    // Dropped in this order: readers first lose what they read, then the name is free, and only
    // then are they woken to find that out.
    writers: LoadWriters,
    outcomes: ValueWriter<Outcome>,
    commands: Subscriber<ipc::Service, Command, ()>,
    status: ValueWriter<NodeStatus>,
    wake: WakeSender,
    /// Readers at the last refresh, to notice new ones.
    readers_seen: Cell<usize>,
    /// Refreshes to come that wake the readers.
    wakes_due: Cell<u32>,
    services: Services,
    status_service: Values<NodeStatus>,
    // The node goes last.
    _session: Session,
}

/// Refreshes that wake a new reader. It is counted a moment before it can be given anything: the
/// first may come too early. One that is held up longer finds what it was given with a later wake.
const WAKES_PER_READER: u32 = 2;
/// Most commands that are taken at once: those that all clients together can have waiting.
const COMMANDS_TAKEN_MAX: usize = CLIENTS_MAX * COMMANDS_BUFFERED;

impl Owner {
    /// Takes the name, creates its services and publishes scene, topology and surface, and that
    /// nothing is torn; for a scene without colliders also that it has none.
    ///
    /// # Errors
    /// The name is taken, the load is beyond a limit of the contract or of shared memory, or a
    /// service could not be created.
    pub fn create(endpoint: &Endpoint, load: &Load<'_>) -> Result<Self, OwnerError> {
        check_limits(load)?;
        Self::create_in(Session::join(endpoint)?, load)
    }

    pub(crate) fn create_in(session: Session, load: &Load<'_>) -> Result<Self, OwnerError> {
        let status_service = session.values(&STATUS, Access::Create)?;
        let status = take_name(&session, &status_service)?;
        // By now the memory of a killed predecessor is free again.
        check_shared_memory(load)?;
        let services = Services::access(&session, Access::Create)?;
        let owner = Self {
            wake: wake_sender(&services.wake)?,
            commands: subscribe(&services.commands)?,
            outcomes: ValueWriter::create(&services.outcomes, &OUTCOMES)?,
            writers: LoadWriters::create(&services, load)?,
            status,
            readers_seen: Cell::new(0),
            wakes_due: Cell::new(0),
            services,
            status_service,
            _session: session,
        };
        owner.writers.publish(load)?;
        owner.wake(Wake::Load);
        Ok(owner)
    }

    /// Publishes another scene under the same name, as [`Owner::create`] does. Readers stay
    /// connected: after what they have not read of the old load, they are given the new one, and
    /// who comes later meets nothing else. Publish its colliders and its first snapshot next. The
    /// old load keeps its memory until this returns, and longer where a reader holds a snapshot.
    ///
    /// # Errors
    /// As [`Owner::create`]: the load is beyond a limit of the contract or of shared memory, or a
    /// writer could not be created. Then nothing has changed, and the old load can go on. Only after
    /// [`OwnerError::Publish`] it cannot: its writers have gone.
    pub fn load(&mut self, load: &Load<'_>) -> Result<(), OwnerError> {
        check_limits(load)?;
        check_shared_memory(load)?;
        // All of them are created before one of the old ones goes, and the old ones go before one
        // of these says anything: an error leaves the old load as it was, and readers, who empty
        // the buffers of writers that have gone first, never see the new load before the old.
        self.writers = LoadWriters::create(&self.services, load)?;
        self.writers.publish(load)?;
        self.wake(Wake::Load);
        Ok(())
    }

    /// Publishes a snapshot of `header.particle_count` particles: `particle(0)`, `particle(1)`, ...
    /// are written straight into shared memory, once.
    ///
    /// # Errors
    /// More particles than loaded, or no memory.
    pub fn publish_particles(
        &self,
        header: &SnapshotHeader,
        particle: impl Fn(usize) -> ParticleState,
    ) -> Result<(), PublishError> {
        self.writers.particles.write(*header, particle)
    }

    /// Publishes the keyframe that completes a published snapshot; `size_bytes` is filled in.
    ///
    /// # Errors
    /// A keyframe longer than announced at load, or no memory.
    pub fn publish_keyframe(
        &self,
        header: KeyframeHeader,
        bytes: &[u8],
    ) -> Result<(), PublishError> {
        let size_bytes = bytes.len() as u64;
        self.writers.keyframe.write(KeyframeHeader { size_bytes, ..header }, |index| bytes[index])
    }

    /// Publishes all constraints torn since the load or the last reset, in the order of tearing.
    /// `count` is filled in.
    ///
    /// # Errors
    /// More torn constraints than the load has, or no memory.
    pub fn publish_tears(
        &self,
        header: TearsHeader,
        torn: &[TornConstraint],
    ) -> Result<(), PublishError> {
        self.writers.publish_tears(header, torn)
    }

    /// Publishes the values of all parameters, from `step` on. A load publishes its own.
    ///
    /// # Errors
    /// No memory.
    pub fn publish_parameters(
        &self,
        run_id: u64,
        step: u64,
        values: &ParameterValues,
    ) -> Result<(), PublishError> {
        self.writers.publish_parameters(run_id, step, values)
    }

    /// Publishes all colliders in their poses at the end of a step, by index; `count` is filled in.
    /// To be called after a load with colliders, when one changes, and each step while one moves.
    ///
    /// # Errors
    /// More than announced at load, or no memory.
    pub fn publish_colliders(
        &self,
        header: CollidersHeader,
        colliders: &[ColliderState],
    ) -> Result<(), PublishError> {
        self.writers.publish_colliders(header, colliders)
    }

    /// Publishes what became of a command.
    ///
    /// # Errors
    /// No memory.
    pub fn publish_outcome(&self, outcome: &Outcome) -> Result<(), PublishError> {
        self.outcomes.write(*outcome).map(|_| ())
    }

    /// Publishes how the node is doing.
    ///
    /// # Errors
    /// No memory.
    pub fn publish_status(&self, status: &NodeStatus) -> Result<(), PublishError> {
        self.status.write(*status).map(|_| ())
    }

    /// Appends all commands that have arrived, each client's in the order of sending; returns how
    /// many. A client whose connection is broken is passed over: nothing from outside stops the
    /// owner.
    pub fn receive_commands(&self, commands: &mut Vec<Command>) -> usize {
        let before = commands.len();
        while commands.len() - before < COMMANDS_TAKEN_MAX {
            match self.commands.receive() {
                Ok(Some(command)) => commands.push(*command),
                Ok(None) | Err(_) => break,
            }
        }
        commands.len() - before
    }

    /// Readers of `particles`, killed ones included until their places are freed.
    pub fn reader_count(&self) -> usize {
        reader_count(&self.services.particles)
    }

    /// Readers of `keyframe`, counted like [`Owner::reader_count`].
    pub fn keyframe_reader_count(&self) -> usize {
        reader_count(&self.services.keyframe)
    }

    /// Gives readers that have come since the last call what is latched, and wakes them. Cheap:
    /// call it every step, and while paused.
    pub fn refresh(&self) {
        let readers = self.all_reader_count();
        if readers != self.readers_seen.replace(readers) {
            self.wakes_due.set(WAKES_PER_READER);
        }
        self.outcomes.refresh();
        self.status.refresh();
        self.writers.refresh();
        if self.wakes_due.get() > 0 {
            self.wakes_due.set(self.wakes_due.get() - 1);
            self.wake(Wake::Load);
        }
    }

    /// Wakes everyone who waits. Costs a system call per waiting process, nothing for others.
    pub fn wake(&self, what: Wake) {
        self.wake.wake(what);
    }

    fn all_reader_count(&self) -> usize {
        let services = &self.services;
        reader_count(&services.particles)
            + reader_count(&services.keyframe)
            + reader_count(&services.topology)
            + reader_count(&services.surface)
            + reader_count(&services.scene)
            + reader_count(&services.tears)
            + reader_count(&services.parameters)
            + reader_count(&services.colliders)
            + reader_count(&services.outcomes)
            + reader_count(&self.status_service)
    }
}

/// The status publisher is the lock: there can be only one.
fn take_name(
    session: &Session,
    service: &Values<NodeStatus>,
) -> Result<ValueWriter<NodeStatus>, OwnerError> {
    match ValueWriter::create(service, &STATUS) {
        Err(ServiceError::Full { .. }) => Err(OwnerError::NameTaken {
            endpoint: session.endpoint.clone(),
            process_id: owner(service).and_then(|process| process.id),
        }),
        status => Ok(status?),
    }
}

fn wake_sender(service: &Events) -> Result<WakeSender, ServiceError> {
    let full = NotifierCreateError::ExceedsMaxSupportedNotifiers;
    let places = Places { what: "notifiers", max: WAKE.publishers_max };
    let notifier = create_port(service, &full, places, || service.notifier_builder().create())?;
    Ok(WakeSender::new(notifier))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::Client;
    use crate::limits::OWNER_PUBLISHERS_MAX;
    use crate::messages::topology::{LoadHeader, Triangle};
    use crate::ports::service::SURFACE;
    use crate::ports::session::Slices;
    use crate::testing::TestDomain;

    const SOON: std::time::Duration = std::time::Duration::from_secs(10);

    fn load(topology_revision: u32) -> Load<'static> {
        Load {
            header: LoadHeader { topology_revision, ..LoadHeader::default() },
            scene: b"version = 1",
            constraints: &[],
            triangles: &[],
            collider_count: 0,
            keyframe_size_bytes_max: 8,
            parameters: ParameterValues::default(),
        }
    }

    #[test]
    fn a_load_without_a_place_for_one_of_its_writers_leaves_the_old_one_as_it_was() {
        let domain = TestDomain::new();
        let mut owner = Owner::create(&domain.endpoint(), &load(1)).unwrap();
        let session = Session::join(&domain.endpoint()).unwrap();
        let service: Slices<Triangle, LoadHeader> = session.slices(&SURFACE, Access::Open).unwrap();
        // A tunnel has the spare place; something else the one that a load needs.
        let strangers: Vec<_> = (1..OWNER_PUBLISHERS_MAX)
            .map(|_| service.publisher_builder().create().unwrap())
            .collect();
        let error = owner.load(&load(2)).unwrap_err();
        assert!(matches!(error, OwnerError::Service(ServiceError::Full { .. })), "{error}");

        let mut client = Client::attach(&domain.endpoint()).unwrap();
        let revision = |client: &mut Client| {
            let topology = client.topology(SOON).unwrap();
            topology.map(|topology| topology.header.topology_revision)
        };
        assert!(client.topology(std::time::Duration::ZERO).unwrap().is_none());
        owner.refresh();
        assert_eq!(revision(&mut client), Some(1));
        owner.publish_particles(&SnapshotHeader::default(), |_| unreachable!()).unwrap();
        owner.publish_keyframe(KeyframeHeader::default(), &[0; 8]).unwrap();

        drop(strangers);
        owner.load(&load(2)).unwrap();
        assert_eq!(revision(&mut client), Some(2));
    }
}
