//! The values of all parameters at one moment.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::{self, Deserialize, Deserializer, IgnoredAny, MapAccess, Visitor};
use serde::ser::{Serialize, SerializeMap, Serializer};

use crate::json::number;
use crate::kinds::ConstraintKind;
use crate::parameter::{
    OffMeaning, PARAMETERS, Parameter, ParameterInfo, ParameterValue, Part, Parts, ValueForm,
};

/// A parameter with a value, for the whole scene or a part of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// The parameter.
    pub parameter: Parameter,
    /// The part of the scene with this value.
    pub part: Part,
    /// The value.
    pub value: ParameterValue,
}

/// Number of [`Setting`]s in [`ParameterValues`], besides one for each block with a `bending` of its own: one for each
/// parameter, or one for each kind of constraint. The values of colliders are not among them.
pub const SETTINGS_COUNT: usize = FIRST_SLOTS[PARAMETERS.len()];

/// By parameter: index of its first value in [`ParameterValues`]. One more entry at the end.
const FIRST_SLOTS: [usize; PARAMETERS.len() + 1] = {
    let mut first = [0; PARAMETERS.len() + 1];
    let mut index = 0;
    while index < PARAMETERS.len() {
        first[index + 1] = first[index] + slot_count(PARAMETERS[index].parts);
        index += 1;
    }
    first
};

const fn slot_count(parts: Parts) -> usize {
    match parts {
        Parts::None | Parts::Blocks => 1,
        Parts::Kinds => ConstraintKind::ALL.len(),
        Parts::Colliders => 0,
    }
}

/// The values of all parameters. The values of colliders are not among them: they are published with the colliders.
///
/// In JSON, an object with the names of the parameters. One with a value for each kind of constraint is an object with the
/// names of the kinds. Parameters that the JSON lacks have their defaults.
#[derive(Debug, PartialEq)]
pub struct ParameterValues {
    /// The values of a parameter begin at its entry in [`FIRST_SLOTS`].
    values: [ParameterValue; SETTINGS_COUNT],
    /// Blocks with a `bending` of their own, ascending.
    pub bending_by_block: Vec<BlockValue>,
}

/// A value for one generated block.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct BlockValue {
    /// Index of the block among the scene's `[[generate]]` blocks.
    pub block: u32,
    /// The value.
    #[serde(with = "number")]
    pub value: f32,
}

impl Default for ParameterValues {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl Clone for ParameterValues {
    fn clone(&self) -> Self {
        Self { values: self.values, bending_by_block: self.bending_by_block.clone() }
    }

    /// Allocates nothing if there is room for the blocks.
    fn clone_from(&mut self, source: &Self) {
        self.values = source.values;
        self.bending_by_block.clone_from(&source.bending_by_block);
    }
}

impl ParameterValues {
    /// The values in a scene that sets none.
    pub const DEFAULT: Self = {
        let mut values = [ParameterValue::Off; SETTINGS_COUNT];
        let mut index = 0;
        while index < PARAMETERS.len() {
            let mut slot = FIRST_SLOTS[index];
            while slot < FIRST_SLOTS[index + 1] {
                values[slot] = PARAMETERS[index].default;
                slot += 1;
            }
            index += 1;
        }
        Self { values, bending_by_block: Vec::new() }
    };

    /// Returns the value of a parameter for a part of the scene. Without a value of its own, a block has the `bending` of
    /// all bends. A parameter with a value for each kind is off for the whole scene, and so is one of colliders.
    pub fn get(&self, parameter: Parameter, part: Part) -> ParameterValue {
        let of_block = match part {
            Part::Block(block) => {
                let place = self.bending_by_block.binary_search_by_key(&block, |one| one.block);
                place.ok().map(|place| self.bending_by_block[place])
            }
            _ => None,
        };
        match (of_block, slot(parameter, part)) {
            (Some(of_block), _) => ParameterValue::Number(of_block.value),
            (None, Some(slot)) => self.values[slot],
            (None, None) => ParameterValue::Off,
        }
    }

    /// Returns the number of a parameter of the whole scene; 0 if it is off.
    pub fn number(&self, parameter: Parameter) -> f32 {
        self.optional(parameter).unwrap_or(0.0)
    }

    /// Returns the number of a parameter of the whole scene, unless it is off.
    pub fn optional(&self, parameter: Parameter) -> Option<f32> {
        self.get(parameter, Part::All).number()
    }

    /// Returns a whole number, such as the number of substeps.
    pub fn count(&self, parameter: Parameter) -> u32 {
        to_count(self.number(parameter))
    }

    /// Returns the three numbers of a parameter.
    pub fn vector(&self, parameter: Parameter) -> [f32; 3] {
        match self.get(parameter, Part::All) {
            ParameterValue::Vector(vector) => vector,
            ParameterValue::Number(_) | ParameterValue::Off => [0.0; 3],
        }
    }

    /// Returns by kind the compliance or stiffness that replaces the softness of every constraint of the kind.
    pub fn softness(&self) -> [Option<f32>; ConstraintKind::ALL.len()] {
        ConstraintKind::ALL.map(|kind| {
            let value = |parameter| self.get(parameter, Part::Kind(kind)).number();
            value(Parameter::Compliance).or_else(|| value(Parameter::Stiffness))
        })
    }

    /// Returns the rigidity that replaces the rigidity of the bends of a block, or of all bends.
    pub fn bending(&self, block: Option<u32>) -> Option<f32> {
        self.get(Parameter::Bending, block.map_or(Part::All, Part::Block)).number()
    }

    /// Returns these values with another one for the whole scene. See [`Self::set`].
    #[must_use]
    pub fn with(mut self, parameter: Parameter, value: impl Into<ParameterValue>) -> Self {
        self.set(Setting { parameter, part: Part::All, value: value.into() });
        self
    }

    /// Stores a value without a check of its range. A value for the whole scene replaces the values of all kinds or blocks. Off
    /// means 0 for a parameter that cannot be off. A value of another form and a value for another part change nothing.
    pub fn set(&mut self, setting: Setting) {
        let Setting { parameter, part, value } = setting;
        let info = parameter.info();
        let value = match (value, info.form) {
            (ParameterValue::Off, _) if info.can_store_off() => value,
            (ParameterValue::Off, ValueForm::Vector) => ParameterValue::Vector([0.0; 3]),
            (ParameterValue::Off, _) => ParameterValue::Number(0.0),
            _ if info.can_store(value) => value,
            _ => return,
        };
        match (part, info.parts) {
            (Part::All, _) => {
                self.values[slots(parameter)].fill(value);
                if info.parts == Parts::Blocks {
                    self.bending_by_block.clear();
                }
            }
            (Part::Block(block), Parts::Blocks) => self.set_block(block, value),
            _ => {
                if let Some(slot) = slot(parameter, part) {
                    self.values[slot] = value;
                }
            }
        }
    }

    /// Replaces the values of all blocks.
    fn set_blocks(&mut self, mut blocks: Vec<BlockValue>) {
        blocks.sort_by_key(|one| one.block);
        blocks.dedup_by_key(|one| one.block);
        self.bending_by_block = blocks;
    }

    /// Sets or removes the value of a block. The blocks stay in ascending order.
    fn set_block(&mut self, block: u32, value: ParameterValue) {
        let blocks = &mut self.bending_by_block;
        match (blocks.binary_search_by_key(&block, |one| one.block), value) {
            (Ok(place), ParameterValue::Number(value)) => blocks[place].value = value,
            (Ok(place), _) => _ = blocks.remove(place),
            (Err(place), ParameterValue::Number(value)) => {
                blocks.insert(place, BlockValue { block, value });
            }
            (Err(_), _) => {}
        }
    }

    /// Returns all values, by parameter and then by kind, and then the values of blocks.
    pub fn settings(&self) -> Vec<Setting> {
        let of_parameters = PARAMETERS
            .iter()
            .flat_map(|info| parts(info).into_iter().map(|part| (info.parameter, part)));
        let of_blocks =
            self.bending_by_block.iter().map(|one| (Parameter::Bending, Part::Block(one.block)));
        of_parameters
            .chain(of_blocks)
            .map(|(parameter, part)| Setting { parameter, part, value: self.get(parameter, part) })
            .collect()
    }

    /// Returns `true` if a parameter has the same bits in both, for each part of the scene.
    pub fn has_bits_of(&self, other: &Self, parameter: Parameter) -> bool {
        let (own, others) = (&self.values[slots(parameter)], &other.values[slots(parameter)]);
        let [own_blocks, other_blocks] = [self, other].map(|values| {
            values.bending_by_block.iter().map(|one| (one.block, one.value.to_bits()))
        });
        own.iter().zip(others).all(|(own, other)| own.has_bits_of(other))
            && (parameter.info().parts != Parts::Blocks || own_blocks.eq(other_blocks))
    }
}

impl ParameterInfo {
    /// Off is a value of its own.
    fn can_store_off(&self) -> bool {
        matches!(self.off, OffMeaning::NoLimit | OffMeaning::Absent | OffMeaning::OwnOfEach)
    }

    /// The value has the form of the parameter.
    fn can_store(&self, value: ParameterValue) -> bool {
        match value {
            ParameterValue::Vector(_) => self.form == ValueForm::Vector,
            ParameterValue::Number(_) => self.form != ValueForm::Vector,
            ParameterValue::Off => self.can_store_off(),
        }
    }
}

/// Settings that are missing have their defaults. Of several for a block, the first one counts.
impl FromIterator<Setting> for ParameterValues {
    fn from_iter<I: IntoIterator<Item = Setting>>(settings: I) -> Self {
        let (mut values, mut blocks) = (Self::default(), Vec::new());
        for setting in settings {
            match (setting.part, setting.value) {
                (Part::Block(block), ParameterValue::Number(value)) => {
                    blocks.push(BlockValue { block, value });
                }
                _ => values.set(setting),
            }
        }
        values.set_blocks(blocks);
        values
    }
}

/// The parts of a scene that have values of a parameter in [`ParameterValues`], besides blocks.
fn parts(info: &ParameterInfo) -> Vec<Part> {
    match info.parts {
        Parts::None | Parts::Blocks => vec![Part::All],
        Parts::Kinds => ConstraintKind::ALL.map(Part::Kind).to_vec(),
        Parts::Colliders => Vec::new(),
    }
}

/// Range of the values of a parameter in [`ParameterValues`].
fn slots(parameter: Parameter) -> std::ops::Range<usize> {
    FIRST_SLOTS[parameter as usize]..FIRST_SLOTS[parameter as usize + 1]
}

/// Index of a value in [`ParameterValues`].
fn slot(parameter: Parameter, part: Part) -> Option<usize> {
    let first = FIRST_SLOTS[parameter as usize];
    match (parameter.info().parts, part) {
        (Parts::None, Part::All) | (Parts::Blocks, Part::All | Part::Block(_)) => Some(first),
        (Parts::Kinds, Part::Kind(kind)) => Some(first + kind as usize),
        _ => None,
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

/// Key of the values of blocks in JSON.
const BY_BLOCK: &str = "bending_by_block";

impl Serialize for ParameterValues {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for info in &PARAMETERS {
            let value = self.get(info.parameter, Part::All);
            match (info.parts, info.form, value) {
                (Parts::Colliders, ..) => {}
                (Parts::Kinds, ..) => {
                    map.serialize_entry(info.name, &ByKind(&self.values[slots(info.parameter)]))?;
                }
                (_, ValueForm::Whole, ParameterValue::Number(number)) => {
                    map.serialize_entry(info.name, &to_count(number))?;
                }
                _ => map.serialize_entry(info.name, &value)?,
            }
        }
        map.serialize_entry(BY_BLOCK, &self.bending_by_block)?;
        map.end()
    }
}

/// The values of a parameter for each kind of constraint.
struct ByKind<'a>(&'a [ParameterValue]);

impl Serialize for ByKind<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let kinds = ConstraintKind::ALL.into_iter().map(ConstraintKind::name);
        serializer.collect_map(kinds.zip(self.0))
    }
}

impl<'de> Deserialize<'de> for ParameterValues {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(ValuesVisitor)
    }
}

struct ValuesVisitor;

impl<'de> Visitor<'de> for ValuesVisitor {
    type Value = ParameterValues;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object with the values of parameters")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<ParameterValues, A::Error> {
        let (mut values, mut blocks) = (ParameterValues::default(), Vec::new());
        while let Some(name) = map.next_key::<String>()? {
            let Some(parameter) = Parameter::from_name(&name) else {
                if name == BY_BLOCK {
                    blocks = map.next_value()?;
                } else {
                    map.next_value::<IgnoredAny>()?;
                }
                continue;
            };
            let mut set = |part, value| {
                if !parameter.info().can_store(value) {
                    return Err(de::Error::custom(format!("the value of {name} has another form")));
                }
                values.set(Setting { parameter, part, value });
                Ok(())
            };
            if parameter.info().parts == Parts::Kinds {
                for (kind, value) in map.next_value::<BTreeMap<ConstraintKind, _>>()? {
                    set(Part::Kind(kind), value)?;
                }
            } else {
                set(Part::All, map.next_value()?)?;
            }
        }
        values.set_blocks(blocks);
        Ok(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bending_of(block: u32, value: impl Into<ParameterValue>) -> Setting {
        Setting { parameter: Parameter::Bending, part: Part::Block(block), value: value.into() }
    }

    #[test]
    fn every_setting_survives_a_round_trip() {
        let mut values = ParameterValues::default();
        for setting in values.settings() {
            let value = match setting.parameter.info().form {
                ValueForm::Vector => [0.5, -1.0, 2.0].into(),
                ValueForm::Number | ValueForm::Whole => 7.0.into(),
            };
            values.set(Setting { value, ..setting });
            assert_eq!(values.get(setting.parameter, setting.part), value, "{setting:?}");
        }
        for (block, value) in [(7, 0.5), (2, 0.25), (7, 0.125), (3, 1.0)] {
            values.set(bending_of(block, value));
        }
        values.set(bending_of(3, ParameterValue::Off));
        let blocks: Vec<_> = values.bending_by_block.iter().map(|b| (b.block, b.value)).collect();
        assert_eq!(blocks, [(2, 0.25), (7, 0.125)]);
        assert_eq!((values.bending(Some(2)), values.bending(Some(1))), (Some(0.25), Some(7.0)));
        let mut copy = ParameterValues::default();
        for setting in values.settings() {
            copy.set(setting);
        }
        assert_eq!(copy, values);
        let text = serde_json::to_string(&values).unwrap();
        assert_eq!(serde_json::from_str::<ParameterValues>(&text).unwrap(), values);
    }

    #[test]
    fn off_is_zero_or_none_and_a_value_of_another_form_changes_nothing() {
        let values = ParameterValues::default()
            .with(Parameter::Damping, 1.0)
            .with(Parameter::TearForce, 3.0)
            .with(Parameter::Damping, [1.0; 3]);
        assert_eq!(values.number(Parameter::Damping), 1.0);
        let values = PARAMETERS
            .iter()
            .fold(values, |values, info| values.with(info.parameter, ParameterValue::Off));
        assert_eq!(values.vector(Parameter::Gravity), [0.0; 3]);
        assert_eq!(values.optional(Parameter::Damping), Some(0.0));
        assert_eq!(values.optional(Parameter::TearForce), None);
    }

    #[test]
    fn a_softness_of_the_whole_scene_applies_to_all_kinds() {
        let values = ParameterValues::default().with(Parameter::Compliance, 1e-3);
        assert_eq!(values.softness(), [Some(1e-3); 4]);
    }

    #[test]
    fn a_bending_of_the_whole_scene_replaces_those_of_all_blocks() {
        let mut values = ParameterValues::default();
        values.set(bending_of(1, 0.5));
        assert_eq!(values.settings().len(), SETTINGS_COUNT + 1);
        assert!(!values.has_bits_of(&ParameterValues::default(), Parameter::Bending));
        let values = values.with(Parameter::Bending, 0.25);
        assert_eq!((values.bending(None), &values.bending_by_block[..]), (Some(0.25), &[][..]));
        assert_eq!(values.settings().len(), SETTINGS_COUNT);
    }

    #[test]
    fn json_has_the_names_of_the_table_and_what_it_lacks_has_its_default() {
        let json = serde_json::to_value(ParameterValues::default()).unwrap();
        let of_scene = PARAMETERS.iter().filter(|info| info.parts != Parts::Colliders);
        let names: Vec<_> = of_scene.map(|info| info.name).chain([BY_BLOCK]).collect();
        assert!(names.iter().all(|name| json.get(name).is_some()));
        assert_eq!(json.as_object().unwrap().len(), names.len());
        assert_eq!((&json["substeps"], &json["wind.drag"]), (&4.into(), &0.0.into()));
        let read = |text| serde_json::from_str::<ParameterValues>(text);
        let later = read(r#"{"damping":2,"compliance":{"shear":1e-3},"of_a_later_version":[]}"#);
        let later = later.unwrap();
        assert_eq!(later.number(Parameter::Damping), 2.0);
        assert_eq!(later.softness()[ConstraintKind::Shear as usize], Some(1e-3));
        assert_eq!(later.optional(Parameter::ContactFriction), Some(0.3));
        for wrong in
            [r#"{"gravity":1}"#, r#"{"damping":null}"#, r#"{"compliance":{"silk":1}}"#, "[]"]
        {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
