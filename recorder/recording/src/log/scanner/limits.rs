//! The most bytes that a reader allocates for a part of a file.
//!
//! A length in a file is a claim. A reader compares it with the most that the scene of the file can
//! need before it allocates, so that a damaged or hostile file costs no more memory than a valid one.

use sim_solver::MOTION_POINTS_MAX;

use crate::log::run::RunDescription;
use crate::log::topic::Topic;

/// Size of a record's header: opcode and length.
pub(in crate::log) const RECORD_HEADER_SIZE_BYTES: usize = 9;
/// Longest record that is read before the size of the scene is known: the attachment with the scene.
pub(in crate::log) const HEADER_RECORD_SIZE_BYTES_MAX: u64 =
    sim_messages::SCENE_SIZE_BYTES_MAX as u64 + TEXT_SIZE_BYTES_MAX;
/// Longest header, channel, schema or metadata record. Those of a recorder have a few kilobytes.
pub(in crate::log) const TEXT_SIZE_BYTES_MAX: u64 = 1 << 16;
/// Size of a message beside the columns that grow with the scene.
const FIXED_SIZE_BYTES: u64 = 1 << 14;
/// Header of a message: channel, sequence and two times.
const MESSAGE_HEADER_SIZE_BYTES: u64 = 2 + 4 + 8 + 8;
/// Uncompressed size of a chunk beside its largest message. A recorder closes a chunk at 1 MiB, and
/// other tools rewrite files with chunks of 4 MiB.
const CHUNK_SIZE_BYTES: u64 = 4 << 20;
/// Memory for the decoded messages of a chunk beside the size of the scene: many times the chunk.
const DECODED_SIZE_BYTES: u64 = 64 << 20;
/// Memory for the decoded messages between two snapshots beside the size of the scene: 3000 steps of a
/// thousand moving colliders, for nodes that publish few snapshots.
const BACKLOG_SIZE_BYTES: u64 = 256 << 20;

/// Returns the most bytes by which data that does not compress grows: the headers of its blocks.
pub(in crate::log) fn compression_growth(size_bytes: u64) -> u64 {
    size_bytes / 16 + (1 << 16)
}

/// The most bytes of each part of a file. They grow with the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::log) struct SizeLimits {
    particle_count: u64,
    constraint_count: u64,
    bend_count: u64,
    scene_size_bytes: u64,
}

impl SizeLimits {
    /// Returns the limits of a recording. `scene_size_bytes` is the length of its scene as text, which
    /// bounds the number of colliders, anchors and listed triangles.
    pub(in crate::log) fn new(run: &RunDescription, scene_size_bytes: usize) -> Self {
        Self {
            particle_count: u64::from(run.particle_count),
            constraint_count: u64::from(run.constraint_count),
            bend_count: u64::from(run.bend_count),
            scene_size_bytes: scene_size_bytes as u64,
        }
    }

    /// Describes a part of a file that is longer than its scene can need.
    pub(in crate::log) fn exceeded(part: &str, size_bytes: u64, size_bytes_max: u64) -> String {
        format!("{part} of {size_bytes} bytes (allowed: up to {size_bytes_max} for its scene)")
    }

    /// Returns the length of the longest message on a topic.
    pub(in crate::log) fn message_size_bytes_max(&self, topic: Topic) -> u64 {
        let Self { particle_count, constraint_count, bend_count, scene_size_bytes } = *self;
        let growing = match topic {
            // Per constraint: two particles, a kind and a tear of up to 9 digits, and two numbers of up
            // to 25. Per bend: four particles, a shape and a block, and seven numbers.
            Topic::Topology => 96 * constraint_count + 256 * bend_count,
            // Three indices per triangle. Generated cloth has two triangles per particle, and a listed
            // triangle has at least 6 bytes in the scene.
            Topic::Surface => 54 * particle_count + 5 * scene_size_bytes,
            // A collider has at least 32 bytes in the scene.
            Topic::Colliders => 16 * scene_size_bytes,
            // An index and a cause.
            Topic::Tears => 32 * constraint_count,
            // An index of up to 9 digits and three numbers of up to 25 for each particle. A collider or an anchor
            // has at least 32 bytes in the scene.
            Topic::Forces => 96 * particle_count + 16 * scene_size_bytes,
            // The same bounds as `Solver::keyframe_size_bytes_max`.
            Topic::Keyframe => {
                let motions = 64 * MOTION_POINTS_MAX as u64;
                motions + 64 * particle_count + 16 * constraint_count + 2 * scene_size_bytes
            }
            Topic::Particles => 32 * particle_count,
            // A generated block has at least 30 bytes in the scene, and at most 60 here.
            Topic::Parameters => 2 * scene_size_bytes,
            Topic::Tf | Topic::Outcomes | Topic::Status | Topic::Events | Topic::Steps => 0,
        };
        FIXED_SIZE_BYTES + growing
    }

    /// Returns the length of the longest message record on any topic.
    pub(in crate::log) fn record_size_bytes_max(&self) -> u64 {
        let longest = Topic::ALL.into_iter().map(|topic| self.message_size_bytes_max(topic)).max();
        MESSAGE_HEADER_SIZE_BYTES + longest.unwrap_or_default()
    }

    /// Returns the uncompressed size of the largest chunk.
    pub(in crate::log) fn chunk_size_bytes_max(&self) -> u64 {
        CHUNK_SIZE_BYTES + self.record_size_bytes_max()
    }

    /// Returns the length of the longest record of a chunk: its header, and data that may grow when
    /// it is compressed.
    pub(in crate::log) fn chunk_record_size_bytes_max(&self) -> u64 {
        let size_bytes = self.chunk_size_bytes_max();
        size_bytes + compression_growth(size_bytes) + TEXT_SIZE_BYTES_MAX
    }

    /// Returns the most memory for the decoded messages of a chunk.
    pub(in crate::log) fn decoded_size_bytes_max(&self) -> usize {
        self.with_loads(DECODED_SIZE_BYTES)
    }

    /// Returns the most memory for the decoded messages between two snapshots.
    pub(in crate::log) fn backlog_size_bytes_max(&self) -> usize {
        self.with_loads(BACKLOG_SIZE_BYTES)
    }

    /// Adds the memory of a few loads with their states.
    fn with_loads(&self, size_bytes: u64) -> usize {
        let load = [Topic::Topology, Topic::Surface, Topic::Keyframe, Topic::Particles];
        let load: u64 = load.into_iter().map(|topic| self.message_size_bytes_max(topic)).sum();
        usize::try_from(size_bytes + 4 * load).unwrap_or(usize::MAX)
    }
}

#[cfg(test)]
mod tests {
    use sim_messages::{
        BendState, BlockValue, COLLIDERS_MAX, ConstraintState, ELEMENTS_MAX, LoadHeader,
        ParameterValues, PlainF32, TearCause, TornConstraint,
    };
    use sim_solver::{Scene, Solver, builtin};

    use super::*;
    use crate::log::rows::{ParametersRow, SurfaceRow, TearsRow, TopologyRow};

    fn limits(particle_count: u64, constraint_count: u64, scene_size_bytes: u64) -> SizeLimits {
        SizeLimits { particle_count, constraint_count, bend_count: 0, scene_size_bytes }
    }

    /// The number with the longest text that a column can have.
    fn longest_number() -> f32 {
        let numbers = (0..u32::from(u16::MAX)).map(|bits| f32::from_bits(bits << 16 | 0xbeef));
        let length =
            |number: &f32| serde_json::to_string(&PlainF32(*number)).map_or(0, |text| text.len());
        numbers.filter(|number| number.is_finite()).max_by_key(length).unwrap()
    }

    #[test]
    fn the_longest_rows_are_within_the_limits() {
        let (number, index) = (longest_number(), ELEMENTS_MAX - 1);
        let constraint = ConstraintState {
            a: index,
            b: index,
            rest_length: number,
            compliance: number,
            kind: 3,
        };
        let count = 5000;
        let bend = BendState {
            particles: [index; 4],
            coefficients: [number; 4],
            geometry: number,
            rigidity: number,
            rest: number,
            shape: 2,
            block: i32::try_from(index).unwrap(),
        };
        let mut topology =
            TopologyRow::new(&LoadHeader::default(), &vec![constraint; count], &vec![bend; count]);
        topology.torn = vec![index; count];
        let torn = vec![TornConstraint::new(index, Some(TearCause::Distance)); count];
        let tears = TearsRow::new(u64::MAX, &torn);
        let surface = SurfaceRow { step: 0, triangles: vec![index; 3 * 2 * count] };
        let blocks = (0..500).map(|block| BlockValue { block: index - 500 + block, value: number });
        let mut values = ParameterValues::default();
        values.bending_by_block.extend(blocks);
        let parameters = ParametersRow { step: u64::MAX, values };
        let limits =
            SizeLimits { bend_count: count as u64, ..limits(count as u64, count as u64, 500 * 30) };
        for (topic, text) in [
            (Topic::Topology, serde_json::to_string(&topology).unwrap()),
            (Topic::Parameters, serde_json::to_string(&parameters).unwrap()),
            (Topic::Tears, serde_json::to_string(&tears).unwrap()),
            (Topic::Surface, serde_json::to_string(&surface).unwrap()),
        ] {
            let limit = limits.message_size_bytes_max(topic);
            assert!(text.len() as u64 <= limit, "{topic:?}: {} of {limit}", text.len());
        }
    }

    #[test]
    fn the_longest_keyframe_of_every_scene_is_within_the_limits() {
        for name in builtin::names() {
            let scene = Scene::from_toml(builtin::text(name).unwrap(), name).unwrap();
            let solver = Solver::new(&scene);
            let (particles, constraints) = (solver.particle_count(), solver.constraint_count());
            let limits = limits(particles as u64, constraints as u64, scene.to_toml().len() as u64);
            // The message has two keys, a step and a size before the keyframe.
            let longest = solver.keyframe_size_bytes_max() as u64 + 22;
            assert!(longest <= limits.message_size_bytes_max(Topic::Keyframe), "{name}");
        }
    }

    #[test]
    fn a_small_scene_needs_little_memory() {
        let small = limits(2, 1, 1000);
        assert!(small.chunk_record_size_bytes_max() < 8 << 20);
        assert!(small.decoded_size_bytes_max() < 128 << 20);
        assert!(small.backlog_size_bytes_max() < 320 << 20);
        let most_text = COLLIDERS_MAX as u64 * 32;
        assert!(limits(2, 1, most_text).message_size_bytes_max(Topic::Colliders) < 64 << 20);
    }
}
