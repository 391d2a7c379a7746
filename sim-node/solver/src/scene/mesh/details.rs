//! Texture coordinates and names of the faces of a mesh. The simulation ignores them; exports write them.

use serde::Serialize;

use crate::scene::definition::decimal;

/// Texture coordinates and names of the faces of a mesh.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FaceDetails {
    /// Texture coordinates u, v.
    #[serde(skip_serializing_if = "Vec::is_empty", serialize_with = "decimal::pairs::serialize")]
    pub uvs: Vec<[f32; 2]>,
    /// By face: an index of `uvs` for each corner, or none for a face without texture coordinates. An
    /// empty list if each vertex has the texture coordinates of its own index.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub face_uvs: Vec<Vec<u32>>,
    /// Names of the groups of faces.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub groups: Vec<NameRun>,
    /// Names of the materials of faces.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub materials: Vec<NameRun>,
}

/// A name of consecutive faces: from the face `first` up to the first face of the next run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
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
