//! What a picture must show: the box around particles and colliders of all frames, without those
//! that have flown far away.

use glam::{DQuat, DVec3};
use recorder::ShapeRow;
use sim_contract::{ParticleState, PlainF32};

use super::moment::Moment;

/// Of so many particles the outermost one on each side of each axis is not relied on.
const PARTICLES_PER_FLYER: usize = 200;
/// With fewer particles than this, each of them is meant.
const FLYERS_FROM: usize = 10;
/// Farthest that a particle may be outside of the box of most, in longest sides of that box.
const FLYER_DISTANCE: f64 = 1.0;
/// Farthest that a collider is followed away from the particles, in longest sides of their box.
const COLLIDER_DISTANCE: f64 = 2.0;

/// A box along the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extent {
    pub(crate) min: DVec3,
    pub(crate) max: DVec3,
}

impl Extent {
    /// Around all points; `None` without any.
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

    /// Larger by that many of its longest sides on each side.
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

    /// What both have in common, if anything.
    fn common(self, other: Self) -> Option<Self> {
        let common = Self { min: self.min.max(other.min), max: self.max.min(other.max) };
        common.min.cmple(common.max).all().then_some(common)
    }
}

/// Grows frame by frame.
#[derive(Debug, Default)]
pub(crate) struct Fit {
    particles: Option<Extent>,
    /// By index of the collider, over all frames.
    colliders: Vec<Option<Extent>>,
}

impl Fit {
    /// Takes one frame more.
    pub(crate) fn add(&mut self, moment: &Moment) {
        self.particles = union(self.particles, extent_of_particles(&moment.particles));
        if self.colliders.len() < moment.colliders.len() {
            self.colliders.resize(moment.colliders.len(), None);
        }
        for (known, collider) in self.colliders.iter_mut().zip(&moment.colliders) {
            *known = union(*known, extent_of_collider(&collider.shape));
        }
    }

    /// The box to show; around the origin where there is nothing.
    pub(crate) fn extent(&self) -> Extent {
        let colliders = self.colliders.iter().flatten().copied();
        let reach = self.particles.filter(|particles| particles.size() != DVec3::ZERO);
        let reach = reach.map(|particles| particles.grown(COLLIDER_DISTANCE));
        let near = colliders.filter_map(|collider| match reach {
            Some(reach) => collider.common(reach),
            None => Some(collider),
        });
        let all = self.particles.into_iter().chain(near).reduce(Extent::union);
        all.unwrap_or(Extent { min: DVec3::ZERO, max: DVec3::ZERO })
    }
}

fn union(one: Option<Extent>, other: Option<Extent>) -> Option<Extent> {
    one.into_iter().chain(other).reduce(Extent::union)
}

/// Around all but those that are far outside of the box of 99 % of them.
fn extent_of_particles(particles: &[ParticleState]) -> Option<Extent> {
    let points = particles.iter().map(|one| position(one.position));
    let mut points: Vec<_> = points.filter(|point| point.is_finite()).collect();
    if points.is_empty() {
        return None;
    }
    let is_few = points.len() < FLYERS_FROM;
    let rank = if is_few { 0 } else { points.len().div_ceil(PARTICLES_PER_FLYER) };
    let (mut min, mut max) = (DVec3::ZERO, DVec3::ZERO);
    let last = points.len() - 1;
    for axis in 0..3 {
        let by_axis = |a: &DVec3, b: &DVec3| a[axis].total_cmp(&b[axis]);
        min[axis] = points.select_nth_unstable_by(rank, by_axis).1[axis];
        max[axis] = points.select_nth_unstable_by(last - rank, by_axis).1[axis];
    }
    let reach = Extent { min, max }.grown(FLYER_DISTANCE);
    Extent::around(points.into_iter().filter(|point| reach.contains(*point)))
}

/// `None` for a plane, which has no end.
fn extent_of_collider(shape: &ShapeRow) -> Option<Extent> {
    let ball = |center: DVec3, radius: PlainF32| {
        let radius = DVec3::splat(radius.0.into());
        Extent { min: center - radius, max: center + radius }
    };
    let extent = match shape {
        ShapeRow::Plane { .. } => return None,
        ShapeRow::Box { center, half_extents, rotation } => {
            Extent::around(box_corners(*center, *half_extents, *rotation))?
        }
        ShapeRow::Sphere { center, radius } => ball(plain(*center), *radius),
        ShapeRow::Capsule { a, b, radius } => {
            ball(plain(*a), *radius).union(ball(plain(*b), *radius))
        }
        ShapeRow::Bounds { min, max } => Extent { min: plain(*min), max: plain(*max) },
    };
    (extent.min.is_finite() && extent.max.is_finite()).then_some(extent)
}

/// The corners of a box in its pose, numbered as those of an [`Extent`].
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
    fn a_flyer_and_what_is_not_finite_do_not_count() {
        let mut points = row(11);
        points.extend([[0.0, 500.0, 0.0], [f32::NAN, 0.0, 0.0], [f32::INFINITY, 0.0, 0.0]]);
        let found = extent_of_particles(&particles(points));
        assert_eq!(found, Some(extent([0.0; 3], [10.0, 0.0, 0.0])));
    }

    #[test]
    fn ends_of_a_rope_count_and_so_does_each_of_a_few() {
        let found = extent_of_particles(&particles(row(41)));
        assert_eq!(found, Some(extent([0.0; 3], [40.0, 0.0, 0.0])));
        let found = extent_of_particles(&particles([[0.0; 3], [1.0; 3], [0.0, 500.0, 0.0]]));
        assert_eq!(found, Some(extent([0.0; 3], [1.0, 500.0, 1.0])));
        assert_eq!(extent_of_particles(&[]), None);
    }

    #[test]
    fn colliders_count_as_far_as_they_are_near() {
        let number = PlainF32;
        let ball = ShapeRow::Sphere { center: [number(0.0); 3], radius: number(0.5) };
        let floor = ShapeRow::Box {
            center: [number(0.0); 3],
            half_extents: [1000.0, 0.5, 1000.0].map(number),
            rotation: [0.0, 0.0, 0.0, 1.0].map(number),
        };
        let plane = ShapeRow::Plane { normal: [number(1.0); 3], offset: number(0.0) };
        let colliders = [ball, floor, plane].iter().map(extent_of_collider).collect();
        let fit = Fit { particles: Some(extent([0.0; 3], [2.0, 1.0, 0.0])), colliders };
        assert_eq!(fit.extent(), extent([-4.0, -0.5, -4.0], [6.0, 1.0, 4.0]));
    }

    #[test]
    fn a_turned_box_is_as_wide_as_its_corners() {
        let half_angle = 22.5_f32.to_radians();
        let rotation = [0.0, 0.0, half_angle.sin(), half_angle.cos()].map(PlainF32);
        let corners = box_corners([PlainF32(0.0); 3], [PlainF32(1.0); 3], rotation);
        let extent = Extent::around(corners).unwrap();
        let wide = 2_f64.sqrt();
        assert!((extent.max - DVec3::new(wide, wide, 1.0)).length() < 1e-6, "{extent:?}");
    }
}
