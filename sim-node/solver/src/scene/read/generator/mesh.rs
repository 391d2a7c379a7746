//! The shape "obj": a mesh as a cloth.

use glam::{DQuat, Vec3};
use sim_types::NumberRange;

use super::fields::GeneratorFields;
use super::file::{FileNameRun, FilePinned};

use super::super::mesh::MeshKeys;
use super::super::reader::SIZE;
use super::super::value::{Spanned, Table};
use crate::scene::error::SceneError;
use crate::scene::generate::obj::Obj;
use crate::scene::generate::pinned::Pinned;
use crate::scene::generate::{Generator, Shape};
use crate::scene::mesh::details::{FaceDetails, NameRun};
use crate::scene::mesh::{Mesh, pins};

impl GeneratorFields<'_, '_> {
    /// Checks the keys of the shape "obj".
    pub(super) fn obj(&self) -> Result<Generator, SceneError> {
        let file = self.file;
        let mut mesh = self.reader.mesh(&MeshKeys {
            path: file.path.as_ref(),
            vertices: file.vertices.as_ref(),
            faces: file.faces.as_ref(),
            span: self.span.clone(),
            field: &|key| self.name(key),
            parse: Mesh::from_obj,
        })?;
        self.read_details(&mut mesh)?;
        self.scale(&mut mesh)?;
        let pinned = self.pinned_vertices(&mesh)?;
        self.place(&mut mesh)?;
        let density = file
            .density
            .as_ref()
            .map(|number| self.reader.ranged(&self.name("density"), number, NumberRange::POSITIVE));
        let density = density.transpose()?;
        Ok(Generator {
            mass: self.mass()?,
            pinned,
            shape: Shape::Obj(Obj::new(mesh, density, self.mesh_bending()?)),
            tear_stretch: self.tear_stretch()?,
            contact: self.file.contact.unwrap_or(true),
            softness: self.softness()?,
        })
    }

    /// Multiplies the vertices by the key `scale`.
    fn scale(&self, mesh: &mut Mesh) -> Result<(), SceneError> {
        let Some(number) = &self.file.scale else { return Ok(()) };
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
        Ok(())
    }

    /// Turns the vertices by the key `rotation` about the mesh's own origin, and moves that to the key
    /// `origin`.
    fn place(&self, mesh: &mut Mesh) -> Result<(), SceneError> {
        let file = self.file;
        if let Some(rotation) = &file.rotation {
            let rotation = self.reader.rotation(&self.name("rotation"), Some(rotation))?;
            let rotation = DQuat::from_array(rotation.map(f64::from)).normalize();
            for vertex in &mut mesh.vertices {
                let turned = rotation * Vec3::from_array(*vertex).as_dvec3();
                *vertex = turned.as_vec3().to_array();
            }
        }
        if let Some(origin) = &file.origin {
            let origin = Vec3::from_array(self.reader.vector(&self.name("origin"), origin)?);
            for vertex in &mut mesh.vertices {
                *vertex = (Vec3::from_array(*vertex) + origin).to_array();
            }
        }
        Ok(())
    }

    /// Returns the pinned vertices of a scaled mesh that is not placed yet, so that all copies of a mesh
    /// can have the same pins.
    fn pinned_vertices(&self, mesh: &Mesh) -> Result<Pinned, SceneError> {
        let Some(pinned) = &self.file.pinned else { return Ok(Pinned::Word("none")) };
        let FilePinned::Word(word) = pinned.get_ref() else {
            return self.pinned(&["none"], mesh.vertices.len() as u64);
        };
        if word == "none" {
            return Ok(Pinned::Word("none"));
        }
        match pins::matching_vertices(word, mesh) {
            Ok(list) if list.is_empty() => {
                let (field, extent) = (self.name("pinned"), pins::extent(mesh));
                let warning = format!("{field} matches no particle of the shape ({extent})");
                self.reader.warnings.borrow_mut().push(warning);
                Ok(Pinned::Word("none"))
            }
            Ok(list) => Ok(Pinned::List(list)),
            Err(problem) => self.reader.error(pinned.span(), &self.name("pinned"), problem),
        }
    }

    /// Reads texture coordinates and names of a mesh that is written out.
    fn read_details(&self, mesh: &mut Mesh) -> Result<(), SceneError> {
        let file = self.file;
        let spans = [
            ("uvs", file.uvs.as_ref().map(Spanned::span)),
            ("face_uvs", file.face_uvs.as_ref().map(Spanned::span)),
            ("groups", file.groups.as_ref().map(Spanned::span)),
            ("materials", file.materials.as_ref().map(Spanned::span)),
        ];
        let mut given = spans.into_iter().filter_map(|(key, span)| Some((key, span?)));
        let Some((key, span)) = given.next() else { return Ok(()) };
        if file.path.is_some() {
            let problem =
                "the file of the mesh has its own (allowed: together with vertices and faces)";
            return self.reader.error(span, &self.name(key), problem);
        }
        let uvs = self.uvs()?;
        let face_uvs = self.face_uvs(&uvs, mesh)?;
        let count = mesh.faces.len();
        let runs = |key, runs: &Option<Spanned<Vec<_>>>| match runs {
            Some(runs) => self.name_runs(key, runs.get_ref(), count),
            None => Ok(Vec::new()),
        };
        let groups = runs("groups", &file.groups)?;
        let materials = runs("materials", &file.materials)?;
        mesh.details = FaceDetails { uvs, face_uvs, groups, materials };
        Ok(())
    }

    fn uvs(&self) -> Result<Vec<[f32; 2]>, SceneError> {
        let Some(uvs) = &self.file.uvs else { return Ok(Vec::new()) };
        let field = self.name("uvs");
        let uv = |pair: &Spanned<_>| self.reader.pair(&field, pair);
        uvs.get_ref().iter().map(uv).collect()
    }

    /// Returns the indices of texture coordinates by face.
    fn face_uvs(&self, uvs: &[[f32; 2]], mesh: &Mesh) -> Result<Vec<Vec<u32>>, SceneError> {
        let file = self.file;
        let Some(lists) = &file.face_uvs else {
            return match &file.uvs {
                Some(list) if uvs.len() != mesh.vertices.len() => {
                    let (count, expected) = (uvs.len(), mesh.vertices.len());
                    let problem = format!(
                        "has {count} entries without face_uvs (allowed: {expected}, one for each vertex)"
                    );
                    self.reader.error(list.span(), &self.name("uvs"), problem)
                }
                _ => Ok(Vec::new()),
            };
        };
        let wrong = |problem| self.reader.error(lists.span(), &self.name("face_uvs"), problem);
        let lists = lists.get_ref();
        if lists.len() != mesh.faces.len() {
            let (count, expected) = (lists.len(), mesh.faces.len());
            return wrong(format!("has {count} entries (allowed: {expected}, one for each face)"));
        }
        let mut checked = Vec::with_capacity(lists.len());
        for (place, (list, face)) in lists.iter().zip(&mesh.faces).enumerate() {
            let index =
                |one: &i64| u32::try_from(*one).ok().filter(|one| (*one as usize) < uvs.len());
            match list.iter().map(index).collect::<Option<Vec<_>>>() {
                Some(uvs) if uvs.is_empty() || uvs.len() == face.len() => checked.push(uvs),
                _ => {
                    return wrong(format!(
                        "face {place} is {list:?} (allowed: none, or {} numbers below {})",
                        face.len(),
                        uvs.len()
                    ));
                }
            }
        }
        Ok(checked)
    }

    /// Checks the names of faces. Their first faces ascend.
    fn name_runs(
        &self,
        key: &str,
        runs: &[Spanned<Table<FileNameRun>>],
        face_count: usize,
    ) -> Result<Vec<NameRun>, SceneError> {
        let mut checked: Vec<NameRun> = Vec::with_capacity(runs.len());
        for (place, run) in runs.iter().enumerate() {
            let field = |part: &str| self.name(&format!("{key}[{place}].{part}"));
            let FileNameRun { name, first } = &**run.get_ref();
            let name = self.reader.required(
                name.as_ref(),
                run.span(),
                &field("name"),
                "a line of text",
            )?;
            if name.get_ref().chars().any(char::is_control) {
                let problem = "has control characters (allowed: a line of text)";
                return self.reader.error(name.span(), &field("name"), problem);
            }
            let file_first =
                self.reader.required(first.as_ref(), run.span(), &field("first"), "a face")?;
            let least = checked.last().map_or(0, |run| run.first + 1);
            let most = u32::try_from(face_count).unwrap_or(u32::MAX).saturating_sub(1);
            let first = self.reader.whole(&field("first"), file_first, least..=most)?;
            checked.push(NameRun { name: name.get_ref().clone(), first });
        }
        Ok(checked)
    }
}
