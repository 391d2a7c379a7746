//! Anchors: particles that follow a moving frame.

use crate::fields::{At, Fields, SceneTable, printed};

/// Largest time of a waypoint in seconds (30 years). In f64 it still resolves microseconds.
const TIME_MAX: f64 = 1e9;
/// Rotation that leaves everything in place.
pub(crate) const NO_ROTATION: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// Particles that follow a moving frame. Each is driven to origin + R (start - origin) +
/// translation. A pin on an anchored particle has no effect.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SceneAnchor {
    /// Indices, ascending. A particle follows at most one anchor.
    pub particles: Vec<u32>,
    /// Fixed point of the rotations.
    pub origin: [f32; 3],
    /// Starts the path again when it ends.
    pub repeat: bool,
    /// Poses of the frame over time. The frame moves linearly between them, and stands still
    /// before the first and after the last.
    pub path: Vec<Waypoint>,
}

/// Pose of a frame at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waypoint {
    /// Seconds since the scene's step 0, >= 0.
    pub time: f64,
    /// Relative to the frame's position at load.
    pub translation: [f32; 3],
    /// Quaternion x, y, z, w. It is normalised on use.
    pub rotation: [f32; 4],
}

impl SceneTable for SceneAnchor {
    fn fields(&mut self, fields: &mut Fields<'_>) {
        let problem_count = fields.problem_count();
        fields.require("particles", "a list of indices");
        fields.value("particles", &mut self.particles, read_particles, printed);
        fields.vector("origin", &mut self.origin);
        fields.value("repeat", &mut self.repeat, |at| at.flag(), printed);
        fields.tables("path", &mut self.path, &Waypoint::default());
        if fields.problem_count() == problem_count {
            check_path(fields, &self.path, self.repeat);
        }
    }
}

/// Returns particles without another anchor, ascending.
fn read_particles(at: At<'_>) -> Option<Vec<u32>> {
    let mut is_anchored = at.reader.is_anchored.borrow_mut();
    is_anchored.resize(at.reader.particle_count.get().unwrap_or(0) as usize, false);
    let list = at.list()?;
    let mut particles = Vec::with_capacity(list.len());
    for element in list {
        let particle = element.particle()?;
        let is_twice =
            is_anchored.get_mut(particle as usize).is_some_and(|one| std::mem::replace(one, true));
        if is_twice {
            return element
                .error(format!("particle {particle} occurs in an anchor twice (allowed: once)"));
        }
        particles.push(particle);
    }
    particles.sort_unstable();
    Some(particles)
}

/// Refuses points of the key `path` that do not follow each other, and the repetition of fewer than two points.
pub(super) fn check_path(fields: &Fields<'_>, path: &[Waypoint], repeat: bool) {
    let times = path.windows(2).map(|pair| (pair[0].time, pair[1].time));
    if let Some((index, (previous, time))) = (1..).zip(times).find(|(_, (a, b))| a >= b) {
        let problem = format!("{time} is not after {previous} (allowed: ascending times)");
        fields.error_in("path", index, "time", &problem);
    }
    if repeat && path.len() < 2 {
        let problem = "a path of fewer than two points cannot repeat (allowed: false)";
        fields.error("repeat", problem);
    }
}

impl Default for Waypoint {
    fn default() -> Self {
        Self { time: 0.0, translation: [0.0; 3], rotation: NO_ROTATION }
    }
}

impl SceneTable for Waypoint {
    const FORM: &'static str = "a table of time, translation and rotation";

    fn fields(&mut self, fields: &mut Fields<'_>) {
        let allowed = format!("0 to {TIME_MAX:e} s");
        fields.require("time", &allowed);
        let read = |at: At<'_>| {
            let time = at.double()?;
            if (0.0..=TIME_MAX).contains(&time) {
                return Some(time);
            }
            at.error(format!("{time} is out of range (allowed: {allowed})"))
        };
        fields.value("time", &mut self.time, read, printed);
        fields.vector("translation", &mut self.translation);
        fields.rotation("rotation", &mut self.rotation);
    }
}
