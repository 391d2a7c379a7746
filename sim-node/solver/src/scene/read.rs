//! From text to a checked scene: each value is checked where it is read, and wrong ones are named
//! with their line.

use std::cell::RefCell;
use std::path::Path;

use toml::Spanned;

use super::check::{Range32, Reader};
use super::error::Place;
use super::file::{FileConstraint, FileParticle, FileScene, FileSolver, Number, Vector, Whole};
use super::{
    ELEMENTS_MAX, Method, Model, PASSES_MAX, RATE_HZ_MAX, SCENE_VERSION, Scene, SceneConstraint,
    SceneError, SceneParticle, Softness, SolverSettings,
};
use sim_types::COORDINATE_MAX;

/// Reads and checks a scene.
pub(super) fn scene(
    text: &str,
    label: &str,
    read_file: &dyn Fn(&str) -> Result<String, String>,
) -> Result<Scene, SceneError> {
    let place = Place { text, label };
    let file: FileScene = parse(&place)?;
    let method = file.solver.method.unwrap_or_default();
    let findings = RefCell::default();
    let mut reader = Reader { place, read_file, findings, is_planar: false, method };
    let settings = solver(&reader, &file.solver)?;
    reader.whole("version", &file.version, SCENE_VERSION..=SCENE_VERSION)?;
    let dimensions = match &file.dimensions {
        Some(dimensions) => reader.whole("dimensions", dimensions, 2..=3)?,
        None => 3,
    };
    reader.is_planar = dimensions == 2;
    let particles = enumerate(&file.particle, |index, one| reader.particle(index, one))?;
    let generators = enumerate(&file.generate, |index, one| reader.generator(index, one))?;
    let colliders = enumerate(&file.collider, |index, one| reader.collider(index, one))?;
    let mut scene = Scene {
        version: SCENE_VERSION,
        name: reader.name(file.name.as_ref())?,
        origin: reader.origin(file.origin.as_ref())?,
        dimensions,
        up: file.up.unwrap_or_default(),
        unit: file.unit.clone().unwrap_or_else(|| "m".to_owned()),
        gravity: reader.vector_or("gravity", file.gravity.as_ref(), [0.0, -9.81, 0.0])?,
        solver: settings,
        wind: file.wind.as_ref().map(|wind| reader.wind(wind)).transpose()?,
        particles,
        constraints: Vec::new(),
        colliders,
        anchors: Vec::new(),
        generators,
        findings: Vec::new(),
    };
    scene.findings = reader.findings.take();
    reader.check_size(&scene, &file)?;
    let model = Model::new(&scene);
    reader.check_generated(&scene, &file, &model)?;
    scene.constraints =
        enumerate(&file.constraint, |index, one| reader.constraint(index, one, &model))?;
    let mut is_taken = vec![false; model.particles.len()];
    scene.anchors =
        enumerate(&file.anchor, |index, one| reader.anchor(index, one, &model, &mut is_taken))?;
    Ok(scene)
}

fn parse(place: &Place<'_>) -> Result<FileScene, SceneError> {
    let syntax = |error: &toml::de::Error| place.syntax_error(error, "");
    let deserializer = toml::Deserializer::parse(place.text).map_err(|error| syntax(&error))?;
    serde_path_to_error::deserialize(deserializer).map_err(|error| {
        // Behind the last key of ours the path names the parser's own wrappers.
        let path = error.path().to_string();
        let path = path.split(".$__").next().unwrap_or_default();
        place.syntax_error(error.inner(), path.trim_matches('.'))
    })
}

fn enumerate<F, T>(
    items: &[F],
    mut read: impl FnMut(usize, &F) -> Result<T, SceneError>,
) -> Result<Vec<T>, SceneError> {
    items.iter().enumerate().map(|(index, item)| read(index, item)).collect()
}

fn solver(reader: &Reader<'_>, file: &FileSolver) -> Result<SolverSettings, SceneError> {
    let default = SolverSettings::default();
    let passes = |field, value: Option<&Whole>, default, max| match value {
        Some(value) => reader.whole(field, value, 1..=max),
        None => Ok(default),
    };
    let number_or = |field, number: Option<&Number>, range, default| {
        number.map_or(Ok(default), |number| reader.ranged(field, number, range))
    };
    Ok(SolverSettings {
        rate_hz: passes("solver.rate_hz", file.rate_hz.as_ref(), default.rate_hz, RATE_HZ_MAX)?,
        substeps: passes("solver.substeps", file.substeps.as_ref(), default.substeps, PASSES_MAX)?,
        iterations: passes(
            "solver.iterations",
            file.iterations.as_ref(),
            default.iterations,
            PASSES_MAX,
        )?,
        method: reader.method,
        order: file.order.unwrap_or_default(),
        damping: number_or(
            "solver.damping",
            file.damping.as_ref(),
            Range32::AT_LEAST_ZERO,
            default.damping,
        )?,
        relaxation: number_or(
            "solver.relaxation",
            file.relaxation.as_ref(),
            Range32::RELAXATION,
            default.relaxation,
        )?,
        tethers: file.tethers,
        max_speed: number_or(
            "solver.max_speed",
            file.max_speed.as_ref(),
            Range32::POSITIVE,
            default.max_speed,
        )?,
        limits: reader.scene_limits(file)?,
    })
}

impl Reader<'_> {
    fn name(&self, name: Option<&Spanned<String>>) -> Result<String, SceneError> {
        match name {
            None => {
                let stem = Path::new(self.place.label).file_stem();
                Ok(stem.map_or("scene".to_owned(), |stem| stem.to_string_lossy().into_owned()))
            }
            Some(name)
                if name.get_ref().is_empty() || name.get_ref().chars().any(char::is_control) =>
            {
                let allowed = "is empty or has control characters (allowed: a line of text)";
                self.error(name.span(), "name", allowed.to_owned())
            }
            Some(name) => Ok(name.get_ref().clone()),
        }
    }

    fn origin(&self, origin: Option<&Vector>) -> Result<[f64; 3], SceneError> {
        let Some(origin) = origin else { return Ok([0.0; 3]) };
        let axes = origin.get_ref().each_ref().map(|axis| *axis.get_ref());
        if axes.iter().all(|axis| axis.is_finite()) {
            return Ok(axes);
        }
        self.error(origin.span(), "origin", "not finite (allowed: finite numbers)".to_owned())
    }

    fn particle(&self, index: usize, file: &FileParticle) -> Result<SceneParticle, SceneError> {
        let field = |name: &str| format!("particle[{index}].{name}");
        let velocity = self.vector_or(&field("velocity"), file.velocity.as_ref(), [0.0; 3])?;
        if let Some(given) = file.velocity.as_ref().filter(|_| file.pinned && velocity != [0.0; 3])
        {
            let problem = "a pinned particle does not move (allowed: [0, 0, 0])".to_owned();
            return self.error(given.span(), &field("velocity"), problem);
        }
        Ok(SceneParticle {
            position: self.vector(&field("position"), &file.position)?,
            mass: self.mass(&field("mass"), file.mass.as_ref())?,
            pinned: file.pinned,
            velocity,
        })
    }

    fn constraint(
        &self,
        index: usize,
        file: &FileConstraint,
        model: &Model,
    ) -> Result<SceneConstraint, SceneError> {
        let field = |name: &str| format!("constraint[{index}].{name}");
        let [a, b] = file.particles.get_ref();
        let a = self.particle_index(&field("particles"), a, model)?;
        let b = self.particle_index(&field("particles"), b, model)?;
        if a == b {
            let problem =
                format!("joins particle {a} to itself (allowed: two different particles)");
            return self.error(file.particles.span(), &field("particles"), problem);
        }
        let rest_length = match &file.rest_length {
            Some(number) => self.ranged(&field("rest_length"), number, Range32::AT_LEAST_ZERO)?,
            None => model.distance(a, b),
        };
        let softness =
            match self.softness_key(field, file.compliance.as_ref(), file.stiffness.as_ref())? {
                Some((name, number)) => self.softness(&field(name), number)?,
                None => Softness::rigid(self.method).value(),
            };
        let softness = match self.method {
            Method::Xpbd => Softness::Compliance(softness),
            Method::Pbd => Softness::Stiffness(softness),
        };
        let limits = self.constraint_limits(index, file)?;
        Ok(SceneConstraint { particles: [a, b], rest_length, kind: file.kind, softness, limits })
    }

    /// The index of a particle that the scene has.
    pub(super) fn particle_index(
        &self,
        field: &str,
        index: &Whole,
        model: &Model,
    ) -> Result<u32, SceneError> {
        let Some(last) = model.particle_count().checked_sub(1) else {
            return self.error(index.span(), field, "the scene has no particles".to_owned());
        };
        self.whole(field, index, 0..=last)
    }

    /// Refuses shapes that reach beyond the coordinates that a scene may have.
    fn check_generated(
        &self,
        scene: &Scene,
        file: &FileScene,
        model: &Model,
    ) -> Result<(), SceneError> {
        let mut first = scene.particles.len();
        for (index, generator) in scene.generators.iter().enumerate() {
            let count = usize::try_from(generator.particle_count()).unwrap_or(usize::MAX);
            let positions = model.particles[first..first + count].iter().map(|one| one.position);
            first += count;
            for position in positions {
                // Not a number is no coordinate either.
                let is_far = !position.iter().all(|axis| axis.abs() <= COORDINATE_MAX);
                let problem = match position {
                    _ if is_far => format!("has a particle at {position:?} (allowed: -1e7 to 1e7)"),
                    [.., z] if self.is_planar && z != 0.0 => {
                        format!("has a particle at z {z} in a scene of 2 dimensions (allowed: 0)")
                    }
                    _ => continue,
                };
                let span = file.generate[index].shape.span();
                return self.error(span, &format!("generate[{index}]"), problem);
            }
        }
        Ok(())
    }

    /// Refuses a scene that is too big before anything of its size is made.
    fn check_size(&self, scene: &Scene, file: &FileScene) -> Result<(), SceneError> {
        let mut particles = scene.particles.len() as u64;
        let mut constraints = file.constraint.len() as u64;
        for (index, generator) in scene.generators.iter().enumerate() {
            particles = particles.saturating_add(generator.particle_count());
            constraints = constraints.saturating_add(generator.constraint_count());
            if particles.max(constraints) > u64::from(ELEMENTS_MAX) {
                let problem = format!(
                    "brings the scene to {particles} particles and {constraints} constraints \
                     (allowed: {ELEMENTS_MAX} of each)"
                );
                let span = file.generate[index].shape.span();
                return self.error(span, &format!("generate[{index}]"), problem);
            }
        }
        if particles.max(constraints) > u64::from(ELEMENTS_MAX) {
            let problem = format!("too big (allowed: {ELEMENTS_MAX} particles and constraints)");
            return self.error(0..0, "scene", problem);
        }
        Ok(())
    }
}
