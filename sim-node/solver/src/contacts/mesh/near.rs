//! Memory of the triangles near particles, so that they are not searched in every substep.
//!
//! It is no state: a list holds all triangles that its particle can touch, and the others are not touched.

use std::ops::ControlFlow;

use glam::Vec3;

use super::tree::{NearestTriangle, TriangleTree};
use crate::contacts::bounds::Bounds;

/// Largest number of triangles in a list. With more, each contact searches the tree.
const LISTED_MAX: usize = 32;
/// Largest number of lists of a worker: 22 MiB.
const LISTS_MAX: usize = 1 << 17;

/// The triangles in a box, or more.
#[derive(Debug, Clone)]
pub(crate) struct NearTriangles {
    /// In the frame of the mesh.
    bounds: Bounds,
    indices: [u32; LISTED_MAX],
    /// None if there are too many of them.
    count: Option<u32>,
}

impl NearTriangles {
    fn none_in(bounds: Bounds) -> Self {
        Self { bounds, indices: [0; LISTED_MAX], count: Some(0) }
    }

    fn push(&mut self, triangle: u32) -> ControlFlow<()> {
        match self.count {
            Some(count) if (count as usize) < LISTED_MAX => {
                self.indices[count as usize] = triangle;
                self.count = Some(count + 1);
                ControlFlow::Continue(())
            }
            _ => ControlFlow::Break(()),
        }
    }

    /// True if no path in the box can touch a triangle.
    pub(crate) fn are_none(&self) -> bool {
        self.count == Some(0)
    }

    /// Returns the triangles, ascending, or `None` if there are too many of them.
    pub(super) fn listed(&self) -> Option<&[u32]> {
        self.count.map(|count| &self.indices[..count as usize])
    }

    /// Returns the triangle of the mesh that is nearest to a point, if it is certainly one of these: all others are beyond
    /// the box.
    pub(super) fn nearest(&self, tree: &TriangleTree, point: Vec3) -> Option<NearestTriangle> {
        let distance = self.bounds.depth_of(point.to_array());
        let triangles = self.listed().filter(|_| distance > 0.0)?;
        tree.nearest_of(triangles, point, distance)
    }
}

/// The lists of a worker, each in a place that the number of the particle gives.
#[derive(Debug, Clone, Default)]
pub(crate) struct NearMeshes {
    /// A power of two.
    lists: Vec<List>,
}

#[derive(Debug, Clone)]
struct List {
    collider: usize,
    triangles: NearTriangles,
}

impl NearMeshes {
    /// Makes room for a number of particles; 0 in a scene without meshes.
    pub(crate) fn new(particle_count: usize) -> Self {
        let empty = List { collider: 0, triangles: NearTriangles::none_in(Bounds::EMPTY) };
        let count = if particle_count > 0 { particle_count.next_power_of_two() } else { 0 };
        Self { lists: vec![empty; count.min(LISTS_MAX)] }
    }

    /// Returns the triangles that the particle of a query can touch.
    pub(super) fn find(&mut self, tree: &TriangleTree, query: &NearQuery) -> &NearTriangles {
        let NearQuery { collider, particle, bounds, margin } = *query;
        // Meshes that a particle is near have different places.
        let place = (particle + collider * 0x9e37_79b1) & (self.lists.len() - 1);
        let list = &mut self.lists[place];
        if list.collider != collider || !list.triangles.bounds.contains_box(&bounds) {
            let bounds = bounds.grown(margin);
            *list = List { collider, triangles: NearTriangles::none_in(bounds) };
            let triangles = &mut list.triangles;
            let found = tree.search(&bounds, &mut |index| {
                let is_near = tree.triangles[index as usize].meets(&bounds);
                if is_near { triangles.push(index) } else { ControlFlow::Continue(()) }
            });
            if found.is_break() {
                triangles.count = None;
            }
        }
        &list.triangles
    }
}

/// The place of a particle near a mesh.
#[derive(Debug, Clone, Copy)]
pub(super) struct NearQuery {
    pub(super) collider: usize,
    pub(super) particle: usize,
    /// Box in which the triangles lie that it can touch, in the frame of the mesh.
    pub(super) bounds: Bounds,
    /// Distance by which a new list exceeds the box.
    pub(super) margin: f32,
}
