//! The messages of the service `parameters`.

use bytemuck::{Pod, Zeroable};
use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;
use sim_types::{ConstraintKind, Parameter, ParameterValue, ParameterValues, Part, Parts, Setting};

/// Header of `parameters`: 24 bytes, alignment 8. The payload holds the values of all parameters.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.ParametersHeader")]
pub struct ParametersHeader {
    /// Same as in [`crate::SnapshotHeader`].
    pub run_id: u64,
    /// First step that these values apply to.
    pub step: u64,
    /// Length of the payload.
    pub count: u32,
    /// Always 0.
    pub spare: u32,
}

const _: () = assert!(size_of::<ParametersHeader>() == 24 && align_of::<ParametersHeader>() == 8);

/// The value of one parameter: 28 bytes, alignment 4; an element of `parameters`. A parameter with a
/// value for each kind of constraint has one element for each kind. `bending` has one element for all bends,
/// and after all parameters one for each generated block with a value of its own.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.ParameterState")]
pub struct ParameterState {
    /// A [`Parameter`] as a number.
    pub parameter: u32,
    /// A [`ConstraintKind`] as a number, for a parameter with a value for each kind; else 0.
    pub constraint_kind: u32,
    /// Index of a generated block, for its `bending`; else -1, because 0 is a block.
    pub block: i32,
    /// Form of the value: 0 is off, 1 a number, 2 three numbers.
    pub form: u32,
    /// The number, or the three numbers. Unused components are 0.
    pub value: [f32; 3],
}

const _: () = assert!(size_of::<ParameterState>() == 28 && align_of::<ParameterState>() == 4);

impl From<Setting> for ParameterState {
    fn from(setting: Setting) -> Self {
        let (constraint_kind, block) = match setting.part {
            Part::Kind(kind) => (kind as u32, -1),
            Part::Block(block) => (0, i32::try_from(block).unwrap_or(i32::MAX)),
            Part::All | Part::Collider(_) => (0, -1),
        };
        let (form, value) = match setting.value {
            ParameterValue::Off => (0, [0.0; 3]),
            ParameterValue::Number(number) => (1, [number, 0.0, 0.0]),
            ParameterValue::Vector(vector) => (2, vector),
        };
        Self { parameter: setting.parameter as u32, constraint_kind, block, form, value }
    }
}

impl ParameterState {
    /// Returns the parameter and its value; `None` for a parameter, kind or form of another version.
    pub fn setting(&self) -> Option<Setting> {
        let parameter = Parameter::from_number(self.parameter)?;
        let part = match (parameter.info().parts, u32::try_from(self.block)) {
            (Parts::Kinds, Err(_)) => {
                Part::Kind(ConstraintKind::from_number(self.constraint_kind)?)
            }
            (Parts::Blocks, Ok(block)) => Part::Block(block),
            (_, Err(_)) => Part::All,
            (_, Ok(_)) => return None,
        };
        let value = match self.form {
            0 => ParameterValue::Off,
            1 => ParameterValue::Number(self.value[0]),
            2 => ParameterValue::Vector(self.value),
            _ => return None,
        };
        Some(Setting { parameter, part, value })
    }

    /// Collects the values of a message. Parameters that the message lacks have their defaults.
    pub fn to_values(states: &[Self]) -> ParameterValues {
        states.iter().filter_map(Self::setting).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_survive_the_wire() {
        let mut values = ParameterValues::default()
            .with(Parameter::Gravity, [0.0, -1.6, 0.5])
            .with(Parameter::Substeps, 9.0)
            .with(Parameter::TearForce, 0.25)
            .with(Parameter::TimeScale, 0.5)
            .with(Parameter::Bending, 1e-3);
        for (parameter, part, value) in [
            (Parameter::Stiffness, Part::Kind(ConstraintKind::Bend), 0.125),
            (Parameter::Bending, Part::Block(0), 0.0),
            (Parameter::Bending, Part::Block(7), 2e-3),
        ] {
            values.set(Setting { parameter, part, value: value.into() });
        }
        let settings = values.settings();
        let states: Vec<_> = settings.into_iter().map(ParameterState::from).collect();
        assert_eq!(ParameterState::to_values(&states), values);
    }

    #[test]
    fn an_element_of_another_version_is_skipped() {
        let valid = ParameterState {
            parameter: Parameter::Damping as u32,
            block: -1,
            form: 1,
            ..Default::default()
        };
        for unknown in [
            ParameterState { parameter: 99, ..valid },
            ParameterState { block: 0, ..valid },
            ParameterState { form: 3, ..valid },
            ParameterState { parameter: Parameter::Stiffness as u32, constraint_kind: 4, ..valid },
        ] {
            assert_eq!(unknown.setting(), None);
            assert_eq!(ParameterState::to_values(&[unknown]), ParameterValues::default());
        }
    }
}
