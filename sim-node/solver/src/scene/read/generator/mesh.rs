//! The keys of a mesh, from a file or written out.

use sim_types::NumberRange;

use super::fields::GeneratorFields;
use super::file::FilePinned;

use super::super::value::{Spanned, Vector, Word};
use crate::scene::error::SceneError;
use crate::scene::generate::obj::Obj;
use crate::scene::generate::pinned::Pinned;
use crate::scene::generate::{Generator, Shape};
use crate::scene::mesh::{Mesh, pins};

impl GeneratorFields<'_, '_> {
    /// Checks the keys of the shape "obj".
    pub(super) fn obj(&self) -> Result<Generator, SceneError> {
        let file = self.file;
        let mesh = match (&file.path, &file.vertices) {
            (Some(path), None) => self.mesh_of_file(path)?,
            (None, Some(vertices)) => self.written_mesh(vertices)?,
            (path, _) => {
                let span = path.as_ref().map_or(self.span.clone(), Spanned::span);
                let problem = "a mesh needs a path, or vertices and faces (allowed: either one)";
                return self.reader.error(span, &self.name("path"), problem);
            }
        };
        let density = file
            .density
            .as_ref()
            .map(|number| self.reader.ranged(&self.name("density"), number, NumberRange::POSITIVE));
        let density = density.transpose()?;
        Ok(Generator {
            mass: self.mass()?,
            pinned: self.pinned_vertices(&mesh)?,
            shape: Shape::Obj(Obj::new(mesh, density, self.mesh_bending()?)),
            tear_stretch: self.tear_stretch()?,
            contact: self.file.contact.unwrap_or(true),
            softness: self.softness()?,
        })
    }

    fn mesh_of_file(&self, path: &Word) -> Result<Mesh, SceneError> {
        let name = path.get_ref();
        let read_file = self.reader.read_file;
        let text = read_file(name).map_err(|problem| format!("{problem} (allowed: an OBJ file)"));
        match text.and_then(|text| Mesh::from_obj(&text)) {
            Ok(parsed) => {
                let warnings = parsed.warnings.iter().map(|warning| format!("{name}: {warning}"));
                self.reader.warnings.borrow_mut().extend(warnings);
                Ok(parsed.mesh)
            }
            Err(problem) => {
                let problem = format!("{name}: {problem}");
                self.reader.error(path.span(), &self.name("path"), problem)
            }
        }
    }

    fn written_mesh(&self, vertices: &Spanned<Vec<Vector>>) -> Result<Mesh, SceneError> {
        let allowed = "lists of 3 or more vertices";
        let faces = self.required("faces", self.file.faces.as_ref(), allowed)?;
        let count = vertices.get_ref().len();
        let mut checked = Vec::with_capacity(faces.get_ref().len());
        for (place, corners) in faces.get_ref().iter().enumerate() {
            let Some(face) = checked_face(corners, count) else {
                let problem = format!(
                    "face {place} is {corners:?} (allowed: 3 or more different vertices below \
                     {count})"
                );
                return self.reader.error(faces.span(), &self.name("faces"), problem);
            };
            checked.push(face);
        }
        let positions: Result<Vec<_>, _> = (vertices.get_ref().iter())
            .map(|vertex| self.reader.vector(&self.name("vertices"), vertex))
            .collect();
        Ok(Mesh { vertices: positions?, faces: checked, ..Mesh::default() })
    }

    fn pinned_vertices(&self, mesh: &Mesh) -> Result<Pinned, SceneError> {
        let Some(pinned) = &self.file.pinned else { return Ok(Pinned::Word("none")) };
        let FilePinned::Word(word) = pinned.get_ref() else {
            return self.pinned(&["none"], mesh.vertices.len() as u64);
        };
        if word == "none" {
            return Ok(Pinned::Word("none"));
        }
        match pins::matching_vertices(word, mesh) {
            Ok(list) => Ok(Pinned::List(list)),
            Err(problem) => self.reader.error(pinned.span(), &self.name("pinned"), problem),
        }
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
