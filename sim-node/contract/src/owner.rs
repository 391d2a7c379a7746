//! The owner of a name: the node or replay that publishes everything and takes the commands.

use std::cell::Cell;

use iceoryx2::port::notifier::NotifierCreateError;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::ipc;
use thiserror::Error;

use crate::ports::{Places, create_port, reader_count};
use crate::reader::subscribe;
use crate::service::{
    KEYFRAME, OUTCOMES, PARTICLES, STATUS, ServiceError, ServiceSpec, TEARS, WAKE,
};
use crate::services::{Services, owner};
use crate::session::{Access, Events, Session, Values};
use crate::wake::{Wake, WakeSender};
use crate::writer::{Capacity, SliceWriter, ValueWriter};
use crate::{
    BORROWED_SAMPLES_MAX, CLIENTS_MAX, COMMANDS_BUFFERED, Command, ConstraintState, ELEMENTS_MAX,
    Endpoint, KeyframeHeader, LoadHeader, NodeStatus, Outcome, ParticleState, PublishError,
    SCENE_SIZE_BYTES_MAX, SNAPSHOTS_BUFFERED, SnapshotHeader, TearsHeader, Triangle,
};

/// What an owner publishes once per load, and what the sizes of its messages follow from.
#[derive(Debug, Clone, Copy)]
pub struct Load<'a> {
    /// The common part of the headers; `count` is filled in for each service.
    pub header: LoadHeader,
    /// The effective scene as TOML, at most [`SCENE_SIZE_BYTES_MAX`].
    pub scene: &'a [u8],
    /// All constraints, by index.
    pub constraints: &'a [ConstraintState],
    /// The surface; may be empty.
    pub triangles: &'a [Triangle],
    /// The longest keyframe of this load, in bytes.
    pub keyframe_size_bytes_max: usize,
}

/// Why a name could not be taken.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum OwnerError {
    /// Another process has the name.
    #[error(
        "{endpoint} is running already{by}: stop that one, or choose another --name or --domain",
        by = process_id.map(|id| format!(", as process {id}")).unwrap_or_default()
    )]
    NameTaken {
        /// Whose.
        endpoint: Endpoint,
        /// The process that has it, where it is known.
        process_id: Option<u32>,
    },
    /// The snapshots would not fit into shared memory.
    #[error(
        "{particle_count} particles need {needed_mib} MiB of shared memory ({samples} snapshots for one stalled reader), but /dev/shm has {available_mib} MiB left: take a smaller scene, or enlarge it (mount -o remount,size=... /dev/shm; docker run --shm-size ...)"
    )]
    NotEnoughSharedMemory {
        /// Particles of the scene.
        particle_count: u32,
        /// Snapshots that one reader can keep from being overwritten.
        samples: usize,
        /// What they take, rounded up.
        needed_mib: u64,
        /// What is available, rounded down.
        available_mib: u64,
    },
    /// The load is beyond a limit of the contract.
    #[error("the scene has {count} {what}, at most {max} are possible: take a smaller scene")]
    TooLarge {
        /// What there is too much of.
        what: &'static str,
        /// How much.
        count: usize,
        /// The limit.
        max: usize,
    },
    /// A service could not be created or connected to.
    #[error(transparent)]
    Service(#[from] ServiceError),
    /// The load could not be published.
    #[error(transparent)]
    Publish(#[from] PublishError),
}

/// The process that owns a name: it publishes everything and takes the commands.
///
/// Nothing here ever waits for a reader. Per step publish tears, keyframe, outcomes, and the
/// particles last; then [`Owner::wake`] the readers and [`Owner::refresh`] the latched messages.
/// Dropping it frees the name and wakes everyone with [`Wake::OwnerGone`].
#[derive(Debug)]
pub struct Owner {
    // Dropped in this order: readers first lose what they read, then the name is free, and only
    // then are they woken to find that out.
    particles: SliceWriter<ParticleState, SnapshotHeader>,
    keyframe: SliceWriter<u8, KeyframeHeader>,
    load: LoadWriters,
    tears: SliceWriter<u32, TearsHeader>,
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

/// Snapshots that one reader which has stalled keeps from being overwritten: its full buffer, what
/// it holds, and beside them the latched one, the one being written and one being handed over.
const STALLED_SNAPSHOTS: usize = SNAPSHOTS_BUFFERED + BORROWED_SAMPLES_MAX + 3;
/// Bytes of a message before its payload, beside our header.
const MESSAGE_HEADER_SIZE_BYTES: usize = 48;
/// Refreshes that wake a new reader. It is counted a moment before it can be given anything: the
/// first may come too early. One that is held up longer finds what it was given with a later wake.
const WAKES_PER_READER: u32 = 2;
/// Most commands that are taken at once: those that all clients together can have waiting.
const COMMANDS_TAKEN_MAX: usize = CLIENTS_MAX * COMMANDS_BUFFERED;

impl Owner {
    /// Takes the name, creates its services and publishes scene, topology and surface.
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
        if let Ok(memory) = rustix::fs::statvfs("/dev/shm") {
            check_shared_memory(load.header.particle_count, memory.f_bavail * memory.f_frsize)?;
        }
        let services = Services::access(&session, Access::Create)?;
        let many =
            |spec: &ServiceSpec, len_max| Capacity { len_max, samples: spec.samples_in_use_max() };
        let particle_count = load.header.particle_count as usize;
        let owner = Self {
            wake: wake_sender(&services.wake)?,
            commands: subscribe(&services.commands)?,
            outcomes: ValueWriter::create(&services.outcomes, &OUTCOMES)?,
            tears: SliceWriter::create(&services.tears, many(&TEARS, load.constraints.len()))?,
            keyframe: SliceWriter::create(
                &services.keyframe,
                many(&KEYFRAME, load.keyframe_size_bytes_max),
            )?,
            particles: SliceWriter::create(&services.particles, many(&PARTICLES, particle_count))?,
            load: LoadWriters::create(&services, load)?,
            status,
            readers_seen: Cell::new(0),
            wakes_due: Cell::new(0),
            services,
            status_service,
            _session: session,
        };
        owner.load.publish(load)?;
        owner.wake(Wake::Load);
        Ok(owner)
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
        self.particles.write(*header, particle)
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
        self.keyframe.write(KeyframeHeader { size_bytes, ..header }, |index| bytes[index])
    }

    /// Publishes all constraints torn since the load, in the order of tearing; `count` is filled
    /// in.
    ///
    /// # Errors
    /// More than there are constraints, or no memory.
    pub fn publish_tears(&self, header: TearsHeader, torn: &[u32]) -> Result<(), PublishError> {
        let count = count_of(torn);
        self.tears.write(TearsHeader { count, ..header }, |index| torn[index])
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
        self.load.scene.refresh();
        self.load.topology.refresh();
        self.load.surface.refresh();
        self.tears.refresh();
        self.keyframe.refresh();
        self.outcomes.refresh();
        self.status.refresh();
        self.particles.refresh();
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
            + reader_count(&services.outcomes)
            + reader_count(&self.status_service)
    }
}

/// The writers whose only message is the load: exactly as long as it, and no memory beside it.
#[derive(Debug)]
struct LoadWriters {
    scene: SliceWriter<u8, LoadHeader>,
    topology: SliceWriter<ConstraintState, LoadHeader>,
    surface: SliceWriter<Triangle, LoadHeader>,
}

impl LoadWriters {
    fn create(services: &Services, load: &Load<'_>) -> Result<Self, ServiceError> {
        let single = |len_max| Capacity { len_max, samples: 1 };
        Ok(Self {
            scene: SliceWriter::create(&services.scene, single(load.scene.len()))?,
            topology: SliceWriter::create(&services.topology, single(load.constraints.len()))?,
            surface: SliceWriter::create(&services.surface, single(load.triangles.len()))?,
        })
    }

    fn publish(&self, load: &Load<'_>) -> Result<(), PublishError> {
        let header = |count| LoadHeader { count, ..load.header };
        self.scene.write(header(count_of(load.scene)), |index| load.scene[index])?;
        let constraints = load.constraints;
        self.topology.write(header(count_of(constraints)), |index| constraints[index])?;
        self.surface.write(header(count_of(load.triangles)), |index| load.triangles[index])
    }
}

/// The length of a payload, which a limit of the contract keeps within u32.
fn count_of<T>(payload: &[T]) -> u32 {
    u32::try_from(payload.len()).unwrap_or(u32::MAX)
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

fn check_limits(load: &Load<'_>) -> Result<(), OwnerError> {
    let limits = [
        ("particles", load.header.particle_count as usize, ELEMENTS_MAX),
        ("constraints", load.constraints.len(), ELEMENTS_MAX),
        ("bytes of text", load.scene.len(), SCENE_SIZE_BYTES_MAX),
    ];
    match limits.into_iter().find(|(_, count, max)| count > max) {
        Some((what, count, max)) => Err(OwnerError::TooLarge { what, count, max }),
        None => Ok(()),
    }
}

/// Shared memory is not reserved when it is created: a writer that runs out of it is killed by
/// SIGBUS, so whether it can happen is found out before.
fn check_shared_memory(particle_count: u32, available_bytes: u64) -> Result<(), OwnerError> {
    let snapshot_size_bytes = MESSAGE_HEADER_SIZE_BYTES
        + size_of::<SnapshotHeader>()
        + particle_count as usize * size_of::<ParticleState>();
    let needed_bytes = (STALLED_SNAPSHOTS * snapshot_size_bytes) as u64;
    if needed_bytes <= available_bytes {
        return Ok(());
    }
    Err(OwnerError::NotEnoughSharedMemory {
        particle_count,
        samples: STALLED_SNAPSHOTS,
        needed_mib: needed_bytes.div_ceil(1 << 20),
        available_mib: available_bytes >> 20,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_that_one_stalled_reader_could_fill_memory_with_is_refused_with_the_numbers() {
        let docker_default = 64 << 20;
        assert_eq!(check_shared_memory(20_000, docker_default), Ok(()));
        let error = check_shared_memory(100_000, docker_default).unwrap_err().to_string();
        assert_eq!(
            error,
            "100000 particles need 217 MiB of shared memory (71 snapshots for one stalled \
             reader), but /dev/shm has 64 MiB left: take a smaller scene, or enlarge it (mount \
             -o remount,size=... /dev/shm; docker run --shm-size ...)"
        );
    }
}
