//! A mesh of triangles, quads and more, as a cloth.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Serialize, Serializer};

use super::super::obj::{Mesh, area, edges, fan};
use super::{Builder, Pinned, round};
use sim_types::ConstraintKind;

/// A mesh: vertices are particles; the edges are structural; the diagonals of quads, and those of
/// bigger faces from their first corner, are shear; across
/// each edge of two faces, the corners beside it on both sides are joined by bends.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Obj {
    /// Positions.
    #[serde(serialize_with = "vertices")]
    pub vertices: Vec<[f32; 3]>,
    /// Corners of each face.
    pub faces: Vec<Vec<u32>>,
    /// In kg per area; without it each particle has the mass of the block.
    #[serde(serialize_with = "density", skip_serializing_if = "Option::is_none")]
    pub density: Option<f32>,
}

fn vertices<S: Serializer>(vertices: &[[f32; 3]], serializer: S) -> Result<S::Ok, S::Error> {
    let shortest = vertices.iter().map(|vertex| vertex.map(super::decimal::shortest));
    serializer.collect_seq(shortest)
}

#[allow(clippy::ref_option, clippy::trivially_copy_pass_by_ref, reason = "as serde asks for")]
fn density<S: Serializer>(density: &Option<f32>, serializer: S) -> Result<S::Ok, S::Error> {
    super::decimal::optional::serialize(density, serializer)
}

impl Obj {
    /// The mesh as a cloth.
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
        for (index, vertex) in (0_u32..).zip(&self.vertices) {
            let is_pinned = match builder.pinned() {
                Pinned::Word(_) => false,
                Pinned::List(list) => list.binary_search(&index).is_ok(),
            };
            match &masses {
                Some(masses) => builder.heavy_particle(*vertex, is_pinned, masses[index as usize]),
                None => builder.particle(*vertex, is_pinned),
            }
        }
        for (pair, kind) in self.links() {
            builder.link(pair, kind);
        }
        for triangle in self.faces.iter().flat_map(|face| fan(face)) {
            builder.triangle(triangle);
        }
    }

    /// A third of the mass of each triangle goes to each of its corners.
    fn masses(&self, density: f64) -> Vec<f32> {
        let mut masses = vec![0.0; self.vertices.len()];
        for triangle in self.faces.iter().flat_map(|face| fan(face)) {
            let corners = triangle.map(|corner| self.vertices[corner as usize].map(f64::from));
            for corner in triangle {
                masses[corner as usize] += density * area(corners) / 3.0;
            }
        }
        // A corner of triangles without area only still has to have a mass.
        masses
            .into_iter()
            .map(|mass| round(mass.max(f64::from(f32::MIN_POSITIVE) * 1e10)))
            .collect()
    }

    /// Edges face by face, then diagonals, then bends; each pair once, as what it is first.
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

    /// Across each edge of exactly two faces: from the neighbour of each of its ends in the one to
    /// that in the other; for two triangles, both are their third corners.
    fn bends(&self) -> Vec<[u32; 2]> {
        let mut faces_at: BTreeMap<[u32; 2], Vec<&[u32]>> = BTreeMap::new();
        for face in &self.faces {
            for edge in edges(face) {
                faces_at.entry(edge).or_default().push(face);
            }
        }
        let mut bends = Vec::new();
        for (edge, faces) in faces_at {
            let [left, right] = faces.as_slice() else { continue };
            for (end, other) in [(edge[0], edge[1]), (edge[1], edge[0])] {
                let (from, to) = (beside(left, end, other), beside(right, end, other));
                bends.extend(from.zip(to).map(|(from, to)| [from, to]));
            }
        }
        bends
    }
}

/// The neighbour of a corner in a face that is not `other`.
fn beside(face: &[u32], corner: u32, other: u32) -> Option<u32> {
    let place = face.iter().position(|index| *index == corner)?;
    let next = face[(place + 1) % face.len()];
    let previous = face[(place + face.len() - 1) % face.len()];
    if next == other { Some(previous) } else { Some(next) }
}
