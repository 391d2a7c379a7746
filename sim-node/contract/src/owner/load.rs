//! The data that an owner publishes per load, and the writers whose sizes follow from it.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fs::File;

use sim_messages::{
    BendState, COLLIDERS_MAX, ColliderState, CollidersHeader, ConstraintState, ELEMENTS_MAX,
    ForceRow, ForcesHeader, KeyframeHeader, LoadHeader, ParameterState, ParameterValues,
    ParametersHeader, ParticleState, SCENE_SIZE_BYTES_MAX, SETTINGS_COUNT, SnapshotHeader,
    TearsHeader, TornConstraint, Triangle, scene_hash,
};

use crate::owner::error::OwnerError;
use crate::ports::memory;
use crate::ports::service::{
    COLLIDERS, KEYFRAME, PARAMETERS, PARTICLES, ServiceError, ServiceSpec, TEARS,
};
use crate::ports::services::Services;
use crate::ports::writer::PublishError;
use crate::ports::writer::{Capacity, Writer};

/// A load: the data that an owner publishes once, and the sizes of its later messages.
#[derive(Debug, Clone, Default)]
pub struct Load<'a> {
    /// Common part of the headers. The owner sets `count` for each service.
    pub header: LoadHeader,
    /// The effective scene as TOML, at most [`SCENE_SIZE_BYTES_MAX`] bytes.
    pub scene: &'a [u8],
    /// All constraints, by index.
    pub constraints: &'a [ConstraintState],
    /// All bends, by index; may be empty.
    pub bends: &'a [BendState],
    /// The surface; may be empty.
    pub triangles: &'a [Triangle],
    /// Number of colliders, at most [`COLLIDERS_MAX`].
    pub collider_count: usize,
    /// Size of the longest keyframe of this load, in bytes.
    pub keyframe_size_bytes_max: usize,
    /// Values of the parameters at the first step of this load.
    pub parameters: ParameterValues,
}

impl Load<'_> {
    /// Returns the free shared memory that an owner needs to publish this load, in bytes.
    pub fn shared_memory_bytes(&self) -> u64 {
        Capacities::of(self).size_bytes() + SERVICES_SIZE_BYTES
    }
}

/// The writers of a load.
#[derive(Debug)]
pub(crate) struct LoadWriters {
    pub(crate) particles: Writer<ParticleState, SnapshotHeader>,
    pub(crate) keyframe: Writer<u8, KeyframeHeader>,
    // These four publish only the load, so they have memory for one message of exactly its length. New
    // writers replace them when they publish it again.
    pub(super) scene: RefCell<Writer<u8, LoadHeader>>,
    pub(super) topology: RefCell<Writer<ConstraintState, LoadHeader>>,
    pub(super) bends: RefCell<Writer<BendState, LoadHeader>>,
    pub(super) surface: RefCell<Writer<Triangle, LoadHeader>>,
    pub(super) tears: Writer<TornConstraint, TearsHeader>,
    pub(super) parameters: Writer<ParameterState, ParametersHeader>,
    pub(super) colliders: Writer<ColliderState, CollidersHeader>,
    /// Only while a client reads the forces.
    pub(super) forces: RefCell<Option<Writer<ForceRow, ForcesHeader>>>,
}

/// Memory of the writers of a load.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Capacities {
    particles: Capacity,
    keyframe: Capacity,
    scene: Capacity,
    topology: Capacity,
    bends: Capacity,
    surface: Capacity,
    tears: Capacity,
    parameters: Capacity,
    colliders: Capacity,
}

impl Capacities {
    pub(super) fn of(load: &Load<'_>) -> Self {
        let single = |len_max| Capacity { len_max, samples: 1 };
        let many =
            |spec: &ServiceSpec, len_max| Capacity { len_max, samples: spec.samples_in_use_max() };
        Self {
            particles: many(&PARTICLES, load.header.particle_count as usize),
            keyframe: many(&KEYFRAME, load.keyframe_size_bytes_max),
            scene: single(load.scene.len()),
            topology: single(load.constraints.len()),
            bends: single(load.bends.len()),
            surface: single(load.triangles.len()),
            tears: many(&TEARS, load.constraints.len()),
            parameters: many(&PARAMETERS, SETTINGS_COUNT + bent_block_count(load.bends)),
            colliders: many(&COLLIDERS, load.collider_count),
        }
    }

    fn size_bytes(&self) -> u64 {
        self.particles.size_bytes::<ParticleState, SnapshotHeader>()
            + self.keyframe.size_bytes::<u8, KeyframeHeader>()
            + self.scene.size_bytes::<u8, LoadHeader>()
            + self.topology.size_bytes::<ConstraintState, LoadHeader>()
            + self.bends.size_bytes::<BendState, LoadHeader>()
            + self.surface.size_bytes::<Triangle, LoadHeader>()
            + self.tears.size_bytes::<TornConstraint, TearsHeader>()
            + self.parameters.size_bytes::<ParameterState, ParametersHeader>()
            + self.colliders.size_bytes::<ColliderState, CollidersHeader>()
    }
}

impl LoadWriters {
    pub(crate) fn create(services: &Services, load: &Load<'_>) -> Result<Self, ServiceError> {
        let capacities = Capacities::of(load);
        let config = &services.config;
        Ok(Self {
            particles: Writer::create(config, &services.particles, capacities.particles)?,
            keyframe: Writer::create(config, &services.keyframe, capacities.keyframe)?,
            scene: RefCell::new(Writer::create(config, &services.scene, capacities.scene)?),
            topology: RefCell::new(Writer::create(
                config,
                &services.topology,
                capacities.topology,
            )?),
            bends: RefCell::new(Writer::create(config, &services.bends, capacities.bends)?),
            surface: RefCell::new(Writer::create(config, &services.surface, capacities.surface)?),
            tears: Writer::create(config, &services.tears, capacities.tears)?,
            parameters: Writer::create(config, &services.parameters, capacities.parameters)?,
            colliders: Writer::create(config, &services.colliders, capacities.colliders)?,
            forces: RefCell::new(None),
        })
    }

    /// Removes the writers, and returns their segments, which keep their memory until they are closed.
    pub(super) fn close(self) -> Vec<File> {
        let always = [
            self.particles.close(),
            self.keyframe.close(),
            self.scene.into_inner().close(),
            self.topology.into_inner().close(),
            self.bends.into_inner().close(),
            self.surface.into_inner().close(),
            self.tears.close(),
            self.parameters.close(),
            self.colliders.close(),
        ];
        always.into_iter().chain(self.forces.into_inner().map(Writer::close)).collect()
    }

    /// Returns the size of the longest state of the load: its particles and a keyframe.
    pub(crate) fn state_size_bytes_max(&self) -> usize {
        self.particles.len_max() * size_of::<ParticleState>() + self.keyframe.len_max()
    }

    /// Publishes the load, its parameters and an empty list of tears. Without that list, readers would
    /// keep the list of the load before.
    pub(crate) fn publish(&self, load: &Load<'_>) -> Result<(), PublishError> {
        let scene_hash = scene_hash(load.scene);
        let header = |count| LoadHeader { scene_hash, count, ..load.header };
        self.scene.borrow().write(header(payload_count(load.scene)), |index| load.scene[index])?;
        let constraints = load.constraints;
        self.topology
            .borrow()
            .write(header(payload_count(constraints)), |index| constraints[index])?;
        self.bends.borrow().write(header(payload_count(load.bends)), |index| load.bends[index])?;
        self.surface
            .borrow()
            .write(header(payload_count(load.triangles)), |index| load.triangles[index])?;
        let LoadHeader { run_id, step, .. } = load.header;
        self.publish_parameters(run_id, step, &load.parameters)?;
        self.publish_tears(
            TearsHeader { run_id, step, since_step: step, ..TearsHeader::default() },
            &[],
        )
    }

    pub(crate) fn publish_tears(
        &self,
        header: TearsHeader,
        torn: &[TornConstraint],
    ) -> Result<(), PublishError> {
        let header = TearsHeader { count: payload_count(torn), ..header };
        self.tears.write(header, |index| torn[index])
    }

    pub(crate) fn publish_parameters(
        &self,
        run_id: u64,
        step: u64,
        values: &ParameterValues,
    ) -> Result<(), PublishError> {
        let settings = values.settings();
        let header = ParametersHeader { run_id, step, count: payload_count(&settings), spare: 0 };
        self.parameters.write(header, |index| settings[index].into())
    }

    pub(crate) fn publish_colliders(
        &self,
        header: CollidersHeader,
        colliders: &[ColliderState],
    ) -> Result<(), PublishError> {
        let header = CollidersHeader { count: payload_count(colliders), ..header };
        self.colliders.write(header, |index| colliders[index])
    }

    /// Sends the latched messages to readers that joined since the last call. The particles come last,
    /// as in the order of publication.
    pub(crate) fn refresh(&self) {
        self.scene.borrow().refresh();
        self.topology.borrow().refresh();
        self.bends.borrow().refresh();
        self.surface.borrow().refresh();
        self.colliders.refresh();
        self.tears.refresh();
        self.parameters.refresh();
        self.forces.borrow().iter().for_each(Writer::refresh);
        self.keyframe.refresh();
        self.particles.refresh();
    }
}

/// Returns the number of generated blocks with bends, each of which can have a setting of its own.
fn bent_block_count(bends: &[BendState]) -> usize {
    let blocks: BTreeSet<_> =
        bends.iter().map(|bend| bend.block).filter(|block| *block >= 0).collect();
    blocks.len()
}

/// Returns the length of a payload. The limits of the contract keep it within u32.
fn payload_count<T>(payload: &[T]) -> u32 {
    u32::try_from(payload.len()).unwrap_or(u32::MAX)
}

pub(crate) fn check_limits(load: &Load<'_>) -> Result<(), OwnerError> {
    let limits = [
        ("particles", load.header.particle_count as usize, ELEMENTS_MAX as usize),
        ("constraints", load.constraints.len(), ELEMENTS_MAX as usize),
        ("bends", load.bends.len(), ELEMENTS_MAX as usize),
        ("colliders", load.collider_count, COLLIDERS_MAX),
        ("bytes of text", load.scene.len(), SCENE_SIZE_BYTES_MAX),
    ];
    match limits.into_iter().find(|(_, count, max)| count > max) {
        Some((elements, count, max)) => Err(OwnerError::TooLarge { elements, count, max }),
        None => Ok(()),
    }
}

/// Shared memory of everything that an owner creates beside the writers of a load: outcomes, status,
/// and the ports and connections of iceoryx2.
const SERVICES_SIZE_BYTES: u64 = 4 << 20;

/// Checks that the messages of a load fit into shared memory, before any of it is allocated. The memory
/// of the load before does not count as free, because readers hold its messages.
pub(crate) fn check_memory(load: &Load<'_>) -> Result<(), OwnerError> {
    memory::check(load.shared_memory_bytes()).map_err(|memory| OwnerError::NotEnoughSharedMemory {
        particle_count: load.header.particle_count,
        constraint_count: load.constraints.len(),
        memory,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_whose_messages_could_fill_shared_memory_is_refused_with_the_numbers() {
        let load = Load {
            header: LoadHeader { particle_count: 100_000, ..LoadHeader::default() },
            ..Load::default()
        };
        // A full buffer, the samples that all readers hold, the latched one and the one being written.
        let samples = 64 + 16 * 4 + 1 + 1;
        let needed_bytes = Capacities::of(&load).size_bytes();
        let snapshots_bytes = samples * 100_000 * 32;
        assert!((snapshots_bytes..snapshots_bytes + (1 << 20)).contains(&needed_bytes));
        let docker_default = 64 << 20;
        let memory = memory::check_fits(needed_bytes, docker_default).unwrap_err();
        let (particle_count, constraint_count) = (100_000, 0);
        let error = OwnerError::NotEnoughSharedMemory { particle_count, constraint_count, memory };
        assert_eq!(
            error.to_string(),
            "100000 particles and 0 constraints: 397 MiB of shared memory are needed, but /dev/shm \
             has only 64 MiB left: free some, or enlarge it (mount -o remount,size=... /dev/shm; \
             docker run --shm-size ...), or choose a smaller scene"
        );
    }
}
