//! A mesh of triangles, quads and larger polygons, as a cloth.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use sim_types::ConstraintKind;

use super::builder::{Builder, round};
use crate::scene::definition::decimal;
use crate::scene::mesh::{Mesh, area, edges, fan};

/// A mesh of polygons. Vertices become particles, and edges become structural constraints. The
/// diagonals of quads, and those of larger faces from their first corner, become shear
/// constraints. Across each edge of exactly two faces, bends join the neighbouring corners.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Obj {
    /// Positions of the particles.
    #[serde(serialize_with = "decimal::vectors::serialize")]
    pub vertices: Vec<[f32; 3]>,
    /// Corners of each face, as indices of vertices.
    pub faces: Vec<Vec<u32>>,
    /// Mass per area in kg/unit^2. Without it, each particle has the generator's mass.
    #[serde(with = "decimal::optional", skip_serializing_if = "Option::is_none")]
    pub density: Option<f32>,
}

impl Obj {
    /// Creates the shape of a mesh.
    pub fn new(mesh: &Mesh, density: Option<f32>) -> Self {
        Self { vertices: mesh.vertices.clone(), faces: mesh.faces.clone(), density }
    }

    pub(super) fn particle_count(&self) -> u64 {
        self.vertices.len() as u64
    }

    pub(super) fn constraint_count(&self) -> u64 {
        self.links().len() as u64
    }

    pub(super) fn build(&self, builder: &mut Builder<'_>) {
        let masses = self.density.map(|density| self.masses(f64::from(density)));
        for (index, vertex) in self.vertices.iter().enumerate() {
            if let Some(masses) = &masses {
                builder.mass = masses[index];
            }
            builder.particle(*vertex, |_| false);
        }
        for (pair, kind) in self.links() {
            builder.link(pair, kind);
        }
        for triangle in self.faces.iter().flat_map(|face| fan(face)) {
            builder.triangle(triangle);
        }
    }

    /// Returns the masses of the particles. Each triangle gives a third of its mass to each corner.
    fn masses(&self, density: f64) -> Vec<f32> {
        let mut masses = vec![0.0; self.vertices.len()];
        for triangle in self.faces.iter().flat_map(|face| fan(face)) {
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

    /// Returns edges face by face, then diagonals, then bends. A pair occurs once, with the kind that
    /// comes first.
    fn links(&self) -> Vec<([u32; 2], ConstraintKind)> {
        let mut links = Vec::new();
        let mut seen = BTreeSet::new();
        let mut push = |[a, b]: [u32; 2], kind| {
            let pair = if a < b { [a, b] } else { [b, a] };
            if a != b && seen.insert(pair) {
                links.push((pair, kind));
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
        for pair in self.bends() {
            push(pair, ConstraintKind::Bend);
        }
        links
    }

    /// Returns the bends across each edge of exactly two faces. A bend joins the neighbours that an
    /// end of the edge has in the two faces. For two triangles, these are their third corners.
    fn bends(&self) -> Vec<[u32; 2]> {
        let faces: Vec<_> = self.faces.iter().map(|face| IndexedFace::new(face)).collect();
        let mut faces_at: BTreeMap<[u32; 2], Vec<&IndexedFace<'_>>> = BTreeMap::new();
        for face in &faces {
            for edge in edges(face.corners) {
                faces_at.entry(edge).or_default().push(face);
            }
        }
        let mut bends = Vec::new();
        for (edge, faces) in faces_at {
            let [left, right] = faces.as_slice() else { continue };
            for (end, other) in [(edge[0], edge[1]), (edge[1], edge[0])] {
                let from = left.other_neighbour(end, other);
                let to = right.other_neighbour(end, other);
                bends.extend(from.zip(to).map(|(from, to)| [from, to]));
            }
        }
        bends
    }
}

/// A face whose corners are found without a search through all of them: a face can have as many
/// corners as the mesh.
struct IndexedFace<'a> {
    corners: &'a [u32],
    /// Places of the corners, ascending by vertex, then by place.
    places: Vec<usize>,
}

impl<'a> IndexedFace<'a> {
    fn new(corners: &'a [u32]) -> Self {
        let mut places: Vec<_> = (0..corners.len()).collect();
        places.sort_by_key(|place| corners[*place]);
        Self { corners, places }
    }

    /// Returns the neighbour of a corner in the face that is not `other`. The first of equal corners
    /// counts.
    fn other_neighbour(&self, corner: u32, other: u32) -> Option<u32> {
        let Self { corners, places } = self;
        let index = places.partition_point(|place| corners[*place] < corner);
        let place = *places.get(index).filter(|place| corners[**place] == corner)?;
        let next = corners[(place + 1) % corners.len()];
        let previous = corners[(place + corners.len() - 1) % corners.len()];
        if next == other { Some(previous) } else { Some(next) }
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
        let obj = Obj { vertices, faces: vec![corners, backwards], density: None };
        // n edges, n - 3 diagonals from the first corner of each face, of which the one between the two
        // first corners is an edge; no bends, because both faces have the same neighbours.
        let diagonals = 2 * (u64::from(count) - 3);
        assert_eq!(obj.constraint_count(), u64::from(count) + diagonals);
    }
}
