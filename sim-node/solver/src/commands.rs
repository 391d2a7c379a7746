//! What can be done to the state at the boundary before a step. A rejected command changes nothing.

use thiserror::Error;

use crate::Solver;
use crate::drive::Grab;
use crate::particles::flag;

/// Largest coordinate that a command may name: f32 resolves 1 m there.
pub const COORDINATE_MAX: f32 = 1e7;

/// Longest time, in seconds, that a grabbed particle may take to its target.
pub const GRAB_OVER_S_MAX: f32 = 0.25;

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
    /// The particle is not grabbed.
    #[error("the particle is not grabbed")]
    NotGrabbed,
    /// Another client holds the particle.
    #[error("another client holds the particle")]
    GrabbedByOther,
    /// The particle is frozen.
    #[error("the particle is frozen")]
    NoEffectHere,
}

impl Rejection {
    /// The word for it in logs and outcomes.
    pub fn name(self) -> &'static str {
        match self {
            Self::NonFinite => "non_finite",
            Self::OutOfRange => "out_of_range",
            Self::UnknownParticle => "unknown_particle",
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
        self.particles.change_flags(index, flag::PINNED, 0);
        // A grabbed one goes on with the hand that holds it, and stands where it is let go.
        if !self.has_flag(index, flag::GRABBED) {
            self.particles.stop(index);
        }
        Ok(())
    }

    /// Frees a pinned particle, from rest. Unpinning a free one is fine.
    ///
    /// # Errors
    /// Unknown or frozen particle.
    pub fn unpin(&mut self, particle: u32) -> Result<(), Rejection> {
        let index = self.living_particle(particle)?;
        self.particles.change_flags(index, 0, flag::PINNED);
        Ok(())
    }

    /// Drives a particle to a target until [`Self::release`]. Grabbing again is a new target.
    ///
    /// # Errors
    /// Bad target or time, unknown or frozen particle, or another client holds it.
    pub fn grab(&mut self, client_id: u64, grip: Grip) -> Result<(), Rejection> {
        self.check_target(&grip)?;
        let index = self.living_particle(grip.particle)?;
        let substeps_left = self.substeps_of(grip.over_s);
        let Grip { particle, target, .. } = grip;
        let grab = Grab { particle, client_id, target, substeps_left };
        match self.find_grab(particle) {
            Ok(place) if self.grabs[place].client_id != client_id => {
                return Err(Rejection::GrabbedByOther);
            }
            Ok(place) => self.grabs[place] = grab,
            Err(place) => self.grabs.insert(place, grab),
        }
        self.particles.change_flags(index, flag::GRABBED, 0);
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
        self.grabs[place].substeps_left = self.substeps_of(grip.over_s);
        Ok(())
    }

    /// Lets a grabbed particle go with the velocity of its last motion; a pinned one stays where
    /// it is.
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
        Ok(())
    }

    fn living_particle(&self, particle: u32) -> Result<usize, Rejection> {
        let index = particle as usize;
        if index >= self.particles.count() {
            return Err(Rejection::UnknownParticle);
        }
        if self.has_flag(index, flag::FROZEN) { Err(Rejection::NoEffectHere) } else { Ok(index) }
    }

    fn has_flag(&self, index: usize, flag: u32) -> bool {
        self.particles.flags[index] & flag != 0
    }

    fn check_target(&self, grip: &Grip) -> Result<(), Rejection> {
        if !grip.over_s.is_finite() || !grip.target.iter().all(|axis| axis.is_finite()) {
            return Err(Rejection::NonFinite);
        }
        let is_near = grip.target.iter().all(|axis| axis.abs() <= COORDINATE_MAX);
        let is_in_plane = !self.is_planar || grip.target[2] == 0.0;
        let is_timely = (0.0..=GRAB_OVER_S_MAX).contains(&grip.over_s);
        if is_near && is_in_plane && is_timely { Ok(()) } else { Err(Rejection::OutOfRange) }
    }

    /// Whole steps in `over_s`, rounded up, in substeps. A time that is a whole number of steps but
    /// for its rounding to f32 is taken as that number: 1/60 s at 240 Hz is 4 steps, not 5.
    fn substeps_of(&self, over_s: f32) -> u32 {
        let steps = f64::from(over_s) * f64::from(self.settings.rate_hz) * (1.0 - 1e-7);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "0 <= over_s <= 0.25 and rate <= 1e5: at most 25,000"
        )]
        let steps = steps.ceil() as u32;
        steps.max(1) * self.settings.substeps
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
