//! Derives the constraints of a store from the scene, the parameters and the tears.

use sim_scene::constraints::bends::families::BendFamily;
use sim_scene::constraints::families::Family;
use sim_scene::constraints::sides::TornSides;
use sim_scene::model::Model;
use sim_types::Affects;

use super::ParticleStore;
use super::graph::block::BLOCK_GROUPS;
use super::layout::{Configured, Location, SceneFields};
use super::patch::sheets::find_sheet;
use crate::constraints::builder::ConstraintBuilder;
use crate::constraints::fields::ConstraintFields;
use crate::constraints::parameters::ConstraintParameters;
use crate::parameters::Parameters;

impl ParticleStore {
    /// Derives the constraints, as far as they depend on what has changed since the last call. Torn
    /// ones are inactive. Allocates only fields that are not in memory yet.
    pub(crate) fn configure(
        &mut self,
        builder: &ConstraintBuilder<'_>,
        scene: SceneFields,
        is_torn: &[bool],
    ) -> Configured {
        let affected =
            self.derived_from.as_ref().map(|from| builder.parameters.affected_since(from));
        let configured = match affected {
            Some(Affects::Nothing) => Configured::InPlace,
            Some(Affects::Limits) => self.configure_limits(builder, scene),
            _ => self.configure_all(builder, scene),
        };
        match &mut self.derived_from {
            Some(from) => from.clone_from(builder.parameters),
            none => *none = Some(builder.parameters.clone()),
        }
        self.follow_tears(builder, is_torn);
        configured
    }

    /// Returns true if the constraints are those of these parameters.
    pub(crate) fn is_derived_from(&self, parameters: &Parameters) -> bool {
        let is_same = |from| parameters.affected_since(from) == Affects::Nothing;
        self.derived_from.as_ref().is_some_and(is_same)
    }

    fn configure_all(&mut self, builder: &ConstraintBuilder<'_>, scene: SceneFields) -> Configured {
        self.survey.restart(self.patches.len());
        for (constraint, location) in (0_u32..).zip(&self.locations) {
            let family = builder.model.families[constraint as usize].map(Family::from_group);
            let sheet = location.rows().filter(|rows| *rows < self.patches.len());
            let place = sheet.zip(family);
            self.survey.observe(&builder.build(constraint), place);
        }
        let used = self.survey.fields(builder.pass_count());
        let configured = self.use_fields(builder.model, used, scene);
        for constraint in (0_u32..).take(self.locations.len()) {
            self.set_parameters(constraint, &self.parameters_of(constraint, builder));
        }
        for bend in (0_u32..).take(self.bends.locations.len()) {
            self.derive_bend(bend, builder);
        }
        configured
    }

    fn derive_bend(&mut self, bend: u32, builder: &ConstraintBuilder<'_>) {
        let is_whole = self.bends.sides.is_whole(bend);
        self.set_bend(bend, if is_whole { builder.bend_compliance(bend) } else { f32::INFINITY });
    }

    fn parameters_of(
        &self,
        constraint: u32,
        builder: &ConstraintBuilder<'_>,
    ) -> ConstraintParameters {
        if self.is_torn[constraint as usize] {
            ConstraintParameters::INACTIVE
        } else {
            builder.build(constraint)
        }
    }

    /// Sets the limits of all constraints, when nothing else has changed.
    fn configure_limits(
        &mut self,
        builder: &ConstraintBuilder<'_>,
        scene: SceneFields,
    ) -> Configured {
        let possible = builder.possible_limit_fields();
        let possible = ConstraintFields { multipliers: possible.tear_multipliers, ..possible };
        if !self.layout.extended(possible, scene).fits(&self.layout) {
            return self.configure_all(builder, scene);
        }
        self.survey.restart_limits();
        for constraint in (0_u32..).take(self.locations.len()) {
            let limits = builder.limit_lengths(constraint);
            self.survey.observe_limits(&limits);
            if !self.is_torn[constraint as usize] {
                let location = self.locations[constraint as usize];
                self.writer(location).set_limits(location.index(), &limits);
            }
        }
        self.use_fields(builder.model, self.survey.fields(builder.pass_count()), scene)
    }

    /// Deactivates the constraints that have torn since the last call, with the bends and triangles at their sides,
    /// and activates those that are no longer torn.
    fn follow_tears(&mut self, builder: &ConstraintBuilder<'_>, is_torn: &[bool]) {
        for (constraint, is_torn) in (0_u32..).zip(is_torn) {
            if self.is_torn[constraint as usize] != *is_torn {
                self.is_torn[constraint as usize] = *is_torn;
                self.set_parameters(constraint, &self.parameters_of(constraint, builder));
                self.follow_side(constraint, |bend| builder.bend_compliance(bend));
            }
        }
    }

    /// Takes fields into use, and allocates them if they are not in memory.
    fn use_fields(
        &mut self,
        model: &Model,
        used: ConstraintFields,
        scene: SceneFields,
    ) -> Configured {
        let before = self.layout;
        self.layout = before.extended(used, scene);
        self.graph.use_fields(self.layout, self.survey.loose_softness());
        for (index, patch) in self.patches.iter_mut().enumerate() {
            patch.use_fields(self.layout, self.survey.family_softness(index));
        }
        for crowd in &mut self.crowds {
            crowd.use_fields(self.layout, self.survey.loose_softness());
        }
        if self.is_allocated && self.layout.fits(&before) {
            return Configured::InPlace;
        }
        self.allocate_triangles(model);
        self.graph.allocate(model);
        for patch in &mut self.patches {
            patch.allocate();
        }
        for crowd in &mut self.crowds {
            crowd.allocate();
        }
        self.locate_constraints(model);
        let widest = self.all_rows().map(|rows| rows.layout.columns).max();
        let largest = (8 * BLOCK_GROUPS).min(self.graph.particle_count()).max(widest.unwrap_or(0));
        self.contact_room.block_length = if scene.colliders { largest } else { 0 };
        self.workers.reserve_contacts(self.contact_room);
        self.is_allocated = true;
        Configured::Moved
    }

    /// Finds the sides of the triangles on which wind may blow, the torn ones included.
    fn allocate_triangles(&mut self, model: &Model) {
        self.are_triangles_changed = self.layout.scene.wind;
        if self.layout.scene.wind {
            let triangles = model.triangles.iter().copied();
            self.triangles = TornSides::of_triangles(model.pairs(), triangles);
            let torn = (0_u32..).zip(&self.is_torn).filter(|(_, is_torn)| **is_torn);
            self.triangles.set_torn(torn.map(|(constraint, _)| constraint));
        }
    }

    /// Updates the locations of the constraints and bends of sheets and crowds, whose indices depend on the
    /// layout.
    pub(super) fn locate_constraints(&mut self, model: &Model) {
        for (number, crowd) in (self.patches.len()..).zip(&self.crowds) {
            for (constraint, index) in crowd.constraint_indices() {
                self.locations[constraint as usize] = Location::in_rows(number, index);
            }
        }
        if self.patches.is_empty() {
            return;
        }
        for (constraint, group) in (0_u32..).zip(&model.families) {
            let found = find_sheet(&self.sheets, model.pair(constraint)[0]);
            if let (Some(found), Some(group)) = (found, group) {
                let family = Family::from_group(*group);
                let [row, column] = found.place;
                let place = [row, column - family.shifts()[0]];
                let index = self.patches[found.sheet].constraint_index(family, place);
                self.locations[constraint as usize] = Location::in_rows(found.sheet, index);
            }
        }
        for (bend, group) in (0_u32..).zip(&model.bend_families) {
            let found = find_sheet(&self.sheets, model.bends[bend as usize].particles[0]);
            if let (Some(found), Some(group)) = (found, group) {
                let family = BendFamily::from_group(*group);
                let index = self.patches[found.sheet].bend_index(family, found.place);
                self.bends.locations[bend as usize] = Location::in_rows(found.sheet, index);
            }
        }
    }
}
