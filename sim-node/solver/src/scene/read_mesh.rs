//! From the keys of a mesh to a checked one.

use toml::Spanned;

use super::SceneError;
use super::check::Range32;
use super::file::{FileGenerator, FilePinned, Vector};
use super::generate::{Generator, Obj, Pinned, Shape};
use super::obj::Mesh;
use super::pins;
use super::read_generator::Fields;

impl Fields<'_, '_> {
    /// A mesh from a file, or written out.
    pub(super) fn obj(&self, file: &FileGenerator) -> Result<Generator, SceneError> {
        let mesh = match (&file.path, &file.vertices) {
            (Some(path), None) => self.mesh_of_file(path)?,
            (None, Some(vertices)) => self.written_mesh(vertices, file)?,
            _ => {
                let problem = "needs a path, or vertices and faces (allowed: one of both)";
                return self.reader.error(
                    self.shape.span(),
                    &self.name("path"),
                    problem.to_owned(),
                );
            }
        };
        let density = match &file.density {
            Some(number) => {
                Some(self.reader.ranged(&self.name("density"), number, Range32::POSITIVE)?)
            }
            None => None,
        };
        let pinned = match &file.pinned {
            None => Pinned::Word("none"),
            Some(pinned) => self.pinned_vertices(pinned, &mesh)?,
        };
        Ok(Generator {
            shape: Shape::Obj(Obj::new(&mesh, density)),
            mass: self.reader.mass(&self.name("mass"), file.mass.as_ref())?,
            pinned,
            tear_stretch: self.tear_stretch(file)?,
            softness: self.softness(file)?,
        })
    }

    fn mesh_of_file(&self, path: &Spanned<String>) -> Result<Mesh, SceneError> {
        let name = path.get_ref();
        let read = (self.reader.read_file)(name).and_then(|text| Mesh::from_obj(&text));
        match read {
            Ok(read) => {
                let findings = read.findings.iter().map(|finding| format!("{name}: {finding}"));
                self.reader.findings.borrow_mut().extend(findings);
                Ok(read.mesh)
            }
            Err(problem) => {
                let problem = format!("{name}: {problem} (allowed: a readable OBJ file)");
                self.reader.error(path.span(), &self.name("path"), problem)
            }
        }
    }

    fn written_mesh(
        &self,
        vertices: &Spanned<Vec<Vector>>,
        file: &FileGenerator,
    ) -> Result<Mesh, SceneError> {
        let faces = self.required("faces", file.faces.as_ref())?;
        let count = vertices.get_ref().len();
        for (place, face) in faces.get_ref().iter().enumerate() {
            let mut corners = face.clone();
            corners.sort_unstable();
            let is_face = corners.len() >= 3
                && corners.windows(2).all(|pair| pair[0] != pair[1])
                && corners.last().is_none_or(|last| (*last as usize) < count);
            if !is_face {
                let problem = format!(
                    "face {place} is none: {face:?} (allowed: 3 or more different vertices below \
                     {count})"
                );
                return self.reader.error(faces.span(), &self.name("faces"), problem);
            }
        }
        let positions: Result<Vec<_>, _> = (vertices.get_ref().iter())
            .map(|vertex| self.reader.vector(&self.name("vertices"), vertex))
            .collect();
        Ok(Mesh { vertices: positions?, faces: faces.get_ref().clone(), ..Mesh::default() })
    }

    fn pinned_vertices(
        &self,
        pinned: &Spanned<FilePinned>,
        mesh: &Mesh,
    ) -> Result<Pinned, SceneError> {
        match pinned.get_ref() {
            FilePinned::Word(word) if word != "none" => match pins::vertices(word, mesh) {
                Ok(list) => Ok(Pinned::List(list)),
                Err(problem) => self.reader.error(pinned.span(), &self.name("pinned"), problem),
            },
            _ => self.pinned(pinned, &["none"], mesh.vertices.len() as u64),
        }
    }
}
