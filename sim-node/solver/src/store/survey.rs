//! Properties that the constraints of a scene have with the current parameters.

use sim_scene::constraints::families::Family;

use crate::constraints::fields::ConstraintFields;
use crate::constraints::parameters::{ConstraintParameters, LimitLengths, PassSoftness};

/// Softness of each family of a sheet, in the order of [`Family::ALL`].
pub(crate) type FamilySoftness = [Option<PassSoftness>; Family::ALL.len()];

/// Properties of all constraints of a scene.
#[derive(Debug, Clone, Default)]
pub(crate) struct Survey {
    fields: ConstraintFields,
    /// True if any constraint is soft.
    is_soft: bool,
    /// Softness of the first constraint outside of sheets.
    loose_softness: Option<PassSoftness>,
    /// By sheet.
    family_softness: Vec<FamilySoftness>,
}

impl Survey {
    /// Forgets everything.
    pub(crate) fn restart(&mut self, sheet_count: usize) {
        (self.fields, self.is_soft, self.loose_softness) = Default::default();
        self.family_softness.clear();
        self.family_softness.resize(sheet_count, FamilySoftness::default());
    }

    /// Forgets the limits.
    pub(crate) fn restart_limits(&mut self) {
        let ConstraintFields { softness, floors, .. } = self.fields;
        self.fields = ConstraintFields { softness, floors, ..ConstraintFields::default() };
    }

    /// Adds a constraint outside of sheets, or of a family of a sheet.
    ///
    /// # Panics
    /// If the constraints of a family differ in their softness.
    pub(crate) fn observe(
        &mut self,
        parameters: &ConstraintParameters,
        family: Option<(usize, Family)>,
    ) {
        let softness = parameters.softness;
        match family {
            None => {
                let first = self.loose_softness.get_or_insert(softness);
                self.fields.softness |= *first != softness;
            }
            Some((sheet, family)) => {
                let first = self.family_softness[sheet][family as usize].get_or_insert(softness);
                assert!(
                    *first == softness,
                    "constraints of {family:?} in sheet {sheet} differ in their softness"
                );
            }
        }
        self.fields.floors |= parameters.floor >= 0.0;
        self.is_soft |= softness.scaled_compliance != 0.0;
        self.observe_limits(&parameters.limits);
    }

    /// Adds the limits of a constraint.
    pub(crate) fn observe_limits(&mut self, limits: &LimitLengths) {
        self.fields.max_lengths |= limits.max_length.is_finite();
        self.fields.tear_lengths |= limits.tear_length.is_finite();
        self.fields.tear_multipliers |= limits.tear_multiplier.is_finite();
    }

    /// The fields that a substep of `pass_count` passes uses.
    pub(crate) fn fields(&self, pass_count: u32) -> ConstraintFields {
        let multipliers = self.fields.tear_multipliers || (self.is_soft && pass_count > 1);
        ConstraintFields { multipliers, ..self.fields }
    }

    /// Softness of the constraints outside of sheets, unless they differ.
    pub(crate) fn loose_softness(&self) -> PassSoftness {
        self.loose_softness.unwrap_or_default()
    }

    pub(crate) fn family_softness(&self, sheet: usize) -> &FamilySoftness {
        &self.family_softness[sheet]
    }
}

#[cfg(test)]
mod tests {
    //! A family has one softness.
    use super::*;

    fn observe(survey: &mut Survey, scaled_compliance: f32, family: Option<(usize, Family)>) {
        let softness = PassSoftness { scaled_compliance, share: 1.0 };
        let parameters = ConstraintParameters { softness, ..ConstraintParameters::INACTIVE };
        survey.observe(&parameters, family);
    }

    #[test]
    fn constraints_outside_of_sheets_may_differ_in_their_softness() {
        let mut survey = Survey::default();
        survey.restart(0);
        observe(&mut survey, 1.0, None);
        assert!(!survey.fields(1).softness);
        observe(&mut survey, 2.0, None);
        assert!(survey.fields(1).softness);
    }

    #[test]
    #[should_panic(expected = "differ in their softness")]
    fn a_family_with_two_softnesses_is_refused() {
        let mut survey = Survey::default();
        survey.restart(1);
        observe(&mut survey, 1.0, Some((0, Family::Vertical)));
        observe(&mut survey, 1.0, Some((0, Family::Vertical)));
        observe(&mut survey, 2.0, Some((0, Family::Horizontal)));
        observe(&mut survey, 2.0, Some((0, Family::Vertical)));
    }
}
