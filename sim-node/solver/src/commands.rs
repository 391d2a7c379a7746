//! What can be done to the state at the boundary before a step. A rejected command changes nothing.

use thiserror::Error;

use glam::Vec3;

use crate::Solver;
use crate::constraints::ConstraintKind;
use crate::cut::Ball;
use crate::frame::{Frame, Pose};
use crate::parameters::{Affected, Context, Setting};
use crate::particles::flag;
use crate::step::drive::Grab;

/// Largest coordinate that a command may name: f32 resolves 1 m there.
pub const COORDINATE_MAX: f32 = 1e7;

/// Longest time, in seconds, that a grabbed particle may take to its target.
pub const GRAB_OVER_S_MAX: f32 = 0.25;

/// Whether all are within [`COORDINATE_MAX`].
pub(crate) fn is_near(numbers: &[f32]) -> bool {
    numbers.iter().all(|number| number.abs() <= COORDINATE_MAX)
}

pub(crate) fn check_finite(numbers: &[f32]) -> Result<(), Rejection> {
    let is_finite = numbers.iter().all(|number| number.is_finite());
    if is_finite { Ok(()) } else { Err(Rejection::NonFinite) }
}

/// A wish to drive a particle somewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grip {
    /// Index of the particle.
    pub particle: u32,
    /// Where to, relative to the scene's origin; each coordinate within [`COORDINATE_MAX`].
    pub target: [f32; 3],
    /// Seconds to get there, 0..=[`GRAB_OVER_S_MAX`], rounded up to whole steps, at least one.
    pub over_s: f32,
}

/// A stroke of a brush.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Push {
    /// What it touches.
    pub ball: Ball,
    /// How far the brush moved in a step.
    pub delta: [f32; 3],
    /// Largest size of each component of `delta`, >= 0, if there is one.
    pub limit: Option<f32>,
}

/// Why a command changed nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Rejection {
    /// A number is NaN or infinite.
    #[error("a number is not finite")]
    NonFinite,
    /// A coordinate beyond [`COORDINATE_MAX`], or a value outside of its range.
    #[error("a value is out of its range")]
    OutOfRange,
    /// There is no such particle.
    #[error("there is no such particle")]
    UnknownParticle,
    /// There is no such constraint.
    #[error("there is no such constraint")]
    UnknownConstraint,
    /// There is no such anchor.
    #[error("there is no such anchor")]
    UnknownAnchor,
    /// There is no such collider.
    #[error("there is no such collider")]
    UnknownCollider,
    /// There is no such parameter.
    #[error("there is no such parameter")]
    UnknownParameter,
    /// The constraint is torn already.
    #[error("the constraint is torn already")]
    AlreadyTorn,
    /// The particle is not grabbed.
    #[error("the particle is not grabbed")]
    NotGrabbed,
    /// Another client holds the particle.
    #[error("another client holds the particle")]
    GrabbedByOther,
    /// The particle is frozen, or the parameter means nothing in this scene.
    #[error("it has no effect here")]
    NoEffectHere,
}

impl Rejection {
    /// The word for it in logs and outcomes.
    pub fn name(self) -> &'static str {
        match self {
            Self::NonFinite => "non_finite",
            Self::OutOfRange => "out_of_range",
            Self::UnknownParticle => "unknown_particle",
            Self::UnknownConstraint => "unknown_constraint",
            Self::UnknownAnchor => "unknown_anchor",
            Self::UnknownCollider => "unknown_collider",
            Self::UnknownParameter => "unknown_parameter",
            Self::AlreadyTorn => "already_torn",
            Self::NotGrabbed => "not_grabbed",
            Self::GrabbedByOther => "grabbed_by_other",
            Self::NoEffectHere => "no_effect_here",
        }
    }
}

impl Solver {
    /// Holds a particle where it stands, until [`Self::unpin`]. Pinning a pinned one is fine.
    ///
    /// # Errors
    /// Unknown or frozen particle.
    pub fn pin(&mut self, particle: u32) -> Result<(), Rejection> {
        let index = self.living_particle(particle)?;
        if self.has_flag(index, flag::PINNED) {
            return Ok(());
        }
        self.particles.change_flags(index, flag::PINNED, 0);
        // A grabbed one goes on with the hand that holds it, and stands where it is let go.
        if !self.has_flag(index, flag::GRABBED) {
            self.particles.stop(index);
        }
        self.due.tethers = true;
        Ok(())
    }

    /// Frees a pinned particle, from rest; one that has an anchor goes back to it. Unpinning a free one is fine.
    ///
    /// # Errors
    /// Unknown or frozen particle.
    pub fn unpin(&mut self, particle: u32) -> Result<(), Rejection> {
        let index = self.living_particle(particle)?;
        if self.has_flag(index, flag::PINNED) {
            self.particles.change_flags(index, 0, flag::PINNED);
            self.due.tethers = true;
        }
        Ok(())
    }

    /// Drives a particle to a target until [`Self::release`]. Grabbing again is a new target.
    ///
    /// # Errors
    /// Bad target or time, unknown or frozen particle, or another client holds it.
    pub fn grab(&mut self, client_id: u64, grip: Grip) -> Result<(), Rejection> {
        self.check_target(&grip)?;
        let index = self.living_particle(grip.particle)?;
        let steps_left = self.steps_of(grip.over_s);
        let Grip { particle, target, .. } = grip;
        let grab = Grab { particle, client_id, target, steps_left };
        match self.find_grab(particle) {
            Ok(place) if self.grabs[place].client_id != client_id => {
                return Err(Rejection::GrabbedByOther);
            }
            Ok(place) => self.grabs[place] = grab,
            Err(place) => self.grabs.insert(place, grab),
        }
        self.particles.change_flags(index, flag::GRABBED, 0);
        self.tie_if_root(index);
        Ok(())
    }

    /// Gives a particle that this client grabbed a new target.
    ///
    /// # Errors
    /// Bad target or time, unknown particle, or this client does not hold it.
    pub fn move_grabbed(&mut self, client_id: u64, grip: Grip) -> Result<(), Rejection> {
        self.check_target(&grip)?;
        self.living_particle(grip.particle)?;
        let place = self.find_own_grab(client_id, grip.particle)?;
        self.grabs[place].target = grip.target;
        self.grabs[place].steps_left = self.steps_of(grip.over_s);
        Ok(())
    }

    /// Lets a grabbed particle go with the velocity of its last motion; a pinned one stays where
    /// it is, an anchored one goes back to its anchor.
    ///
    /// # Errors
    /// Unknown particle, or this client does not hold it.
    pub fn release(&mut self, client_id: u64, particle: u32) -> Result<(), Rejection> {
        let index = self.living_particle(particle)?;
        let place = self.find_own_grab(client_id, particle)?;
        self.grabs.remove(place);
        self.particles.change_flags(index, 0, flag::GRABBED);
        if self.has_flag(index, flag::PINNED) {
            self.particles.stop(index);
        }
        self.tie_if_root(index);
        Ok(())
    }

    /// What is in a hand is no root of tethers.
    fn tie_if_root(&mut self, index: usize) {
        self.due.tethers |= self.has_flag(index, flag::PINNED | flag::ANCHORED);
    }

    /// Gives every free particle strictly within a ball the velocity of a brush.
    ///
    /// # Errors
    /// A wrong number.
    pub fn push(&mut self, push: Push) -> Result<(), Rejection> {
        self.check_ball(&push.ball)?;
        check_finite(&push.delta)?;
        check_finite(push.limit.as_slice())?;
        let limit = push.limit.unwrap_or(f32::MAX);
        let is_in_plane = !self.is_planar || push.delta[2] == 0.0;
        if !is_in_plane || limit < 0.0 {
            return Err(Rejection::OutOfRange);
        }
        let delta = push.delta.map(|axis| axis.clamp(-limit, limit));
        if !is_near(&delta) {
            return Err(Rejection::OutOfRange);
        }
        let [x, y, z] = delta.map(|axis| axis * self.settings.rate_hz as f32);
        for state in &mut self.particles.states {
            if state.inverse_mass != 0.0 && push.ball.has(Vec3::from_array(state.position)) {
                state.velocity = [x, y, z];
            }
        }
        Ok(())
    }

    /// Brings the frame of an anchor to a pose by the end of the next step; from then on it stands.
    ///
    /// # Errors
    /// Unknown anchor, or a wrong number.
    pub fn move_anchor(&mut self, anchor: u32, pose: Pose) -> Result<(), Rejection> {
        let frame = Frame::check(&pose, self.context())?;
        let moved = self.anchors.moved.get_mut(anchor as usize);
        *moved.ok_or(Rejection::UnknownAnchor)? = Some(frame);
        Ok(())
    }

    /// Brings a collider to a pose, against where it was at load, by the end of the next step, with
    /// the velocity that this implies; from then on it stands. It turns about its own middle;
    /// bounds do not turn.
    ///
    /// # Errors
    /// Unknown collider, or a wrong number.
    pub fn move_collider(&mut self, collider: u32, pose: Pose) -> Result<(), Rejection> {
        let frame = Frame::check(&pose, self.context())?;
        let moved = self.colliders.get_mut(collider as usize);
        moved.ok_or(Rejection::UnknownCollider)?.move_to(frame)
    }

    /// Sets a parameter, one of [`crate::PARAMETERS`], from the next step on; `kind` chooses the
    /// constraints that `compliance` or `stiffness` is meant for, none is all of them.
    ///
    /// The state keeps every bit: nothing jumps, only the forces are other ones from now on.
    ///
    /// # Errors
    /// Unknown parameter, a value of another form or outside of its range, or a softness that is
    /// not the method's.
    pub fn set(
        &mut self,
        name: &str,
        setting: Setting,
        kind: Option<ConstraintKind>,
    ) -> Result<(), Rejection> {
        let affected = self.parameters.set(name, setting, kind, self.context())?;
        self.due.constraints |= affected != Affected::Nothing;
        self.due.tethers |= affected == Affected::RigidPaths;
        Ok(())
    }

    pub(crate) fn context(&self) -> Context {
        Context { method: self.settings.method, is_planar: self.is_planar }
    }

    fn living_particle(&self, particle: u32) -> Result<usize, Rejection> {
        let index = particle as usize;
        if index >= self.particle_count() {
            return Err(Rejection::UnknownParticle);
        }
        if self.has_flag(index, flag::FROZEN) { Err(Rejection::NoEffectHere) } else { Ok(index) }
    }

    fn has_flag(&self, index: usize, flag: u32) -> bool {
        self.particles.states[index].flags & flag != 0
    }

    fn check_target(&self, grip: &Grip) -> Result<(), Rejection> {
        check_finite(&grip.target)?;
        check_finite(&[grip.over_s])?;
        let is_near = is_near(&grip.target);
        let is_in_plane = !self.is_planar || grip.target[2] == 0.0;
        let is_timely = (0.0..=GRAB_OVER_S_MAX).contains(&grip.over_s);
        if is_near && is_in_plane && is_timely { Ok(()) } else { Err(Rejection::OutOfRange) }
    }

    /// Whole steps in `over_s`, rounded up, at least one. A time that is a whole number of steps but
    /// for its rounding to f32 is taken as that number: 1/60 s at 240 Hz is 4 steps, not 5.
    pub(crate) fn steps_of(&self, over_s: f32) -> u32 {
        let steps = f64::from(over_s) * f64::from(self.settings.rate_hz) * (1.0 - 1e-7);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "0 <= over_s <= 0.25 and rate <= 1e5: at most 25,000"
        )]
        let steps = steps.ceil() as u32;
        steps.max(1)
    }

    /// The place of a particle's grab in the list, or where it would go: ascending by particle.
    fn find_grab(&self, particle: u32) -> Result<usize, usize> {
        self.grabs.binary_search_by_key(&particle, |grab| grab.particle)
    }

    fn find_own_grab(&self, client_id: u64, particle: u32) -> Result<usize, Rejection> {
        let place = self.find_grab(particle).map_err(|_| Rejection::NotGrabbed)?;
        if self.grabs[place].client_id == client_id {
            Ok(place)
        } else {
            Err(Rejection::GrabbedByOther)
        }
    }
}
