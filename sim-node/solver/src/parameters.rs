//! The parameters that can change while a scene runs.

pub(crate) mod surfaces;

use serde::{Deserialize, Serialize};
use sim_scene::constraints::bends::Bend;
use sim_scene::scene::{Limits, Scene};
use sim_types::{
    Affects, KindFilter, OffMeaning, PARAMETERS, Parameter, ParameterInfo, ParameterValue,
    ParameterValues, Part, Parts, Reason, Setting,
};

use crate::checks::Context;
use surfaces::Surfaces;

/// Values that can change while a scene runs. Part of the state, and of a keyframe.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Parameters {
    /// All values except the values of colliders. The pace belongs to the node: the time scale is 1.
    #[serde(with = "settings")]
    pub(crate) values: ParameterValues,
    /// The surface of each collider.
    pub(crate) surfaces: Surfaces,
}

/// The values in a keyframe: for each setting the number of its parameter, its part and its numbers.
mod settings {
    use serde::de::Error as _;
    use serde::{Deserialize, Deserializer, Serializer};
    use sim_types::{Parameter, ParameterValue, ParameterValues, Part, Setting};

    pub(super) fn serialize<S: Serializer>(
        values: &ParameterValues,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let settings = values.settings();
        let row = |one: &Setting| (one.parameter as u32, one.part, one.value.numbers().to_vec());
        serializer.collect_seq(settings.iter().map(row))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<ParameterValues, D::Error> {
        let rows = Vec::<(u32, Part, Vec<f32>)>::deserialize(deserializer)?;
        let setting = |(number, part, numbers): &(u32, Part, Vec<f32>)| {
            let parameter = Parameter::from_number(*number)?;
            let value = ParameterValue::from_numbers(numbers)?;
            Some(Setting { parameter, part: *part, value })
        };
        let settings: Option<Vec<_>> = rows.iter().map(setting).collect();
        let settings = settings.unwrap_or_default();
        let values: ParameterValues = settings.iter().copied().collect();
        let is_read = |(read, given): (&Setting, &Setting)| {
            (read.parameter, read.part) == (given.parameter, given.part)
                && read.value.has_bits_of(&given.value)
        };
        let read = values.settings();
        if read.len() == settings.len() && read.iter().zip(&settings).all(is_read) {
            Ok(values)
        } else {
            Err(D::Error::custom("the parameters are those of no scene"))
        }
    }
}

/// Largest size of a setting in a keyframe: its number below 128, its part, and three numbers with their count.
pub(crate) const SETTING_SIZE_BYTES_MAX: usize = 1 + (1 + 5) + (1 + 3 * 4);

impl Clone for Parameters {
    fn clone(&self) -> Self {
        let mut copy = Self { values: self.values.clone(), surfaces: self.surfaces.clone() };
        copy.make_room_for(self.values.bending_by_block.capacity());
        copy
    }

    /// Allocates nothing if both belong to the same scene.
    fn clone_from(&mut self, source: &Self) {
        self.values.clone_from(&source.values);
        self.surfaces.clone_from(&source.surfaces);
    }
}

/// The part of the scene that a command is for.
pub(crate) fn part_of_command(
    kind: Option<KindFilter>,
    block: Option<u32>,
    collider: Option<u32>,
) -> Result<Part, Reason> {
    match (kind, block, collider) {
        (None, None, None) => Ok(Part::All),
        (None, Some(block), None) => Ok(Part::Block(block)),
        (None, None, Some(collider)) => Ok(Part::Collider(collider)),
        (Some(KindFilter::Known(kind)), None, None) => Ok(Part::Kind(kind)),
        _ => Err(Reason::OutOfRange),
    }
}

impl Parameters {
    pub(crate) fn new(scene: &Scene) -> Self {
        let mut parameters =
            Self { values: scene.parameter_values(), surfaces: Surfaces::new(&scene.colliders) };
        parameters.make_room_for(scene.generators.len());
        parameters
    }

    /// Makes room for the bending of each block, so that a setting allocates nothing.
    pub(crate) fn make_room_for(&mut self, block_count: usize) {
        let blocks = &mut self.values.bending_by_block;
        blocks.reserve(block_count.saturating_sub(blocks.len()));
    }

    /// Current limits of constraints without limits of their own.
    pub(crate) fn limits(&self) -> Limits {
        Limits {
            max_stretch: self.values.optional(Parameter::MaxStretch),
            tear_stretch: self.values.optional(Parameter::TearStretch),
            tear_distance: self.values.optional(Parameter::TearDistance),
            tear_force: self.values.optional(Parameter::TearForce),
        }
    }

    /// Contact distance of particles. None while they do not touch each other.
    pub(crate) fn contact_thickness(&self) -> Option<f32> {
        self.values.optional(Parameter::ContactThickness)
    }

    /// Rigidity of a bend.
    pub(crate) fn rigidity(&self, bend: &Bend) -> f32 {
        self.values.bending(bend.block).unwrap_or(bend.rigidity)
    }

    /// Sets one parameter. A wrong value changes nothing.
    pub(crate) fn set(
        &mut self,
        name: &str,
        value: ParameterValue,
        part: Part,
        context: Context<'_>,
    ) -> Result<Affects, Reason> {
        let info = Parameter::from_name(name).ok_or(Reason::UnknownParameter)?.info();
        let is_of_other_method = info.method.is_some_and(|method| method != context.method);
        let has_parts = match info.parts {
            Parts::None | Parts::Kinds => true,
            Parts::Blocks => context.has_bends,
            Parts::Colliders => context.size.colliders > 0,
        };
        if is_of_other_method || !has_parts {
            return Err(Reason::NoEffectHere);
        }
        check_part(info, part, context)?;
        check_value(info, value, context)?;
        let setting = Setting { parameter: info.parameter, part, value };
        self.check_pass_count(setting, context)?;
        self.store(setting);
        Ok(info.affects)
    }

    /// Stores a checked value. The pace belongs to the node. It is checked here, so that every program refuses the same
    /// values.
    fn store(&mut self, setting: Setting) {
        match setting.parameter.info().parts {
            Parts::Colliders => self.surfaces.set(setting),
            _ if setting.parameter == Parameter::TimeScale => {}
            _ => self.values.set(setting),
        }
    }

    /// Returns the derived state that is out of date if it was derived from `before`.
    pub(crate) fn affected_since(&self, before: &Self) -> Affects {
        let differs = |info: &&ParameterInfo| match info.affects {
            Affects::Nothing => false,
            Affects::Presence => {
                self.is_present(info.parameter) != before.is_present(info.parameter)
            }
            _ => !self.values.has_bits_of(&before.values, info.parameter),
        };
        let affects = PARAMETERS.iter().filter(differs).map(|info| info.affects);
        affects.max().unwrap_or(Affects::Nothing)
    }

    /// Returns true if a parameter is neither 0 nor off, for any collider.
    fn is_present(&self, parameter: Parameter) -> bool {
        match parameter {
            Parameter::Restitution => self.surfaces.have_bounces(),
            _ => self.values.number(parameter) > 0.0,
        }
    }

    /// Returns true if the same constraints are rigid as with `other`.
    pub(crate) fn has_softness_of(&self, other: &Self) -> bool {
        let softness = [Parameter::Compliance, Parameter::Stiffness];
        softness.iter().all(|one| self.values.has_bits_of(&other.values, *one))
    }

    /// Checks that a number of passes keeps the work of a step within its limit.
    fn check_pass_count(&self, setting: Setting, context: Context<'_>) -> Result<(), Reason> {
        if !matches!(setting.parameter, Parameter::Substeps | Parameter::Iterations) {
            return Ok(());
        }
        let values = ParameterValues::default()
            .with(Parameter::Substeps, self.values.number(Parameter::Substeps))
            .with(Parameter::Iterations, self.values.number(Parameter::Iterations))
            .with(setting.parameter, setting.value);
        check_work(&values, context)
    }

    /// Returns `true` if a scene of this method and dimension can have these values.
    pub(crate) fn is_valid(&self, context: Context<'_>) -> bool {
        let is_valid = |setting: &Setting| {
            let info = setting.parameter.info();
            if setting.value == ParameterValue::Off && info.off == OffMeaning::OwnOfEach {
                return true;
            }
            info.method.is_none_or(|method| method == context.method)
                && check_part(info, setting.part, context).is_ok()
                && check_value(info, setting.value, context).is_ok()
        };
        self.values.settings().iter().all(is_valid)
            && self.values.number(Parameter::TimeScale) == 1.0
            && self.surfaces.are_valid(context)
            && check_work(&self.values, context).is_ok()
    }
}

/// Checks that a setting can be for this part of the scene.
fn check_part(info: &ParameterInfo, part: Part, context: Context<'_>) -> Result<(), Reason> {
    match (part, info.parts) {
        (Part::All, _) | (Part::Kind(_), Parts::Kinds) => Ok(()),
        (Part::Collider(collider), Parts::Colliders) => {
            let is_known = u64::from(collider) < context.size.colliders;
            if is_known { Ok(()) } else { Err(Reason::UnknownCollider) }
        }
        (Part::Block(block), Parts::Blocks) => match context.bent_blocks.get(block as usize) {
            Some(true) => Ok(()),
            Some(false) => Err(Reason::NoEffectHere),
            None => Err(Reason::OutOfRange),
        },
        _ => Err(Reason::OutOfRange),
    }
}

/// Checks a value against the table of parameters and the dimensions of the scene.
fn check_value(
    info: &ParameterInfo,
    value: ParameterValue,
    context: Context<'_>,
) -> Result<(), Reason> {
    let is_in_plane = match value {
        ParameterValue::Vector([_, _, z]) => !context.is_planar || z == 0.0,
        ParameterValue::Number(_) | ParameterValue::Off => true,
    };
    if is_in_plane && info.accepts(value) { Ok(()) } else { Err(Reason::OutOfRange) }
}

/// Checks the work of a step.
fn check_work(values: &ParameterValues, context: Context<'_>) -> Result<(), Reason> {
    let (substeps, iterations) =
        (values.count(Parameter::Substeps), values.count(Parameter::Iterations));
    if context.size.allows(substeps, iterations) { Ok(()) } else { Err(Reason::OutOfRange) }
}
