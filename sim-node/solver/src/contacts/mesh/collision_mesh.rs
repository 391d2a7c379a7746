//! A mesh that particles touch.

use glam::Vec3;
use sim_scene::collider_mesh::{corners, extents, sliver_height};
use sim_scene::scene::ColliderMesh;

use super::inside::{Inside, SurfacePoint};
use super::near::NearTriangles;
use super::tree::TriangleTree;
use super::triangle::Triangle;

/// The triangles of a mesh, ready for contacts. Immutable from load to load.
#[derive(Debug, Default)]
pub(crate) struct CollisionMesh {
    pub(super) tree: TriangleTree,
    /// Tells what is inside a solid. `None` for a mesh that is not solid.
    pub(super) inside: Option<Inside>,
    /// Index of the collider.
    pub(super) collider: usize,
    /// Largest coordinate on each axis.
    pub(super) extents: Vec3,
}

impl CollisionMesh {
    pub(crate) fn new(mesh: &ColliderMesh, collider: usize) -> Self {
        let height_min = sliver_height(&mesh.vertices);
        let corners = mesh.triangles.iter().map(|one| corners(&mesh.vertices, *one));
        let triangles = corners.filter_map(|one| Triangle::new(one, height_min)).collect();
        let (tree, order) = TriangleTree::new(triangles);
        let inside = mesh.is_solid.then(|| Inside::new(mesh, &order));
        Self { tree, inside, collider, extents: extents(&mesh.vertices) }
    }

    /// Prepares a solid for many steps.
    pub(crate) fn find_cells(&mut self) {
        if let Some(inside) = &mut self.inside {
            inside.find_cells(&self.tree);
        }
    }

    /// Returns the point of the surface of a solid that is nearest to a point. `tolerance` bounds the rounding of the
    /// point. `None` if the mesh is not solid.
    pub(super) fn surface_near(&self, point: Vec3, tolerance: f32) -> Option<SurfacePoint> {
        self.inside.as_ref()?.surface_near(&self.tree, point, tolerance)
    }

    /// True if a point is inside a solid. `near` are the triangles around it.
    pub(super) fn is_inside(&self, point: Vec3, near: &NearTriangles, tolerance: f32) -> bool {
        let is_inside = |inside: &Inside| inside.contains(&self.tree, point, near, tolerance);
        self.inside.as_ref().is_some_and(is_inside)
    }
}
