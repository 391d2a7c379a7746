//! Checks that a snapshot and a keyframe are a state of a scene. Both come from outside.

use sim_scene::checks::is_near;
use sim_scene::rotation::Pose;
use sim_types::{OVER_S_MAX, ParticleFlags};

use super::{RestoreError, is_held};
use crate::constraints::tethers::{TetherBasis, is_root};
use crate::frame::Frame;
use crate::motion::{MOTION_POINTS_MAX, MotionState, steps_at};
use crate::solver::Solver;
use crate::state::keyframe::{Keyframe, Motions, Moved};
use crate::state::particles::Particle;
use crate::step::drive::GRAB_HORIZON_S;

/// Latest step of a scene. Up to it, f64 counts steps exactly.
const SCENE_STEP_MAX: u64 = 1 << 53;

impl Solver {
    pub(super) fn check_state(
        &self,
        particles: &[Particle],
        keyframe: &Keyframe,
    ) -> Result<(), RestoreError> {
        self.check_count(particles)?;
        for (particle, state) in particles.iter().enumerate() {
            self.check_particle(particle, state)
                .map_err(|what| RestoreError::Particle { particle, what })?;
        }
        self.check_holds(particles, keyframe)
            .and_then(|()| self.check_keyframe(keyframe))
            .map_err(|what| RestoreError::Mismatch { what })
    }

    fn check_particle(&self, index: usize, particle: &Particle) -> Result<(), &'static str> {
        let is_fixed = particle.flags & ParticleFlags::ALL != 0;
        let numbers = || particle.position.iter().chain(&particle.velocity);
        let is_negative_zero = |number: &f32| number.to_bits() == (-0.0_f32).to_bits();
        if numbers().chain([&particle.inverse_mass]).any(is_negative_zero) {
            return Err("a zero has a minus sign");
        }
        if particle.flags & !ParticleFlags::ALL != 0 {
            return Err("its flags are unknown to this version");
        }
        if (particle.flags ^ self.particles.states[index].flags) & ParticleFlags::ANCHORED != 0 {
            return Err("the scene has other anchored particles");
        }
        if is_fixed != (particle.inverse_mass == 0.0) {
            return Err("its flags and its inverse mass contradict each other");
        }
        self.check_place(particle, particle.flags)?;
        if is_fixed || self.has_mass(index, particle.inverse_mass) {
            Ok(())
        } else {
            Err("its mass is not the one in the scene")
        }
    }

    /// Returns true if a free particle has this inverse mass in the scene, which no command changes.
    fn has_mass(&self, particle: usize, inverse_mass: f32) -> bool {
        self.particles.base_inverse_masses[particle].to_bits() == inverse_mass.to_bits()
    }

    fn check_count(&self, particles: &[Particle]) -> Result<(), RestoreError> {
        self.assert_whole();
        let (expected, found) = (self.particle_count(), particles.len());
        if expected == found {
            Ok(())
        } else {
            Err(RestoreError::ParticleCount { expected, found })
        }
    }

    /// Checks positions and velocities for the current state.
    pub(super) fn check_motion(&self, particles: &[Particle]) -> Result<(), RestoreError> {
        self.check_count(particles)?;
        for (index, (given, current)) in particles.iter().zip(&self.particles.states).enumerate() {
            self.check_place(given, current.flags)
                .map_err(|what| RestoreError::Particle { particle: index, what })?;
        }
        Ok(())
    }

    /// Checks the position and the velocity of a particle that has these flags.
    fn check_place(&self, particle: &Particle, flags: u32) -> Result<(), &'static str> {
        let mut numbers = particle.position.iter().chain(&particle.velocity);
        if !numbers.all(|number| number.is_finite()) {
            return Err("a number is not finite");
        }
        if is_held(flags) && particle.velocity != [0.0; 3] {
            return Err("it is pinned or frozen, but has a velocity");
        }
        if self.is_planar && (particle.position[2] != 0.0 || particle.velocity[2] != 0.0) {
            return Err("it lies outside of the plane of a scene of 2 dimensions");
        }
        Ok(())
    }

    /// Checks the keyframe against the scene alone.
    pub(crate) fn check_keyframe(&self, keyframe: &Keyframe) -> Result<(), &'static str> {
        let (particles, constraints) = (self.particle_count(), self.constraint_count());
        let mut all_torn = keyframe.torn.clone();
        all_torn.sort_unstable();
        if !is_ascending_below(&all_torn, constraints) {
            return Err("a torn constraint is unknown or listed twice");
        }
        if keyframe.tear_causes.len() != keyframe.torn.len() {
            return Err("torn constraints and causes differ in number");
        }
        let TetherBasis { roots, torn } = &keyframe.tethers;
        let is_torn = |index: &u32| all_torn.binary_search(index).is_ok();
        let has_tethers = !roots.is_empty() || !torn.is_empty();
        if (has_tethers && !self.settings.has_tethers())
            || !is_ascending_below(roots, particles)
            || !is_ascending_below(torn, constraints)
            || !torn.iter().all(is_torn)
        {
            return Err("its tethers belong to another scene");
        }
        if !keyframe.parameters.is_valid(self.context()) {
            return Err("a parameter is out of its range");
        }
        self.check_moved(&keyframe.moved_anchors, self.anchor_count())?;
        self.check_moved(&keyframe.moved_colliders, self.collider_count())?;
        let moved = keyframe.moved_colliders.iter();
        for (collider, moved) in moved.map(|one| (&self.colliders[one.index as usize], one)) {
            if !collider.accepts(&moved.frame()) {
                return Err("bounds are rotated");
            }
        }
        self.check_motions(keyframe)?;
        self.check_grabs_and_counters(keyframe)
    }

    fn check_motions(&self, keyframe: &Keyframe) -> Result<(), &'static str> {
        let Motions { grabs, anchors, colliders } = &keyframe.motions;
        let particles: Vec<_> = keyframe.grabs.iter().map(|grab| grab.particle).collect();
        let moved = |all: &[Moved]| all.iter().map(|one| one.index).collect::<Vec<_>>();
        let is_among = |motions: &[MotionState], owners: &[u32]| {
            let mut owners = owners.iter();
            motions.iter().all(|motion| owners.any(|owner| *owner == motion.index))
        };
        if !is_among(grabs, &particles)
            || !is_among(anchors, &moved(&keyframe.moved_anchors))
            || !is_among(colliders, &moved(&keyframe.moved_colliders))
        {
            return Err("a motion belongs to nothing that is grabbed or moved");
        }
        let count: usize = keyframe.motions.all().map(|motion| motion.points().len()).sum();
        if count > MOTION_POINTS_MAX {
            return Err("its motions have too many points");
        }
        let steps_max = steps_at(f64::from(OVER_S_MAX), self.settings.rate_hz);
        for motion in keyframe.motions.all() {
            if motion.begins_after(keyframe.scene_step) {
                return Err("a motion begins after the step");
            }
            let times: Vec<_> = motion.points().map(|(time, _)| time).collect();
            let is_ascending = times.windows(2).all(|pair| pair[0] < pair[1]);
            let is_time = |time: &f64| (0.0..=steps_max).contains(time);
            if times.is_empty() || !is_ascending || !times.iter().all(is_time) {
                return Err("a time of a motion is out of range");
            }
            let is_frame = |(_, pose): (f64, Pose)| {
                Frame::check(&pose, self.context()).is_ok_and(|_| is_unit(&pose))
            };
            if !motion.points().all(is_frame) {
                return Err("a point of a motion is out of range");
            }
        }
        let bounds = |motion: &&MotionState| {
            let collider = &self.colliders[motion.index as usize];
            motion.points().any(|(_, pose)| !collider.accepts(&Frame::from_pose(&pose)))
        };
        if colliders.iter().find(bounds).is_some() { Err("bounds are rotated") } else { Ok(()) }
    }

    fn check_moved(&self, all: &[Moved], count: usize) -> Result<(), &'static str> {
        let indices: Vec<_> = all.iter().map(|one| one.index).collect();
        if !is_ascending_below(&indices, count) {
            return Err("a moved anchor or collider is unknown");
        }
        let is_frame = |moved: &Moved| {
            let pose = Pose { translation: moved.translation, rotation: moved.rotation };
            Frame::check(&pose, self.context()).is_ok() && is_unit(&pose)
        };
        if all.iter().all(is_frame) {
            Ok(())
        } else {
            Err("an anchor or a collider is out of range")
        }
    }

    fn check_grabs_and_counters(&self, keyframe: &Keyframe) -> Result<(), &'static str> {
        let steps_max = self.grab_steps(GRAB_HORIZON_S);
        if keyframe.grabs.iter().any(|grab| grab.steps_left > steps_max) {
            return Err("a grab exceeds the longest duration");
        }
        if self.is_planar && keyframe.grabs.iter().any(|grab| grab.target[2] != 0.0) {
            return Err("a target lies outside of the plane of a scene of 2 dimensions");
        }
        if keyframe.scene_step > SCENE_STEP_MAX {
            return Err("its scene step is too large");
        }
        Ok(())
    }

    /// Checks that the snapshot and the keyframe agree on fixed and grabbed particles.
    fn check_holds(&self, particles: &[Particle], keyframe: &Keyframe) -> Result<(), &'static str> {
        let with = |flags: u32| {
            let indices = (0_u32..).zip(particles);
            indices.filter(move |(_, one)| one.flags & flags != 0).map(|(index, _)| index)
        };
        if !with(ParticleFlags::ALL).eq(keyframe.fixed.iter().map(|one| one.particle)) {
            return Err("their fixed particles differ");
        }
        if !with(ParticleFlags::GRABBED).eq(keyframe.grabs.iter().map(|grab| grab.particle)) {
            return Err("their grabbed particles differ");
        }
        // The position of a root is taken from the snapshot, so it must not depend on the step.
        let is_root =
            |root: &u32| particles.get(*root as usize).is_some_and(|one| is_root(one.flags));
        if !keyframe.tethers.roots.iter().all(is_root) {
            return Err("a root of its tethers is not fixed");
        }
        let mut fixed = keyframe.fixed.iter();
        if !fixed.all(|one| self.has_mass(one.particle as usize, one.base_inverse_mass)) {
            return Err("the mass of a fixed particle is not the one in the scene");
        }
        if !keyframe.grabs.iter().all(|grab| is_near(&grab.target)) {
            return Err("a target is out of range");
        }
        Ok(())
    }
}

/// True if the rotation is a unit quaternion, up to rounding.
fn is_unit(pose: &Pose) -> bool {
    let square: f32 = pose.rotation.iter().map(|part| part * part).sum();
    (square - 1.0).abs() < 1e-5
}

/// True if the indices ascend strictly, all below a limit.
fn is_ascending_below(indices: &[u32], limit: usize) -> bool {
    indices.windows(2).all(|pair| pair[0] < pair[1])
        && indices.last().is_none_or(|last| (*last as usize) < limit)
}
