//! Anchors: moving frames, and the particles that follow them.

use glam::{DQuat, DVec3, Vec3};

use sim_types::ParticleFlags;

use super::drive::{DriveTarget, drive_towards};
use crate::frame::{Frame, Pose};
use crate::scene::definition::anchor::{SceneAnchor, Waypoint};
use crate::scene::definition::element::SceneParticle;
use crate::state::particles::{Particle, Particles};
use crate::store::ParticleStore;

/// All anchors of a scene.
#[derive(Debug, Clone, Default)]
pub(crate) struct Anchors {
    paths: Vec<AnchorPath>,
    /// By anchor: frame that a client has set; it replaces the path.
    pub(crate) moved: Vec<Option<Frame>>,
    /// By anchor: frame at the end of the running step.
    frames: Vec<Frame>,
    followers: Vec<Follower>,
    /// By follower: position at the end of the running step.
    targets: Vec<[f32; 3]>,
}

/// The motion of one frame.
#[derive(Debug, Clone)]
struct AnchorPath {
    origin: Vec3,
    waypoints: Vec<Waypoint>,
    is_repeated: bool,
}

/// A particle that follows a frame.
#[derive(Debug, Clone, Copy)]
struct Follower {
    particle: u32,
    anchor: u32,
    /// Position at load.
    start: Vec3,
}

/// Flags of particles that an anchor does not drive.
const HELD: u32 = ParticleFlags::PINNED | ParticleFlags::FROZEN;

impl Anchors {
    pub(crate) fn new(scene: &[SceneAnchor], particles: &[SceneParticle]) -> Self {
        let path = |anchor: &SceneAnchor| AnchorPath {
            origin: Vec3::from_array(anchor.origin),
            waypoints: anchor.path.clone(),
            is_repeated: anchor.repeat,
        };
        let followers: Vec<_> = (0..)
            .zip(scene)
            .flat_map(|(anchor, one)| one.particles.iter().map(move |particle| (anchor, *particle)))
            .map(|(anchor, particle)| Follower {
                particle,
                anchor,
                start: Vec3::from_array(particles[particle as usize].position),
            })
            .collect();
        Self {
            paths: scene.iter().map(path).collect(),
            moved: vec![None; scene.len()],
            frames: vec![Frame::AT_LOAD; scene.len()],
            targets: vec![[0.0; 3]; followers.len()],
            followers,
        }
    }

    /// Returns every frame to its path.
    pub(crate) fn reset(&mut self) {
        self.moved.fill(None);
    }

    /// Computes the targets of the followers for a step that ends at `time_s`, in seconds.
    pub(crate) fn begin_step(&mut self, time_s: f64) {
        let motions = self.paths.iter().zip(&self.moved);
        for (frame, (path, moved)) in self.frames.iter_mut().zip(motions) {
            *frame = moved.unwrap_or_else(|| path.frame(time_s));
        }
        for (follower, target) in self.followers.iter().zip(&mut self.targets) {
            let anchor = follower.anchor as usize;
            let (frame, origin) = (&self.frames[anchor], self.paths[anchor].origin);
            let arm = frame.rotation * (follower.start - origin);
            *target = (origin + arm + frame.translation).to_array();
        }
    }

    /// Drives each follower by its share of the path to its target, unless it is pinned or frozen.
    /// `reach` is `max_speed` h.
    pub(crate) fn drive(
        &self,
        store: &mut ParticleStore,
        particles: &Particles,
        substeps_left: u32,
        reach: f32,
    ) {
        for (follower, target) in self.followers.iter().zip(&self.targets) {
            if particles.states[follower.particle as usize].flags & HELD == 0 {
                let location = store.location(follower.particle);
                let target = DriveTarget { position: *target, substeps_left };
                drive_towards(store, location, target, reach);
            }
        }
    }
}

impl Anchors {
    /// Center of a frame at the end of the running step.
    pub(crate) fn center(&self, anchor: usize) -> Vec3 {
        self.paths[anchor].origin + self.frames[anchor].translation
    }

    /// Returns the particles that an anchor drives, and no client holds.
    pub(crate) fn driven_particles<'a>(
        &'a self,
        anchor: usize,
        states: &'a [Particle],
    ) -> impl Iterator<Item = u32> + 'a {
        let own = self.followers.iter().filter(move |one| one.anchor as usize == anchor);
        own.map(|one| one.particle).filter(|particle| {
            states[*particle as usize].flags & (HELD | ParticleFlags::GRABBED) == 0
        })
    }
}

impl AnchorPath {
    /// Frame at a time: interpolated between waypoints, constant before the first and after the last.
    fn frame(&self, time_s: f64) -> Frame {
        let (Some(first), Some(last)) = (self.waypoints.first(), self.waypoints.last()) else {
            return Frame::AT_LOAD;
        };
        let mut time_s = time_s;
        if self.is_repeated && time_s > last.time {
            let period = last.time - first.time;
            time_s -= ((time_s - first.time) / period).floor() * period;
        }
        let next = self.waypoints.partition_point(|waypoint| waypoint.time <= time_s);
        if next == 0 || next == self.waypoints.len() {
            let Waypoint { translation, rotation, .. } = if next == 0 { *first } else { *last };
            return Frame::from_pose(&Pose { translation, rotation });
        }
        let (from, to) = (&self.waypoints[next - 1], &self.waypoints[next]);
        let share = (time_s - from.time) / (to.time - from.time);
        Frame::new(translation_between(from, to, share), rotation_between(from, to, share))
    }
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
