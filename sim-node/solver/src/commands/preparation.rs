//! Constraints and contacts that another thread derives while the solver steps.
//!
//! A command that changes a parameter of every constraint, or the contact distance, costs as much as several steps of a
//! large scene. `Solver::plan` describes the work, [`Plan::prepare`] does it on any thread, and after
//! `Solver::offer` the command takes the result over. Without a result, or with one that no longer
//! fits, the command does the work itself. The bits are the same in any case.

use std::sync::Arc;

use sim_scene::model::Model;
use sim_scene::scene::{ConstraintOrder, ContactMode};

use crate::constraints::builder::{ConstraintBuilder, Setup};
use crate::constraints::order::ProjectionOrders;
use crate::constraints::tethers::{TetherBasis, Tethers};
use crate::contacts::pairs::ParticleContacts;
use crate::kernels::Kernels;
use crate::parameters::Parameters;
use crate::store::{ParticleStore, SceneFields};

/// Constraints, tethers and contacts to derive.
#[derive(Debug)]
pub struct Plan {
    pub(super) model: Arc<Model>,
    pub(super) order: ConstraintOrder,
    pub(super) kernels: Kernels,
    pub(super) setup: Setup,
    pub(super) fields: SceneFields,
    pub(super) parameters: Parameters,
    /// True if the constraints change, false if only the tethers or the contacts do.
    pub(super) has_new_constraints: bool,
    /// In any order.
    pub(super) torn: Vec<u32>,
    /// None in scenes without tethers, and if they stay.
    pub(super) tether_basis: Option<TetherBasis>,
    /// None if the contact distance stays.
    pub(super) contact_mode: Option<ContactMode>,
}

/// The constraints and contacts of a [`Plan`], for [`Solver::offer`](crate::Solver::offer).
#[derive(Debug, Clone)]
pub struct Prepared {
    pub(super) model: Arc<Model>,
    /// None in the result of a first plan without new constraints.
    pub(super) store: Option<ParticleStore>,
    pub(super) tethers: Tethers,
    pub(super) particle_contacts: Option<ParticleContacts>,
}

/// Memory for the constraints of another [`Plan`].
#[derive(Debug)]
pub struct Spare(pub(super) Box<Prepared>);

impl Plan {
    /// Derives everything. A spare of the same scene saves most of the time.
    pub fn prepare(self, spare: Option<Spare>) -> Prepared {
        let spare = spare.filter(|Spare(spare)| Arc::ptr_eq(&spare.model, &self.model));
        let mut store = spare.and_then(|Spare(spare)| spare.store);
        if self.has_new_constraints {
            self.configure(store.get_or_insert_with(|| self.new_store()));
        }
        let new_tethers =
            |basis| Tethers::new(&self.model, &self.parameters, basis, self.fields.tethers);
        let tethers = self.tether_basis.clone().map(new_tethers).unwrap_or_default();
        let particle_contacts = self.contact_mode.map(|mode| {
            let thickness = self.parameters.contact_thickness();
            ParticleContacts::new(&self.model, mode, thickness, self.kernels)
        });
        Prepared { store, tethers, particle_contacts, model: self.model }
    }

    fn new_store(&self) -> ParticleStore {
        let orders = ProjectionOrders::new(&self.model, self.order);
        ParticleStore::new(&self.model, &orders, self.kernels)
    }

    fn configure(&self, store: &mut ParticleStore) {
        let mut is_torn = vec![false; self.model.constraints.len()];
        for constraint in &self.torn {
            is_torn[*constraint as usize] = true;
        }
        let builder = ConstraintBuilder::new(&self.model, &self.parameters, self.setup);
        // Nothing has a location that could move.
        let _moved = store.configure(&builder, self.fields, &is_torn);
    }
}
