//! Texture coordinates and names of the faces of a mesh. The simulation ignores them; exports write them.

use sim_types::{ELEMENTS_MAX, NumberRange};

use crate::fields::{At, Fields, SceneTable, printed};
use crate::lists::{print_lists, print_points};

/// A texture coordinate.
const ANY_NUMBER: NumberRange =
    NumberRange { min: f32::MIN, max: f32::MAX, text: "a finite number", ..NumberRange::SHARE };

/// Texture coordinates and names of the faces of a mesh.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FaceDetails {
    /// Texture coordinates u, v.
    pub uvs: Vec<[f32; 2]>,
    /// By face: an index of `uvs` for each corner, or none for a face without texture coordinates. An
    /// empty list if each vertex has the texture coordinates of its own index.
    pub face_uvs: Vec<Vec<u32>>,
    /// Names of the groups of faces.
    pub groups: Vec<NameRun>,
    /// Names of the materials of faces.
    pub materials: Vec<NameRun>,
}

/// A name of consecutive faces: from the face `first` up to the first face of the next run.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct NameRun {
    /// One line of text. If it is empty, the faces have no name.
    pub name: String,
    /// Index of the first face with this name.
    pub first: u32,
}

impl NameRun {
    /// Returns the name of a face, or `None` if it has no name. `runs` are sorted by their first faces.
    pub fn of_face(runs: &[Self], face: usize) -> Option<&str> {
        let count = runs.partition_point(|run| run.first as usize <= face);
        runs[..count].last().map(|run| run.name.as_str()).filter(|name| !name.is_empty())
    }

    /// Returns the runs of a mesh of which only the faces `kept` are left. `kept` has ascending indices of faces.
    pub(super) fn of_kept(runs: &[Self], kept: &[usize]) -> Vec<Self> {
        let mut new: Vec<Self> = Vec::new();
        for (first, face) in (0..).zip(kept) {
            let name = Self::of_face(runs, *face).unwrap_or_default();
            if new.last().map_or("", |run| run.name.as_str()) != name {
                new.push(Self { name: name.to_owned(), first });
            }
        }
        new
    }
}

impl FaceDetails {
    const KEYS: [&str; 4] = ["uvs", "face_uvs", "groups", "materials"];

    /// Refuses the keys beside the file of a mesh.
    pub(crate) fn refuse(fields: &Fields<'_>) {
        for key in Self::KEYS.into_iter().filter(|key| fields.find(key).is_some()) {
            let problem =
                "the file of the mesh has its own (allowed: together with vertices and faces)";
            fields.error(key, problem);
        }
    }

    /// Walks the texture coordinates of a mesh with these faces, or one that has errors.
    pub(crate) fn uv_fields(
        &mut self,
        fields: &mut Fields<'_>,
        vertex_count: usize,
        faces: Option<&Vec<Vec<u32>>>,
    ) {
        let print = |uvs: &Vec<_>| printed(&print_points(uvs)).filter(|_| !uvs.is_empty());
        fields.value("uvs", &mut self.uvs, |at| at.points(ANY_NUMBER), print);
        let uv_count = self.uvs.len();
        let print = |uvs: &Vec<Vec<u32>>| {
            printed(&print_lists(uvs.iter().map(Vec::as_slice))).filter(|_| !uvs.is_empty())
        };
        let read = |at: At<'_>| checked_face_uvs(at, uv_count, faces?);
        fields.value("face_uvs", &mut self.face_uvs, read, print);
        let is_by_vertex = fields.find("uvs").is_some() && fields.find("face_uvs").is_none();
        if faces.is_some() && is_by_vertex && ![0, vertex_count].contains(&uv_count) {
            let problem = format!(
                "has {uv_count} entries without face_uvs (allowed: {vertex_count}, one for each vertex)"
            );
            fields.error("uvs", problem);
        }
    }

    /// Walks the names of the faces of a mesh.
    pub(crate) fn name_fields(&mut self, fields: &mut Fields<'_>, face_count: usize) {
        for (key, runs) in [("groups", &mut self.groups), ("materials", &mut self.materials)] {
            let problem_count = fields.problem_count();
            fields.tables(key, runs, &NameRun::default());
            if fields.find(key).is_none() || fields.problem_count() > problem_count {
                continue;
            }
            let least = |index: usize| index.checked_sub(1).map_or(0, |last| runs[last].first + 1);
            let is_wrong = |index: &usize| {
                let first = runs[*index].first;
                first < least(*index) || first as usize >= face_count
            };
            if let Some(index) = (0..runs.len()).find(is_wrong) {
                let (first, least, most) =
                    (runs[index].first, least(index), face_count.saturating_sub(1));
                let allowed = format!("{least} to {most}");
                let allowed = if least as usize == most { least.to_string() } else { allowed };
                let problem = format!("{first} is out of range (allowed: {allowed})");
                fields.error_in(key, index, "first", &problem);
            }
        }
    }
}

/// Returns the indices of texture coordinates by face.
fn checked_face_uvs(at: At<'_>, uv_count: usize, faces: &[Vec<u32>]) -> Option<Vec<Vec<u32>>> {
    let lists = at.index_lists()?;
    if lists.len() != faces.len() {
        return at.wrong_length(lists.len(), &format!("{}, one for each face", faces.len()));
    }
    let is_wrong = |(list, face): (&Vec<u32>, &Vec<u32>)| {
        let has_length = list.is_empty() || list.len() == face.len();
        !has_length || list.iter().any(|uv| *uv as usize >= uv_count)
    };
    let Some(face) = lists.iter().zip(faces).position(is_wrong) else { return Some(lists) };
    let (list, count) = (at.element_text(face, &lists[face]), faces[face].len());
    at.error(format!("face {face} is {list} (allowed: none, or {count} numbers below {uv_count})"))
}

impl SceneTable for NameRun {
    const FORM: &'static str = "a table { name, first }";

    fn fields(&mut self, fields: &mut Fields<'_>) {
        fields.require("name", "a line of text");
        fields.value("name", &mut self.name, |at| at.line().map(str::to_owned), printed);
        fields.require("first", "a face");
        fields.whole("first", &mut self.first, 0..=ELEMENTS_MAX);
    }
}
