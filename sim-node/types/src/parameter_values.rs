//! The values of all parameters at one moment.

use serde::{Deserialize, Serialize};

use crate::constraint_kind::ConstraintKind;
use crate::json::non_finite::{number, optional_number, vector};
use crate::parameter::{Parameter, ParameterValue};

/// A parameter with a value. `compliance` and `stiffness` have a value for each kind of constraint, and
/// `bending` can have one for each generated block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// The parameter.
    pub parameter: Parameter,
    /// Kind of constraint, for a parameter with a value for each kind.
    pub constraint_kind: Option<ConstraintKind>,
    /// Index of the generated block, for the `bending` of one block.
    pub block: Option<u32>,
    /// The value.
    pub value: ParameterValue,
}

/// Number of [`Setting`]s in [`ParameterValues`], besides one for each block with a `bending` of its own:
/// 16 parameters have one value, and two have a value for each of the four kinds of constraints.
pub const SETTINGS_COUNT: usize = 24;

/// The values of all parameters, named as in commands. `None` means off. The values of colliders are not among
/// them: they are published with the colliders.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "described in the table of parameters")]
pub struct ParameterValues {
    #[serde(with = "vector")]
    pub gravity: [f32; 3],
    #[serde(with = "number")]
    pub damping: f32,
    #[serde(with = "vector")]
    pub wind_velocity: [f32; 3],
    #[serde(with = "number")]
    pub wind_drag: f32,
    pub substeps: u32,
    pub iterations: u32,
    #[serde(with = "number")]
    pub relaxation: f32,
    #[serde(with = "optional_number")]
    pub max_stretch: Option<f32>,
    #[serde(with = "optional_number")]
    pub tear_stretch: Option<f32>,
    #[serde(with = "optional_number")]
    pub tear_distance: Option<f32>,
    #[serde(with = "optional_number")]
    pub tear_force: Option<f32>,
    #[serde(with = "number")]
    pub max_speed: f32,
    #[serde(with = "number")]
    pub time_scale: f32,
    pub compliance: PerKind,
    pub stiffness: PerKind,
    #[serde(with = "optional_number", default)]
    pub contact: Option<f32>,
    #[serde(with = "number", default = "default_friction")]
    pub contact_friction: f32,
    /// Older recordings lack it.
    #[serde(default, with = "optional_number")]
    pub bending: Option<f32>,
    /// Blocks with a `bending` of their own, ascending. Older recordings lack it.
    #[serde(default)]
    pub bending_by_block: Vec<BlockValue>,
}

/// A value for one generated block.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BlockValue {
    /// Index of the block among the scene's `[[generate]]` blocks.
    pub block: u32,
    /// The value.
    #[serde(with = "number")]
    pub value: f32,
}

/// In recordings from before there were contacts.
fn default_friction() -> f32 {
    ParameterValues::DEFAULT.contact_friction
}

/// A softness for each kind of constraint. `None` means that each constraint has its own softness.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the kinds of constraints")]
pub struct PerKind {
    #[serde(with = "optional_number")]
    pub structural: Option<f32>,
    #[serde(with = "optional_number")]
    pub shear: Option<f32>,
    #[serde(with = "optional_number")]
    pub bend: Option<f32>,
    #[serde(with = "optional_number")]
    pub tether: Option<f32>,
}

impl PerKind {
    /// Returns the value for a kind.
    pub fn get(&self, kind: ConstraintKind) -> Option<f32> {
        match kind {
            ConstraintKind::Structural => self.structural,
            ConstraintKind::Shear => self.shear,
            ConstraintKind::Bend => self.bend,
            ConstraintKind::Tether => self.tether,
        }
    }

    /// Sets the value for a kind.
    pub fn set(&mut self, kind: ConstraintKind, value: Option<f32>) {
        *match kind {
            ConstraintKind::Structural => &mut self.structural,
            ConstraintKind::Shear => &mut self.shear,
            ConstraintKind::Bend => &mut self.bend,
            ConstraintKind::Tether => &mut self.tether,
        } = value;
    }
}

impl Default for ParameterValues {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl PerKind {
    /// Each constraint has its own value.
    pub const OWN_OF_EACH: Self = Self { structural: None, shear: None, bend: None, tether: None };
}

impl ParameterValues {
    /// The values in a scene that sets none.
    pub const DEFAULT: Self = Self {
        gravity: [0.0, -9.81, 0.0],
        damping: 0.0,
        wind_velocity: [0.0; 3],
        wind_drag: 0.0,
        substeps: 4,
        iterations: 1,
        relaxation: 1.0,
        max_stretch: None,
        tear_stretch: None,
        tear_distance: None,
        tear_force: None,
        max_speed: 10_000.0,
        time_scale: 1.0,
        compliance: PerKind::OWN_OF_EACH,
        stiffness: PerKind::OWN_OF_EACH,
        contact: None,
        contact_friction: 0.3,
        bending: None,
        bending_by_block: Vec::new(),
    };

    /// Returns all values, by parameter and then by kind, and then those of blocks.
    pub fn settings(&self) -> Vec<Setting> {
        let of_scene = |parameter: &Parameter| !parameter.info().is_per_collider;
        let keys = Parameter::ALL.into_iter().filter(of_scene).flat_map(|parameter| {
            let kinds: &[Option<ConstraintKind>] =
                if parameter.info().is_per_kind { &KINDS } else { &[None] };
            kinds.iter().map(move |kind| (parameter, *kind))
        });
        let of_all = keys.map(|(parameter, constraint_kind)| {
            let value = self.get(parameter, constraint_kind);
            Setting { parameter, constraint_kind, block: None, value }
        });
        let of_blocks = self.bending_by_block.iter().map(|one| Setting {
            parameter: Parameter::Bending,
            constraint_kind: None,
            block: Some(one.block),
            value: ParameterValue::Number(one.value),
        });
        of_all.chain(of_blocks).collect()
    }

    /// Returns the value of a parameter; the `bending` of blocks without one of their own. `kind` selects
    /// the value of a parameter with a value for each kind; without it, such a parameter is off. The parameters of
    /// colliders are off here, too.
    pub fn get(&self, parameter: Parameter, kind: Option<ConstraintKind>) -> ParameterValue {
        use ParameterValue::{Number, Vector};
        let optional = |value: Option<f32>| value.map_or(ParameterValue::Off, Number);
        match parameter {
            Parameter::Gravity => Vector(self.gravity),
            Parameter::Damping => Number(self.damping),
            Parameter::WindVelocity => Vector(self.wind_velocity),
            Parameter::WindDrag => Number(self.wind_drag),
            Parameter::Substeps => Number(self.substeps as f32),
            Parameter::Iterations => Number(self.iterations as f32),
            Parameter::Relaxation => Number(self.relaxation),
            Parameter::MaxStretch => optional(self.max_stretch),
            Parameter::TearStretch => optional(self.tear_stretch),
            Parameter::TearDistance => optional(self.tear_distance),
            Parameter::TearForce => optional(self.tear_force),
            Parameter::MaxSpeed => Number(self.max_speed),
            Parameter::TimeScale => Number(self.time_scale),
            Parameter::Compliance => optional(kind.and_then(|kind| self.compliance.get(kind))),
            Parameter::Stiffness => optional(kind.and_then(|kind| self.stiffness.get(kind))),
            Parameter::Contact => optional(self.contact),
            Parameter::ContactFriction => Number(self.contact_friction),
            Parameter::Bending => optional(self.bending),
            Parameter::Friction | Parameter::Restitution => ParameterValue::Off,
        }
    }

    /// Stores a value without checks, because the node has checked the values that it publishes. For a
    /// parameter that cannot be off, off means 0. A number does not change a vector, and a vector means
    /// off for a number. A `bending` without a block replaces those of all blocks. A parameter of colliders changes
    /// nothing.
    pub fn set(&mut self, setting: Setting) {
        let Setting { parameter, constraint_kind, block, value } = setting;
        let (number, vector) = match value {
            ParameterValue::Number(number) => (Some(number), None),
            ParameterValue::Vector(vector) => (None, Some(vector)),
            ParameterValue::Off => (None, Some([0.0; 3])),
        };
        let or_zero = number.unwrap_or(0.0);
        match parameter {
            Parameter::Gravity => self.gravity = vector.unwrap_or(self.gravity),
            Parameter::WindVelocity => self.wind_velocity = vector.unwrap_or(self.wind_velocity),
            Parameter::Damping => self.damping = or_zero,
            Parameter::WindDrag => self.wind_drag = or_zero,
            Parameter::Substeps => self.substeps = to_count(or_zero),
            Parameter::Iterations => self.iterations = to_count(or_zero),
            Parameter::Relaxation => self.relaxation = or_zero,
            Parameter::MaxStretch => self.max_stretch = number,
            Parameter::TearStretch => self.tear_stretch = number,
            Parameter::TearDistance => self.tear_distance = number,
            Parameter::TearForce => self.tear_force = number,
            Parameter::MaxSpeed => self.max_speed = or_zero,
            Parameter::TimeScale => self.time_scale = or_zero,
            Parameter::Compliance => set_kinds(&mut self.compliance, constraint_kind, number),
            Parameter::Stiffness => set_kinds(&mut self.stiffness, constraint_kind, number),
            Parameter::Contact => self.contact = number,
            Parameter::ContactFriction => self.contact_friction = or_zero,
            Parameter::Bending => {
                if let Some(block) = block {
                    set_block(&mut self.bending_by_block, block, number);
                } else {
                    self.bending = number;
                    self.bending_by_block.clear();
                }
            }
            Parameter::Friction | Parameter::Restitution => {}
        }
    }
}

const KINDS: [Option<ConstraintKind>; 4] = [
    Some(ConstraintKind::Structural),
    Some(ConstraintKind::Shear),
    Some(ConstraintKind::Bend),
    Some(ConstraintKind::Tether),
];

/// Sets the value for one kind, or for all kinds.
fn set_kinds(values: &mut PerKind, kind: Option<ConstraintKind>, value: Option<f32>) {
    match kind {
        Some(kind) => values.set(kind, value),
        None => ConstraintKind::ALL.into_iter().for_each(|kind| values.set(kind, value)),
    }
}

/// Sets or removes the value of a block. The blocks stay in ascending order.
fn set_block(values: &mut Vec<BlockValue>, block: u32, value: Option<f32>) {
    match (values.binary_search_by_key(&block, |one| one.block), value) {
        (Ok(place), Some(value)) => values[place].value = value,
        (Ok(place), None) => _ = values.remove(place),
        (Err(place), Some(value)) => values.insert(place, BlockValue { block, value }),
        (Err(_), None) => {}
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a count of passes is at most 1000, and a negative count becomes 0"
)]
fn to_count(number: f32) -> u32 {
    number as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{OffMeaning, PARAMETERS, ParameterInfo, ValueForm};

    /// The parameters whose values are here.
    fn of_scene() -> impl Iterator<Item = ParameterInfo> {
        PARAMETERS.into_iter().filter(|info| !info.is_per_collider)
    }

    #[test]
    fn the_defaults_match_the_table() {
        for info in of_scene() {
            assert_eq!(
                ParameterValues::default().get(info.parameter, Some(ConstraintKind::Shear)),
                info.default,
                "{}",
                info.name
            );
        }
    }

    #[test]
    fn every_setting_survives_a_round_trip() {
        let mut values = ParameterValues::default();
        for info in of_scene() {
            let value = match info.form {
                ValueForm::Vector => ParameterValue::Vector([0.5, -1.0, 2.0]),
                ValueForm::Number | ValueForm::Whole => ParameterValue::Number(7.0),
            };
            let constraint_kind = info.is_per_kind.then_some(ConstraintKind::Bend);
            values.set(Setting { parameter: info.parameter, constraint_kind, block: None, value });
            assert_eq!(values.get(info.parameter, constraint_kind), value, "{}", info.name);
        }
        for (block, value) in [(7, 0.5), (2, 0.25), (7, 0.125), (3, 1.0)] {
            values.set(bending_of(block, ParameterValue::Number(value)));
        }
        values.set(bending_of(3, ParameterValue::Off));
        let blocks: Vec<_> = values.bending_by_block.iter().map(|b| (b.block, b.value)).collect();
        assert_eq!(blocks, [(2, 0.25), (7, 0.125)]);
        let mut copy = ParameterValues::default();
        for setting in values.settings() {
            copy.set(setting);
        }
        assert_eq!(copy, values);
        let text = serde_json::to_string(&values).unwrap();
        assert_eq!(serde_json::from_str::<ParameterValues>(&text).unwrap(), values);
    }

    #[test]
    fn off_is_zero_or_none() {
        let mut values =
            ParameterValues { damping: 1.0, tear_force: Some(3.0), ..Default::default() };
        for info in PARAMETERS.iter().filter(|info| info.off != OffMeaning::NotAllowed) {
            values.set(Setting {
                parameter: info.parameter,
                constraint_kind: None,
                block: None,
                value: ParameterValue::Off,
            });
        }
        assert_eq!((values.gravity, values.damping, values.tear_force), ([0.0; 3], 0.0, None));
    }

    #[test]
    fn a_softness_without_a_kind_applies_to_all_kinds() {
        let mut values = ParameterValues::default();
        let value = ParameterValue::Number(1e-3);
        let parameter = Parameter::Compliance;
        values.set(Setting { parameter, constraint_kind: None, block: None, value });
        assert!(ConstraintKind::ALL.iter().all(|kind| values.compliance.get(*kind) == Some(1e-3)));
    }

    #[test]
    fn the_json_names_every_parameter() {
        let json = serde_json::to_value(ParameterValues::default()).unwrap();
        let names: Vec<_> = of_scene().map(|info| info.name).collect();
        assert!(names.iter().all(|name| json.get(name).is_some()));
        assert_eq!(json.as_object().unwrap().len(), names.len() + 1, "and bending_by_block");
    }

    fn bending_of(block: u32, value: ParameterValue) -> Setting {
        let parameter = Parameter::Bending;
        Setting { parameter, constraint_kind: None, block: Some(block), value }
    }

    #[test]
    fn a_bending_without_a_block_replaces_those_of_all_blocks() {
        let mut values = ParameterValues::default();
        values.set(bending_of(1, ParameterValue::Number(0.5)));
        assert_eq!(values.settings().len(), SETTINGS_COUNT + 1);
        let value = ParameterValue::Number(0.25);
        let parameter = Parameter::Bending;
        values.set(Setting { parameter, constraint_kind: None, block: None, value });
        assert_eq!((values.bending, &values.bending_by_block[..]), (Some(0.25), &[][..]));
        assert_eq!(values.settings().len(), SETTINGS_COUNT);
    }
}
