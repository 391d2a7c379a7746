//! Points in time that a command carries.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::json::{double, rotation, vector};
use crate::limits::{MOTION_POINTS_MAX, OVER_S_MAX};

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

/// Fault of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PathError {
    /// The path has no points, or more than [`MOTION_POINTS_MAX`].
    Length {
        /// Count of its points.
        count: usize,
    },
    /// A point is wrong.
    Point {
        /// Index of the point in the path.
        index: usize,
        /// Its fault.
        fault: PointFault,
    },
}

/// Fault of a point of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PointFault {
    /// Its row has neither 4 nor 8 numbers.
    Row {
        /// Count of its numbers.
        count: usize,
    },
    /// A number is not finite.
    NotFinite,
    /// Its time is out of range.
    Time {
        /// The time in s.
        time: f64,
    },
    /// Its time is not after the time of the point before it.
    Order {
        /// The time in s.
        time: f64,
        /// Time of the point before it, in s.
        before: f64,
    },
}

impl fmt::Display for PathError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { count } => {
                write!(formatter, "a path of {count} points (allowed: 1 to {MOTION_POINTS_MAX})")
            }
            Self::Point { index, fault } => write!(formatter, "point {index} of the path: {fault}"),
        }
    }
}

impl fmt::Display for PointFault {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Row { count } => write!(
                formatter,
                "{count} numbers (allowed: 4, its time in s and x, y, z; or 8, a quaternion x, y, z, w behind these)"
            ),
            Self::NotFinite => write!(formatter, "a number is not finite in 32 bits"),
            Self::Time { time } => {
                write!(formatter, "the time {time} is out of range (allowed: 0 to {OVER_S_MAX} s)")
            }
            Self::Order { time, before } => {
                write!(
                    formatter,
                    "the time {time} is not after {before} (allowed: ascending times)"
                )
            }
        }
    }
}

impl std::error::Error for PathError {}
impl std::error::Error for PointFault {}

/// Checks the points that one motion or its appended part consists of.
pub(crate) fn check_path(points: &[PathPoint]) -> Result<(), PathError> {
    if points.is_empty() || points.len() > MOTION_POINTS_MAX {
        return Err(PathError::Length { count: points.len() });
    }
    let mut before = None;
    for (index, point) in points.iter().enumerate() {
        point.check(before).map_err(|fault| PathError::Point { index, fault })?;
        before = Some(point.time);
    }
    Ok(())
}

impl PathPoint {
    /// The point of a row: the time in s, x, y and z, and where it rotates the quaternion x, y, z, w.
    ///
    /// # Errors
    /// There are neither 4 nor 8 numbers.
    pub fn from_row(row: &[f64]) -> Result<Self, PointFault> {
        let rounded: Vec<f32> = row.iter().skip(1).map(|number| rounded(*number)).collect();
        match (row, rounded.as_slice()) {
            ([time, ..], &[x, y, z]) => {
                Ok(Self { time: *time, translation: [x, y, z], ..Self::AT_LOAD })
            }
            ([time, ..], &[x, y, z, qx, qy, qz, qw]) => {
                Ok(Self { time: *time, translation: [x, y, z], rotation: [qx, qy, qz, qw] })
            }
            _ => Err(PointFault::Row { count: row.len() }),
        }
    }

    /// `before` is the time of the point before it.
    fn check(&self, before: Option<f64>) -> Result<(), PointFault> {
        let Self { time, translation, rotation } = *self;
        if !time.is_finite() || !translation.iter().chain(&rotation).all(|one| one.is_finite()) {
            return Err(PointFault::NotFinite);
        }
        if !(0.0..=f64::from(OVER_S_MAX)).contains(&time) {
            return Err(PointFault::Time { time });
        }
        match before {
            Some(before) if before >= time => Err(PointFault::Order { time, before }),
            _ => Ok(()),
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

#[cfg(test)]
mod tests {
    //! A path with a fault is named, with the index of its point.
    use super::*;

    fn point(time: f64) -> PathPoint {
        PathPoint { time, ..PathPoint::AT_LOAD }
    }

    #[test]
    fn the_fault_of_a_path_names_its_point() {
        let far = PathPoint { translation: [0.0, f32::INFINITY, 0.0], ..point(1.0) };
        let turned = PathPoint { rotation: [0.0, 0.0, 0.0, f32::NAN], ..point(1.0) };
        for (points, expected) in [
            (vec![], "a path of 0 points (allowed: 1 to 2048)"),
            (vec![point(0.0); 2049], "a path of 2049 points (allowed: 1 to 2048)"),
            (
                vec![point(0.0), point(f64::NAN)],
                "point 1 of the path: a number is not finite in 32 bits",
            ),
            (vec![far], "point 0 of the path: a number is not finite in 32 bits"),
            (vec![point(0.5), turned], "point 1 of the path: a number is not finite in 32 bits"),
            (
                vec![point(0.0), point(1.0), point(1.0)],
                "point 2 of the path: the time 1 is not after 1 (allowed: ascending times)",
            ),
            (
                vec![point(0.0), point(3600.5)],
                "point 1 of the path: the time 3600.5 is out of range (allowed: 0 to 3600 s)",
            ),
            (
                vec![point(-1.0)],
                "point 0 of the path: the time -1 is out of range (allowed: 0 to 3600 s)",
            ),
        ] {
            assert_eq!(check_path(&points).unwrap_err().to_string(), expected);
        }
        assert_eq!(check_path(&[point(0.0), point(3600.0)]), Ok(()));
        let fault = PathPoint::from_row(&[0.0; 5]).unwrap_err().to_string();
        assert!(fault.starts_with("5 numbers (allowed: 4, its time in s"), "{fault}");
    }
}
