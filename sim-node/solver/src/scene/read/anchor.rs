//! The table `[[anchor]]`.

use serde::Deserialize;

use super::reader::Reader;
use super::value::{
    Number, Quaternion, Spanned, Table, TableKeys, Tables, Vector, Whole, append, append_elements,
    element_count,
};
use crate::scene::definition::anchor::{SceneAnchor, Waypoint};
use crate::scene::error::SceneError;
use crate::scene::model::Positions;

/// Largest time of a waypoint in seconds (30 years). In f64 it still resolves microseconds.
const TIME_MAX: f64 = 1e9;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileAnchor {
    particles: Option<Spanned<Vec<Whole>>>,
    origin: Option<Vector>,
    #[serde(default)]
    path: Tables<FileWaypoint>,
    repeat: Option<Spanned<bool>>,
}

impl TableKeys for FileAnchor {}

impl FileAnchor {
    /// The lists that a text can give in parts.
    pub(super) const LISTS: [&str; 2] = ["particles", "path"];

    /// Appends the lists of a part of the table.
    pub(super) fn append(&mut self, part: Self) {
        append_elements(self.particles.as_mut(), part.particles);
        append(&mut self.path, part.path);
    }

    /// Returns the number of points of the path.
    pub(super) fn point_count(&self) -> usize {
        self.path.len()
    }

    /// Returns the size of the lists in memory.
    pub(super) fn lists_size_bytes(&self) -> usize {
        let particles = element_count(self.particles.as_ref()) * size_of::<Whole>();
        particles + size_of_val(self.path.as_slice())
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileWaypoint {
    time: Option<Number>,
    translation: Option<Vector>,
    rotation: Option<Quaternion>,
}

impl TableKeys for FileWaypoint {
    const FORM: &'static str = "a table of time, translation and rotation";
}

impl Reader<'_> {
    /// Checks a table `[[anchor]]`. `is_anchored` marks the particles of the anchors before it, and
    /// is updated.
    pub(super) fn anchor(
        &self,
        index: usize,
        table: &Spanned<Table<FileAnchor>>,
        positions: &Positions,
        is_anchored: &mut [bool],
    ) -> Result<SceneAnchor, SceneError> {
        let field = |key: &str| format!("anchor[{index}].{key}");
        let file = table.get_ref();
        let list = file.particles.as_ref();
        let list = self.required(list, table.span(), &field("particles"), "a list of indices")?;
        let mut particles = Vec::with_capacity(list.get_ref().len());
        for particle in list.get_ref() {
            let anchored = self.particle_index(&field("particles"), particle, positions)?;
            if std::mem::replace(&mut is_anchored[anchored as usize], true) {
                let problem =
                    format!("particle {anchored} occurs in an anchor twice (allowed: once)");
                return self.error(particle.span(), &field("particles"), problem);
            }
            particles.push(anchored);
        }
        particles.sort_unstable();
        let path = self.path(&field("path"), &file.path)?;
        let repeat = self.repeat(&field("repeat"), file.repeat.as_ref(), path.len())?;
        let origin = self.vector_or(&field("origin"), file.origin.as_ref(), [0.0; 3])?;
        Ok(SceneAnchor { particles, origin, repeat, path })
    }

    /// Returns whether a path of `point_count` points repeats.
    pub(super) fn repeat(
        &self,
        field: &str,
        repeat: Option<&Spanned<bool>>,
        point_count: usize,
    ) -> Result<bool, SceneError> {
        let Some(given) = repeat.filter(|repeat| *repeat.get_ref()) else { return Ok(false) };
        if point_count < 2 {
            let problem = "a path of fewer than two points cannot repeat (allowed: false)";
            return self.error(given.span(), field, problem);
        }
        Ok(true)
    }

    /// Checks the points of a path.
    pub(super) fn path(
        &self,
        field: &str,
        file: &Tables<FileWaypoint>,
    ) -> Result<Vec<Waypoint>, SceneError> {
        let mut path: Vec<Waypoint> = Vec::with_capacity(file.len());
        for (index, table) in file.iter().enumerate() {
            let field = format!("{field}[{index}]");
            let waypoint = self.waypoint(&field, table)?;
            if let Some(previous) = path.last().filter(|previous| previous.time >= waypoint.time) {
                let problem = format!(
                    "{} is not after {} (allowed: ascending times)",
                    waypoint.time, previous.time
                );
                let span = table.get_ref().time.as_ref().map_or(table.span(), Spanned::span);
                return self.error(span, &format!("{field}.time"), problem);
            }
            path.push(waypoint);
        }
        Ok(path)
    }

    fn waypoint(
        &self,
        field: &str,
        table: &Spanned<Table<FileWaypoint>>,
    ) -> Result<Waypoint, SceneError> {
        let field = |key: &str| format!("{field}.{key}");
        let file = table.get_ref();
        let allowed = format!("0 to {TIME_MAX:e} s");
        let number = self.required(file.time.as_ref(), table.span(), &field("time"), &allowed)?;
        let time = *number.get_ref();
        if !(0.0..=TIME_MAX).contains(&time) {
            let problem = format!("{time} is out of range (allowed: {allowed})");
            return self.error(number.span(), &field("time"), problem);
        }
        let translation = file.translation.as_ref();
        let translation = self.vector_or(&field("translation"), translation, [0.0; 3])?;
        let rotation = self.rotation(&field("rotation"), file.rotation.as_ref())?;
        Ok(Waypoint { time, translation, rotation })
    }
}
