//! Points in time that a command carries.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::json::non_finite::{double, rotation, vector};

/// A point of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PathPoint {
    /// Time in s after the step of the command that began the motion, 0..=3600.
    #[serde(with = "double")]
    pub time: f64,
    /// Translation in m, relative to the pose at load; for a particle its position, relative to the scene's origin.
    #[serde(with = "vector")]
    pub translation: [f32; 3],
    /// Rotation relative to the pose at load, as the quaternion x, y, z, w. A particle has none.
    #[serde(default = "no_rotation", with = "rotation")]
    pub rotation: [f32; 4],
}

#[allow(clippy::cast_possible_truncation, reason = "a coordinate is rounded once, here")]
fn rounded(number: f64) -> f32 {
    number as f32
}

fn no_rotation() -> [f32; 4] {
    PathPoint::AT_LOAD.rotation
}

/// A row of numbers that is no point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PathRowError {
    /// Count of its numbers.
    pub count: usize,
}

impl fmt::Display for PathRowError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { count } = self;
        write!(
            formatter,
            "a point of {count} numbers (allowed: 4, its time in s and x, y, z; or 8, a quaternion x, y, z, w behind \
             these)"
        )
    }
}

impl std::error::Error for PathRowError {}

impl PathPoint {
    /// The point of a row: the time in s, x, y and z, and where it rotates the quaternion x, y, z, w.
    ///
    /// # Errors
    /// There are neither 4 nor 8 numbers.
    pub fn from_row(row: &[f64]) -> Result<Self, PathRowError> {
        let rounded: Vec<f32> = row.iter().skip(1).map(|number| rounded(*number)).collect();
        match (row, rounded.as_slice()) {
            ([time, ..], &[x, y, z]) => {
                Ok(Self { time: *time, translation: [x, y, z], ..Self::AT_LOAD })
            }
            ([time, ..], &[x, y, z, qx, qy, qz, qw]) => {
                Ok(Self { time: *time, translation: [x, y, z], rotation: [qx, qy, qz, qw] })
            }
            _ => Err(PathRowError { count: row.len() }),
        }
    }

    /// The pose at load, at the time 0.
    pub const AT_LOAD: Self =
        Self { time: 0.0, translation: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] };
}

/// The points of one command, up to [`PathPart::POINTS_MAX`]. Further commands append theirs. In JSON it is a list.
#[derive(Debug, Clone, Copy)]
pub struct PathPart {
    points: [PathPoint; Self::POINTS_MAX],
    count: usize,
}

impl PathPart {
    /// Most points of one command: as many as fit into shared memory beside its other fields.
    pub const POINTS_MAX: usize = 4;

    /// No points.
    pub const EMPTY: Self = Self { points: [PathPoint::AT_LOAD; Self::POINTS_MAX], count: 0 };

    /// Holds at most [`Self::POINTS_MAX`] points; `None` for more.
    pub fn new(points: &[PathPoint]) -> Option<Self> {
        let mut part = Self { count: points.len(), ..Self::EMPTY };
        part.points.get_mut(..points.len())?.copy_from_slice(points);
        Some(part)
    }

    /// The points.
    pub fn points(&self) -> &[PathPoint] {
        &self.points[..self.count]
    }
}

impl PartialEq for PathPart {
    fn eq(&self, other: &Self) -> bool {
        self.points() == other.points()
    }
}

impl Serialize for PathPart {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.points().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for PathPart {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let points = Vec::<PathPoint>::deserialize(deserializer)?;
        Self::new(&points).ok_or_else(|| {
            let count = points.len();
            serde::de::Error::invalid_length(count, &"at most 4 points in one command")
        })
    }
}
