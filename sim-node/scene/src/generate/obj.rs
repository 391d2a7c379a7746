//! A mesh of triangles, quads and larger polygons, as a cloth.

use std::collections::BTreeSet;

use glam::{DQuat, Vec3};
use sim_types::{ConstraintKind, NumberRange};

use super::builder::{ConstraintBuilder, ParticleBuilder, round};
use super::hinges::Hinges;
use super::pinned::Pinned;
use crate::definition::bending::MeshBending;
use crate::fields::{At, Fields, SIZE, printed};
use crate::lists::{print_lists, print_points};
use crate::mesh::details::FaceDetails;
use crate::mesh::source::read_mesh;
use crate::mesh::{Mesh, area, edges, fan, pins};

/// A mesh of polygons. Vertices become particles, and edges become structural constraints. The
/// diagonals of quads, and those of larger faces from their first corner, become shear
/// constraints. Across each edge of exactly two faces, bends join the neighbouring corners; with a bending
/// rigidity, hinges take their place.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Obj {
    /// Positions of the particles.
    pub vertices: Vec<[f32; 3]>,
    /// Corners of each face, as indices of vertices.
    pub faces: Vec<Vec<u32>>,
    /// Mass per area in kg/unit^2. Without it, each particle has the generator's mass.
    pub density: Option<f32>,
    /// Bending rigidity, if it has any.
    pub bending: Option<MeshBending>,
    /// Texture coordinates and names of the faces, which exports write.
    pub details: FaceDetails,
}

impl Obj {
    /// Creates the shape of a mesh.
    pub fn new(mesh: Mesh, density: Option<f32>, bending: Option<MeshBending>) -> Self {
        let Mesh { vertices, faces, details, groups: _ } = mesh;
        Self { vertices, faces, density, bending, details }
    }

    /// Walks the keys of the mesh, but for the names of its faces.
    pub(super) fn fields(&mut self, fields: &mut Fields<'_>, pinned: &mut Pinned) {
        let problem_count = fields.problem_count();
        fields.value("vertices", &mut self.vertices, |_| None, |list| printed(&print_points(list)));
        let print = |list: &Vec<Vec<u32>>| printed(&print_lists(list.iter().map(Vec::as_slice)));
        fields.value("faces", &mut self.faces, |_| None, print);
        let mut mesh = read_mesh(fields, "path", Mesh::from_obj).unwrap_or_default();
        let is_read = fields.problem_count() == problem_count;
        scale(fields, &mut mesh);
        let read = |at: At<'_>| pinned_vertices(at, &mesh, is_read);
        fields.value("pinned", pinned, read, Pinned::print);
        place(fields, &mut mesh);
        if fields.reader().is_some() {
            (self.vertices, self.faces, self.details) = (mesh.vertices, mesh.faces, mesh.details);
        }
        fields.optional_number("density", &mut self.density, NumberRange::POSITIVE);
        MeshBending::walk(&mut self.bending, fields);
        let vertex_count = self.vertices.len();
        self.details.uv_fields(fields, vertex_count, Some(&self.faces).filter(|_| is_read));
        if fields.find("path").is_some() {
            FaceDetails::refuse(fields);
        }
    }

    /// Returns the indices of the texture coordinates of a face, one for each corner; none if it has none.
    pub fn face_uvs(&self, face: usize) -> &[u32] {
        let FaceDetails { uvs, face_uvs, .. } = &self.details;
        match face_uvs.get(face) {
            Some(corners) => corners,
            None if uvs.is_empty() => &[],
            None => &self.faces[face],
        }
    }

    pub(super) fn particle_count(&self) -> u64 {
        self.vertices.len() as u64
    }

    pub(super) fn constraint_count(&self) -> u64 {
        let mut count = 0;
        self.for_each_link(|_, _| count += 1);
        count
    }

    pub(super) fn build_particles(&self, builder: &mut ParticleBuilder<'_>) {
        let masses = self.density.map(|density| self.masses(f64::from(density)));
        for (index, vertex) in self.vertices.iter().enumerate() {
            if let Some(masses) = &masses {
                builder.mass = masses[index];
            }
            builder.particle(*vertex, |_| false);
        }
    }

    pub(super) fn build_constraints(&self, builder: &mut ConstraintBuilder<'_>) {
        self.for_each_link(|pair, kind| builder.link(pair, kind));
        for triangle in self.triangles() {
            builder.triangle(triangle);
        }
    }

    pub(super) fn bend_count(&self) -> u64 {
        if self.bending.is_some() { self.hinges().count() } else { 0 }
    }

    pub(super) fn build_bends(&self, builder: &mut ConstraintBuilder<'_>) {
        if let Some(bending) = self.bending {
            self.hinges().build(bending, builder);
        }
    }

    /// Returns the number of edges of two triangles that have no hinge, because one of the triangles has no height.
    pub fn missing_hinge_count(&self) -> usize {
        self.hinges().omitted_count
    }

    /// Returns the hinges between the triangles of the mesh.
    fn hinges(&self) -> Hinges {
        Hinges::new(&self.vertices, self.triangles())
    }

    pub(super) fn triangle_count(&self) -> u64 {
        self.faces.iter().map(|face| face.len().saturating_sub(2) as u64).sum()
    }

    fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.faces.iter().flat_map(|face| fan(face))
    }

    /// Returns the masses of the particles. Each triangle gives a third of its mass to each corner.
    fn masses(&self, density: f64) -> Vec<f32> {
        let mut masses = vec![0.0; self.vertices.len()];
        for triangle in self.triangles() {
            let corners = triangle.map(|corner| self.vertices[corner as usize].map(f64::from));
            for corner in triangle {
                masses[corner as usize] += density * area(corners) / 3.0;
            }
        }
        // A vertex whose triangles all have no area still needs a mass.
        masses
            .into_iter()
            .map(|mass| round(mass.max(f64::from(f32::MIN_POSITIVE) * 1e10)))
            .collect()
    }

    /// Visits edges face by face, then diagonals, then bends, unless hinges take their place. A pair occurs
    /// once, with the kind that comes first.
    fn for_each_link(&self, mut visit: impl FnMut([u32; 2], ConstraintKind)) {
        let mut seen = BTreeSet::new();
        let mut push = |[a, b]: [u32; 2], kind| {
            let pair = if a < b { [a, b] } else { [b, a] };
            if a != b && seen.insert(pair) {
                visit(pair, kind);
            }
        };
        for edge in self.faces.iter().flat_map(|face| edges(face)) {
            push(edge, ConstraintKind::Structural);
        }
        for face in &self.faces {
            for [first, second, third] in fan(face) {
                push([first, third], ConstraintKind::Shear);
                push([first, second], ConstraintKind::Shear);
            }
            if let [_, second, _, fourth] = face.as_slice() {
                push([*second, *fourth], ConstraintKind::Shear);
            }
        }
        if self.bending.is_some() {
            return;
        }
        let sides = self.sides();
        for sides_of_edge in sides.chunk_by(|one, next| one.edge == next.edge) {
            let [left, right] = sides_of_edge else { continue };
            for (from, to) in left.neighbours.into_iter().zip(right.neighbours) {
                push([from, to], ConstraintKind::Bend);
            }
        }
    }

    /// Returns the sides of all faces, ascending by edge.
    fn sides(&self) -> Vec<Side> {
        let mut sides = Vec::with_capacity(self.faces.iter().map(Vec::len).sum());
        for face in &self.faces {
            sides.extend((0..face.len()).map(|place| Side::new(face, place)));
        }
        sides.sort_unstable_by_key(|side| side.edge);
        sides
    }
}

/// Multiplies the vertices by the key `scale`.
fn scale(fields: &mut Fields<'_>, mesh: &mut Mesh) {
    let Some(at) = fields.get("scale") else { return };
    let Some(scale) = at.number(SIZE) else { return };
    for axis in mesh.vertices.as_flattened_mut() {
        *axis *= scale;
    }
    let range = NumberRange::COORDINATE;
    let far = mesh.vertices.as_flattened().iter().find(|axis| !range.contains(**axis));
    if let Some(axis) = far {
        at.error::<()>(format!("a vertex is at {axis} (allowed: {})", range.text));
    }
}

/// Turns the vertices by the key `rotation` about the mesh's own origin, and moves that to the key
/// `origin`.
fn place(fields: &mut Fields<'_>, mesh: &mut Mesh) {
    if let Some(rotation) = fields.get("rotation").and_then(|at| at.rotation()) {
        let rotation = DQuat::from_array(rotation.map(f64::from)).normalize();
        for vertex in &mut mesh.vertices {
            let turned = rotation * Vec3::from_array(*vertex).as_dvec3();
            *vertex = turned.as_vec3().to_array();
        }
    }
    if let Some(origin) = fields.get("origin").and_then(|at| at.vector()) {
        let origin = Vec3::from_array(origin);
        for vertex in &mut mesh.vertices {
            *vertex = (Vec3::from_array(*vertex) + origin).to_array();
        }
    }
}

/// Reads the pinned vertices of a scaled mesh that is not placed yet, so that all copies of a mesh
/// can have the same pins.
fn pinned_vertices(at: At<'_>, mesh: &Mesh, is_read: bool) -> Option<Pinned> {
    let count = Some(mesh.vertices.len() as u64).filter(|_| is_read);
    let Some(word) = at.as_text() else { return Pinned::read_list(at, count) };
    if word == "none" || !is_read {
        return Some(Pinned::Word("none"));
    }
    match pins::matching_vertices(word, mesh) {
        Ok(list) if list.is_empty() => {
            let (field, extent) = (at.field(), pins::extent(mesh));
            let warning = format!("{field} matches no particle of the shape ({extent})");
            at.reader.warnings.borrow_mut().push(warning);
            Some(Pinned::Word("none"))
        }
        Ok(list) => Some(Pinned::List(list)),
        Err(problem) => at.error(problem),
    }
}

/// An edge of a face. Across each edge of exactly two faces, bends join the neighbours that an end of the
/// edge has in the two faces. For two triangles, these are their third corners.
struct Side {
    /// The ends, ascending.
    edge: [u32; 2],
    /// By end: the next corner of the face away from the edge.
    neighbours: [u32; 2],
}

impl Side {
    /// Returns the side from the corner at a place of the face to the next one.
    fn new(face: &[u32], place: usize) -> Self {
        let corner = |offset| face[(place + offset) % face.len()];
        let (start, end) = (corner(0), corner(1));
        let (before, after) = (corner(face.len() - 1), corner(2));
        if start < end {
            Self { edge: [start, end], neighbours: [before, after] }
        } else {
            Self { edge: [end, start], neighbours: [after, before] }
        }
    }
}

#[cfg(test)]
mod tests {
    //! Bends of faces with many corners, against their number in closed form.
    use super::*;

    /// A quadratic search would take minutes.
    #[test]
    fn faces_with_as_many_corners_as_the_mesh_are_linked_in_time() {
        let count = 300_000;
        let corners: Vec<u32> = (0..count).collect();
        let backwards: Vec<u32> = corners.iter().rev().copied().collect();
        let vertices = vec![[0.0; 3]; corners.len()];
        let mesh = Mesh { vertices, faces: vec![corners, backwards], ..Mesh::default() };
        let obj = Obj::new(mesh, None, None);
        // n edges, n - 3 diagonals from the first corner of each face, of which the one between the two
        // first corners is an edge; no bends, because both faces have the same neighbours.
        let diagonals = 2 * (u64::from(count) - 3);
        assert_eq!(obj.constraint_count(), u64::from(count) + diagonals);
    }
}
