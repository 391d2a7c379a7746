//! Settings of the solver, and other choices that hold for a whole scene: the air, and contacts.

use sim_types::{Method, NumberRange, Parameter, ParameterValues};

use super::element::Limits;
use crate::fields::{At, Fields, SceneTable, printed};

/// Largest [`SolverSettings::rate_hz`].
pub const RATE_HZ_MAX: u32 = 100_000;
/// Largest [`SolverSettings::substeps`] and [`SolverSettings::iterations`].
pub const PASSES_MAX: u32 = 1000;
/// Largest [`SolverSettings::tethers`].
pub const TETHERS_MAX: u32 = 4;
/// A period: a step counts it in whole numbers.
const PERIOD: NumberRange =
    NumberRange { max: 1e6, text: "more than 0, at most 1e6 s", ..NumberRange::POSITIVE };

/// Axis that points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Up {
    /// y.
    #[default]
    Y,
    /// -y, as on a screen.
    MinusY,
    /// z.
    Z,
}

impl Up {
    /// The names in a scene.
    pub(crate) const NAMES: [(&'static str, Self); 3] =
        [("y", Self::Y), ("-y", Self::MinusY), ("z", Self::Z)];

    /// Returns the name in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Self::Y => "y",
            Self::MinusY => "-y",
            Self::Z => "z",
        }
    }

    /// Returns the axis with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(one, _)| *one == name).map(|(_, up)| *up)
    }
}

/// Order in which constraints are projected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ConstraintOrder {
    /// Groups of constraints that share no particle. It is stable with small substeps.
    #[default]
    Grouped,
    /// The order of the file, for lessons and comparisons. It gains energy with small substeps.
    Listed,
}

impl ConstraintOrder {
    /// The names in a scene.
    pub(crate) const NAMES: [(&'static str, Self); 2] =
        [("grouped", Self::Grouped), ("listed", Self::Listed)];
}

/// Settings of the solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverSettings {
    /// Steps per second, 1..=100000; default 240.
    pub rate_hz: u32,
    /// Substeps per step, 1..=1000; default 4.
    pub substeps: u32,
    /// Passes over the constraints in each substep, 1..=1000; default 1. At the same cost, more
    /// substeps are nearly always better than more iterations.
    pub iterations: u32,
    /// Meaning of a constraint's softness; default xpbd.
    pub method: Method,
    /// Order of projection; default grouped.
    pub order: ConstraintOrder,
    /// Decay rate of velocities in 1/s, >= 0; default 0. The terminal speed under gravity is
    /// gravity / damping. From 1/h on, nothing moves.
    pub damping: f32,
    /// Fraction of each correction that a pass applies, 0 < w < 2; default 1. Values above 1 are
    /// successive over-relaxation, which pays only with hundreds of iterations.
    pub relaxation: f32,
    /// Keeps free particles within the lengths of the shortest rigid paths to their nearest fixed ones:
    /// the number of these, 0..=4; default 0.
    pub tethers: u32,
    /// Largest speed of a particle in unit/s, > 0; default 10000.
    pub max_speed: f32,
    /// Limits at which constraints stop stretching and tear; default none.
    pub limits: Limits,
}

impl Default for SolverSettings {
    fn default() -> Self {
        let defaults = ParameterValues::DEFAULT;
        Self {
            rate_hz: 240,
            substeps: defaults.count(Parameter::Substeps),
            iterations: defaults.count(Parameter::Iterations),
            method: Method::Xpbd,
            order: ConstraintOrder::Grouped,
            damping: defaults.number(Parameter::Damping),
            relaxation: defaults.number(Parameter::Relaxation),
            tethers: 0,
            max_speed: defaults.number(Parameter::MaxSpeed),
            limits: Limits::default(),
        }
    }
}

impl SolverSettings {
    /// Returns the length of a substep in seconds: 1 / (`rate_hz` `substeps`), rounded once.
    pub fn h(&self) -> f32 {
        substep_length(self.rate_hz, self.substeps)
    }

    /// Returns `true` if free particles have tethers.
    pub fn has_tethers(&self) -> bool {
        self.tethers > 0
    }
}

impl SceneTable for SolverSettings {
    fn fields(&mut self, fields: &mut Fields<'_>) {
        let range = |parameter: Parameter| parameter.info().range;
        fields.whole("rate_hz", &mut self.rate_hz, 1..=RATE_HZ_MAX);
        fields.whole("substeps", &mut self.substeps, 1..=PASSES_MAX);
        fields.whole("iterations", &mut self.iterations, 1..=PASSES_MAX);
        fields.word("method", &mut self.method, &Method::ALL.map(|one| (one.name(), one)));
        fields.word("order", &mut self.order, &ConstraintOrder::NAMES);
        fields.number("damping", &mut self.damping, range(Parameter::Damping));
        fields.number("relaxation", &mut self.relaxation, range(Parameter::Relaxation));
        fields.value("tethers", &mut self.tethers, read_tethers, |count| print_tethers(*count));
        fields.number("max_speed", &mut self.max_speed, range(Parameter::MaxSpeed));
        self.limits.fields(fields);
    }
}

/// The values of the settings that are parameters.
pub(crate) fn parameter_values(
    gravity: [f32; 3],
    solver: &SolverSettings,
    contact: &ContactSettings,
    wind: Option<&Wind>,
) -> ParameterValues {
    let Limits { max_stretch, tear_stretch, tear_distance, tear_force } = solver.limits;
    let values = ParameterValues::default()
        .with(Parameter::Gravity, gravity)
        .with(Parameter::Damping, solver.damping)
        .with(Parameter::Substeps, solver.substeps as f32)
        .with(Parameter::Iterations, solver.iterations as f32)
        .with(Parameter::Relaxation, solver.relaxation)
        .with(Parameter::MaxStretch, max_stretch)
        .with(Parameter::TearStretch, tear_stretch)
        .with(Parameter::TearDistance, tear_distance)
        .with(Parameter::TearForce, tear_force)
        .with(Parameter::MaxSpeed, solver.max_speed)
        .with(Parameter::ContactThickness, contact.distance())
        .with(Parameter::ContactFriction, contact.friction);
    match wind {
        Some(wind) => {
            values.with(Parameter::WindVelocity, wind.velocity).with(Parameter::WindDrag, wind.drag)
        }
        None => values,
    }
}

/// Reads the tethers of each particle: whether it has some, or their number.
fn read_tethers(at: At<'_>) -> Option<u32> {
    match at.text() {
        "true" => Some(TETHERS_MAX),
        "false" => Some(0),
        text if text.parse::<i64>().is_ok() => at.whole(0..=TETHERS_MAX),
        _ => at.error(format!(
            "is neither true, false nor a whole number (allowed: true, false, 0 to {TETHERS_MAX})"
        )),
    }
}

/// Prints 0 as `false` and the maximum as `true`.
fn print_tethers(count: u32) -> Option<String> {
    match count {
        0 | TETHERS_MAX => printed(&(count > 0)),
        _ => printed(&count),
    }
}

/// Returns 1 / (`rate_hz` `substeps`) in seconds, rounded once to the solver's f32.
#[allow(clippy::cast_possible_truncation, reason = "the one rounding to the solver's f32")]
fn substep_length(rate_hz: u32, substeps: u32) -> f32 {
    (1.0 / (f64::from(rate_hz) * f64::from(substeps))) as f32
}

/// Which parts of cloths, ropes and other bodies touch each other.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ContactMode {
    /// None: they pass through each other.
    #[default]
    Off,
    /// Particles touch particles.
    Particles,
    /// Particles touch the triangles of cloths, and particles without triangles touch each other.
    Surfaces,
}

impl ContactMode {
    /// The names in a scene.
    pub(crate) const NAMES: [(&'static str, Self); 3] =
        [("off", Self::Off), ("particles", Self::Particles), ("surfaces", Self::Surfaces)];
}

/// Contacts of particles with each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactSettings {
    /// Default off.
    pub mode: ContactMode,
    /// Smallest distance of the centres of two particles, or of a particle and a triangle, in the scene's unit, > 0; default the smallest
    /// rest length of a structural constraint. `None` while the mode is off and the scene gives none.
    pub thickness: Option<f32>,
    /// Coulomb's coefficient, >= 0; default 0.3.
    pub friction: f32,
}

impl Default for ContactSettings {
    fn default() -> Self {
        let friction = ParameterValues::DEFAULT.number(Parameter::ContactFriction);
        Self { mode: ContactMode::Off, thickness: None, friction }
    }
}

impl ContactSettings {
    /// Returns the contact distance, or `None` if particles do not touch each other.
    pub fn distance(&self) -> Option<f32> {
        self.thickness.filter(|_| self.mode != ContactMode::Off)
    }

    /// Returns `true` if particles touch each other, and the scene must give the distance.
    pub(crate) fn lacks_thickness(&self) -> bool {
        self.mode != ContactMode::Off && self.thickness.is_none()
    }
}

impl SceneTable for ContactSettings {
    fn fields(&mut self, fields: &mut Fields<'_>) {
        let range = |parameter: Parameter| parameter.info().range;
        fields.word("mode", &mut self.mode, &ContactMode::NAMES);
        fields.optional_number(
            "thickness",
            &mut self.thickness,
            range(Parameter::ContactThickness),
        );
        fields.number("friction", &mut self.friction, range(Parameter::ContactFriction));
    }
}

/// Moving air. A triangle of area A and normal n experiences the force drag A |u n| u, where u is
/// the wind minus the mean velocity of the corners. Each corner takes a third of the force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wind {
    /// In unit/s; default 0, which is still air.
    pub velocity: [f32; 3],
    /// Half the density of the air times the drag coefficient, in kg/m^3, >= 0; default 0.6.
    pub drag: f32,
    /// Amplitude of the gusts as a fraction of the velocity, 0..=1; default 0.
    pub gust: f32,
    /// Time between two gusts in seconds, > 0; default 4.
    pub gust_period: f32,
}

impl Default for Wind {
    /// Still air at sea level around a flat plate.
    fn default() -> Self {
        Self { velocity: [0.0; 3], drag: 0.6, gust: 0.0, gust_period: 4.0 }
    }
}

impl SceneTable for Wind {
    fn fields(&mut self, fields: &mut Fields<'_>) {
        fields.vector("velocity", &mut self.velocity);
        fields.number("drag", &mut self.drag, NumberRange::AT_LEAST_ZERO);
        fields.number("gust", &mut self.gust, NumberRange::SHARE);
        fields.number("gust_period", &mut self.gust_period, PERIOD);
    }
}
