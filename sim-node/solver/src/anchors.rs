//! Anchors: particles that follow moving frames.

use glam::{DQuat, DVec3, Vec3};

use sim_types::ParticleFlags;

use crate::bodies::Bodies;
use crate::drive::step_towards;
use crate::frame::{Frame, Pose};
use crate::particles::Particles;
use crate::scene::{SceneAnchor, SceneParticle, Waypoint};

/// All anchors of a scene.
#[derive(Debug, Clone, Default)]
pub(crate) struct Anchors {
    paths: Vec<Path>,
    /// By anchor: where a client has put it, in place of its path.
    pub(crate) moved: Vec<Option<Frame>>,
    /// By anchor: where it is at the end of the running step.
    frames: Vec<Frame>,
    followers: Vec<Follower>,
    /// Where each follower is to be at the end of the running step.
    targets: Vec<[f32; 3]>,
}

/// The motion of one frame.
#[derive(Debug, Clone)]
struct Path {
    origin: Vec3,
    waypoints: Vec<Waypoint>,
    is_repeated: bool,
}

/// A particle that follows a frame.
#[derive(Debug, Clone, Copy)]
struct Follower {
    particle: u32,
    anchor: u32,
    /// Where it was at load.
    start: Vec3,
}

impl Anchors {
    pub(crate) fn new(scene: &[SceneAnchor], particles: &[SceneParticle]) -> Self {
        let path = |anchor: &SceneAnchor| Path {
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

    /// Lets every frame follow its path again.
    pub(crate) fn reset(&mut self) {
        self.moved.fill(None);
    }

    /// Works out where the followers are to be at the time of the running step's end, in seconds.
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

    /// Moves each follower by its share of the way that is left, unless something holds it.
    pub(crate) fn drive(
        &self,
        bodies: &mut Bodies,
        particles: &Particles,
        (substeps_left, reach): (u32, f32),
    ) {
        const HELD: u32 = ParticleFlags::PINNED | ParticleFlags::FROZEN;
        for (follower, target) in self.followers.iter().zip(&self.targets) {
            if particles.states[follower.particle as usize].flags & HELD == 0 {
                let place = bodies.place(follower.particle);
                step_towards(bodies, place, (*target, substeps_left), reach);
            }
        }
    }
}

impl Path {
    /// Where the frame is at a time: linear between two waypoints, standing outside of them.
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
        Frame::new(between(from, to, share), turned_between(from, to, share))
    }
}

fn between(from: &Waypoint, to: &Waypoint, share: f64) -> DVec3 {
    let vector = |waypoint: &Waypoint| Vec3::from_array(waypoint.translation).as_dvec3();
    vector(from) * (1.0 - share) + vector(to) * share
}

/// Normalised-linear, the short way round; [`Frame::new`] normalises.
fn turned_between(from: &Waypoint, to: &Waypoint, share: f64) -> DQuat {
    let unit =
        |waypoint: &Waypoint| DQuat::from_array(waypoint.rotation.map(f64::from)).normalize();
    let (from, to) = (unit(from), unit(to));
    let from = if from.dot(to) < 0.0 { -from } else { from };
    let blend = from * (1.0 - share) + to * share;
    // Opposite rotations have no middle; the nearer end stands for it.
    let is_lost = blend.dot(blend) < 1e-12;
    if is_lost { if share < 0.5 { from } else { to } } else { blend }
}
