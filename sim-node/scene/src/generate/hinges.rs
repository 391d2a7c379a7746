//! The hinges of a mesh.

use glam::Vec3;

use super::builder::ConstraintBuilder;
use crate::constraints::bends::hinge::Hinge;
use crate::definition::bending::MeshBending;

/// The hinges of a mesh, ascending by edge: one at each edge of exactly two triangles.
#[derive(Debug, Clone, Default)]
pub(crate) struct Hinges {
    all: Vec<Hinge>,
    /// Factor k of their energy k B |C|^2 / (2 A), where A is the area of both triangles.
    stiffness: f64,
    /// Number of edges that have no hinge because one of their triangles is a line.
    pub(crate) omitted_count: usize,
}

impl Hinges {
    /// Finds the hinges of triangles with corners at these vertices.
    pub(crate) fn new(vertices: &[[f32; 3]], triangles: impl Iterator<Item = [u32; 3]>) -> Self {
        let mut hinges = Self::default();
        let mut test = PatchTest::default();
        let sides = sorted_sides(triangles);
        let position = |index: u32| Vec3::from_array(vertices[index as usize]).as_dvec3();
        for sides in sides.chunk_by(|one, next| one.edge == next.edge) {
            // Triangles with the same corners lie on each other.
            let [one, other] = sides else { continue };
            if one.corner == other.corner {
                continue;
            }
            let particles = [one.corner, one.edge[0], one.edge[1], other.corner];
            match Hinge::new(particles, particles.map(position)) {
                Some(hinge) => {
                    test.add(&hinge, [one, other].map(|side| side.triangle));
                    hinges.all.push(hinge);
                }
                None => hinges.omitted_count += 1,
            }
        }
        hinges.stiffness = test.stiffness();
        hinges
    }

    pub(crate) fn count(&self) -> u64 {
        self.all.len() as u64
    }

    /// Appends the bends to a model.
    pub(super) fn build(&self, bending: MeshBending, builder: &mut ConstraintBuilder<'_>) {
        for hinge in &self.all {
            let bend = hinge.bend(self.stiffness, bending.rest, bending.bending);
            builder.bend(bend);
        }
    }
}

/// A side of a triangle. The order is that of the fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    /// The ends, ascending.
    edge: [u32; 2],
    triangle: usize,
    /// The third corner of the triangle.
    corner: u32,
}

fn sorted_sides(triangles: impl Iterator<Item = [u32; 3]>) -> Vec<Side> {
    let sides = triangles.enumerate().flat_map(|(triangle, [a, b, c])| {
        [[a, b, c], [b, c, a], [c, a, b]].map(|[from, to, corner]| Side {
            edge: if from < to { [from, to] } else { [to, from] },
            triangle,
            corner,
        })
    });
    let mut sides: Vec<_> = sides.collect();
    sides.sort_unstable();
    sides
}

/// Compares the energy of the hinges with that of the surface, B / 2 for each unit of area on a cylinder of
/// the curvature 1, in the mean of two directions of its axis.
///
/// The energy with k = 3, as it is published, depends on the mesh: grids of right triangles have 2.4 to 9
/// times that of the surface. Only triangles with three hinges count, each with half of the energy of its
/// hinges, because the others lack a part of it.
#[derive(Debug, Default)]
struct PatchTest {
    /// By triangle.
    parts: Vec<Part>,
}

/// The part of a triangle in the energy of the hinges.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    hinge_count: u32,
    /// Half of the energies of its hinges / (k B / 2).
    energy: f64,
    area: f64,
}

impl PatchTest {
    fn add(&mut self, hinge: &Hinge, triangles: [usize; 2]) {
        let squares = hinge.squares_on_cylinders();
        for ((triangle, area), square) in triangles.into_iter().zip(hinge.areas()).zip(squares) {
            self.parts.resize(self.parts.len().max(triangle + 1), Part::default());
            let part = &mut self.parts[triangle];
            part.hinge_count += 1;
            part.energy += square / hinge.area() / 2.0;
            part.area = area;
        }
    }

    /// Returns k: 1 on grids, and where no triangle has three hinges.
    fn stiffness(&self) -> f64 {
        let whole = || self.parts.iter().filter(|part| part.hinge_count == 3);
        let energy: f64 = whole().map(|part| part.energy).sum();
        let area: f64 = whole().map(|part| part.area).sum();
        if energy > 0.0 { area / energy } else { 1.0 }
    }
}
