//! The shape "obj": a mesh as a cloth.

use sim_types::NumberRange;

use super::fields::GeneratorFields;
use super::file::FilePinned;

use super::super::mesh::MeshKeys;
use super::super::reader::SIZE;
use crate::scene::error::SceneError;
use crate::scene::generate::obj::Obj;
use crate::scene::generate::pinned::Pinned;
use crate::scene::generate::{Generator, Shape};
use crate::scene::mesh::{Mesh, pins};

impl GeneratorFields<'_, '_> {
    /// Checks the keys of the shape "obj".
    pub(super) fn obj(&self) -> Result<Generator, SceneError> {
        let file = self.file;
        let mesh = self.reader.mesh(&MeshKeys {
            path: file.path.as_ref(),
            vertices: file.vertices.as_ref(),
            faces: file.faces.as_ref(),
            span: self.span.clone(),
            field: &|key| self.name(key),
            parse: Mesh::from_obj,
        })?;
        let mesh = self.scaled(mesh)?;
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

    /// Multiplies the vertices by the key `scale`.
    fn scaled(&self, mut mesh: Mesh) -> Result<Mesh, SceneError> {
        let Some(number) = &self.file.scale else { return Ok(mesh) };
        let field = self.name("scale");
        let scale = self.reader.ranged(&field, number, SIZE)?;
        for axis in mesh.vertices.as_flattened_mut() {
            *axis *= scale;
            if !NumberRange::COORDINATE.contains(*axis) {
                let problem =
                    format!("a vertex is at {axis} (allowed: {})", NumberRange::COORDINATE.text);
                return self.reader.error(number.span(), &field, problem);
            }
        }
        Ok(mesh)
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
