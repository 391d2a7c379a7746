//! States from outside that replace the state of a solver.

mod check;

use sim_types::ParticleFlags;
use thiserror::Error;

use crate::motion::{Motion, MotionState};
use crate::solver::{Due, Overfull, Solver};
use crate::state::hash::state_hash;
use crate::state::keyframe::{Keyframe, Motions};
use crate::state::particles::Particle;

/// Error of restoring a snapshot and a keyframe.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum RestoreError {
    /// The snapshot belongs to another scene.
    #[error("the snapshot has {found} particles, but the scene has {expected}")]
    ParticleCount {
        /// Number of particles in the scene.
        expected: usize,
        /// Number of particles in the snapshot.
        found: usize,
    },
    /// A particle has a state that no step produces.
    #[error("particle {particle} of the snapshot is invalid: {what}")]
    Particle {
        /// Index of the particle.
        particle: usize,
        /// The fault.
        what: &'static str,
    },
    /// The keyframe belongs to another snapshot.
    #[error("the keyframe does not belong to the snapshot: {what}")]
    Mismatch {
        /// The difference.
        what: &'static str,
    },
}

impl Solver {
    /// Restores the state of a snapshot and the keyframe of the same step.
    ///
    /// # Errors
    /// They are not a state of this scene. Then nothing changes.
    pub fn restore(
        &mut self,
        particles: &[Particle],
        keyframe: &Keyframe,
    ) -> Result<(), RestoreError> {
        self.check_state(particles, keyframe)?;
        let what = "its contact distance has too many neighbours at load";
        let contacts = self.contacts_of_client(keyframe.parameters.contact_thickness());
        let contacts = contacts.map_err(|Overfull| RestoreError::Mismatch { what })?;
        if let Some(contacts) = contacts {
            self.replace_particle_contacts(contacts);
        }
        self.reset();
        self.particles.states.copy_from_slice(particles);
        let frozen = particles.iter().filter(|one| one.flags & ParticleFlags::FROZEN != 0);
        self.frozen_count = frozen.count() as u64;
        self.grabs.extend_from_slice(&keyframe.grabs);
        self.scene_step = keyframe.scene_step;
        self.restore_motions(&keyframe.motions);
        self.is_put_in_place = false;
        self.parameters.clone_from(&keyframe.parameters);
        self.parameters.make_room_for(self.model.bent_blocks.len());
        self.follow_surfaces();
        self.restore_constraints(keyframe);
        self.restore_frames(keyframe);
        self.state_hash = state_hash(&self.particles.states, self.torn.hash_seed());
        Ok(())
    }

    fn restore_constraints(&mut self, keyframe: &Keyframe) {
        self.torn.restore(&keyframe.torn, &keyframe.tear_causes);
        (self.due, self.has_new_tethers) = (Due::default(), false);
        if self.settings.has_tethers() {
            self.replace_tethers(keyframe.tethers.clone());
        }
        self.configure();
        self.tethers.attach(&mut self.store, &self.particles);
        self.tethers.drop_torn(&self.torn, &mut self.store);
    }

    fn restore_frames(&mut self, keyframe: &Keyframe) {
        for moved in &keyframe.moved_anchors {
            self.anchors.moved[moved.index as usize] = Some(moved.frame());
        }
        for moved in &keyframe.moved_colliders {
            self.colliders[moved.index as usize].moved = Some(moved.frame());
        }
        let time_s = self.scene_time_s();
        for collider in &mut self.colliders {
            collider.place(time_s);
        }
    }

    fn restore_motions(&mut self, motions: &Motions) {
        let restored = |state: &MotionState| Some(Motion::restored(state));
        for state in &motions.grabs {
            if let Ok(place) = self.grabs.binary_search_by_key(&state.index, |one| one.particle) {
                self.grabs[place].motion = restored(state);
            }
        }
        for state in &motions.anchors {
            self.anchors.motions[state.index as usize] = restored(state);
        }
        for state in &motions.colliders {
            self.colliders[state.index as usize].motion = restored(state);
        }
    }

    /// Makes the next step publish the state of a snapshot and its keyframe, as a reset does with the
    /// initial state. [`Self::step`] integrates nothing then.
    ///
    /// # Errors
    /// Same as [`Self::restore`].
    pub fn put_in_place(
        &mut self,
        particles: &[Particle],
        keyframe: &Keyframe,
    ) -> Result<(), RestoreError> {
        self.restore(particles, keyframe)?;
        self.is_put_in_place = true;
        Ok(())
    }

    /// Makes the next step publish the current state with the positions and velocities of `particles`.
    /// Their inverse masses and flags are not read.
    ///
    /// # Errors
    /// Another number of particles than the scene has, a number that is not finite, a velocity of a pinned
    /// or frozen particle, or a particle outside of the plane of a scene of 2 dimensions. Then nothing
    /// changes.
    pub fn put_motion_in_place(&mut self, particles: &[Particle]) -> Result<(), RestoreError> {
        self.check_motion(particles)?;
        for (state, given) in self.particles.states.iter_mut().zip(particles) {
            state.position = given.position.map(|axis| axis + 0.0);
            state.velocity = given.velocity.map(|axis| axis + 0.0);
        }
        self.finish_boundary();
        // Pinned roots may have other positions.
        self.tethers.attach(&mut self.store, &self.particles);
        self.is_put_in_place = true;
        Ok(())
    }

    /// Returns the hash of the state that was put in place, before the step that publishes it.
    pub fn hash_in_place(&self) -> u64 {
        self.assert_whole();
        state_hash(&self.particles.states, self.torn.next_hash_seed())
    }
}

/// Returns true if a particle with these flags does not move by itself.
fn is_held(flags: u32) -> bool {
    flags & (ParticleFlags::PINNED | ParticleFlags::FROZEN) != 0
        && flags & ParticleFlags::GRABBED == 0
}
