//! The parameters of a running scene: as the scene has them, and what commands have made of them.

use serde::Serialize;
use sim_contract::{ConstraintKind, KindFilter, ParameterValue, PlainF32};

/// A limit, or a softness that is not set for all; `None` is off.
pub type Limit = Option<PlainF32>;

/// The value of each parameter, in the units of [`crate::message::settings::SETTINGS`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[allow(missing_docs, reason = "named as in commands, which the contract's README explains")]
pub struct Parameters {
    pub gravity: [PlainF32; 3],
    pub damping: PlainF32,
    pub wind_velocity: [PlainF32; 3],
    pub wind_drag: PlainF32,
    pub substeps: PlainF32,
    pub iterations: PlainF32,
    pub relaxation: PlainF32,
    pub max_speed: PlainF32,
    pub max_stretch: Limit,
    pub tear_stretch: Limit,
    pub tear_distance: Limit,
    pub tear_force: Limit,
    pub time_scale: PlainF32,
    pub compliance: PerKind,
    pub stiffness: PerKind,
}

/// A softness by kind of constraints; `None` where each has its own.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the kinds of constraints")]
pub struct PerKind {
    pub structural: Limit,
    pub shear: Limit,
    pub bend: Limit,
    pub tether: Limit,
}

impl PerKind {
    fn set(&mut self, kind: Option<ConstraintKind>, value: Limit) {
        match kind {
            Some(ConstraintKind::Structural) => self.structural = value,
            Some(ConstraintKind::Shear) => self.shear = value,
            Some(ConstraintKind::Bend) => self.bend = value,
            Some(ConstraintKind::Tether) => self.tether = value,
            None => {
                *self = Self { structural: value, shear: value, bend: value, tether: value };
            }
        }
    }
}

impl Default for Parameters {
    /// Those of a scene that says nothing.
    fn default() -> Self {
        Self {
            gravity: [0.0, -9.81, 0.0].map(PlainF32),
            damping: PlainF32(0.0),
            wind_velocity: [PlainF32(0.0); 3],
            wind_drag: PlainF32(0.0),
            substeps: PlainF32(4.0),
            iterations: PlainF32(1.0),
            relaxation: PlainF32(1.0),
            max_speed: PlainF32(10_000.0),
            max_stretch: None,
            tear_stretch: None,
            tear_distance: None,
            tear_force: None,
            time_scale: PlainF32(1.0),
            compliance: PerKind::default(),
            stiffness: PerKind::default(),
        }
    }
}

impl Parameters {
    /// Follows a `set` that the node has applied; it has checked everything.
    pub fn follow(&mut self, parameter: &str, value: ParameterValue, kind: Option<KindFilter>) {
        let number = match value {
            ParameterValue::Number(number) => Some(PlainF32(number)),
            ParameterValue::Vector(_) | ParameterValue::Off => None,
        };
        let vector = match value {
            ParameterValue::Vector(vector) => vector.map(PlainF32),
            ParameterValue::Number(_) | ParameterValue::Off => [PlainF32(0.0); 3],
        };
        let kind = match kind {
            Some(KindFilter::Known(kind)) => Some(kind),
            Some(KindFilter::Unknown) | None => None,
        };
        let or_zero = number.unwrap_or(PlainF32(0.0));
        match parameter {
            "gravity" => self.gravity = vector,
            "wind_velocity" => self.wind_velocity = vector,
            "damping" => self.damping = or_zero,
            "wind_drag" => self.wind_drag = or_zero,
            "substeps" => self.substeps = or_zero,
            "iterations" => self.iterations = or_zero,
            "relaxation" => self.relaxation = or_zero,
            "max_speed" => self.max_speed = or_zero,
            "max_stretch" => self.max_stretch = number,
            "tear_stretch" => self.tear_stretch = number,
            "tear_distance" => self.tear_distance = number,
            "tear_force" => self.tear_force = number,
            "time_scale" => self.time_scale = or_zero,
            "compliance" => self.compliance.set(kind, number),
            "stiffness" => self.stiffness.set(kind, number),
            // One of a later version: there is no control for it either.
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::settings::{SETTINGS, ValueKind};

    #[test]
    fn every_setting_is_followed() {
        for setting in SETTINGS {
            let value = match setting.value {
                ValueKind::Vector => ParameterValue::Vector([0.5; 3]),
                ValueKind::Number | ValueKind::Whole => ParameterValue::Number(0.5),
            };
            let mut parameters = Parameters::default();
            parameters.follow(setting.name, value, None);
            assert_ne!(parameters, Parameters::default(), "{}", setting.name);
        }
    }

    #[test]
    fn off_is_null_or_zero_and_a_kind_is_set_alone() {
        let mut parameters = Parameters::default();
        parameters.follow("tear_force", ParameterValue::Number(3.0), None);
        parameters.follow("tear_force", ParameterValue::Off, None);
        parameters.follow("gravity", ParameterValue::Off, None);
        assert_eq!((parameters.tear_force, parameters.gravity), (None, [PlainF32(0.0); 3]));
        let shear = Some(KindFilter::Known(ConstraintKind::Shear));
        parameters.follow("compliance", ParameterValue::Number(1e-3), shear);
        assert_eq!(parameters.compliance.shear, Some(PlainF32(1e-3)));
        assert_eq!(parameters.compliance.bend, None);
    }
}
