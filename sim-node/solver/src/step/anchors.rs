//! Anchors: moving frames, and the particles that follow them.

use glam::Vec3;
use sim_scene::scene::{SceneAnchor, SceneParticle};

use sim_types::ParticleFlags;

use super::drive::{DriveTarget, drive_towards};
use crate::frame::Frame;
use crate::motion::{Motion, Path};
use crate::state::particles::{Particle, Particles};
use crate::store::ParticleStore;

/// All anchors of a scene.
#[derive(Debug, Clone, Default)]
pub(crate) struct Anchors {
    paths: Vec<AnchorPath>,
    /// By anchor: frame to which a client has moved it; it replaces the path.
    pub(crate) moved: Vec<Option<Frame>>,
    /// By anchor: the motion of a client, which moves that frame.
    pub(crate) motions: Vec<Option<Motion>>,
    /// By anchor: frame at the end of the running step.
    frames: Vec<Frame>,
    followers: Vec<Follower>,
    /// By follower: position at the end of the running step.
    targets: Vec<[f32; 3]>,
}

/// The path of one frame.
#[derive(Debug, Clone)]
struct AnchorPath {
    origin: Vec3,
    path: Path,
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
            path: Path::new(&anchor.path, anchor.repeat),
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
            motions: vec![None; scene.len()],
            frames: vec![Frame::AT_LOAD; scene.len()],
            targets: vec![[0.0; 3]; followers.len()],
            followers,
        }
    }

    /// Returns every frame to its path.
    pub(crate) fn reset(&mut self) {
        self.moved.fill(None);
        self.motions.fill(None);
    }

    /// Frame of an anchor between two steps, at `time_s` in seconds. None if it is unknown.
    pub(crate) fn frame(&self, anchor: u32, time_s: f64) -> Option<Frame> {
        let moved = self.moved.get(anchor as usize)?;
        Some(moved.unwrap_or_else(|| self.paths[anchor as usize].path.frame(time_s)))
    }

    /// Computes the targets of the followers for a step that ends at `time_s`, in seconds.
    pub(crate) fn begin_step(&mut self, scene_step: u64, time_s: f64) {
        for (moved, motion) in self.moved.iter_mut().zip(&self.motions) {
            *moved = motion.as_ref().map_or(*moved, |motion| Some(motion.frame(scene_step)));
        }
        let motions = self.paths.iter().zip(&self.moved);
        for (frame, (AnchorPath { path, .. }, moved)) in self.frames.iter_mut().zip(motions) {
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
