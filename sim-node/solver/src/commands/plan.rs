//! Plans the constraints that commands need, and takes prepared ones over.

use std::sync::Arc;

use sim_types::{Action, KindFilter};

use super::preparation::{Plan, Prepared, Spare};
use crate::constraints::tethers::TetherBasis;
use crate::parameters::Parameters;
use crate::solver::Solver;
use crate::state::keyframe::Keyframe;

/// Number of constraints below which a command is cheaper than another thread: it takes about 0.1 us
/// for each constraint, and a thread takes 0.1 ms to start.
const CONSTRAINTS_MIN: usize = 2000;

impl Solver {
    /// Returns the work that makes an action cheap; None if it is cheap already, and for an action that
    /// [`Self::apply`] rejects.
    pub fn plan(&self, action: &Action) -> Option<Plan> {
        match *action {
            Action::Set { parameter, value, constraint_kind } => {
                let kind = match constraint_kind {
                    None => None,
                    Some(KindFilter::Known(kind)) => Some(kind),
                    Some(KindFilter::Unknown) => return None,
                };
                let mut parameters = self.parameters;
                parameters.set(parameter.as_str(), value, kind, self.context()).ok()?;
                self.plan_for(&parameters, self.torn(), || self.tether_basis())
            }
            Action::Reset => {
                self.plan_for(&self.initial_parameters, &[], || self.initial_tether_basis())
            }
            _ => None,
        }
    }

    /// Returns the work that makes [`Self::restore`] and [`Self::put_in_place`] cheap; None if they are
    /// cheap already, and for a keyframe that they reject.
    pub fn plan_state(&self, keyframe: &Keyframe) -> Option<Plan> {
        self.check_keyframe(keyframe).ok()?;
        self.plan_for(&keyframe.parameters, &keyframe.torn, || keyframe.tethers.clone())
    }

    fn plan_for(
        &self,
        parameters: &Parameters,
        torn: &[u32],
        tether_basis: impl FnOnce() -> TetherBasis,
    ) -> Option<Plan> {
        if self.constraint_count() < CONSTRAINTS_MIN {
            return None;
        }
        let tether_basis = self.settings.tethers.then(tether_basis);
        let has_tethers = tether_basis
            .as_ref()
            .is_none_or(|basis| self.tethers.are_derived_from(parameters, basis));
        if has_tethers && self.store.is_derived_from(parameters) {
            return None;
        }
        Some(Plan {
            model: Arc::clone(&self.model),
            order: self.settings.order,
            kernels: self.store.kernels(),
            setup: self.setup(parameters),
            fields: self.scene_fields(parameters),
            parameters: *parameters,
            torn: torn.to_vec(),
            tether_basis,
        })
    }

    /// Offers prepared constraints to the commands of the next boundary. Constraints of another scene
    /// are ignored.
    pub fn offer(&mut self, prepared: Prepared) {
        if Arc::ptr_eq(&prepared.model, &self.model) {
            self.offered = Some(Box::new(prepared));
        }
    }

    /// Withdraws the offer after the boundary. Returns the memory that is free then; None without an
    /// offer.
    pub fn withdraw(&mut self) -> Option<Spare> {
        self.offered.take().map(Spare)
    }

    /// Takes offered constraints over if they have the current parameters. Returns true if all
    /// particles have new locations then.
    pub(crate) fn accept_constraints(&mut self) -> bool {
        let Self { offered, store, parameters, .. } = self;
        let offered = offered.as_mut().filter(|offered| {
            offered.store.is_derived_from(parameters) && !store.is_derived_from(parameters)
        });
        if let Some(offered) = offered {
            store.exchange(&mut offered.store);
            return true;
        }
        false
    }

    /// Takes offered tethers over if they have this basis.
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
