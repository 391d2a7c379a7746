//! The data that an owner publishes per load, and the writers whose sizes follow from it.

use crate::limits::{BORROWED_SAMPLES_MAX, SNAPSHOTS_BUFFERED};
use crate::messages::collider::{ColliderState, CollidersHeader};
use crate::messages::parameters::{ParameterState, ParametersHeader};
use crate::messages::snapshot::{ParticleState, SnapshotHeader};
use crate::messages::tears::{TearsHeader, TornConstraint};
use crate::messages::topology::{ConstraintState, KeyframeHeader, LoadHeader, Triangle};
use crate::owner::error::OwnerError;
use crate::ports::service::{
    COLLIDERS, KEYFRAME, PARAMETERS, PARTICLES, ServiceError, ServiceSpec, TEARS,
};
use crate::ports::services::Services;
use crate::ports::writer::PublishError;
use crate::ports::writer::{Capacity, SliceWriter};
use sim_types::{
    COLLIDERS_MAX, ELEMENTS_MAX, ParameterValues, SCENE_SIZE_BYTES_MAX, SETTINGS_COUNT,
};

/// A load: the data that an owner publishes once, and the sizes of its later messages.
#[derive(Debug, Clone, Copy)]
pub struct Load<'a> {
    /// Common part of the headers. The owner sets `count` for each service.
    pub header: LoadHeader,
    /// The effective scene as TOML, at most [`SCENE_SIZE_BYTES_MAX`] bytes.
    pub scene: &'a [u8],
    /// All constraints, by index.
    pub constraints: &'a [ConstraintState],
    /// The surface; may be empty.
    pub triangles: &'a [Triangle],
    /// Number of colliders, at most [`COLLIDERS_MAX`].
    pub collider_count: usize,
    /// Size of the longest keyframe of this load, in bytes.
    pub keyframe_size_bytes_max: usize,
    /// Values of the parameters at the first step of this load.
    pub parameters: ParameterValues,
}

/// The writers of a load.
#[derive(Debug)]
pub(crate) struct LoadWriters {
    pub(crate) particles: SliceWriter<ParticleState, SnapshotHeader>,
    pub(crate) keyframe: SliceWriter<u8, KeyframeHeader>,
    // These three publish only the load, so they have memory for one message of exactly its length.
    scene: SliceWriter<u8, LoadHeader>,
    topology: SliceWriter<ConstraintState, LoadHeader>,
    surface: SliceWriter<Triangle, LoadHeader>,
    tears: SliceWriter<TornConstraint, TearsHeader>,
    parameters: SliceWriter<ParameterState, ParametersHeader>,
    colliders: SliceWriter<ColliderState, CollidersHeader>,
}

impl LoadWriters {
    pub(crate) fn create(services: &Services, load: &Load<'_>) -> Result<Self, ServiceError> {
        let single = |len_max| Capacity { len_max, samples: 1 };
        let many =
            |spec: &ServiceSpec, len_max| Capacity { len_max, samples: spec.samples_in_use_max() };
        let (particle_count, constraint_count) =
            (load.header.particle_count as usize, load.constraints.len());
        let keyframe = many(&KEYFRAME, load.keyframe_size_bytes_max);
        let colliders = many(&COLLIDERS, load.collider_count);
        Ok(Self {
            particles: SliceWriter::create(&services.particles, many(&PARTICLES, particle_count))?,
            keyframe: SliceWriter::create(&services.keyframe, keyframe)?,
            scene: SliceWriter::create(&services.scene, single(load.scene.len()))?,
            topology: SliceWriter::create(&services.topology, single(constraint_count))?,
            surface: SliceWriter::create(&services.surface, single(load.triangles.len()))?,
            tears: SliceWriter::create(&services.tears, many(&TEARS, constraint_count))?,
            parameters: SliceWriter::create(
                &services.parameters,
                many(&PARAMETERS, SETTINGS_COUNT),
            )?,
            colliders: SliceWriter::create(&services.colliders, colliders)?,
        })
    }

    /// Publishes the load, its parameters, an empty list of tears and, for a scene without colliders,
    /// an empty list of colliders. Without these lists, readers would keep those of the load before.
    pub(crate) fn publish(&self, load: &Load<'_>) -> Result<(), PublishError> {
        let header = |count| LoadHeader { count, ..load.header };
        self.scene.write(header(payload_count(load.scene)), |index| load.scene[index])?;
        let constraints = load.constraints;
        self.topology.write(header(payload_count(constraints)), |index| constraints[index])?;
        self.surface.write(header(payload_count(load.triangles)), |index| load.triangles[index])?;
        let LoadHeader { run_id, step, .. } = load.header;
        if load.collider_count == 0 {
            let header = CollidersHeader { run_id, step, ..CollidersHeader::default() };
            self.publish_colliders(header, &[])?;
        }
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
        self.scene.refresh();
        self.topology.refresh();
        self.surface.refresh();
        self.colliders.refresh();
        self.tears.refresh();
        self.parameters.refresh();
        self.keyframe.refresh();
        self.particles.refresh();
    }
}

/// Returns the length of a payload. The limits of the contract keep it within u32.
fn payload_count<T>(payload: &[T]) -> u32 {
    u32::try_from(payload.len()).unwrap_or(u32::MAX)
}

pub(crate) fn check_limits(load: &Load<'_>) -> Result<(), OwnerError> {
    let limits = [
        ("particles", load.header.particle_count as usize, ELEMENTS_MAX as usize),
        ("constraints", load.constraints.len(), ELEMENTS_MAX as usize),
        ("colliders", load.collider_count, COLLIDERS_MAX),
        ("bytes of text", load.scene.len(), SCENE_SIZE_BYTES_MAX),
    ];
    match limits.into_iter().find(|(_, count, max)| count > max) {
        Some((elements, count, max)) => Err(OwnerError::TooLarge { elements, count, max }),
        None => Ok(()),
    }
}

/// Number of snapshots that one stalled reader keeps from being overwritten: its full buffer and the
/// samples it holds, beside the latched one, the one being written and the one being handed over.
const STALLED_SNAPSHOTS: usize = SNAPSHOTS_BUFFERED + BORROWED_SAMPLES_MAX + 3;
/// Size of iceoryx2's own header of a message, in bytes.
const MESSAGE_HEADER_SIZE_BYTES: usize = 48;

/// Checks that the snapshots fit into shared memory. Creating shared memory does not reserve it, and
/// SIGBUS kills a writer that runs out of it. The memory of the load before does not count as free,
/// because a reader that holds one of its snapshots keeps it.
pub(crate) fn check_shared_memory(load: &Load<'_>) -> Result<(), OwnerError> {
    match rustix::fs::statvfs("/dev/shm") {
        Ok(memory) => check_fits(load.header.particle_count, memory.f_bavail * memory.f_frsize),
        // If the size is unknown, it may still be large enough.
        Err(_) => Ok(()),
    }
}

fn check_fits(particle_count: u32, available_bytes: u64) -> Result<(), OwnerError> {
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
    fn a_scene_whose_snapshots_could_fill_shared_memory_is_refused_with_the_numbers() {
        let docker_default = 64 << 20;
        assert_eq!(check_fits(20_000, docker_default), Ok(()));
        let error = check_fits(100_000, docker_default).unwrap_err().to_string();
        assert_eq!(
            error,
            "100000 particles need 217 MiB of shared memory (71 snapshots for one stalled \
             reader), but /dev/shm has only 64 MiB left: choose a smaller scene, or enlarge \
             /dev/shm (mount -o remount,size=... /dev/shm; docker run --shm-size ...)"
        );
    }
}
