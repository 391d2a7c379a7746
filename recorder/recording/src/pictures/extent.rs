//! The box that the pictures show: around the particles and colliders of all frames, without
//! outliers.

use glam::{DQuat, DVec3};
use sim_messages::{ParticleState, PlainF32};
use sim_solver::scene::ColliderMesh;

use crate::log::ShapeRow;
use crate::scene_state::SceneState;

/// One in this many particles may be an outlier, on each side of each axis.
const PARTICLES_PER_OUTLIER: usize = 200;
/// Scenes with fewer particles have no outliers.
const OUTLIERS_FROM: usize = 10;
/// A particle farther than this from the core box is an outlier, relative to the longest side of
/// that box.
const OUTLIER_DISTANCE: f64 = 1.0;
/// Colliders count up to this distance from the particles, relative to the longest side of their box.
const COLLIDER_DISTANCE: f64 = 2.0;

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Least coordinates.
    pub min: DVec3,
    /// Greatest coordinates.
    pub max: DVec3,
}

impl Extent {
    /// Returns the box between two of its corners.
    pub fn between(one: [f64; 3], other: [f64; 3]) -> Self {
        let [one, other] = [one, other].map(DVec3::from_array);
        Self { min: one.min(other), max: one.max(other) }
    }

    /// Returns true if no coordinate is infinite or NaN.
    pub fn is_finite(&self) -> bool {
        self.min.is_finite() && self.max.is_finite()
    }

    /// Returns the box around all points, or `None` if there are none.
    pub(crate) fn around(points: impl IntoIterator<Item = DVec3>) -> Option<Self> {
        let points = points.into_iter().map(|point| Self { min: point, max: point });
        points.reduce(Self::union)
    }

    pub(crate) fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    pub(crate) fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// Returns the box extended on each side by `sides` times its longest side.
    pub(crate) fn grown(&self, sides: f64) -> Self {
        let by = DVec3::splat(self.size().max_element() * sides);
        Self { min: self.min - by, max: self.max + by }
    }

    pub(crate) fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|corner| {
            let is_max = |axis: usize| corner >> axis & 1 == 1;
            DVec3::select(glam::BVec3::new(is_max(0), is_max(1), is_max(2)), self.max, self.min)
        })
    }

    fn contains(&self, point: DVec3) -> bool {
        point.cmpge(self.min).all() && point.cmple(self.max).all()
    }

    /// Returns the intersection, if it is not empty.
    fn intersection(self, other: Self) -> Option<Self> {
        let both = Self { min: self.min.max(other.min), max: self.max.min(other.max) };
        both.min.cmple(both.max).all().then_some(both)
    }
}

/// Accumulates the extents of all frames.
#[derive(Debug, Default)]
pub struct ExtentTracker {
    particles: Option<Extent>,
    /// By index of the collider, over all frames.
    colliders: Vec<Option<Extent>>,
}

impl ExtentTracker {
    /// Adds a frame.
    pub fn add(&mut self, state: &SceneState) {
        self.particles = union(self.particles, extent_of_particles(&state.particles));
        if self.colliders.len() < state.colliders().len() {
            self.colliders.resize(state.colliders().len(), None);
        }
        let colliders = self.colliders.iter_mut().zip(state.colliders());
        for (index, (known, collider)) in colliders.enumerate() {
            let extent = match state.collider_mesh(index) {
                Some(mesh) => Extent::around(mesh_corners(&collider.shape, mesh)),
                None => extent_of_collider(&collider.shape),
            };
            *known = union(*known, extent);
        }
    }

    /// Returns the box to show. An empty scene has an empty box at the origin.
    pub fn extent(&self) -> Extent {
        let colliders = self.colliders.iter().flatten().copied();
        let reach = self.particles.filter(|particles| particles.size() != DVec3::ZERO);
        let reach = reach.map(|particles| particles.grown(COLLIDER_DISTANCE));
        let near = colliders.filter_map(|collider| match reach {
            Some(reach) => collider.intersection(reach),
            None => Some(collider),
        });
        let all = self.particles.into_iter().chain(near).reduce(Extent::union);
        all.unwrap_or(Extent { min: DVec3::ZERO, max: DVec3::ZERO })
    }
}

fn union(one: Option<Extent>, other: Option<Extent>) -> Option<Extent> {
    one.into_iter().chain(other).reduce(Extent::union)
}

/// Returns the box around the particles without outliers, which are far from the box around 99 % of
/// the particles.
fn extent_of_particles(particles: &[ParticleState]) -> Option<Extent> {
    let points = particles.iter().map(|one| position(one.position));
    let mut points: Vec<_> = points.filter(|point| point.is_finite()).collect();
    if points.is_empty() {
        return None;
    }
    let has_no_outliers = points.len() < OUTLIERS_FROM;
    let rank = if has_no_outliers { 0 } else { points.len().div_ceil(PARTICLES_PER_OUTLIER) };
    let (mut min, mut max) = (DVec3::ZERO, DVec3::ZERO);
    let last = points.len() - 1;
    for axis in 0..3 {
        let by_axis = |a: &DVec3, b: &DVec3| a[axis].total_cmp(&b[axis]);
        min[axis] = points.select_nth_unstable_by(rank, by_axis).1[axis];
        max[axis] = points.select_nth_unstable_by(last - rank, by_axis).1[axis];
    }
    let reach = Extent { min, max }.grown(OUTLIER_DISTANCE);
    Extent::around(points.into_iter().filter(|point| reach.contains(*point)))
}

/// Returns `None` for a plane, which is infinite, and for a mesh, whose triangles the shape lacks.
fn extent_of_collider(shape: &ShapeRow) -> Option<Extent> {
    let sphere_extent = |center: DVec3, radius: PlainF32| {
        let radius = DVec3::splat(radius.0.into());
        Extent { min: center - radius, max: center + radius }
    };
    let extent = match shape {
        ShapeRow::Plane { .. } | ShapeRow::Mesh { .. } => return None,
        ShapeRow::Box { center, half_extents, rotation } => {
            Extent::around(box_corners(*center, *half_extents, *rotation))?
        }
        ShapeRow::Sphere { center, radius } => sphere_extent(plain(*center), *radius),
        ShapeRow::Capsule { a, b, radius } => {
            sphere_extent(plain(*a), *radius).union(sphere_extent(plain(*b), *radius))
        }
        ShapeRow::Bounds { min, max } => Extent { min: plain(*min), max: plain(*max) },
    };
    (extent.min.is_finite() && extent.max.is_finite()).then_some(extent)
}

/// Returns the corners of a box in its pose, in the order of [`Extent::corners`].
pub(crate) fn box_corners(
    center: [PlainF32; 3],
    half_extents: [PlainF32; 3],
    rotation: [PlainF32; 4],
) -> [DVec3; 8] {
    let rotation = DQuat::from_array(rotation.map(|one| one.0.into()));
    let half = plain(half_extents);
    let own = Extent { min: -half, max: half };
    own.corners().map(|corner| plain(center) + rotation * corner)
}

/// Returns the vertices of a mesh in its pose; none if the shape is no mesh or its pose not finite.
pub(crate) fn mesh_corners(shape: &ShapeRow, mesh: &ColliderMesh) -> Vec<DVec3> {
    let ShapeRow::Mesh { center, rotation, .. } = shape else { return Vec::new() };
    let rotation = DQuat::from_array(rotation.map(|one| one.0.into()));
    let center = plain(*center);
    if !(center.is_finite() && rotation.is_finite()) {
        return Vec::new();
    }
    mesh.vertices.iter().map(|vertex| center + rotation * position(*vertex)).collect()
}

pub(crate) fn position(vector: [f32; 3]) -> DVec3 {
    DVec3::from_array(vector.map(f64::from))
}

pub(crate) fn plain(vector: [PlainF32; 3]) -> DVec3 {
    DVec3::from_array(vector.map(|one| one.0.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn particles(points: impl IntoIterator<Item = [f32; 3]>) -> Vec<ParticleState> {
        let state = |position| ParticleState { position, ..ParticleState::default() };
        points.into_iter().map(state).collect()
    }

    fn extent(min: [f64; 3], max: [f64; 3]) -> Extent {
        Extent { min: min.into(), max: max.into() }
    }

    fn row(count: u16) -> Vec<[f32; 3]> {
        (0..count).map(|x| [f32::from(x), 0.0, 0.0]).collect()
    }

    #[test]
    fn outliers_and_non_finite_particles_do_not_count() {
        let mut points = row(11);
        points.extend([[0.0, 500.0, 0.0], [f32::NAN, 0.0, 0.0], [f32::INFINITY, 0.0, 0.0]]);
        let box_around = extent_of_particles(&particles(points));
        assert_eq!(box_around, Some(extent([0.0; 3], [10.0, 0.0, 0.0])));
    }

    #[test]
    fn the_ends_of_a_rope_and_each_particle_of_a_small_scene_count() {
        let box_around = extent_of_particles(&particles(row(41)));
        assert_eq!(box_around, Some(extent([0.0; 3], [40.0, 0.0, 0.0])));
        let box_around = extent_of_particles(&particles([[0.0; 3], [1.0; 3], [0.0, 500.0, 0.0]]));
        assert_eq!(box_around, Some(extent([0.0; 3], [1.0, 500.0, 1.0])));
        assert_eq!(extent_of_particles(&[]), None);
    }

    #[test]
    fn only_the_near_part_of_a_collider_counts() {
        let number = PlainF32;
        let ball = ShapeRow::Sphere { center: [number(0.0); 3], radius: number(0.5) };
        let floor = ShapeRow::Box {
            center: [number(0.0); 3],
            half_extents: [1000.0, 0.5, 1000.0].map(number),
            rotation: [0.0, 0.0, 0.0, 1.0].map(number),
        };
        let plane = ShapeRow::Plane { normal: [number(1.0); 3], offset: number(0.0) };
        let colliders = [ball, floor, plane].iter().map(extent_of_collider).collect();
        let fit = ExtentTracker { particles: Some(extent([0.0; 3], [2.0, 1.0, 0.0])), colliders };
        assert_eq!(fit.extent(), extent([-4.0, -0.5, -4.0], [6.0, 1.0, 4.0]));
    }

    #[test]
    fn the_extent_of_a_rotated_box_contains_its_corners() {
        let half_angle = 22.5_f32.to_radians();
        let rotation = [0.0, 0.0, half_angle.sin(), half_angle.cos()].map(PlainF32);
        let corners = box_corners([PlainF32(0.0); 3], [PlainF32(1.0); 3], rotation);
        let extent = Extent::around(corners).unwrap();
        let wide = 2_f64.sqrt();
        assert!((extent.max - DVec3::new(wide, wide, 1.0)).length() < 1e-6, "{extent:?}");
    }
}
