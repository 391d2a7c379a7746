//! The owner of a name: the node or replay that publishes everything and receives the commands.

mod claim;
pub(crate) mod error;
mod forces;
pub(crate) mod load;
pub(crate) mod preparation;
mod repetition;

use std::cell::Cell;
use std::io;
use std::mem;
use std::path::PathBuf;
use std::sync::Arc;

use iceoryx2::port::notifier::NotifierCreateError;
use iceoryx2::prelude::PortFactory;
use sim_messages::{
    COMMANDS_BUFFERED, CONTRACT_VERSION, ColliderState, CollidersHeader, Command, KeyframeHeader,
    LoadHeader, MalformedState, NodeStatus, Outcome, ParameterValues, ParticleState,
    READY_BUFFERED, RESTORES_MAX, Ready, ReceivedState, RestoreHeader, SnapshotHeader, TearsHeader,
    TornConstraint,
};

use crate::endpoint::Endpoint;
use crate::owner::claim::{claim_name, take_lock};
use crate::owner::error::OwnerError;
use crate::owner::load::{Load, LoadWriters, check_limits, check_memory};
use crate::owner::preparation::{LoadPreparer, Preparation, ReplacedMemory};
use crate::owner::repetition::Repetition;
use crate::ports::connection::{self, ConnectionId, ReceivedCommand, receive_held, receive_round};
use crate::ports::leftovers::lock::OwnerLock;
use crate::ports::leftovers::orphans;
use crate::ports::leftovers::unfinished;
use crate::ports::port::{PortLimit, Service, create_port, reader_count};
use crate::ports::reader::Reader;
use crate::ports::service::{COMMANDS, OUTCOMES, READY, RESTORE, STATUS, ServiceError, WAKE};
use crate::ports::services::Services;
use crate::ports::session::{Access, Events, Session};
use crate::ports::wake::{Wake, WakeSender};
use crate::ports::writer::{PublishError, Writer};

/// The process that owns a name: it publishes everything and receives the commands.
///
/// No method waits for a reader. For each step, publish colliders, tears, parameters, keyframe and
/// outcomes, and the particles last. Then call [`Owner::wake`] and [`Owner::refresh`]. Dropping the
/// owner frees the name and wakes all waiting processes with [`Wake::OwnerGone`].
#[derive(Debug)]
pub struct Owner {
    // Dropped in this order: the writers go first, then `status`, so that readers notice that the owner
    // is gone when they wake. The name is free once all services are removed.
    preparation: Preparation,
    writers: LoadWriters,
    outcomes: Writer<Outcome>,
    commands: Reader<Command>,
    ready: Reader<Ready>,
    restore: Reader<u8, RestoreHeader>,
    status: Writer<NodeStatus>,
    wake: WakeSender,
    /// The request of a far reader.
    repetition: Repetition,
    /// Number of readers at the last refresh, to notice new readers.
    last_reader_count: Cell<usize>,
    /// Number of the next refreshes that wake the readers.
    wakes_due: Cell<u32>,
    /// The run of the last list of colliders, and the number of lists that it has published.
    collider_lists: Cell<(u64, u32)>,
    services: Arc<Services>,
    status_service: Service<NodeStatus>,
    // Dropped after the services, which belong to its node.
    session: Session,
    lock: OwnerLock,
}

/// Number of refreshes that wake a new reader. A reader is counted shortly before it can receive a
/// message, so the first wake may be too early. A reader that takes longer finds its messages at a
/// later wake.
const WAKES_PER_READER: u32 = 2;

impl Owner {
    /// Claims the name, creates its services and publishes scene, topology, bends, surface, parameters and an
    /// empty list of tears. For a scene without colliders, also publishes an empty list of colliders.
    ///
    /// # Errors
    /// Another process owns the name, the load exceeds a limit of the contract or of shared memory, or a
    /// service could not be created.
    pub fn create(endpoint: &Endpoint, load: &Load<'_>) -> Result<Self, OwnerError> {
        check_limits(load)?;
        Self::create_with_version(endpoint, CONTRACT_VERSION, load)
    }

    pub(crate) fn create_with_version(
        endpoint: &Endpoint,
        contract_version: u32,
        load: &Load<'_>,
    ) -> Result<Self, OwnerError> {
        let lock = take_lock(endpoint)?;
        let session = Session::join_with_version(endpoint, contract_version)?;
        unfinished::remove_nodes(session.config());
        let status_service = session.service(&STATUS, Access::Create)?;
        // The memory of a killed predecessor is free now.
        check_memory(load)?;
        let status = claim_name(&session, &status_service)?;
        let services = Arc::new(Services::access(&session, Access::Create)?);
        session.restore_orphans(&[services.ports(), orphans::ports(&status_service)].concat());
        let owner = Self {
            preparation: Preparation::new(Arc::clone(&services)),
            wake: wake_sender(&services.wake)?,
            commands: Reader::of_every_publisher(&services.commands, &COMMANDS)?,
            ready: Reader::of_every_publisher(&services.ready, &READY)?,
            restore: Reader::of_every_publisher(&services.restore, &RESTORE)?,
            outcomes: Writer::of_values(&services.config, &services.outcomes, &OUTCOMES)?,
            writers: LoadWriters::create(&services, load)?,
            status,
            repetition: Repetition::default(),
            last_reader_count: Cell::new(0),
            wakes_due: Cell::new(0),
            collider_lists: Cell::new((0, 0)),
            services,
            status_service,
            session,
            lock,
        };
        owner.publish_load(load)?;
        owner.wake(Wake::Load);
        Ok(owner)
    }

    /// Publishes another scene under the same name, like [`Owner::create`]. Readers stay connected:
    /// they receive the unread messages of the old load, then the new load. Later readers receive
    /// only the new load. Publish its colliders and its first snapshot next. The old load occupies
    /// its memory until this returns, and longer while a reader holds a snapshot.
    ///
    /// Another thread can take the memory in advance; see [`Owner::preparer`].
    ///
    /// # Errors
    /// The load exceeds a limit of the contract or of shared memory, or a writer could not be created:
    /// nothing has changed, and the old load can continue. After [`OwnerError::Publish`] it
    /// cannot continue, because its writers are gone.
    pub fn load(&mut self, load: &Load<'_>) -> Result<(), OwnerError> {
        self.load_after(load, |_| Ok(())).map(drop)
    }

    /// Returns a handle with which another thread prepares loads. A load, and the end of the owner, wait for
    /// a preparation in progress.
    pub fn preparer(&self) -> LoadPreparer {
        self.preparation.preparer()
    }

    /// Same as [`Owner::load`]. Calls `publish_last` once nothing but memory can fail, before anything of the
    /// new load is published. The caller chooses when to free the memory of the old load.
    ///
    /// # Errors
    /// Same as [`Owner::load`], or those of `publish_last`.
    pub fn load_after(
        &mut self,
        load: &Load<'_>,
        publish_last: impl FnOnce(&Self) -> Result<(), PublishError>,
    ) -> Result<ReplacedMemory, OwnerError> {
        // All new writers exist before the old ones are dropped, so an error leaves the old load as
        // it was. The old ones are dropped before the new ones publish: readers empty the buffers of
        // dropped writers first, so they never see the new load before the old.
        let writers = self.preparation.take(&self.services, load)?;
        publish_last(self)?;
        let replaced = ReplacedMemory::of(mem::replace(&mut self.writers, writers));
        self.publish_load(load)?;
        self.wake(Wake::Load);
        Ok(replaced)
    }

    /// Publishes a snapshot of `header.particle_count` particles: `particle(0)`, `particle(1)`, ...
    /// Each is written once, straight into shared memory.
    ///
    /// # Errors
    /// More particles than announced at load, or no memory.
    pub fn publish_particles(
        &self,
        header: &SnapshotHeader,
        particle: impl Fn(usize) -> ParticleState,
    ) -> Result<(), PublishError> {
        self.repetition.on_snapshot();
        self.writers.particles.write(*header, particle)
    }

    /// Publishes the keyframe that completes a published snapshot. Sets `size_bytes`.
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

    /// Publishes all torn constraints, in the order of tearing.
    /// Sets `count`.
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

    /// Publishes the values of all parameters from `step` on. A load publishes its own values.
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

    /// Publishes all colliders, by index, in their poses at the end of a step. Sets `count` and
    /// `list_index`. Call it
    /// after a load with colliders, when a collider changes, and each step while a collider moves.
    ///
    /// # Errors
    /// More colliders than announced at load, or no memory.
    pub fn publish_colliders(
        &self,
        header: CollidersHeader,
        colliders: &[ColliderState],
    ) -> Result<(), PublishError> {
        let list_index = self.next_list_index(header.run_id);
        self.writers.publish_colliders(CollidersHeader { list_index, ..header }, colliders)
    }

    /// Publishes what belongs to a load: its data, and for a scene without colliders an empty list of
    /// them. Without that list, readers would keep the list of the load before.
    fn publish_load(&self, load: &Load<'_>) -> Result<(), PublishError> {
        self.writers.publish(load)?;
        if load.collider_count > 0 {
            return Ok(());
        }
        let LoadHeader { run_id, step, .. } = load.header;
        self.publish_colliders(CollidersHeader { run_id, step, ..CollidersHeader::default() }, &[])
    }

    /// Returns the number of lists of colliders that the run has published, and counts one more.
    fn next_list_index(&self, run_id: u64) -> u32 {
        let (last_run_id, count) = self.collider_lists.get();
        let index = if run_id == last_run_id { count } else { 0 };
        self.collider_lists.set((run_id, index.wrapping_add(1)));
        index
    }

    /// Publishes the outcome of a command.
    ///
    /// # Errors
    /// No memory.
    pub fn publish_outcome(&self, outcome: &Outcome) -> Result<(), PublishError> {
        self.outcomes.send_value(*outcome).map(|_| ())
    }

    /// Publishes the status of the node.
    ///
    /// # Errors
    /// No memory.
    pub fn publish_status(&self, status: &NodeStatus) -> Result<(), PublishError> {
        self.status.send_value(*status).map(|_| ())
    }

    /// Appends the commands that have arrived, those of each connection in the order of sending, and at
    /// most one queue of each, so that a client that sends without a pause keeps no other waiting.
    /// Returns their number. Ends early at a client with a broken connection, and returns no error: no
    /// other process can stop the owner.
    pub fn receive_commands(&self, commands: &mut Vec<ReceivedCommand>) -> usize {
        let before = commands.len();
        receive_round(&self.commands, COMMANDS_BUFFERED, |command, connection| {
            commands.push(ReceivedCommand { command, connection });
        });
        commands.len() - before
    }

    /// Passes the messages of the members of the lockstep that have arrived to `receive`, as
    /// [`Owner::receive_commands`] does with commands. Whatever a foreign process has written comes too.
    /// Requests for the latched messages are answered by the next calls of [`Owner::refresh`].
    pub fn receive_ready(&self, mut receive: impl FnMut(Ready, ConnectionId)) {
        receive_round(&self.ready, READY_BUFFERED, |message, connection| {
            if message.tag == Ready::REPEAT_TAG {
                self.repetition.request();
            } else {
                receive(message, connection);
            }
        });
    }

    /// Appends the messages of clients that give a state, each with the command that its outcome answers: at most
    /// two of each connection, and [`crate::RESTORES_MAX`] in all.
    pub fn receive_states(
        &self,
        states: &mut Vec<(ReceivedCommand, Result<ReceivedState, MalformedState>)>,
    ) {
        let size_bytes_max = self.writers.state_size_bytes_max();
        receive_held(&self.restore, RESTORES_MAX, |header, payload, connection| {
            let received = ReceivedCommand { command: header.command(), connection };
            let state = ReceivedState::from_message(header, payload, size_bytes_max);
            states.push((received, state));
        });
    }

    /// Returns the connections of members, dead ones too. Cheap.
    pub fn listed_members(&self) -> Vec<ConnectionId> {
        connection::listed(&self.services.ready)
    }

    /// Returns the connections of living members. As costly as [`Owner::connections`].
    pub fn living_members(&self) -> Vec<ConnectionId> {
        connection::living(&self.services.ready)
    }

    /// Returns the connections through which living clients can send commands. It costs some system
    /// calls for each of them: call it a few times a second at most.
    pub fn connections(&self) -> Vec<ConnectionId> {
        connection::living(&self.services.commands)
    }

    /// Returns the number of readers of `particles`. Killed readers count until their places are freed.
    pub fn reader_count(&self) -> usize {
        reader_count(&self.services.particles)
    }

    /// Returns the number of readers of `keyframe`, counted like [`Owner::reader_count`], and of all answered
    /// requests of readers behind a tunnel. A higher number than before means that a reader needs a keyframe.
    pub fn keyframe_reader_count(&self) -> usize {
        reader_count(&self.services.keyframe) + self.repetition.answered_count()
    }

    /// Sends the latched messages to readers that joined since the last call, and wakes them. Cheap:
    /// call it every step, and while paused. After the request of a reader behind a tunnel, each of the next
    /// calls also publishes one of the latched messages again.
    pub fn refresh(&self) {
        if self.repetition.is_due() {
            self.repetition.publish_next(&self.services, &self.writers);
        }
        let reader_count = self.services.reader_count() + reader_count(&self.status_service);
        if reader_count != self.last_reader_count.replace(reader_count) {
            self.wakes_due.set(WAKES_PER_READER);
        }
        self.end_unread_forces();
        self.outcomes.refresh();
        self.status.refresh();
        self.writers.refresh();
        if self.wakes_due.get() > 0 {
            self.wakes_due.set(self.wakes_due.get() - 1);
            self.wake(Wake::Load);
        }
    }

    /// Wakes all waiting processes, with one system call for each of them, or only one after
    /// [`Owner::start_wake_thread`].
    pub fn wake(&self, event: Wake) {
        let listener_count = self.services.wake.dynamic_config().number_of_listeners();
        self.wake.wake(event, listener_count);
    }

    /// Starts a thread that wakes the waiting processes if there are several, so that their number does
    /// not delay the owner. The thread inherits the scheduling of the calling thread.
    ///
    /// # Errors
    /// The system starts no thread.
    pub fn start_wake_thread(&mut self) -> io::Result<()> {
        self.wake.start_thread()
    }

    /// Returns the first file of this owner that is missing in the root of the domain, or its lock in shared
    /// memory, because a cleaner or a person removed it. Connected clients do not notice, but no other can attach.
    pub fn missing_file(&self) -> Option<PathBuf> {
        let config = self.session.config();
        if let Some(path) = self.lock.removed() {
            return Some(path.to_owned());
        }
        let mut files = unfinished::static_files(config, self.session.endpoint.name());
        files.extend(unfinished::node_files(config, self.session.node_id()));
        files.into_iter().find(|path| !path.exists())
    }
}

fn wake_sender(service: &Events) -> Result<WakeSender, ServiceError> {
    let full = NotifierCreateError::ExceedsMaxSupportedNotifiers;
    let limit = PortLimit { ports: "notifiers", max: WAKE.publishers_max };
    let notifier = create_port(service, &full, limit, || service.notifier_builder().create())?;
    Ok(WakeSender::new(notifier))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use sim_messages::{Action, OWNER_PUBLISHERS_MAX, Triangle};

    use super::*;
    use crate::client::Client;
    use crate::ports::port::Service;
    use crate::ports::service::SURFACE;
    use crate::ports::wake::{WakeCause, WakeListener};
    use crate::ports::writer::Capacity;
    use crate::testing::TestDomain;

    /// Longer than any step of the test takes.
    const DEADLINE: Duration = Duration::from_secs(10);

    fn load(topology_revision: u32) -> Load<'static> {
        Load {
            header: LoadHeader { topology_revision, ..LoadHeader::default() },
            scene: b"version = 1",
            constraints: &[],
            bends: &[],
            triangles: &[],
            collider_count: 0,
            keyframe_size_bytes_max: 8,
            parameters: ParameterValues::default(),
        }
    }

    #[test]
    fn a_load_without_a_place_for_one_of_its_writers_leaves_the_old_load_as_it_was() {
        let domain = TestDomain::new();
        let mut owner = Owner::create(&domain.endpoint(), &load(1)).unwrap();
        let session = Session::join(&domain.endpoint()).unwrap();
        let service: Service<Triangle, LoadHeader> =
            session.service(&SURFACE, Access::Open).unwrap();
        // A tunnel has the spare place; another program has the place that a load needs.
        let other_publishers: Vec<_> = (1..OWNER_PUBLISHERS_MAX)
            .map(|_| service.publisher_builder().create().unwrap())
            .collect();
        let error = owner.load(&load(2)).unwrap_err();
        assert!(matches!(error, OwnerError::Service(ServiceError::Full { .. })), "{error}");

        let mut client = Client::attach(&domain.endpoint()).unwrap();
        let revision = |client: &mut Client| {
            let topology = client.topology(DEADLINE).unwrap();
            topology.map(|topology| topology.header.topology_revision)
        };
        assert!(client.topology(Duration::ZERO).unwrap().is_none());
        owner.refresh();
        assert_eq!(revision(&mut client), Some(1));
        owner.publish_particles(&SnapshotHeader::default(), |_| unreachable!()).unwrap();
        owner.publish_keyframe(KeyframeHeader::default(), &[0; 8]).unwrap();

        drop(other_publishers);
        owner.load(&load(2)).unwrap();
        assert_eq!(revision(&mut client), Some(2));
    }

    #[test]
    fn a_wake_thread_wakes_each_waiting_process_also_at_the_end_of_the_owner() {
        let domain = TestDomain::new();
        let mut owner = Owner::create(&domain.endpoint(), &load(1)).unwrap();
        owner.start_wake_thread().unwrap();
        let session = Session::join(&domain.endpoint()).unwrap();
        let service = session.events(Access::Open).unwrap();
        let listeners: Vec<_> = (0..3)
            .map(|_| WakeListener::new(service.listener_builder().create().unwrap()))
            .collect();
        for _ in 0..100 {
            owner.wake(Wake::Frame);
            for listener in &listeners {
                assert_eq!(listener.wait(DEADLINE), WakeCause::Event);
            }
        }
        owner.wake(Wake::Outcome);
        drop(owner);
        for listener in &listeners {
            // The last two events may arrive together.
            let mut causes = std::iter::repeat_with(|| listener.wait(DEADLINE)).take(2);
            assert!(causes.any(|cause| cause == WakeCause::OwnerGone));
        }
    }

    #[test]
    fn a_malformed_state_comes_with_its_command_and_its_fault() {
        let domain = TestDomain::new();
        let owner = Owner::create(&domain.endpoint(), &load(0)).unwrap();
        let session = Session::join(&domain.endpoint()).unwrap();
        let service: Service<u8, RestoreHeader> = session.service(&RESTORE, Access::Open).unwrap();
        let capacity = Capacity { len_max: 40, samples: 8 };
        let stranger = Writer::create(session.config(), &service, capacity).unwrap();
        let give = |header: RestoreHeader| {
            let header = RestoreHeader { client_id: 7, sequence: 3, ..header };
            stranger.send_elements(header, 33, |_| 0).unwrap();
            let mut states = Vec::new();
            owner.receive_states(&mut states);
            let (received, state) = states.pop().unwrap();
            assert_eq!((received.command.client_id, received.command.sequence), (7, 3));
            assert!(matches!(received.command.action(), Action::Restore { .. }));
            state.unwrap_err()
        };
        let fitting = RestoreHeader { size_bytes: 33, contents: 1, ..RestoreHeader::default() };
        let found = [
            give(RestoreHeader { size_bytes: 40, ..fitting }),
            give(RestoreHeader { contents: 9, ..fitting }),
            give(RestoreHeader { particle_count: 2, ..fitting }),
            give(RestoreHeader { contents: 2, ..fitting }),
            give(fitting),
        ];
        let expected = [
            MalformedState::Length { named: 40, found: 33 },
            MalformedState::Contents { contents: 9 },
            MalformedState::Particles { particle_count: 2, size_bytes: 33 },
            MalformedState::Rest { size_bytes: 33 },
            MalformedState::TooLong { size_bytes: 33, max: 8 },
        ];
        assert_eq!(found, expected);
    }
}
