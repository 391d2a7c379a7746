//! The keys of a mesh, from a file or written out.

use std::ops::Range;

use super::reader::Reader;
use super::value::{Spanned, Vector, Word};
use crate::scene::error::SceneError;
use crate::scene::memory::reading_bytes;
use crate::scene::mesh::{Mesh, ParsedMesh};

/// The keys of a mesh in a table.
pub(super) struct MeshKeys<'f> {
    pub(super) path: Option<&'f Word>,
    pub(super) vertices: Option<&'f Spanned<Vec<Vector>>>,
    pub(super) faces: Option<&'f Spanned<Vec<Vec<i64>>>>,
    /// The table.
    pub(super) span: Range<usize>,
    /// Returns the path of a key.
    pub(super) field: &'f dyn Fn(&str) -> String,
    /// Parses the text of a file.
    pub(super) parse: fn(&str) -> Result<ParsedMesh, String>,
}

impl Reader<'_> {
    /// Reads a mesh from the file that a path names, or from its lists.
    pub(super) fn mesh(&self, keys: &MeshKeys<'_>) -> Result<Mesh, SceneError> {
        match (keys.path, keys.vertices, keys.faces) {
            (Some(path), None, None) => self.mesh_of_file(keys, path),
            (None, Some(vertices), _) => self.written_mesh(keys, vertices),
            (path, ..) => {
                let span = path.map_or(keys.span.clone(), Spanned::span);
                let problem = "a mesh needs a path, or vertices and faces (allowed: either one)";
                self.error(span, &(keys.field)("path"), problem)
            }
        }
    }

    fn mesh_of_file(&self, keys: &MeshKeys<'_>, path: &Word) -> Result<Mesh, SceneError> {
        let name = path.get_ref();
        let text =
            (self.read_file)(name).map_err(|problem| format!("{problem} (allowed: an OBJ file)"));
        if let Ok(text) = &text {
            self.place.check_memory(reading_bytes(text.len()))?;
        }
        match text.and_then(|text| (keys.parse)(&text)) {
            Ok(parsed) => {
                let warnings = parsed.warnings.iter().map(|warning| format!("{name}: {warning}"));
                self.warnings.borrow_mut().extend(warnings);
                Ok(parsed.mesh)
            }
            Err(problem) => {
                let problem = format!("{name}: {problem}");
                self.error(path.span(), &(keys.field)("path"), problem)
            }
        }
    }

    fn written_mesh(
        &self,
        keys: &MeshKeys<'_>,
        vertices: &Spanned<Vec<Vector>>,
    ) -> Result<Mesh, SceneError> {
        let allowed = "lists of 3 or more vertices";
        let field = keys.field;
        let faces = self.required(keys.faces, keys.span.clone(), &field("faces"), allowed)?;
        let count = vertices.get_ref().len();
        let mut checked = Vec::with_capacity(faces.get_ref().len());
        for (place, corners) in faces.get_ref().iter().enumerate() {
            let Some(face) = checked_face(corners, count) else {
                let problem = format!(
                    "face {place} is {corners:?} (allowed: 3 or more different vertices below \
                     {count})"
                );
                return self.error(faces.span(), &field("faces"), problem);
            };
            checked.push(face);
        }
        let name = field("vertices");
        let positions: Result<Vec<_>, _> =
            vertices.get_ref().iter().map(|vertex| self.vector(&name, vertex)).collect();
        Ok(Mesh { vertices: positions?, faces: checked, ..Mesh::default() })
    }
}

/// Returns the corners of a face, if they are 3 or more different vertices below `count`.
fn checked_face(corners: &[i64], count: usize) -> Option<Vec<u32>> {
    let vertex = |corner: &i64| u32::try_from(*corner).ok().filter(|one| (*one as usize) < count);
    let face = corners.iter().map(vertex).collect::<Option<Vec<_>>>()?;
    let mut sorted = face.clone();
    sorted.sort_unstable();
    sorted.dedup();
    (sorted.len() == face.len() && face.len() >= 3).then_some(face)
}
