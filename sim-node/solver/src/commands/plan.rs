//! Plans the constraints and contacts that commands need, and takes prepared ones over.

use std::sync::Arc;

use sim_types::{Action, Affects, ParticleFlags};

use super::preparation::{Plan, Prepared, Spare};
use crate::constraints::tethers::{TetherBasis, is_root};
use crate::contacts::pairs::ParticleContacts;
use crate::parameters::{Parameters, part_of_command};
use crate::solver::Solver;
use crate::state::keyframe::Keyframe;

/// Number of constraints below which a command is cheaper than another thread: it takes about 0.1 us
/// for each constraint, and a thread takes 0.1 ms to start.
const CONSTRAINTS_MIN: usize = 2000;
/// Number of particles from which on contacts are derived on another thread: it takes about 1 us for each.
const CONTACTS_MIN: usize = 500;

impl Solver {
    /// Returns the work that another thread can do in advance for a reset, a pin, or settings that follow each other. `None`
    /// if there is little to do, if [`Self::apply`] rejects the actions, and for all other actions.
    pub fn plan(&self, actions: impl IntoIterator<Item = Action>) -> Option<Plan> {
        let (mut parameters, mut affected) = (self.parameters.clone(), Affects::Nothing);
        for action in actions {
            match action {
                Action::Reset => {
                    let basis = self.settings.has_tethers().then(|| self.initial_tether_basis());
                    return self.plan_for(&self.initial_parameters, &[], basis);
                }
                Action::Pin { particle } => return self.plan_pin(particle, true),
                Action::Unpin { particle } => return self.plan_pin(particle, false),
                Action::Set { parameter, value, constraint_kind, block, collider } => {
                    let part = part_of_command(constraint_kind, block, collider);
                    // A rejected setting changes nothing.
                    let set = part.and_then(|part| {
                        parameters.set(parameter.as_str(), value, part, self.context())
                    });
                    affected = affected.max(set.unwrap_or(Affects::Nothing));
                }
                _ => {}
            }
        }
        let has_new_tethers = self.settings.has_tethers() && affected == Affects::RigidPaths;
        let tether_basis = has_new_tethers.then(|| self.tether_basis());
        match affected {
            Affects::Nothing => None,
            _ => self.plan_for(&parameters, self.torn(), tether_basis),
        }
    }

    /// The tethers after a particle was pinned or unpinned.
    fn plan_pin(&self, particle: u32, is_pinned: bool) -> Option<Plan> {
        let index = self.find_unfrozen(particle).ok().filter(|_| self.settings.has_tethers())?;
        let before = self.particles.states[index].flags;
        let pinned = if is_pinned { ParticleFlags::PINNED } else { 0 };
        let after = before & !ParticleFlags::PINNED | pinned;
        let mut basis = (before != after).then(|| self.tether_basis())?;
        basis.roots.retain(|root| *root != particle);
        if is_root(after) {
            let place = basis.roots.partition_point(|root| *root < particle);
            basis.roots.insert(place, particle);
        }
        self.plan_for(&self.parameters, self.torn(), Some(basis))
    }

    /// Returns the work that another thread can do in advance for [`Self::restore`] or [`Self::put_in_place`]. `None` if
    /// there is little to do, and for a keyframe that does not belong to the scene.
    pub fn plan_state(&self, keyframe: &Keyframe) -> Option<Plan> {
        self.check_keyframe(keyframe).ok()?;
        let tether_basis = self.settings.has_tethers().then(|| keyframe.tethers.clone());
        self.plan_for(&keyframe.parameters, &keyframe.torn, tether_basis)
    }

    fn plan_for(
        &self,
        parameters: &Parameters,
        torn: &[u32],
        tether_basis: Option<TetherBasis>,
    ) -> Option<Plan> {
        let has_contacts = self.particle_contacts.are_derived_from(parameters.contact_thickness());
        let has_tethers = tether_basis
            .as_ref()
            .is_none_or(|basis| self.tethers.are_derived_from(parameters, basis));
        let has_constraints = self.store.is_derived_from(parameters);
        if (has_constraints && has_tethers || self.constraint_count() < CONSTRAINTS_MIN)
            && (has_contacts || self.particle_count() < CONTACTS_MIN)
        {
            return None;
        }
        Some(Plan {
            model: Arc::clone(&self.model),
            order: self.settings.order,
            kernels: self.store.kernels(),
            setup: self.setup(parameters),
            fields: self.scene_fields(parameters),
            parameters: parameters.clone(),
            has_new_constraints: !has_constraints,
            torn: torn.to_vec(),
            tether_basis: tether_basis.filter(|_| !has_tethers),
            contact_mode: (!has_contacts).then_some(self.contact_mode),
        })
    }

    /// Offers prepared constraints and contacts to the commands of the next boundary. An offer for another scene is
    /// ignored.
    pub fn offer(&mut self, prepared: Prepared) {
        if Arc::ptr_eq(&prepared.model, &self.model) {
            self.offered = Some(Box::new(prepared));
        }
    }

    /// Ends the offer after the boundary. Returns its memory, for the next plan; `None` without an offer.
    pub fn withdraw(&mut self) -> Option<Spare> {
        self.offered.take().map(Spare)
    }

    /// Exchanges the constraints for the offered ones if only those have the current parameters. Returns true if it has:
    /// particles have other locations then.
    pub(crate) fn accept_constraints(&mut self) -> bool {
        let Self { offered, store, parameters, .. } = self;
        let offered = offered.as_mut().and_then(|offered| offered.store.as_mut());
        let offered = offered.filter(|offered| {
            offered.is_derived_from(parameters) && !store.is_derived_from(parameters)
        });
        if let Some(offered) = offered {
            store.exchange(offered);
            if self.settings.has_tethers() {
                // The offered store may have tethers from its last use.
                store.detach_tethers(self.model.particle_count());
            }
            return true;
        }
        false
    }

    /// Returns the offered contacts if they were derived for this contact distance.
    pub(crate) fn take_offered_contacts(
        &mut self,
        thickness: Option<f32>,
    ) -> Option<ParticleContacts> {
        let offered = &mut self.offered.as_mut()?.particle_contacts;
        offered.take_if(|offered| offered.are_derived_from(thickness))
    }

    /// Puts replaced contacts into the offer, from where another thread frees their memory.
    pub(crate) fn give_away(&mut self, contacts: ParticleContacts) {
        if let Some(offered) = &mut self.offered {
            offered.particle_contacts.get_or_insert(contacts);
        }
    }

    /// Exchanges the tethers for the offered ones if those were derived from this basis. Returns true if it has.
    pub(crate) fn accept_tethers(&mut self, basis: &TetherBasis) -> bool {
        let Self { offered, tethers, parameters, .. } = self;
        let offered = offered.as_mut().map(|offered| &mut offered.tethers);
        let offered = offered.filter(|offered| offered.are_derived_from(parameters, basis));
        if let Some(offered) = offered {
            std::mem::swap(tethers, offered);
            return true;
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use sim_scene::scene::Scene;
    use sim_types::ParameterValue;

    use super::*;

    #[test]
    fn a_state_is_planned_with_the_surfaces_of_its_keyframe() {
        let text = "version = 1\n[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = -1\nrestitution = 0.5\n[[generate]]\n\
            shape = \"cloth\"\ncolumns = 40\nrows = 40\nspacing = 0.01\n";
        let mut solver = Solver::new(&Scene::from_toml(text, "test").unwrap());
        let (particles, keyframe) = (solver.particles().to_vec(), solver.keyframe());
        assert!(solver.plan_state(&keyframe).is_none(), "nothing changes");
        solver.set("restitution", ParameterValue::Off, None).unwrap();
        solver.finish_boundary();
        let plan = solver.plan_state(&keyframe).unwrap();
        solver.offer(plan.prepare(None));
        let is_offered = |solver: &Solver| {
            let offered = solver.offered.as_ref().unwrap().store.as_ref().unwrap();
            offered.is_derived_from(&solver.initial_parameters)
        };
        assert!(is_offered(&solver));
        solver.restore(&particles, &keyframe).unwrap();
        assert!(!is_offered(&solver), "exchanged");
    }

    #[test]
    fn a_boundary_takes_prepared_contacts_over_without_new_constraints() {
        let text = "version = 1\n[contact]\nmode = \"particles\"\n[[generate]]\nshape = \"cloth\"\n\
            columns = 40\nrows = 40\nspacing = 0.01\n";
        let mut solver = Solver::new(&Scene::from_toml(text, "test").unwrap());
        let set = |value| Action::set("contact.thickness", value);
        let plan = solver.plan([set(0.02)]).unwrap();
        assert!(!plan.has_new_constraints);
        solver.offer(plan.prepare(None));
        // The offer is for another distance.
        let is_offered = |solver: &Solver, thickness| {
            let offered = solver.offered.as_ref().unwrap().particle_contacts.as_ref().unwrap();
            offered.are_derived_from(Some(thickness))
        };
        solver.apply(1, &set(0.03)).unwrap();
        assert!(is_offered(&solver, 0.02), "not taken over");
        solver.apply(1, &set(0.02)).unwrap();
        assert!(is_offered(&solver, 0.03), "exchanged");
        assert!(solver.particle_contacts.are_derived_from(Some(0.02)));
        assert!(solver.plan([set(0.02)]).is_none());
    }
}
