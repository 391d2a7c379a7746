//! From TOML text to a checked scene. Each value is checked where it is read.

mod anchor;
mod body;
mod collider;
mod collider_path;
mod contact;
mod element;
mod file_scene;
mod generator;
mod limits;
mod mesh;
mod reader;
mod settings;
mod syntax;
mod value;
mod wind;

use std::cell::RefCell;
use std::mem::take;
use std::ops::Range;
use std::path::Path;

use sim_types::{
    COLLIDERS_MAX, COORDINATE_MAX, ELEMENTS_MAX, Method, ParameterValues, SCENE_SIZE_BYTES_MAX,
};

use super::definition::collider::SceneCollider;
use super::definition::settings::Up;
use super::definition::{SCENE_VERSION, Scene};
use super::error::{Place, SceneError};
use super::generate::Shape;
use super::model::Positions;
use collider::FileCollider;
use file_scene::FileScene;
use reader::Reader;
use settings::FileSolver;
use value::{Spanned, Tables, Vector, Word};

/// Most memory of all positions, and of the constraints and anchors of the file, in MiB. The greatest
/// number of particles and the longest complete text need less.
const REFERENCES_MAX_MIB: u64 = 232;

impl Scene {
    /// Reads and checks a scene. `label` names the text in errors: the path of a file, or a name.
    /// Its stem is the name of a scene that has none.
    ///
    /// Takes at most 256 MiB of memory beyond the scene itself.
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
    /// the files no longer. A mesh from a file takes further memory while it is read.
    ///
    /// # Errors
    /// As for [`Self::from_toml`], and the errors of `read_file`.
    pub fn from_toml_with_files(
        text: &str,
        label: &str,
        read_file: &dyn Fn(&str) -> Result<String, String>,
    ) -> Result<Self, SceneError> {
        let place = Place { text, label };
        let mut file = syntax::parse(&place)?;
        let solver = file.solver.take().unwrap_or_default();
        let (warnings, method) = (RefCell::default(), Method::default());
        let mut reader = Reader { place, read_file, warnings, is_planar: false, method };
        let version = reader.required(file.version.as_ref(), 0..0, "version", "1")?;
        reader.whole("version", version, SCENE_VERSION..=SCENE_VERSION)?;
        reader.method = reader.method(&solver)?;
        let dimensions = file.dimensions.as_ref();
        let dimensions = dimensions.map(|whole| reader.whole("dimensions", whole, 2..=3));
        let dimensions = dimensions.transpose()?.unwrap_or(3);
        reader.is_planar = dimensions == 2;
        let contact_place = file.contact.as_ref().map(Spanned::span);
        let generator_places: Vec<_> = file.generate.iter().map(Spanned::span).collect();
        let mut scene = reader.without_references(&mut file, &solver, dimensions)?;
        let explicit = ElementCounts {
            particles: scene.particles.len() as u64,
            constraints: file.constraint.len() as u64,
            bends: file.bend.len() as u64,
        };
        reader.check_size(&scene, explicit, &generator_places)?;
        reader.check_memory(&scene, &file)?;
        let positions = scene.positions();
        reader.check_generated(&scene, &positions, &generator_places)?;
        reader.read_references(&mut scene, file, &positions)?;
        drop(positions);
        if let Err(problem) = scene.check_step_work() {
            return reader.error(solver.place_of_passes(), "solver", problem);
        }
        reader.complete_contact(&mut scene, contact_place)?;
        reader.check_text_size(&mut scene)?;
        scene.read_warnings = reader.warnings.take();
        Ok(scene)
    }
}

/// Reads the tables of a list, and drops them.
fn enumerate<F, T>(
    tables: Vec<F>,
    mut read: impl FnMut(usize, &F) -> Result<T, SceneError>,
) -> Result<Vec<T>, SceneError> {
    tables.into_iter().enumerate().map(|(index, table)| read(index, &table)).collect()
}

impl Reader<'_> {
    /// Reads the scene except for its constraints, bends and anchors, which refer to particles by index. Takes
    /// the tables that it reads.
    fn without_references(
        &self,
        file: &mut FileScene,
        solver: &FileSolver,
        dimensions: u32,
    ) -> Result<Scene, SceneError> {
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
            solver: self.solver(solver)?,
            wind: file.wind.as_ref().map(|wind| self.wind(wind)).transpose()?,
            contact: self.contact(file.contact.as_ref().map(|table| &**table.get_ref()))?,
            particles: enumerate(take(&mut file.particle), |index, one| self.particle(index, one))?,
            constraints: Vec::new(),
            bends: Vec::new(),
            colliders: self.colliders(take(&mut file.collider))?,
            anchors: Vec::new(),
            generators: enumerate(take(&mut file.generate), |index, one| {
                self.generator(index, one)
            })?,
            read_warnings: Vec::new(),
        })
    }

    /// Reads the explicit constraints and bends, and the anchors.
    fn read_references(
        &self,
        scene: &mut Scene,
        file: FileScene,
        positions: &Positions,
    ) -> Result<(), SceneError> {
        scene.constraints =
            enumerate(file.constraint, |index, one| self.constraint(index, one, positions))?;
        scene.bends = enumerate(file.bend, |index, one| self.bend(index, one, positions))?;
        let mut is_anchored = vec![false; positions.0.len()];
        scene.anchors = enumerate(file.anchor, |index, one| {
            self.anchor(index, one, positions, &mut is_anchored)
        })?;
        Ok(())
    }

    fn colliders(&self, tables: Tables<FileCollider>) -> Result<Vec<SceneCollider>, SceneError> {
        if let Some(first_excess) = tables.get(COLLIDERS_MAX) {
            let problem =
                format!("is one of {} colliders (allowed: {COLLIDERS_MAX})", tables.len());
            let field = format!("collider[{COLLIDERS_MAX}]");
            return self.error(first_excess.span(), &field, problem);
        }
        enumerate(tables, |index, one| self.collider(index, one))
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
        positions: &Positions,
        generator_places: &[Range<usize>],
    ) -> Result<(), SceneError> {
        let mut first = scene.particles.len();
        for (index, generator) in scene.generators.iter().enumerate() {
            let count = usize::try_from(generator.shape.particle_count()).unwrap_or(usize::MAX);
            let generated = &positions.0[first..first + count];
            first += count;
            for &position in generated {
                // NaN fails this comparison, too.
                let is_far = !position.iter().all(|axis| axis.abs() <= COORDINATE_MAX);
                let problem = match position {
                    _ if is_far => format!("has a particle at {position:?} (allowed: -1e7 to 1e7)"),
                    [.., z] if self.is_planar && z != 0.0 => {
                        format!("has a particle at z {z} in a scene of 2 dimensions (allowed: 0)")
                    }
                    _ => continue,
                };
                let span = generator_places[index].clone();
                return self.error(span, &format!("generate[{index}]"), problem);
            }
        }
        Ok(())
    }

    /// Refuses a scene that is too large, before anything of its size is allocated.
    fn check_size(
        &self,
        scene: &Scene,
        explicit: ElementCounts,
        generator_places: &[Range<usize>],
    ) -> Result<(), SceneError> {
        let mut counts = explicit;
        for (index, generator) in scene.generators.iter().enumerate() {
            counts.add(&generator.shape);
            if counts.exceed_limit() {
                let problem = format!("increases the scene to {}", counts.problem());
                let span = generator_places[index].clone();
                return self.error(span, &format!("generate[{index}]"), problem);
            }
        }
        if counts.exceed_limit() {
            return self.error(0..0, "scene", format!("has {}", counts.problem()));
        }
        Ok(())
    }

    /// Refuses a scene whose positions need too much memory beside the tables that refer to them.
    fn check_memory(&self, scene: &Scene, file: &FileScene) -> Result<(), SceneError> {
        let positions = scene.particle_count() * size_of::<[f32; 3]>() as u64;
        let size_mib = (positions + file.size_bytes() as u64) >> 20;
        if size_mib <= REFERENCES_MAX_MIB {
            let model = if scene.contact.lacks_thickness() { scene.model_bytes() } else { 0 };
            return self.place.check_memory(positions + scene.particle_count() + model);
        }
        let problem = format!(
            "needs {size_mib} MiB for its particles, explicit constraints and anchors while it is \
             read (allowed: {REFERENCES_MAX_MIB} MiB)"
        );
        self.error(0..0, "scene", problem)
    }

    /// Refuses a scene whose complete text is too long to be published. What only exports use of its meshes is
    /// left out first.
    fn check_text_size(&self, scene: &mut Scene) -> Result<(), SceneError> {
        let mut size_bytes = scene.to_toml().len();
        if size_bytes > SCENE_SIZE_BYTES_MAX && scene.remove_face_details() {
            self.warnings.borrow_mut().push(format!(
                "texture coordinates, groups and materials are omitted, because the text of the scene would have \
                 {size_bytes} bytes with them (allowed: {SCENE_SIZE_BYTES_MAX})"
            ));
            size_bytes = scene.to_toml().len();
        }
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

/// Numbers of elements, each of which is limited.
#[derive(Clone, Copy)]
struct ElementCounts {
    particles: u64,
    constraints: u64,
    bends: u64,
}

impl ElementCounts {
    fn add(&mut self, shape: &Shape) {
        self.particles = self.particles.saturating_add(shape.particle_count());
        self.constraints = self.constraints.saturating_add(shape.constraint_count());
        self.bends = self.bends.saturating_add(shape.bend_count());
    }

    fn exceed_limit(self) -> bool {
        self.particles.max(self.constraints).max(self.bends) > u64::from(ELEMENTS_MAX)
    }

    fn problem(self) -> String {
        let Self { particles, constraints, bends } = self;
        let bends = if bends > 0 { format!(" and {bends} bends") } else { String::new() };
        format!(
            "{particles} particles and {constraints} constraints{bends} (allowed: {ELEMENTS_MAX} of \
             each)"
        )
    }
}
