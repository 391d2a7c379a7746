//! The table `[contact]`.

use std::ops::Range;

use serde::Deserialize;
use sim_types::{ConstraintKind, NumberRange, Parameter};

use super::reader::Reader;
use super::value::{Number, TableKeys, Word};
use crate::scene::definition::Scene;
use crate::scene::definition::contact::{ContactMode, ContactSettings};
use crate::scene::error::SceneError;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileContact {
    mode: Option<Word>,
    thickness: Option<Number>,
    friction: Option<Number>,
}

impl TableKeys for FileContact {}

impl Reader<'_> {
    /// Checks the table `[contact]`, if there is one.
    pub(super) fn contact(
        &self,
        file: Option<&FileContact>,
    ) -> Result<ContactSettings, SceneError> {
        let default = ContactSettings::default();
        let Some(file) = file else { return Ok(default) };
        let mode = file.mode.as_ref();
        let mode = mode.map(|word| self.word("contact.mode", word, &ContactMode::NAMES));
        let number = |field: &str, number: Option<&Number>, range: NumberRange| {
            number.map(|number| self.ranged(field, number, range)).transpose()
        };
        let range = |parameter: Parameter| parameter.info().range;
        let friction =
            number("contact.friction", file.friction.as_ref(), range(Parameter::ContactFriction))?;
        Ok(ContactSettings {
            mode: mode.transpose()?.unwrap_or_default(),
            thickness: number(
                "contact.thickness",
                file.thickness.as_ref(),
                range(Parameter::Contact),
            )?,
            friction: friction.unwrap_or(default.friction),
        })
    }

    /// Refuses surfaces in two dimensions, where a triangle has no side. Takes the smallest rest length of a structural
    /// constraint for a thickness that the scene needs and does not give.
    pub(super) fn complete_contact(
        &self,
        scene: &mut Scene,
        place: Option<Range<usize>>,
    ) -> Result<(), SceneError> {
        let place = place.unwrap_or(0..0);
        if scene.contact.mode == ContactMode::Surfaces && scene.dimensions == 2 {
            let problem = "\"surfaces\" needs three dimensions (allowed in two: off, particles)";
            return self.error(place, "contact.mode", problem);
        }
        if !scene.contact.lacks_thickness() {
            return Ok(());
        }
        let model = scene.model();
        let structural =
            model.constraints.iter().filter(|one| one.kind == ConstraintKind::Structural);
        let lengths = structural.map(|one| one.rest_length).filter(|length| *length > 0.0);
        scene.contact.thickness = lengths.min_by(f32::total_cmp);
        if scene.contact.thickness.is_some() {
            return Ok(());
        }
        let problem = "is missing, and the scene has no structural constraint with a length to take it \
                       from (allowed: > 0)";
        self.error(place, "contact.thickness", problem)
    }
}
