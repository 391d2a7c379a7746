//! The faces of a recording's surface: those of its meshes as they were imported, and triangles elsewhere.

use std::ops::Range;

use recording::SceneState;
use sim_contract::Triangle;
use sim_solver::Scene;
use sim_solver::scene::{NameRun, Obj, Shape};

use crate::export::snapshots::Snapshots;

/// A face of the surface.
#[derive(Debug)]
pub(super) struct Face {
    /// The particles at its corners, in order.
    pub(super) corners: Vec<u32>,
    /// By corner: an index of [`Faces::uvs`]; empty without texture coordinates.
    pub(super) uvs: Vec<u32>,
    /// An index of [`Faces::groups`].
    pub(super) group: Option<u32>,
    /// An index of [`Faces::materials`].
    pub(super) material: Option<u32>,
    /// Its triangles in `/surface`.
    triangles: Range<usize>,
}

/// All faces, in the order of `/surface`.
#[derive(Debug, Default)]
pub(super) struct Faces {
    pub(super) all: Vec<Face>,
    /// Texture coordinates of all meshes.
    pub(super) uvs: Vec<[f32; 2]>,
    /// Names of groups. Groups of the same name in several meshes are one.
    pub(super) groups: Vec<String>,
    /// Names of materials.
    pub(super) materials: Vec<String>,
}

impl Faces {
    pub(super) fn of(snapshots: &Snapshots<'_>) -> anyhow::Result<Self> {
        Ok(Self::new(snapshots.scene, &snapshots.first()?.triangles))
    }

    fn new(scene: Option<&Scene>, triangles: &[Triangle]) -> Self {
        let mut faces = Self::default();
        let mut next = 0;
        for (shape, particles) in scene.into_iter().flat_map(Scene::shapes) {
            let Shape::Obj(mesh) = shape else { continue };
            let is_before = |one: &&Triangle| u64::from(one.corners[0]) < particles.start;
            let before = triangles[next..].iter().take_while(is_before).count();
            faces.add_triangles(next..next + before, triangles);
            let first = u32::try_from(particles.start).unwrap_or(u32::MAX);
            next = faces.add_mesh(mesh, first, next + before, triangles);
        }
        faces.add_triangles(next..triangles.len(), triangles);
        faces
    }

    fn add_triangles(&mut self, range: Range<usize>, triangles: &[Triangle]) {
        for index in range {
            let corners = triangles[index].corners.to_vec();
            let triangles = index..index + 1;
            self.all.push(Face {
                corners,
                uvs: Vec::new(),
                group: None,
                material: None,
                triangles,
            });
        }
    }

    /// Adds the faces of a mesh that begins at a particle and a triangle, as far as their triangles are those
    /// of the recording. Returns the place behind these.
    fn add_mesh(
        &mut self,
        mesh: &Obj,
        first_particle: u32,
        mut next: usize,
        triangles: &[Triangle],
    ) -> usize {
        let first_uv = u32::try_from(self.uvs.len()).unwrap_or(u32::MAX);
        self.uvs.extend_from_slice(&mesh.details.uvs);
        for (index, corners) in mesh.faces.iter().enumerate() {
            let corners: Vec<_> = corners.iter().map(|corner| first_particle + corner).collect();
            let parts = (1..corners.len() - 1)
                .map(|corner| [corners[0], corners[corner], corners[corner + 1]]);
            let range = next..next + corners.len() - 2;
            let recorded = triangles.get(range.clone()).unwrap_or_default();
            if !recorded.iter().map(|one| one.corners).eq(parts) {
                break;
            }
            next = range.end;
            let uvs = mesh.face_uvs(index).iter().map(|uv| first_uv + uv).collect();
            let name = |runs| NameRun::of_face(runs, index);
            let (group, material) = (name(&mesh.details.groups), name(&mesh.details.materials));
            self.all.push(Face {
                corners,
                uvs,
                group: group.map(|name| number(&mut self.groups, name)),
                material: material.map(|name| number(&mut self.materials, name)),
                triangles: range,
            });
        }
        next
    }

    /// Returns the indices of the faces whose triangles are all intact.
    pub(super) fn intact(&self, state: &SceneState) -> Vec<u32> {
        let mut is_intact = vec![false; state.triangles.len()];
        for (triangle, _) in state.intact_triangles() {
            is_intact[triangle] = true;
        }
        let whole = |face: &Face| {
            is_intact.get(face.triangles.clone()).is_some_and(|parts| parts.iter().all(|one| *one))
        };
        (0..).zip(&self.all).filter(|(_, face)| whole(face)).map(|(index, _)| index).collect()
    }
}

/// Returns the number of a name, which is added if it is new.
fn number(names: &mut Vec<String>, name: &str) -> u32 {
    // The faces of a name follow each other, so the last name is the usual one.
    let known = names.iter().rposition(|known| known == name).unwrap_or_else(|| {
        names.push(name.to_owned());
        names.len() - 1
    });
    u32::try_from(known).unwrap_or(u32::MAX)
}
