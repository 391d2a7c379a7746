//! From TOML text to a checked scene. Each value is checked where it is read.

mod anchor;
mod collider;
mod element;
mod generator;
mod generator_fields;
mod generator_file;
mod limits;
mod mesh;
pub(super) mod pins;
mod reader;
mod settings;
mod syntax;
mod value;
mod wind;

use std::cell::RefCell;
use std::path::Path;

use serde::Deserialize;
use sim_types::{
    COLLIDERS_MAX, COORDINATE_MAX, ELEMENTS_MAX, Method, ParameterValues, SCENE_SIZE_BYTES_MAX,
};

use super::definition::settings::Up;
use super::definition::{SCENE_VERSION, Scene};
use super::error::{Place, SceneError};
use super::model::Model;
use anchor::FileAnchor;
use collider::FileCollider;
use element::{FileConstraint, FileParticle};
use generator_file::FileGenerator;
use reader::Reader;
use settings::FileSolver;
use value::{Table, Tables, Vector, Whole, Word};
use wind::FileWind;

/// The scene file before any check. Every key is optional, and every value has its place in the
/// text.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileScene {
    version: Option<Whole>,
    name: Option<Word>,
    origin: Option<Vector>,
    dimensions: Option<Whole>,
    up: Option<Word>,
    unit: Option<String>,
    gravity: Option<Vector>,
    #[serde(default)]
    solver: Table<FileSolver>,
    wind: Option<Table<FileWind>>,
    #[serde(default)]
    particle: Tables<FileParticle>,
    #[serde(default)]
    constraint: Tables<FileConstraint>,
    #[serde(default)]
    collider: Tables<FileCollider>,
    #[serde(default)]
    anchor: Tables<FileAnchor>,
    #[serde(default)]
    generate: Tables<FileGenerator>,
}

impl Scene {
    /// Reads and checks a scene. `label` names the text in errors: the path of a file, or a name.
    /// Its stem is the name of a scene that has none.
    ///
    /// # Errors
    /// The text is not TOML, or a value is wrong. The error names the line, the field and what is
    /// allowed.
    pub fn from_toml(text: &str, label: &str) -> Result<Self, SceneError> {
        let no_files = |_: &str| Err("a scene without a file cannot name files".to_owned());
        Self::from_toml_with_files(text, label, &no_files)
    }

    /// Reads and checks a scene that may name files, such as meshes.
    ///
    /// `read_file` receives the path as it stands in the text, relative to the scene's own file. It
    /// returns the text of the file, or what is wrong. The scene then holds the contents and needs
    /// the files no longer.
    ///
    /// # Errors
    /// As for [`Self::from_toml`], and the errors of `read_file`.
    pub fn from_toml_with_files(
        text: &str,
        label: &str,
        read_file: &dyn Fn(&str) -> Result<String, String>,
    ) -> Result<Self, SceneError> {
        let place = Place { text, label };
        let file: FileScene = syntax::parse(&place)?;
        let (warnings, method) = (RefCell::default(), Method::default());
        let mut reader = Reader { place, read_file, warnings, is_planar: false, method };
        let version = reader.required(file.version.as_ref(), 0..0, "version", "1")?;
        reader.whole("version", version, SCENE_VERSION..=SCENE_VERSION)?;
        reader.method = reader.method(&file.solver)?;
        let dimensions = file.dimensions.as_ref();
        let dimensions = dimensions.map(|whole| reader.whole("dimensions", whole, 2..=3));
        let dimensions = dimensions.transpose()?.unwrap_or(3);
        reader.is_planar = dimensions == 2;
        let mut scene = reader.without_references(&file, dimensions)?;
        reader.check_size(&scene, &file)?;
        let model = scene.model();
        reader.check_generated(&scene, &file, &model)?;
        reader.read_references(&mut scene, &file, &model)?;
        if let Err(problem) = scene.check_step_work() {
            return reader.error(file.solver.place_of_passes(), "solver", problem);
        }
        reader.check_text_size(&scene)?;
        scene.read_warnings = reader.warnings.take();
        Ok(scene)
    }
}

fn enumerate<F, T>(
    items: &[F],
    mut read: impl FnMut(usize, &F) -> Result<T, SceneError>,
) -> Result<Vec<T>, SceneError> {
    items.iter().enumerate().map(|(index, item)| read(index, item)).collect()
}

impl Reader<'_> {
    /// Reads the scene except for its constraints and anchors, which refer to particles by index.
    fn without_references(&self, file: &FileScene, dimensions: u32) -> Result<Scene, SceneError> {
        let up = file.up.as_ref().map(|word| self.word("up", word, &Up::NAMES));
        Ok(Scene {
            version: SCENE_VERSION,
            name: self.name(file.name.as_ref())?,
            origin: self.origin(file.origin.as_ref())?,
            dimensions,
            up: up.transpose()?.unwrap_or_default(),
            unit: file.unit.clone().unwrap_or_else(|| "m".to_owned()),
            gravity: self.vector_or(
                "gravity",
                file.gravity.as_ref(),
                ParameterValues::DEFAULT.gravity,
            )?,
            solver: self.solver(&file.solver)?,
            wind: file.wind.as_ref().map(|wind| self.wind(wind)).transpose()?,
            particles: enumerate(&file.particle, |index, one| self.particle(index, one))?,
            constraints: Vec::new(),
            colliders: enumerate(&file.collider, |index, one| self.collider(index, one))?,
            anchors: Vec::new(),
            generators: enumerate(&file.generate, |index, one| self.generator(index, one))?,
            read_warnings: Vec::new(),
        })
    }

    /// Reads the explicit constraints and the anchors.
    fn read_references(
        &self,
        scene: &mut Scene,
        file: &FileScene,
        model: &Model,
    ) -> Result<(), SceneError> {
        scene.constraints =
            enumerate(&file.constraint, |index, one| self.constraint(index, one, model))?;
        let mut is_anchored = vec![false; model.particles.len()];
        scene.anchors =
            enumerate(&file.anchor, |index, one| self.anchor(index, one, model, &mut is_anchored))?;
        Ok(())
    }

    fn name(&self, name: Option<&Word>) -> Result<String, SceneError> {
        let Some(name) = name else {
            let stem = Path::new(self.place.label).file_stem();
            return Ok(stem.map_or("scene".to_owned(), |stem| stem.to_string_lossy().into_owned()));
        };
        let text = name.get_ref();
        if !text.is_empty() && !text.chars().any(char::is_control) {
            return Ok(text.clone());
        }
        let problem = "is empty or has control characters (allowed: a line of text)";
        self.error(name.span(), "name", problem)
    }

    fn origin(&self, origin: Option<&Vector>) -> Result<[f64; 3], SceneError> {
        let Some(origin) = origin else { return Ok([0.0; 3]) };
        let axes = origin.get_ref().each_ref().map(|axis| *axis.get_ref());
        if let Some(axis) = axes.iter().find(|axis| !axis.is_finite()) {
            let problem = format!("{axis} is not finite (allowed: finite numbers)");
            return self.error(origin.span(), "origin", problem);
        }
        Ok(axes)
    }

    /// Refuses shapes with coordinates that a scene must not have.
    fn check_generated(
        &self,
        scene: &Scene,
        file: &FileScene,
        model: &Model,
    ) -> Result<(), SceneError> {
        let mut first = scene.particles.len();
        for (index, generator) in scene.generators.iter().enumerate() {
            let count = usize::try_from(generator.shape.particle_count()).unwrap_or(usize::MAX);
            let positions = model.particles[first..first + count].iter().map(|one| one.position);
            first += count;
            for position in positions {
                // NaN fails this comparison, too.
                let is_far = !position.iter().all(|axis| axis.abs() <= COORDINATE_MAX);
                let problem = match position {
                    _ if is_far => format!("has a particle at {position:?} (allowed: -1e7 to 1e7)"),
                    [.., z] if self.is_planar && z != 0.0 => {
                        format!("has a particle at z {z} in a scene of 2 dimensions (allowed: 0)")
                    }
                    _ => continue,
                };
                let span = file.generate[index].span();
                return self.error(span, &format!("generate[{index}]"), problem);
            }
        }
        Ok(())
    }

    /// Refuses a scene that is too large, before anything of its size is allocated.
    fn check_size(&self, scene: &Scene, file: &FileScene) -> Result<(), SceneError> {
        let mut particles = scene.particles.len() as u64;
        let mut constraints = file.constraint.len() as u64;
        for (index, generator) in scene.generators.iter().enumerate() {
            particles = particles.saturating_add(generator.shape.particle_count());
            constraints = constraints.saturating_add(generator.shape.constraint_count());
            if particles.max(constraints) > u64::from(ELEMENTS_MAX) {
                let problem = format!(
                    "increases the scene to {particles} particles and {constraints} constraints \
                     (allowed: {ELEMENTS_MAX} of each)"
                );
                let span = file.generate[index].span();
                return self.error(span, &format!("generate[{index}]"), problem);
            }
        }
        if let Some(first_excess) = file.collider.get(COLLIDERS_MAX) {
            let problem =
                format!("is one of {} colliders (allowed: {COLLIDERS_MAX})", file.collider.len());
            let field = format!("collider[{COLLIDERS_MAX}]");
            return self.error(first_excess.span(), &field, problem);
        }
        if particles.max(constraints) > u64::from(ELEMENTS_MAX) {
            let problem = format!(
                "has {particles} particles and {constraints} constraints (allowed: {ELEMENTS_MAX} \
                 of each)"
            );
            return self.error(0..0, "scene", problem);
        }
        Ok(())
    }

    /// Refuses a scene whose complete text is too long to be published.
    fn check_text_size(&self, scene: &Scene) -> Result<(), SceneError> {
        let size_bytes = scene.to_toml().len();
        if size_bytes <= SCENE_SIZE_BYTES_MAX {
            return Ok(());
        }
        let problem = format!(
            "has {size_bytes} bytes of text with every default and mesh written out (allowed: \
             {SCENE_SIZE_BYTES_MAX})"
        );
        self.error(0..0, "scene", problem)
    }
}
