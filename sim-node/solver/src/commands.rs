//! Commands that change the state at the boundary before a step. A rejected command changes nothing.

pub(crate) mod apply;
pub(crate) mod cut;
mod moves;
pub(crate) mod plan;
pub(crate) mod preparation;

use glam::Vec3;
use sim_scene::rotation::Pose;
use sim_types::{
    Action, Affects, ConstraintKind, MovedObject, Parameter, ParameterValue, Part, ParticleFlags,
    Reason, Setting,
};

use crate::contacts::bodies::driven_body::BodyMotion;
use crate::frame::Frame;
use crate::solver::{Overfull, Solver};
use crate::step::drive::{ActiveGrab, GRAB_HORIZON_S};
use cut::Sphere;

/// A request to drive a particle to a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grab {
    /// Index of the particle.
    pub particle: u32,
    /// Target relative to the scene's origin. No coordinate exceeds [`crate::COORDINATE_MAX`].
    pub target: [f32; 3],
    /// Time to reach the target in seconds, 0..=[`crate::OVER_S_MAX`], rounded up to whole steps, at least
    /// one.
    pub over_s: f32,
}

/// A stroke of a brush.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Push {
    /// Region of the brush.
    pub sphere: Sphere,
    /// Displacement of the brush in one step.
    pub delta: [f32; 3],
    /// Limit of each component of `delta`, >= 0. None for no limit.
    pub limit: Option<f32>,
}

impl Solver {
    /// Holds a particle in place until [`Self::unpin`]. Pinning a pinned particle has no effect.
    ///
    /// # Errors
    /// The particle is unknown or frozen.
    pub fn pin(&mut self, particle: u32) -> Result<(), Reason> {
        let index = self.find_unfrozen(particle)?;
        if self.has_flag(index, ParticleFlags::PINNED) {
            return Ok(());
        }
        self.change_flags(index, ParticleFlags::PINNED, 0);
        // A grabbed particle follows its grab, and stops where it is released.
        if !self.has_flag(index, ParticleFlags::GRABBED) {
            self.particles.stop(index);
        }
        self.due.tethers = true;
        Ok(())
    }

    /// Frees a pinned particle, from rest. A particle with an anchor returns to it. Unpinning a free
    /// particle has no effect.
    ///
    /// # Errors
    /// The particle is unknown or frozen.
    pub fn unpin(&mut self, particle: u32) -> Result<(), Reason> {
        let index = self.find_unfrozen(particle)?;
        if self.has_flag(index, ParticleFlags::PINNED) {
            self.change_flags(index, 0, ParticleFlags::PINNED);
            self.due.tethers = true;
        }
        Ok(())
    }

    /// Drives a particle to a target until [`Self::release`]. Another grab by the same client sets a
    /// new target.
    ///
    /// # Errors
    /// The target or time is out of range, the particle is unknown or frozen, or another client has
    /// grabbed it.
    pub fn grab(&mut self, client_id: u64, grab: Grab) -> Result<(), Reason> {
        self.check_target(&grab)?;
        let index = self.find_unfrozen(grab.particle)?;
        let particle = grab.particle;
        let found = self.find_grab(particle);
        if found.is_ok_and(|place| self.grabs[place].client_id != client_id) {
            return Err(Reason::GrabbedByOther);
        }
        let active = self.active_grab(client_id, &grab)?;
        match found {
            Ok(place) => self.grabs[place] = active,
            Err(place) => self.grabs.insert(place, active),
        }
        self.change_flags(index, ParticleFlags::GRABBED, 0);
        self.update_root(index);
        Ok(())
    }

    /// Sets a new target for a particle that this client has grabbed.
    ///
    /// # Errors
    /// The target or time is out of range, the particle is unknown or frozen, or this client has not
    /// grabbed it.
    pub fn move_grabbed(&mut self, client_id: u64, grab: Grab) -> Result<(), Reason> {
        self.check_target(&grab)?;
        self.find_unfrozen(grab.particle)?;
        let place = self.find_own_grab(client_id, grab.particle)?;
        self.grabs[place] = self.active_grab(client_id, &grab)?;
        Ok(())
    }

    /// The grab on its way to the target. A long way has a motion, with points between.
    fn active_grab(&self, client_id: u64, grab: &Grab) -> Result<ActiveGrab, Reason> {
        let Grab { particle, target, over_s } = *grab;
        let steps = self.grab_steps(over_s);
        let horizon = self.grab_steps(GRAB_HORIZON_S);
        let motion = if steps > horizon {
            let replaced = (MovedObject::Particle, particle);
            let frame = |translation| Frame { translation, ..Frame::AT_LOAD };
            Some(self.motion_to(replaced, frame(Vec3::from_array(target)), steps)?)
        } else {
            None
        };
        Ok(ActiveGrab { particle, client_id, target, steps_left: steps.min(horizon), motion })
    }

    /// Releases a grabbed particle with the velocity of its last step. A pinned particle stays in
    /// place; an anchored one returns to its anchor.
    ///
    /// # Errors
    /// The particle is unknown or frozen, or this client has not grabbed it.
    pub fn release(&mut self, client_id: u64, particle: u32) -> Result<(), Reason> {
        self.find_unfrozen(particle)?;
        self.find_own_grab(client_id, particle)?;
        self.release_of_any(particle)
    }

    /// Releases a grabbed particle as [`Self::release`] does, whichever client has grabbed it.
    ///
    /// # Errors
    /// The particle is unknown or frozen, or no client has grabbed it.
    pub fn release_of_any(&mut self, particle: u32) -> Result<(), Reason> {
        let index = self.find_unfrozen(particle)?;
        let place = self.find_grab(particle).map_err(|_| Reason::NotGrabbed)?;
        self.grabs.remove(place);
        self.change_flags(index, 0, ParticleFlags::GRABBED);
        if self.has_flag(index, ParticleFlags::PINNED) {
            self.particles.stop(index);
        }
        self.update_root(index);
        Ok(())
    }

    /// Sets and clears flags of a particle.
    fn change_flags(&mut self, index: usize, set: u32, clear: u32) {
        self.particles.change_flags(index, set, clear);
        self.locate_forces();
    }

    /// Marks the tethers as out of date if a particle starts or stops being a root. Grabbed
    /// particles are excluded.
    fn update_root(&mut self, index: usize) {
        self.due.tethers |= self.has_flag(index, ParticleFlags::PINNED | ParticleFlags::ANCHORED);
    }

    /// Sets the velocity of every free particle strictly inside a sphere to the velocity of a brush.
    ///
    /// # Errors
    /// A number is not finite or out of range.
    pub fn push(&mut self, push: Push) -> Result<(), Reason> {
        self.assert_whole();
        let Push { sphere: Sphere { center, radius }, delta, limit } = push;
        Action::Push { center, radius, delta, limit }.validate()?;
        self.check_in_plane(&[center, delta])?;
        let limit = limit.unwrap_or(f32::MAX);
        let rate_hz = self.settings.rate_hz as f32;
        let [x, y, z] = delta.map(|axis| axis.clamp(-limit, limit) * rate_hz);
        for state in &mut self.particles.states {
            if state.inverse_mass != 0.0 && push.sphere.contains(Vec3::from_array(state.position)) {
                state.velocity = [x, y, z];
            }
        }
        Ok(())
    }

    /// Moves a body through the next step: from a pose, relative to that at load, and with the given motion. Particles
    /// in contact exchange impulses with it, by its mass and inertia; see [`Self::forces`] for their sum. After
    /// the step it stands where it came.
    ///
    /// # Errors
    /// The collider is unknown or no body, a number is not finite or out of range, or the force or torque alone would
    /// give the body a velocity out of range within the step.
    pub fn drive_body(
        &mut self,
        collider: u32,
        pose: Pose,
        motion: &BodyMotion,
    ) -> Result<(), Reason> {
        let Pose { translation, rotation } = pose;
        let BodyMotion { velocity, angular_velocity, force, torque } = *motion;
        Action::DriveBody {
            collider,
            translation,
            rotation,
            velocity,
            angular_velocity,
            force,
            torque,
        }
        .validate()?;
        let frame = Frame::check(&pose, self.context())?;
        motion.check_in_plane(self.is_planar)?;
        let dt = self.step_length();
        let driven = self.colliders.get_mut(collider as usize);
        driven.ok_or(Reason::UnknownCollider)?.drive(frame, motion, dt)
    }

    /// Sets a parameter, one of [`crate::PARAMETERS`], from the next step on. `kind` selects the
    /// constraints for which `compliance` or `stiffness` is meant; None selects all.
    ///
    /// The state keeps every bit: no particle jumps, only the forces change.
    ///
    /// # Errors
    /// The parameter is unknown, the value has another form or is out of range, or the softness
    /// belongs to the other method. A contact distance is out of range if it has too many neighbours
    /// at load; `check` warns of a scene with such a distance.
    pub fn set(
        &mut self,
        name: &str,
        value: ParameterValue,
        kind: Option<ConstraintKind>,
    ) -> Result<(), Reason> {
        self.set_for(name, value, kind.map_or(Part::All, Part::Kind))
    }

    /// Sets a parameter, as [`Self::set`] does, for a part of the scene.
    ///
    /// # Errors
    /// Those of [`Self::set`], or the parameter has no values for this part.
    pub fn set_for(&mut self, name: &str, value: ParameterValue, part: Part) -> Result<(), Reason> {
        Action::set(name, value).validate()?;
        // Taken out meanwhile, because the context borrows the rest.
        let mut parameters = std::mem::take(&mut self.parameters);
        let thickness = parameters.contact_thickness();
        let affected = parameters.set(name, value, part, self.context());
        self.parameters = parameters;
        let affected = affected?;
        // At once, because only the lists of neighbours tell whether they fit.
        match self.contacts_of_client(self.parameters.contact_thickness()) {
            Ok(Some(contacts)) => self.replace_particle_contacts(contacts),
            Ok(None) => {}
            Err(Overfull) => {
                let (parameter, value) = (Parameter::ContactThickness, thickness.into());
                self.parameters.values.set(Setting { parameter, part: Part::All, value });
                return Err(Reason::OutOfRange);
            }
        }
        self.follow_surfaces();
        self.due.constraints |= affected > Affects::Nothing;
        self.due.tethers |= affected == Affects::RigidPaths;
        Ok(())
    }

    fn find_unfrozen(&self, particle: u32) -> Result<usize, Reason> {
        self.assert_whole();
        let index = particle as usize;
        if index >= self.particle_count() {
            return Err(Reason::UnknownParticle);
        }
        if self.has_flag(index, ParticleFlags::FROZEN) {
            Err(Reason::NoEffectHere)
        } else {
            Ok(index)
        }
    }

    fn has_flag(&self, index: usize, flag: u32) -> bool {
        self.particles.states[index].flags & flag != 0
    }

    fn check_target(&self, grab: &Grab) -> Result<(), Reason> {
        let Grab { particle, target, over_s } = *grab;
        Action::Grab { particle, target, over_s }.validate()?;
        self.check_in_plane(&[target])
    }

    /// Checks that points and displacements of a planar scene stay in the plane.
    pub(crate) fn check_in_plane(&self, vectors: &[[f32; 3]]) -> Result<(), Reason> {
        let is_in_plane = !self.is_planar || vectors.iter().all(|vector| vector[2] == 0.0);
        if is_in_plane { Ok(()) } else { Err(Reason::OutOfRange) }
    }

    /// Position of a particle's grab in the list, or the position where it belongs. The list ascends by particle.
    fn find_grab(&self, particle: u32) -> Result<usize, usize> {
        self.grabs.binary_search_by_key(&particle, |grab| grab.particle)
    }

    fn find_own_grab(&self, client_id: u64, particle: u32) -> Result<usize, Reason> {
        let place = self.find_grab(particle).map_err(|_| Reason::NotGrabbed)?;
        if self.grabs[place].client_id == client_id {
            Ok(place)
        } else {
            Err(Reason::GrabbedByOther)
        }
    }
}
