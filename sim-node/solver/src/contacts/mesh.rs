//! Contacts with meshes.
//!
//! In each substep, the path of a particle in the moving frame of the mesh is tested against the triangles near
//! it. The particle stays on the side on which the path starts, so open and
//! thin meshes work like closed ones, and no state is kept between substeps. Where it cannot be pushed
//! off all triangles, it stays where the path starts, in the frame of the mesh.
//!
//! A solid mesh also has an inside. A particle there leaves it at the nearest point of the surface.

mod cells;
pub(crate) mod collision_mesh;
pub(crate) mod inside;
pub(crate) mod near;
mod tree;
mod triangle;

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::Vec3;
use sim_scene::collider_mesh::TOLERANCE;

use super::bounds::Bounds;
use super::hit::Hit;
use super::path::SubstepPath;
use super::placed_frame::PlacedFrame;
use super::zone::Zone;
use collision_mesh::CollisionMesh;
use inside::SurfacePoint;
use near::{NearMeshes, NearQuery, NearTriangles};
pub(crate) use triangle::MeshPath;
use triangle::{Gap, Touch, Triangle};

/// Least distance that particles keep from a mesh, in tolerances. It exceeds the rounding of a
/// particle on the surface, so that its side is certain.
const SKIN: f32 = 8.0;
/// Length of a push that the surroundings allow for, relative to that of the path. Most paths run along the mesh and
/// are pushed less.
const PUSH_SHARE: f32 = 0.25;
/// Number of further substeps for which triangles near a particle are listed.
const SUBSTEPS_AHEAD: f32 = 4.0;
/// Largest number of pushes of a particle in a substep. A particle in a wedge comes nearer to both sides
/// with each.
pub(crate) const PUSHES_MAX: usize = 8;

/// A mesh in a substep.
#[derive(Debug, Clone)]
pub(crate) struct PlacedMesh {
    mesh: Arc<CollisionMesh>,
    before: PlacedFrame,
    now: PlacedFrame,
    gap: Gap,
}

impl PlacedMesh {
    /// Places a mesh at its frames at the start and the end of a substep. Particles keep `distance`,
    /// but at least the skin.
    pub(crate) fn new(
        mesh: Arc<CollisionMesh>,
        [before, now]: [PlacedFrame; 2],
        distance: f32,
    ) -> Self {
        let tolerance = TOLERANCE * reach(&mesh, [&before, &now]);
        let skin = SKIN * tolerance;
        let distance = if distance > skin { distance } else { skin };
        Self { mesh, before, now, gap: Gap { distance, tolerance } }
    }

    /// Zone outside of which no path comes near a triangle.
    pub(crate) fn zone(&self) -> Zone {
        let Self { mesh, before, now, gap } = self;
        let is_turned = now.is_turned || before.is_turned;
        let extents = if is_turned { Vec3::splat(mesh.extents.length()) } else { mesh.extents };
        let distance = extents + Vec3::splat(gap.distance + gap.tolerance);
        Zone::around([now.center, before.center], distance, self.reach())
    }

    /// Magnitude of its coordinates, which bounds their rounding.
    pub(crate) fn reach(&self) -> f32 {
        reach(&self.mesh, [&self.before, &self.now])
    }

    /// Bound on the rounding of a depth.
    pub(crate) fn rounding(&self) -> f32 {
        self.gap.tolerance
    }

    /// Returns a path in the moving frame of the mesh.
    #[inline(always)]
    pub(crate) fn path(&self, path: &SubstepPath) -> MeshPath {
        let start = self.before.local(path.start);
        // Exactly 0 for a mesh at rest.
        let shift = self.now.local(path.start) - start;
        let motion = shift + self.now.to_local(path.displacement);
        let rounding = TOLERANCE * (start.abs().element_sum() + motion.abs().element_sum());
        MeshPath { start, motion, rounding }
    }

    /// Finds the surroundings of a path of a particle, also after some pushes. The number names the particle.
    pub(crate) fn surroundings<'a>(
        &self,
        lists: &'a mut NearMeshes,
        particle: usize,
        path: &MeshPath,
    ) -> Surroundings<'a> {
        let length = path.motion.dot(path.motion).sqrt();
        let bounds = Bounds::around([path.start.to_array(), path.end().to_array()]);
        let rounding = self.gap.tolerance + 2.0 * path.rounding;
        let ends = bounds.grown(PUSH_SHARE * length + rounding);
        let query = NearQuery {
            collider: self.mesh.collider,
            particle,
            bounds: self.search_box(&ends),
            margin: SUBSTEPS_AHEAD * length + self.gap.tolerance,
        };
        let triangles = lists.find(&self.mesh.tree, &query);
        let starts_inside = self.mesh.is_inside(path.start, triangles, self.gap.tolerance);
        Surroundings { ends, triangles, starts_inside }
    }

    /// Returns the depth of a point inside a solid, or `None` if it is outside or the mesh is not solid.
    pub(crate) fn depth(&self, point: Vec3) -> Option<f32> {
        let point = self.now.local(point);
        let SurfacePoint { height, .. } = self.mesh.surface_near(point, self.gap.tolerance)?;
        (height < 0.0).then_some(-height)
    }

    /// Finds what stops a path after this number of pushes, or `None` if nothing does.
    pub(crate) fn stop(
        &self,
        path: &MeshPath,
        around: &Surroundings<'_>,
        push_count: usize,
    ) -> Option<Stop> {
        if around.starts_inside {
            return self.way_out(path, push_count).map(Stop::Push);
        }
        let is_resolved = |touch: &Touch| match push_count {
            0 => true,
            PUSHES_MAX => touch.is_passage(),
            _ => touch.is_clear(self.gap),
        };
        let mut first: Option<Touch> = None;
        self.for_each(around, |triangle| {
            if let Some(touch) = triangle.touch(path, self.gap).filter(&is_resolved)
                && first.is_none_or(|first| touch.is_before(&first))
            {
                first = Some(touch);
            }
        });
        let Touch { normal, depth, .. } = first?;
        let hit = Hit { normal: self.now.unit_to_scene(normal), depth };
        Some(if push_count == PUSHES_MAX { Stop::Hold } else { Stop::Push(hit) })
    }

    /// Finds where a particle leaves the solid in which its path starts. Returns `None` after the last push.
    fn way_out(&self, path: &MeshPath, push_count: usize) -> Option<Hit> {
        let SurfacePoint { normal, height } =
            self.mesh.surface_near(path.end(), self.gap.tolerance)?;
        let depth = self.gap.distance - height;
        let depth_min = if push_count == 0 { 0.0 } else { self.gap.tolerance };
        let is_pushed = push_count < PUSHES_MAX && depth > depth_min;
        is_pushed.then(|| Hit { normal: self.now.unit_to_scene(normal), depth })
    }

    /// Displacement of a particle that stays where its path starts, in the frame of the mesh.
    pub(crate) fn held_displacement(&self, start: Vec3) -> Vec3 {
        self.now.to_scene(self.before.local(start) - self.now.local(start))
    }

    /// The box in which the triangles lie that paths with these ends can touch.
    fn search_box(&self, ends: &Bounds) -> Bounds {
        ends.grown(self.gap.distance + self.gap.tolerance)
    }

    fn for_each(&self, around: &Surroundings<'_>, mut visit: impl FnMut(&Triangle)) {
        let tree = &self.mesh.tree;
        let mut visit_index = |index: u32| visit(&tree.triangles[index as usize]);
        match around.triangles.listed() {
            Some(indices) => indices.iter().copied().for_each(visit_index),
            None => {
                let _all = tree.search(&self.search_box(&around.ends), &mut |index| {
                    visit_index(index);
                    ControlFlow::Continue(())
                });
            }
        }
    }
}

/// An obstacle in a path.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Stop {
    /// A triangle, off which the particle is pushed.
    Push(Hit),
    /// Triangles that leave it no room to go on.
    Hold,
}

/// The surroundings of the paths of a particle in a substep.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    /// The box in which a path ends, also after some pushes. So the triangles that the particle can touch are known
    /// before the first one.
    ends: Bounds,
    triangles: &'a NearTriangles,
    /// True if the paths start inside a solid.
    starts_inside: bool,
}

impl Surroundings<'_> {
    /// True if a path after some pushes ends here.
    pub(crate) fn contain_end(&self, path: &MeshPath) -> bool {
        self.ends.contains(path.end().to_array())
    }

    /// True if no contact is possible: no triangle is near, and the paths start outside.
    pub(crate) fn are_free(&self) -> bool {
        self.triangles.are_none() && !self.starts_inside
    }
}

fn reach(mesh: &CollisionMesh, frames: [&PlacedFrame; 2]) -> f32 {
    let [before, now] = frames.map(|frame| frame.center.abs().element_sum());
    let farther = if before > now { before } else { now };
    farther + mesh.extents.element_sum()
}
