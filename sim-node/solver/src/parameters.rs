//! The parameters that can change while a scene runs.

pub(crate) mod block_bending;
pub(crate) mod surfaces;

use serde::{Deserialize, Serialize};
use sim_types::{
    BlockValue, ConstraintKind, KindFilter, Method, OffMeaning, Parameter, ParameterInfo,
    ParameterValue, ParameterValues, PerKind, Reason, ValueForm,
};

use crate::checks::{Context, is_near};
use crate::constraints::bends::Bend;
use crate::scene::definition::Scene;
use crate::scene::definition::element::Limits;
use crate::scene::definition::settings::Wind;
use block_bending::BlockBending;
use surfaces::Surfaces;

/// Values that can change while a scene runs. Part of the state, and of a keyframe.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Parameters {
    pub(crate) gravity: [f32; 3],
    pub(crate) damping: f32,
    pub(crate) relaxation: f32,
    pub(crate) max_speed: f32,
    pub(crate) substeps: u32,
    pub(crate) iterations: u32,
    pub(crate) wind_velocity: [f32; 3],
    pub(crate) wind_drag: f32,
    /// Contact distance of particles. None while they do not touch each other.
    pub(crate) contact_thickness: Option<f32>,
    pub(crate) contact_friction: f32,
    max_stretch: Option<f32>,
    tear_stretch: Option<f32>,
    tear_distance: Option<f32>,
    tear_force: Option<f32>,
    /// By kind: softness that replaces that of every constraint of the kind.
    softness: [Option<f32>; 4],
    /// Rigidity that replaces that of every bend.
    bending: Option<f32>,
    /// The bending of blocks that have one of their own, also if `bending` has a value. A keyframe has it behind
    /// its other fields, because older keyframes end there.
    #[serde(skip)]
    pub(crate) block_bending: BlockBending,
    /// The surface of each collider. A keyframe has them behind its other fields, too.
    #[serde(skip)]
    pub(crate) surfaces: Surfaces,
}

impl Clone for Parameters {
    fn clone(&self) -> Self {
        let Self { block_bending, surfaces, .. } = self;
        Self { block_bending: block_bending.clone(), surfaces: surfaces.clone(), ..*self }
    }

    /// Allocates nothing if both belong to the same scene.
    fn clone_from(&mut self, source: &Self) {
        let mut block_bending = std::mem::take(&mut self.block_bending);
        block_bending.clone_from(&source.block_bending);
        let mut surfaces = std::mem::take(&mut self.surfaces);
        surfaces.clone_from(&source.surfaces);
        *self = Self { block_bending, surfaces, ..*source };
    }
}

/// The constraints, bends or colliders that a setting is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Target {
    /// All.
    All,
    /// The constraints of a kind.
    Kind(ConstraintKind),
    /// The bends of a generated block.
    Block(u32),
    /// A collider.
    Collider(u32),
}

impl Target {
    /// The target of a command.
    pub(crate) fn new(
        kind: Option<KindFilter>,
        block: Option<u32>,
        collider: Option<u32>,
    ) -> Result<Self, Reason> {
        match (kind, block, collider) {
            (None, None, None) => Ok(Self::All),
            (None, Some(block), None) => Ok(Self::Block(block)),
            (None, None, Some(collider)) => Ok(Self::Collider(collider)),
            (Some(KindFilter::Known(kind)), None, None) => Ok(Self::Kind(kind)),
            _ => Err(Reason::OutOfRange),
        }
    }

    /// The one collider that a setting is for.
    fn collider(self) -> Option<u32> {
        match self {
            Self::Collider(collider) => Some(collider),
            _ => None,
        }
    }

    /// Checks that a setting of this parameter can be for this target.
    fn check(self, parameter: Parameter, context: Context<'_>) -> Result<(), Reason> {
        let info = parameter.info();
        match self {
            Self::Kind(_) if !info.is_per_kind => Err(Reason::OutOfRange),
            Self::Block(_) if parameter != Parameter::Bending => Err(Reason::OutOfRange),
            Self::Collider(_) if !info.is_per_collider => Err(Reason::OutOfRange),
            Self::Collider(collider) if u64::from(collider) >= context.size.colliders => {
                Err(Reason::UnknownCollider)
            }
            Self::Block(block) => match context.bent_blocks.get(block as usize) {
                Some(true) => Ok(()),
                Some(false) => Err(Reason::NoEffectHere),
                None => Err(Reason::OutOfRange),
            },
            Self::All | Self::Kind(_) | Self::Collider(_) => Ok(()),
        }
    }
}

/// Derived state that a parameter affects, from nothing to everything.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Affected {
    /// None: the step reads the parameter itself.
    Nothing,
    /// The limits of constraints.
    Limits,
    /// All parameters of constraints and bends.
    Constraints,
    /// All parameters of constraints and bends, and the tethers, whose paths consist of rigid constraints.
    RigidPaths,
}

impl Parameters {
    pub(crate) fn new(scene: &Scene) -> Self {
        let solver = &scene.solver;
        let limits = solver.limits;
        // A scene without a wind block has no air drag.
        let wind = scene.wind.unwrap_or(Wind { drag: 0.0, ..Wind::default() });
        Self {
            gravity: scene.gravity,
            damping: solver.damping,
            relaxation: solver.relaxation,
            max_speed: solver.max_speed,
            substeps: solver.substeps,
            iterations: solver.iterations,
            wind_velocity: wind.velocity,
            wind_drag: wind.drag,
            contact_thickness: scene.contact.distance(),
            contact_friction: scene.contact.friction,
            max_stretch: limits.max_stretch,
            tear_stretch: limits.tear_stretch,
            tear_distance: limits.tear_distance,
            tear_force: limits.tear_force,
            softness: [None; 4],
            bending: None,
            block_bending: BlockBending::with_room_for(scene.generators.len()),
            surfaces: Surfaces::new(&scene.colliders),
        }
    }

    /// Current limits of constraints without limits of their own.
    pub(crate) fn limits(&self) -> Limits {
        let Self { max_stretch, tear_stretch, tear_distance, tear_force, .. } = *self;
        Limits { max_stretch, tear_stretch, tear_distance, tear_force }
    }

    /// Softness of a constraint of a kind, where `own` is its softness in the scene.
    pub(crate) fn softness(&self, kind: ConstraintKind, own: f32) -> f32 {
        self.softness[kind as usize].unwrap_or(own)
    }

    /// Rigidity of a bend.
    pub(crate) fn rigidity(&self, bend: &Bend) -> f32 {
        let of_block = bend.block.and_then(|block| self.block_bending.get(block));
        of_block.or(self.bending).unwrap_or(bend.rigidity)
    }

    /// Sets one parameter. A wrong value changes nothing.
    pub(crate) fn set(
        &mut self,
        name: &str,
        value: ParameterValue,
        target: Target,
        context: Context<'_>,
    ) -> Result<Affected, Reason> {
        let parameter = Parameter::from_name(name).ok_or(Reason::UnknownParameter)?;
        let info = parameter.info();
        check_finite(value)?;
        if info.is_per_kind && parameter != softness_parameter(context.method) {
            return Err(Reason::NoEffectHere);
        }
        if parameter == Parameter::Bending && !context.has_bends {
            return Err(Reason::NoEffectHere);
        }
        if info.is_per_collider && context.size.colliders == 0 {
            return Err(Reason::NoEffectHere);
        }
        target.check(parameter, context)?;
        check_value(info, value, context)?;
        self.check_pass_count(parameter, value, context)?;
        let had_bounces = self.surfaces.have_bounces();
        self.store(parameter, value, target);
        Ok(match parameter {
            // The first bounce, and the end of the last one, change the fields of particles.
            Parameter::Restitution if self.surfaces.have_bounces() != had_bounces => {
                Affected::Constraints
            }
            Parameter::Compliance | Parameter::Stiffness => Affected::RigidPaths,
            Parameter::Gravity
            | Parameter::Damping
            | Parameter::WindVelocity
            | Parameter::MaxSpeed
            | Parameter::ContactFriction
            | Parameter::Friction
            | Parameter::Restitution
            | Parameter::TimeScale => Affected::Nothing,
            Parameter::MaxStretch
            | Parameter::TearStretch
            | Parameter::TearDistance
            | Parameter::TearForce => Affected::Limits,
            Parameter::Substeps
            | Parameter::Iterations
            | Parameter::Relaxation
            | Parameter::Bending
            | Parameter::WindDrag
            | Parameter::Contact => Affected::Constraints,
        })
    }

    /// Returns the derived state that is out of date if it was derived from `before`.
    pub(crate) fn affected_since(&self, before: &Self) -> Affected {
        if self.softness_bits() != before.softness_bits() {
            Affected::RigidPaths
        } else if self.pass_bits() != before.pass_bits() || !self.has_bending_of(before) {
            Affected::Constraints
        } else if self.limit_bits() != before.limit_bits() {
            Affected::Limits
        } else {
            Affected::Nothing
        }
    }

    /// Returns true if the same constraints are rigid as with `other`.
    pub(crate) fn has_softness_of(&self, other: &Self) -> bool {
        self.softness_bits() == other.softness_bits()
    }

    /// Returns true if every bend has the same rigidity as with `other`.
    fn has_bending_of(&self, other: &Self) -> bool {
        self.bending.map(f32::to_bits) == other.bending.map(f32::to_bits)
            && self.block_bending == other.block_bending
    }

    /// Adds the surfaces of the scene to parameters from a keyframe without surfaces.
    pub(crate) fn add_surfaces(&mut self, initial: &Self) {
        if self.surfaces.all().is_empty() {
            self.surfaces.clone_from(&initial.surfaces);
        }
    }

    fn softness_bits(&self) -> [Option<u32>; 4] {
        self.softness.map(|softness| softness.map(f32::to_bits))
    }

    fn pass_bits(&self) -> [u32; 6] {
        let has_wind = u32::from(self.wind_drag > 0.0);
        let has_contacts = u32::from(self.contact_thickness.is_some());
        let has_bounces = u32::from(self.surfaces.have_bounces());
        let relaxation = self.relaxation.to_bits();
        [self.substeps, self.iterations, relaxation, has_wind, has_contacts, has_bounces]
    }

    fn limit_bits(&self) -> [Option<u32>; 4] {
        let Limits { max_stretch, tear_stretch, tear_distance, tear_force } = self.limits();
        [max_stretch, tear_stretch, tear_distance, tear_force].map(|one| one.map(f32::to_bits))
    }

    /// Checks that a number of passes keeps the work of a step within its limit.
    fn check_pass_count(
        &self,
        parameter: Parameter,
        value: ParameterValue,
        context: Context<'_>,
    ) -> Result<(), Reason> {
        let ParameterValue::Number(number) = value else { return Ok(()) };
        let (substeps, iterations) = match parameter {
            Parameter::Substeps => (to_count(number), self.iterations),
            Parameter::Iterations => (self.substeps, to_count(number)),
            _ => return Ok(()),
        };
        if context.size.allows(substeps, iterations) { Ok(()) } else { Err(Reason::OutOfRange) }
    }

    /// Stores a checked value.
    fn store(&mut self, parameter: Parameter, value: ParameterValue, target: Target) {
        let number = match value {
            ParameterValue::Number(number) => Some(number),
            ParameterValue::Vector(_) | ParameterValue::Off => None,
        };
        let vector = match value {
            ParameterValue::Vector(vector) => vector,
            ParameterValue::Number(_) | ParameterValue::Off => [0.0; 3],
        };
        let or_zero = number.unwrap_or(0.0);
        match parameter {
            Parameter::Gravity => self.gravity = vector,
            Parameter::WindVelocity => self.wind_velocity = vector,
            Parameter::Damping => self.damping = or_zero,
            Parameter::WindDrag => self.wind_drag = or_zero,
            Parameter::Relaxation => self.relaxation = or_zero,
            Parameter::MaxSpeed => self.max_speed = or_zero,
            Parameter::Contact => self.contact_thickness = number,
            Parameter::ContactFriction => self.contact_friction = or_zero,
            Parameter::Substeps => self.substeps = to_count(or_zero),
            Parameter::Iterations => self.iterations = to_count(or_zero),
            Parameter::MaxStretch => self.max_stretch = number,
            Parameter::TearStretch => self.tear_stretch = number,
            Parameter::TearDistance => self.tear_distance = number,
            Parameter::TearForce => self.tear_force = number,
            Parameter::Compliance | Parameter::Stiffness => match target {
                Target::Kind(kind) => self.softness[kind as usize] = number,
                _ => self.softness = [number; 4],
            },
            Parameter::Bending => {
                if let Target::Block(block) = target {
                    self.block_bending.set(block, number);
                } else {
                    self.bending = number;
                    self.block_bending.clear();
                }
            }
            Parameter::Friction => {
                self.surfaces.set(target.collider(), |one| one.friction = or_zero);
            }
            Parameter::Restitution => {
                self.surfaces.set(target.collider(), |one| one.restitution = or_zero);
            }
            // The pace belongs to the node. It is checked here, so that every program refuses the
            // same values.
            Parameter::TimeScale => {}
        }
    }

    /// All values, with the time scale of a node at real time.
    pub(crate) fn values(&self, method: Method) -> ParameterValues {
        let [structural, shear, bend, tether] = self.softness;
        let softness = PerKind { structural, shear, bend, tether };
        let (compliance, stiffness) = match method {
            Method::Xpbd => (softness, PerKind::default()),
            Method::Pbd => (PerKind::default(), softness),
        };
        ParameterValues {
            gravity: self.gravity,
            damping: self.damping,
            wind_velocity: self.wind_velocity,
            wind_drag: self.wind_drag,
            substeps: self.substeps,
            iterations: self.iterations,
            relaxation: self.relaxation,
            max_stretch: self.max_stretch,
            tear_stretch: self.tear_stretch,
            tear_distance: self.tear_distance,
            tear_force: self.tear_force,
            max_speed: self.max_speed,
            contact: self.contact_thickness,
            contact_friction: self.contact_friction,
            time_scale: 1.0,
            compliance,
            stiffness,
            bending: self.bending,
            bending_by_block: self
                .block_bending
                .iter()
                .map(|(block, value)| BlockValue { block, value })
                .collect(),
        }
    }

    /// Returns `true` if a scene of this method and dimension can have these values.
    pub(crate) fn is_valid(&self, context: Context<'_>) -> bool {
        let softness = softness_parameter(context.method);
        let are_valid = self.values(context.method).settings().iter().all(|setting| {
            let info = setting.parameter.info();
            let is_other_softness = info.is_per_kind && setting.parameter != softness;
            let is_unset = setting.value == ParameterValue::Off;
            is_other_softness
                || (info.off == OffMeaning::OwnOfEach && is_unset)
                || (check_finite(setting.value).is_ok()
                    && check_value(info, setting.value, context).is_ok())
        });
        let are_blocks_valid = self
            .block_bending
            .iter()
            .all(|(block, _)| Target::Block(block).check(Parameter::Bending, context).is_ok());
        are_valid
            && are_blocks_valid
            && self.surfaces.are_valid(context)
            && context.size.allows(self.substeps, self.iterations)
    }
}

/// The parameter that sets the softness of constraints.
fn softness_parameter(method: Method) -> Parameter {
    match method {
        Method::Xpbd => Parameter::Compliance,
        Method::Pbd => Parameter::Stiffness,
    }
}

fn check_finite(value: ParameterValue) -> Result<(), Reason> {
    let is_finite = match value {
        ParameterValue::Off => true,
        ParameterValue::Number(number) => number.is_finite(),
        ParameterValue::Vector(vector) => vector.iter().all(|axis| axis.is_finite()),
    };
    if is_finite { Ok(()) } else { Err(Reason::NonFinite) }
}

/// Checks the form and the range of a finite value against the table of parameters.
fn check_value(
    info: &ParameterInfo,
    value: ParameterValue,
    context: Context<'_>,
) -> Result<(), Reason> {
    let is_allowed = match (info.form, value) {
        (_, ParameterValue::Off) => {
            matches!(info.off, OffMeaning::Zero | OffMeaning::NoLimit | OffMeaning::Absent)
        }
        (ValueForm::Number, ParameterValue::Number(number)) => info.range.contains(number),
        (ValueForm::Whole, ParameterValue::Number(number)) => {
            number.fract() == 0.0 && info.range.contains(number)
        }
        (ValueForm::Vector, ParameterValue::Vector(vector)) => {
            is_near(&vector) && (!context.is_planar || vector[2] == 0.0)
        }
        _ => false,
    };
    if is_allowed { Ok(()) } else { Err(Reason::OutOfRange) }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a checked count is a whole number from 1 to 1000"
)]
fn to_count(number: f32) -> u32 {
    number as u32
}
