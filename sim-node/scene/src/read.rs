//! From TOML text to a checked scene.
//!
//! Each table checks its values where they are read. What concerns several tables is checked here, once they are all right.

use std::cell::{Cell, RefCell};
use std::path::Path;

use sim_types::{
    COLLIDERS_MAX, COORDINATE_MAX, ConstraintKind, ELEMENTS_MAX, Method, SCENE_SIZE_BYTES_MAX,
    nearest,
};

use super::definition::Scene;
use super::definition::anchor::SceneAnchor;
use super::definition::collider::ColliderGeometry;
use super::definition::element::{BendParticles, SceneBend, SceneConstraint, SceneParticle};
use super::definition::settings::{ContactMode, ContactSettings, SolverSettings, Wind};
use super::document::{Table, ValueNode, parse};
use super::error::{Problems, SceneError};
use super::fields::{NamedKeys, Reader, TableShape, printed_size, read};
use super::generate::Shape;
use super::memory::{check_memory, reading_bytes};
use super::mesh::area;
use super::model::Positions;
use super::solids;

impl Scene {
    /// Reads and checks a scene. `label` names the text in errors: the path of a file, or a name.
    /// Its stem is the name of a scene that has none.
    ///
    /// Takes at most 256 MiB of memory beyond the scene itself.
    ///
    /// # Errors
    /// The text is not TOML, or values are wrong. The error names the line, the field and what is
    /// allowed for each.
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
        let problems = Problems::new(text, label);
        check_text(&problems);
        problems.check()?;
        let read_file = |path: &str| {
            let text =
                read_file(path).map_err(|problem| format!("{problem} (allowed: an OBJ file)"))?;
            check_memory(reading_bytes(text.len())).map_err(|error| error.to_string())?;
            Ok(text)
        };
        let reader = Reader {
            problems: &problems,
            read_file: &read_file,
            warnings: RefCell::default(),
            is_planar: Cell::new(false),
            is_method_known: Cell::new(true),
            particle_count: Cell::new(None),
            is_anchored: RefCell::default(),
            advice,
        };
        let stem =
            Path::new(label).file_stem().map_or("scene".into(), |stem| stem.to_string_lossy());
        let mut scene = Self::blank(stem.into_owned());
        let places = read_tables(&reader, text, &mut scene)?;
        scene.check_size(&problems, &places);
        problems.check()?;
        scene.check_positions(&problems, &places)?;
        scene.complete_contact(&problems, places.contact);
        problems.check()?;
        scene.check_text_size(&reader);
        problems.check()?;
        scene.read_warnings = reader.warnings.take();
        Ok(scene)
    }
}

/// Refuses a text that is too long.
fn check_text(problems: &Problems<'_>) {
    let size_bytes = problems.text.len();
    if size_bytes > SCENE_SIZE_BYTES_MAX {
        let problem = format!("has {size_bytes} bytes of text (allowed: {SCENE_SIZE_BYTES_MAX})");
        problems.add(0, "scene", problem);
    } else if let Err(error) = check_memory(reading_bytes(size_bytes)) {
        problems.add(0, "scene", error.to_string());
    }
}

/// Places in the text for checks after its document is dropped, in bytes.
struct Places {
    generators: Vec<u32>,
    /// Of the particles of each bend.
    bends: Vec<u32>,
    /// Constraints without the key `rest_length`.
    unmeasured: Vec<u32>,
    /// Of the counts of passes; 0 if both are the defaults.
    passes: u32,
    contact: u32,
}

impl Places {
    fn new(document: &Table<'_>) -> Self {
        let start = |node: Option<&ValueNode<'_>>| node.map_or(0, |node| node.start);
        let solver = document.get("solver");
        let passes = ["iterations", "substeps"].iter().find_map(|key| solver?.get(key));
        let constraints = (0..).zip(document.list("constraint"));
        let unmeasured =
            constraints.filter(|(_, constraint)| constraint.get("rest_length").is_none());
        Self {
            generators: document.list("generate").iter().map(|table| table.start).collect(),
            bends: document.list("bend").iter().map(|bend| start(bend.get("particles"))).collect(),
            unmeasured: unmeasured.map(|(index, _)| index).collect(),
            passes: start(passes),
            contact: start(document.get("contact")),
        }
    }
}

/// Reads all tables of a text.
fn read_tables(reader: &Reader<'_>, text: &str, scene: &mut Scene) -> Result<Places, SceneError> {
    let problems = reader.problems;
    let document = parse(text, problems);
    problems.check()?;
    read(reader, &document, scene);
    if let Some(excess) = document.list("collider").get(COLLIDERS_MAX) {
        let count = scene.colliders.len();
        let problem = format!("is one of {count} colliders (allowed: {COLLIDERS_MAX})");
        problems.add(excess.start as usize, &format!("collider[{COLLIDERS_MAX}]"), problem);
    }
    problems.check()?;
    for (index, collider) in scene.colliders.iter_mut().enumerate() {
        if let Some(mesh) = &mut collider.mesh {
            solids::check(reader, index, &document.list("collider")[index], mesh);
        }
    }
    problems.check()?;
    Ok(Places::new(&document))
}

impl Scene {
    /// Refuses a scene that is too large, before anything of its size is allocated.
    fn check_size(&self, problems: &Problems<'_>, places: &Places) {
        let mut counts = ElementCounts {
            particles: self.particles.len() as u64,
            constraints: self.constraints.len() as u64,
            bends: self.bends.len() as u64,
        };
        for (index, generator) in self.generators.iter().enumerate() {
            counts.add(&generator.shape);
            if counts.exceed_limit() {
                let problem = format!("increases the scene to {}", counts.problem());
                let start = places.generators[index] as usize;
                return problems.add(start, &format!("generate[{index}]"), problem);
            }
        }
        if counts.exceed_limit() {
            return problems.add(0, "scene", format!("has {}", counts.problem()));
        }
        if let Err(problem) = self.check_step_work() {
            problems.add(places.passes as usize, "solver", problem);
        }
        let model = if self.contact.lacks_thickness() { self.model_bytes() } else { 0 };
        let positions = counts.particles * size_of::<[f32; 3]>() as u64;
        if let Err(error) = check_memory(positions + model) {
            problems.add(0, "scene", error.to_string());
        }
    }

    /// Measures the constraints without a rest length, and refuses shapes and bends whose positions are wrong.
    fn check_positions(
        &mut self,
        problems: &Problems<'_>,
        places: &Places,
    ) -> Result<(), SceneError> {
        let positions = self.positions();
        for index in &places.unmeasured {
            let constraint = &mut self.constraints[*index as usize];
            let [a, b] = constraint.particles;
            constraint.rest_length = positions.distance(a, b);
        }
        for (index, (bend, start)) in self.bends.iter().zip(&places.bends).enumerate() {
            if let Some(problem) = bend_problem(bend.particles, &positions) {
                problems.add(*start as usize, &format!("bend[{index}].particles"), problem);
            }
        }
        let mut first = self.particles.len();
        for (index, generator) in self.generators.iter().enumerate() {
            let count = usize::try_from(generator.shape.particle_count()).unwrap_or(usize::MAX);
            let mut generated = positions.0[first..first + count].iter();
            first += count;
            if let Some(problem) = generated.find_map(|place| self.place_problem(*place)) {
                let start = places.generators[index] as usize;
                problems.add(start, &format!("generate[{index}]"), problem);
            }
        }
        problems.check()
    }

    /// Returns what is wrong with the position of a generated particle.
    fn place_problem(&self, position: [f32; 3]) -> Option<String> {
        // NaN fails this comparison, too.
        let is_near = position.iter().all(|axis| axis.abs() <= COORDINATE_MAX);
        match position {
            _ if !is_near => Some(format!("has a particle at {position:?} (allowed: -1e7 to 1e7)")),
            [.., z] if self.dimensions == 2 && z != 0.0 => {
                Some(format!("has a particle at z {z} in a scene of 2 dimensions (allowed: 0)"))
            }
            _ => None,
        }
    }

    /// Refuses surfaces in two dimensions, where a triangle has no side. Takes the smallest rest length of a structural
    /// constraint for a thickness that the scene needs and does not give.
    fn complete_contact(&mut self, problems: &Problems<'_>, start: u32) {
        if self.contact.mode == ContactMode::Surfaces && self.dimensions == 2 {
            let problem = "\"surfaces\" needs three dimensions (allowed in two: off, particles)";
            return problems.add(start as usize, "contact.mode", problem);
        }
        if !self.contact.lacks_thickness() {
            return;
        }
        let model = self.model();
        let structural =
            model.constraints.iter().filter(|one| one.kind == ConstraintKind::Structural);
        let lengths = structural.map(|one| one.rest_length).filter(|length| *length > 0.0);
        self.contact.thickness = lengths.min_by(f32::total_cmp);
        if self.contact.thickness.is_none() {
            let problem = "is missing, and the scene has no structural constraint with a length to take it \
                           from (allowed: > 0)";
            problems.add(start as usize, "contact.thickness", problem);
        }
    }

    /// Refuses a scene whose complete text is too long to be published. What only exports use of its meshes is
    /// left out first.
    fn check_text_size(&mut self, reader: &Reader<'_>) {
        let mut size_bytes = printed_size(self);
        if size_bytes > SCENE_SIZE_BYTES_MAX && self.remove_face_details() {
            reader.warnings.borrow_mut().push(format!(
                "texture coordinates, groups and materials are omitted, because the text of the scene would have \
                 {size_bytes} bytes with them (allowed: {SCENE_SIZE_BYTES_MAX})"
            ));
            size_bytes = printed_size(self);
        }
        if size_bytes > SCENE_SIZE_BYTES_MAX {
            let problem = format!(
                "has {size_bytes} bytes of text with every default and mesh written out (allowed: \
                 {SCENE_SIZE_BYTES_MAX})"
            );
            reader.problems.add(0, "scene", problem);
        }
    }
}

/// Returns what is wrong with the places of the particles of a bend.
fn bend_problem(particles: BendParticles, positions: &Positions) -> Option<&'static str> {
    match particles {
        BendParticles::Line([a, b, c]) => {
            let has_length = positions.distance(a, b) > 0.0 && positions.distance(b, c) > 0.0;
            let problem = "has neighbours that coincide (allowed: neighbours at a distance)";
            (!has_length).then_some(problem)
        }
        BendParticles::Cell([a, b, c, _]) => {
            let corners = [a, b, c].map(|index| positions.0[index as usize].map(f64::from));
            let problem = "is a cell without area (allowed: two corners above two corners)";
            let has_area = area(corners) > 0.0;
            (!has_area).then_some(problem)
        }
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

/// Returns the advice for a key that its table does not have: the tables that have it, or a similar key of another
/// table. Empty without such a key.
fn advice(key: &str) -> String {
    let tables = tables();
    let owners = NamedKeys::owners(&tables, key);
    if !owners.is_empty() {
        return format!(" (a key of {})", owners.join(", "));
    }
    // The end of a word alone, such as `speed` of `max_speed`, is too little to point to another table.
    let begins_alike = |one: &&str| one.chars().next() == key.chars().next();
    let elsewhere = tables.into_iter().find_map(|NamedKeys { name, keys }| {
        let nearest = nearest(key, keys.iter().copied().filter(begins_alike))?;
        Some(format!(" (did you mean '{nearest}' of {name}?)"))
    });
    elsewhere.unwrap_or_default()
}

/// Each table of a scene with its keys.
fn tables() -> [NamedKeys; 10] {
    let of_all = |name, shapes: Vec<NamedKeys>| {
        let keys = shapes.into_iter().flat_map(|shape| shape.keys).collect();
        NamedKeys { name, keys }
    };
    [
        NamedKeys::new("the top of the file", &mut Scene::blank(String::new())),
        NamedKeys::new("[solver]", &mut SolverSettings::default()),
        NamedKeys::new("[wind]", &mut Wind::default()),
        NamedKeys::new("[contact]", &mut ContactSettings::default()),
        NamedKeys::new("[[particle]]", &mut SceneParticle::default()),
        NamedKeys::new("[[constraint]]", &mut SceneConstraint::blank(Method::default())),
        NamedKeys::new("[[bend]]", &mut SceneBend::default()),
        of_all("[[collider]]", ColliderGeometry::keys()),
        NamedKeys::new("[[anchor]]", &mut SceneAnchor::default()),
        of_all("[[generate]]", Shape::keys()),
    ]
}
