//! TEAR, PINS, STATS and COLLIDERS.

use bytemuck::bytes_of;
use bytes::Bytes;
use sim_contract::{ColliderState, ParticleState};

use super::cursor::Cursor;
use super::{DecodeError, Kind, Stamp, Writer, count_of};

/// A change of the list of torn constraints: what is behind its first entries is replaced.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Tear {
    /// Load and step.
    pub stamp: Stamp,
    /// How many entries stay.
    pub first: u32,
    /// The constraints behind them.
    pub constraints: Vec<u32>,
    /// Why each of these tore: a [`sim_contract::TearCause`] as a number, 255 where not known.
    pub causes: Vec<u8>,
}

impl Tear {
    /// As bytes.
    pub fn encode(&self) -> Bytes {
        let mut writer = Writer::new(Kind::Tear, self.stamp, 28 + 5 * self.constraints.len());
        writer.u32(self.first);
        writer.u32(count_of(&self.constraints));
        self.constraints.iter().for_each(|constraint| writer.u32(*constraint));
        writer.put(&self.causes);
        writer.pad();
        writer.finish()
    }

    pub(super) fn decode(stamp: Stamp, cursor: &mut Cursor<'_>) -> Result<Self, DecodeError> {
        let (first, count) = (cursor.u32()?, cursor.u32()?);
        let constraints = cursor.list(count, 4, Cursor::u32)?;
        Ok(Self { stamp, first, constraints, causes: cursor.padded(count)? })
    }
}

/// All particles that are not free.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Pins {
    /// Load and step.
    pub stamp: Stamp,
    /// Particle and its [`sim_contract::ParticleFlags`], ascending by particle.
    pub held: Vec<[u32; 2]>,
}

impl Pins {
    /// Those of a snapshot.
    pub fn of(particles: &[ParticleState]) -> Vec<[u32; 2]> {
        let all = (0_u32..).zip(particles);
        all.filter(|(_, one)| one.flags != 0).map(|(index, one)| [index, one.flags]).collect()
    }

    /// As bytes.
    pub fn encode(&self) -> Bytes {
        let mut writer = Writer::new(Kind::Pins, self.stamp, 24 + 8 * self.held.len());
        writer.u32(count_of(&self.held));
        writer.u32(0);
        self.held.iter().flatten().for_each(|number| writer.u32(*number));
        writer.finish()
    }

    pub(super) fn decode(stamp: Stamp, cursor: &mut Cursor<'_>) -> Result<Self, DecodeError> {
        let (count, _spare) = (cursor.u32()?, cursor.u32()?);
        let held = cursor.list(count, 8, |cursor| Ok([cursor.u32()?, cursor.u32()?]))?;
        Ok(Self { stamp, held })
    }
}

/// All colliders.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Colliders {
    /// Load and step.
    pub stamp: Stamp,
    /// The colliders, by index, in the layout of the contract.
    pub colliders: Vec<ColliderState>,
}

impl Colliders {
    /// As bytes.
    pub fn encode(&self) -> Bytes {
        let size = 24 + size_of::<ColliderState>() * self.colliders.len();
        let mut writer = Writer::new(Kind::Colliders, self.stamp, size);
        writer.u32(count_of(&self.colliders));
        writer.u32(0);
        self.colliders.iter().for_each(|collider| writer.put(bytes_of(collider)));
        writer.finish()
    }

    pub(super) fn decode(stamp: Stamp, cursor: &mut Cursor<'_>) -> Result<Self, DecodeError> {
        let (count, _spare) = (cursor.u32()?, cursor.u32()?);
        let size = size_of::<ColliderState>();
        let colliders = cursor
            .list(count, size, |cursor| Ok(bytemuck::pod_read_unaligned(cursor.take(size)?)))?;
        Ok(Self { stamp, colliders })
    }
}

/// The bits of the statistics' flags.
pub mod statistics_flag {
    /// The node is paused.
    pub const PAUSED: u32 = 1;
    /// A recording is shown.
    pub const REPLAY: u32 = 1 << 1;
}

/// How node and simulation do. Percentiles are over the last second.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Statistics {
    /// Load and step.
    pub stamp: Stamp,
    /// Time of the solver for a step in µs: median and 99th percentile.
    pub solve_us: [f32; 2],
    /// Lateness of wake-ups in µs: median and 99th percentile.
    pub wake_late_us: [f32; 2],
    /// Period of a step at the present pace, in µs.
    pub period_us: f32,
    /// Simulated time per time.
    pub real_time_factor: f32,
    /// The pace that is asked for.
    pub time_scale: f32,
    /// Mean of length / rest length - 1, over live structural constraints.
    pub stretch_mean: f32,
    /// Its maximum.
    pub stretch_max: f32,
    /// The constraint of the maximum.
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
    /// Readers of the node.
    pub reader_count: u32,
    /// Clients of the bridge.
    pub client_count: u32,
    /// Mean time to encode a frame, in µs.
    pub encode_us: f32,
    /// Encoded frames per second.
    pub frames_per_second: f32,
    /// [`statistics_flag`] bits.
    pub flags: u32,
}

impl Statistics {
    /// As bytes.
    pub fn encode(&self) -> Bytes {
        let mut writer = Writer::new(Kind::Stats, self.stamp, 136);
        for number in self.solve_us.iter().chain(&self.wake_late_us) {
            writer.f32(*number);
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

    pub(super) fn decode(stamp: Stamp, cursor: &mut Cursor<'_>) -> Result<Self, DecodeError> {
        // Fields are read in the order written here.
        let statistics = Self {
            stamp,
            solve_us: [cursor.f32()?, cursor.f32()?],
            wake_late_us: [cursor.f32()?, cursor.f32()?],
            period_us: cursor.f32()?,
            real_time_factor: cursor.f32()?,
            time_scale: cursor.f32()?,
            stretch_mean: cursor.f32()?,
            stretch_max: cursor.f32()?,
            stretch_max_constraint: cursor.u32()?,
            kinetic_j: cursor.f64()?,
            potential_j: cursor.f64()?,
            late_steps: cursor.u64()?,
            skipped_periods: cursor.u64()?,
            outcome_count: cursor.u64()?,
            rejected_count: cursor.u64()?,
            frozen_count: cursor.u32()?,
            torn_count: cursor.u32()?,
            reader_count: cursor.u32()?,
            client_count: cursor.u32()?,
            encode_us: cursor.f32()?,
            frames_per_second: cursor.f32()?,
            flags: cursor.u32()?,
        };
        let _spare = cursor.u32()?;
        Ok(statistics)
    }
}
