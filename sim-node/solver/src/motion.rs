//! Motion along points in time: the paths of a scene, and the motions that clients begin. The frame of a step is a
//! function of its number, so nothing accumulates, and any step can be the first.

use glam::{DQuat, DVec3, Quat, Vec3};
use serde::{Deserialize, Serialize};
use sim_scene::rotation::Pose;
use sim_scene::scene::Waypoint;

use crate::frame::Frame;

pub use sim_types::MOTION_POINTS_MAX;

/// Times that differ from whole steps by less than this, in steps, are those steps: 0.1 s at 240 Hz is 24 steps.
const STEP_ROUNDING: f64 = 1e-6;

/// A path of the scene: poses over time in seconds. Without a point, the frame stays at its pose at load.
#[derive(Debug, Clone, Default)]
pub(crate) struct Path {
    points: Vec<Waypoint>,
    is_repeated: bool,
}

impl Path {
    pub(crate) fn new(points: &[Waypoint], is_repeated: bool) -> Self {
        Self { points: points.to_vec(), is_repeated }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Frame at a time: interpolated between points, constant before the first and after the last.
    pub(crate) fn frame(&self, time_s: f64) -> Frame {
        let (Some(first), Some(last)) = (self.points.first(), self.points.last()) else {
            return Frame::AT_LOAD;
        };
        let mut time_s = time_s;
        if self.is_repeated && time_s > last.time {
            let period = last.time - first.time;
            time_s -= ((time_s - first.time) / period).floor() * period;
        }
        let at = |point: &Waypoint| {
            let Waypoint { translation, rotation, .. } = *point;
            Frame::from_pose(&Pose { translation, rotation })
        };
        frame_at(&self.points, time_s, at)
    }
}

/// A motion that a client has begun: from where the frame was, along points in time, to the last one, where it stays.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Motion {
    /// Step of the scene at whose end the time is 0.
    start_step: u64,
    /// At least one point, at ascending times in steps. Rotations are unit quaternions.
    points: Vec<Waypoint>,
}

/// A motion in a keyframe.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct MotionState {
    /// Index of the particle, anchor or collider.
    pub(crate) index: u32,
    /// Step of the scene at whose end the time is 0.
    start_step: u64,
    /// Time in steps, translation and rotation: from the last point that was passed on.
    points: Vec<(f64, [f32; 3], [f32; 4])>,
}

/// Largest size of a motion with one point in the encoding of a keyframe, in bytes. Further points take less.
pub(crate) const MOTION_SIZE_BYTES_MAX: usize = 5 + 10 + 2 + 8 + 12 + 16;

impl Motion {
    /// From a frame, at the end of `scene_step`, to another one within a number of steps.
    pub(crate) fn between(scene_step: u64, from: Frame, to: Frame, steps: u32) -> Self {
        let points = vec![waypoint(0.0, from), waypoint(f64::from(steps), to)];
        Self { start_step: scene_step, points }
    }

    /// From a frame, at the end of `scene_step`, along points at times in steps. Without a point at the time 0, the
    /// frame is that point.
    pub(crate) fn along(scene_step: u64, from: Frame, points: &[(f64, Frame)]) -> Self {
        let is_given = points.first().is_some_and(|(time, _)| *time == 0.0);
        let start = (!is_given).then_some((0.0, from));
        let points = start.iter().chain(points).map(|(time, frame)| waypoint(*time, *frame));
        Self { start_step: scene_step, points: points.collect() }
    }

    /// The same motion with further points. After its end, it goes on from now: a frame that stands does not jump. None if
    /// the first of the points is not after the last one of the motion, or not after now.
    pub(crate) fn extended(&self, scene_step: u64, points: &[(f64, Frame)]) -> Option<Self> {
        let (pending, now) = (self.pending(scene_step), self.elapsed(scene_step));
        let last = pending.last()?;
        if points.first().is_some_and(|(time, _)| *time <= last.time.max(now)) {
            return None;
        }
        let added = points.iter().map(|(time, frame)| waypoint(*time, *frame));
        let points = if last.time < now {
            std::iter::once(Waypoint { time: now, ..*last }).chain(added).collect()
        } else {
            pending.iter().copied().chain(added).collect()
        };
        Some(Self { start_step: self.start_step, points })
    }

    /// Frame at the end of a step of the scene.
    pub(crate) fn frame(&self, scene_step: u64) -> Frame {
        self.frame_after(self.elapsed(scene_step))
    }

    /// The point for which a driven particle heads in the step that ends as `scene_step`, and the number of steps up to
    /// it: at most `horizon`, and not beyond the next point of the path. A velocity from positions one step apart would
    /// have their rounding.
    pub(crate) fn aim(&self, scene_step: u64, horizon: u32) -> (Vec3, u32) {
        let end = self.elapsed(scene_step);
        let next = self.points.partition_point(|point| point.time <= end - 1.0);
        let corner = self.points.get(next).map_or(end, |point| point.time.floor());
        let aim = corner.min(end - 1.0 + f64::from(horizon)).max(end);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a whole number from 1 to the horizon"
        )]
        let steps = (aim - end + 1.0) as u32;
        (self.frame_after(aim).translation, steps)
    }

    /// Number of points on their way, including the last point passed; 1 after the motion has ended.
    pub(crate) fn point_count(&self, scene_step: u64) -> usize {
        self.pending(scene_step).len()
    }

    fn frame_after(&self, steps: f64) -> Frame {
        frame_at(&self.points, steps, unit_frame)
    }

    fn elapsed(&self, scene_step: u64) -> f64 {
        elapsed(self.start_step, scene_step)
    }

    /// The points from the last one that was passed on.
    fn pending(&self, scene_step: u64) -> &[Waypoint] {
        let elapsed = self.elapsed(scene_step);
        let passed = self.points.partition_point(|point| point.time <= elapsed);
        &self.points[passed.saturating_sub(1)..]
    }

    /// The motion in a keyframe of this step.
    pub(crate) fn state(&self, index: u32, scene_step: u64) -> MotionState {
        let point = |point: &Waypoint| (point.time, point.translation, point.rotation);
        MotionState {
            index,
            start_step: self.start_step,
            points: self.pending(scene_step).iter().map(point).collect(),
        }
    }

    /// True if its frame changes after a step of the scene.
    pub(crate) fn is_under_way(&self, scene_step: u64) -> bool {
        let last = self.points.last().map_or(0.0, |last| last.time);
        self.elapsed(scene_step) < last
    }

    /// The motion of a keyframe that was checked.
    pub(crate) fn restored(state: &MotionState) -> Self {
        let point = |&(time, translation, rotation): &_| Waypoint { time, translation, rotation };
        let points = state.points.iter().map(point).collect();
        Self { start_step: state.start_step, points }
    }
}

/// Number of steps from a step of the scene to another one that is not before it.
fn elapsed(start_step: u64, scene_step: u64) -> f64 {
    scene_step.saturating_sub(start_step) as f64
}

impl MotionState {
    /// True if its frame changes after a step of the scene.
    pub(crate) fn is_under_way(&self, scene_step: u64) -> bool {
        let last = self.points.last().map_or(0.0, |(time, ..)| *time);
        elapsed(self.start_step, scene_step) < last
    }

    /// True if it begins after a step of the scene.
    pub(crate) fn begins_after(&self, scene_step: u64) -> bool {
        self.start_step > scene_step
    }

    /// The times in steps, and the poses.
    pub(crate) fn points(&self) -> impl ExactSizeIterator<Item = (f64, Pose)> + '_ {
        self.points
            .iter()
            .map(|&(time, translation, rotation)| (time, Pose { translation, rotation }))
    }

    pub(crate) fn size_bytes(&self) -> usize {
        size_of::<Self>() + size_of_val(self.points.as_slice())
    }
}

/// A time in seconds in steps.
pub(crate) fn steps_at(time_s: f64, rate_hz: u32) -> f64 {
    let steps = time_s * f64::from(rate_hz);
    let whole = steps.round();
    if (steps - whole).abs() < STEP_ROUNDING { whole } else { steps }
}

fn waypoint(time: f64, frame: Frame) -> Waypoint {
    let Pose { translation, rotation } = frame.to_pose();
    Waypoint { time, translation, rotation }
}

/// The frame of a point whose rotation is a unit quaternion, bit for bit.
fn unit_frame(point: &Waypoint) -> Frame {
    Frame {
        translation: Vec3::from_array(point.translation),
        rotation: Quat::from_array(point.rotation),
    }
}

/// Frame at a time of a path with a point. `at` is the frame of a point.
fn frame_at(points: &[Waypoint], time: f64, at: impl Fn(&Waypoint) -> Frame) -> Frame {
    let next = points.partition_point(|point| point.time <= time);
    if next == 0 || next == points.len() {
        return at(&points[next.saturating_sub(1)]);
    }
    let (from, to) = (&points[next - 1], &points[next]);
    let share = (time - from.time) / (to.time - from.time);
    Frame::new(translation_between(from, to, share), rotation_between(from, to, share))
}

fn translation_between(from: &Waypoint, to: &Waypoint, share: f64) -> DVec3 {
    let vector = |waypoint: &Waypoint| Vec3::from_array(waypoint.translation).as_dvec3();
    vector(from) * (1.0 - share) + vector(to) * share
}

/// Normalised linear interpolation along the shorter arc. [`Frame::new`] normalises.
fn rotation_between(from: &Waypoint, to: &Waypoint, share: f64) -> DQuat {
    let unit =
        |waypoint: &Waypoint| DQuat::from_array(waypoint.rotation.map(f64::from)).normalize();
    let (from, to) = (unit(from), unit(to));
    let from = if from.dot(to) < 0.0 { -from } else { from };
    let blend = from * (1.0 - share) + to * share;
    // Opposite rotations have no middle, so the nearer end replaces it.
    let is_degenerate = blend.dot(blend) < 1e-12;
    if is_degenerate { if share < 0.5 { from } else { to } } else { blend }
}

#[cfg(test)]
mod tests {
    //! The room that a keyframe has for a motion.
    use super::*;

    #[test]
    fn the_largest_size_of_a_motion_is_that_of_its_encoding() {
        let size_bytes = |count| {
            let points = vec![(f64::MAX, [f32::MAX; 3], [f32::MAX; 4]); count];
            let state = MotionState { index: u32::MAX, start_step: u64::MAX, points };
            postcard::to_allocvec(&state).unwrap().len()
        };
        // From 128 points on, their number takes a second byte.
        assert_eq!(size_bytes(1) + 1, MOTION_SIZE_BYTES_MAX);
        assert!(size_bytes(MOTION_POINTS_MAX) <= MOTION_POINTS_MAX * MOTION_SIZE_BYTES_MAX);
    }
}
