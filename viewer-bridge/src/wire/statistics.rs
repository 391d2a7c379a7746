//! STATS: statistics of the node, the scene and the server.

use bytes::Bytes;

use super::writer::{Kind, Stamp, Writer};

/// The bits of the statistics' flags.
pub mod statistics_flag {
    /// The node is paused.
    pub const PAUSED: u32 = 1;
    /// A recording is on show.
    pub const REPLAY: u32 = 1 << 1;
}

/// Percentiles over the last second.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Percentiles {
    /// Median.
    pub p50: f32,
    /// 99th percentile.
    pub p99: f32,
}

/// Statistics of the node, the scene and the server. NaN means unknown.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Statistics {
    /// Load and step.
    pub stamp: Stamp,
    /// Solver time of a step in µs.
    pub solve_us: Percentiles,
    /// Delay of a step's start after its deadline in µs.
    pub wake_late_us: Percentiles,
    /// Period of a step at the present pace, in µs.
    pub period_us: f32,
    /// Simulated seconds per second.
    pub real_time_factor: f32,
    /// Requested simulated seconds per second.
    pub time_scale: f32,
    /// Mean of length / rest length - 1 over the structural constraints that are not torn.
    pub stretch_mean: f32,
    /// Maximum of the same.
    pub stretch_max: f32,
    /// Constraint with the maximum.
    pub stretch_max_constraint: u32,
    /// Kinetic energy of the free particles in J.
    pub kinetic_j: f64,
    /// Potential energy of the free particles in J.
    pub potential_j: f64,
    /// Late steps of the run.
    pub late_steps: u64,
    /// Skipped periods of the run.
    pub skipped_periods: u64,
    /// Outcomes of the run.
    pub outcome_count: u64,
    /// Rejected commands of the run.
    pub rejected_count: u64,
    /// Frozen particles.
    pub frozen_count: u32,
    /// Torn constraints.
    pub torn_count: u32,
    /// Subscribers of the node.
    pub reader_count: u32,
    /// Pages of the server. The server fills it in.
    pub client_count: u32,
    /// Mean time to encode a frame, in µs. The server fills it in.
    pub encode_us: f32,
    /// Encoded frames per second. The server fills it in.
    pub frames_per_second: f32,
    /// [`statistics_flag`] bits.
    pub flags: u32,
}

impl Statistics {
    /// Encodes the message.
    pub fn encode(&self) -> Bytes {
        let mut writer = Writer::new(Kind::Stats, self.stamp, 136);
        for Percentiles { p50, p99 } in [self.solve_us, self.wake_late_us] {
            writer.f32(p50);
            writer.f32(p99);
        }
        for number in [
            self.period_us,
            self.real_time_factor,
            self.time_scale,
            self.stretch_mean,
            self.stretch_max,
        ] {
            writer.f32(number);
        }
        writer.u32(self.stretch_max_constraint);
        writer.f64(self.kinetic_j);
        writer.f64(self.potential_j);
        for number in
            [self.late_steps, self.skipped_periods, self.outcome_count, self.rejected_count]
        {
            writer.u64(number);
        }
        for number in [self.frozen_count, self.torn_count, self.reader_count, self.client_count] {
            writer.u32(number);
        }
        writer.f32(self.encode_us);
        writer.f32(self.frames_per_second);
        writer.u32(self.flags);
        writer.u32(0);
        writer.finish()
    }
}
