//! Contact of a path with one triangle.

use glam::{DVec3, Vec3};
use sim_scene::collider_mesh;

use crate::contacts::bounds::{Bounds, lesser};

/// A triangle, in the frame of its mesh.
#[derive(Debug, Clone)]
pub(super) struct Triangle {
    pub(super) corners: [Vec3; 3],
    /// Unit vector.
    normal: Vec3,
    /// By edge, from each corner to the next: unit vector across it, in the plane, to the inside.
    inwards: [Vec3; 3],
}

// Small, because a search reads many of them.
const _: () = assert!(size_of::<Triangle>() == 84);

/// The path of a particle in a substep, in the moving frame of a mesh.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MeshPath {
    pub(super) start: Vec3,
    pub(super) motion: Vec3,
    /// Bound on the rounding of a point of the path.
    pub(super) rounding: f32,
}

impl MeshPath {
    pub(super) fn end(&self) -> Vec3 {
        self.start + self.motion
    }
}

/// Distances in a contact with a mesh.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gap {
    /// Distance that particles keep from the triangles, at least 8 times the tolerance.
    pub(super) distance: f32,
    /// Bound on the rounding of a position in the frame of the mesh.
    pub(super) tolerance: f32,
}

/// Part of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Feature {
    Face,
    /// The edge from this corner to the next.
    Edge(usize),
    Corner(usize),
}

/// The point of a triangle that is nearest to another point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NearestPoint {
    /// Part of the triangle that holds it.
    pub(super) feature: Feature,
    /// From it to the other point.
    pub(super) apart: Vec3,
}

/// A contact with a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Touch {
    /// Unit vector to the side of the particle, in the frame of the mesh.
    pub(super) normal: Vec3,
    /// Length of the push along the normal, > 0.
    pub(super) depth: f32,
    /// Fraction of the path before it passes through the triangle; 1 if it only comes too near.
    time: f32,
}

impl Touch {
    /// The contact that is resolved first: a passage before mere nearness, and then the earlier or
    /// deeper one.
    pub(super) fn is_before(&self, other: &Self) -> bool {
        self.time < other.time || (self.time == other.time && self.depth > other.depth)
    }

    /// True if it is more than the rounding that an earlier contact leaves.
    pub(super) fn is_clear(&self, gap: Gap) -> bool {
        self.time < 1.0 || self.depth > gap.tolerance
    }

    /// True if the path passes through the triangle.
    pub(super) fn is_passage(&self) -> bool {
        self.time < 1.0
    }
}

impl Triangle {
    /// Creates a triangle, or `None` for a sliver: one whose height over its longest edge is at most
    /// `height_min`.
    pub(super) fn new(corners: [[f32; 3]; 3], height_min: f64) -> Option<Self> {
        let normal = collider_mesh::normal(corners, height_min)?;
        let corner = corners.map(|corner| Vec3::from_array(corner).as_dvec3());
        let edges = [corner[1] - corner[0], corner[2] - corner[1], corner[0] - corner[2]];
        let inwards = edges.map(|edge| unit(normal.cross(edge)));
        Some(Self {
            corners: corners.map(Vec3::from_array),
            normal: normal.as_vec3(),
            inwards: inwards.map(DVec3::as_vec3),
        })
    }

    /// Unit vector.
    pub(super) fn normal(&self) -> Vec3 {
        self.normal
    }

    /// Finds the point that is nearest to another point, unless a plane shows that the square of their distance exceeds
    /// `square_max`. The foot of a point on the plane counts as inside only by more than `rounding`: beyond the tip of
    /// a needle it may seem to be inside.
    pub(super) fn nearest_within(
        &self,
        point: Vec3,
        square_max: f32,
        rounding: f32,
    ) -> Option<NearestPoint> {
        let height = self.normal.dot(point - self.corners[0]);
        let [a, b, c] = [0, 1, 2].map(|edge| self.inwards[edge].dot(point - self.corners[edge]));
        let least = lesser(a, lesser(b, c));
        if least > rounding {
            return Some(NearestPoint { feature: Feature::Face, apart: self.normal * height });
        }
        let outside = lesser(least, 0.0);
        let is_far = height * height + outside * outside > square_max;
        (!is_far).then(|| self.nearest_on_border(point))
    }

    fn nearest_on_border(&self, point: Vec3) -> NearestPoint {
        let [a, b, c] = self.corners;
        let on_edge = |edge: usize, ends: [Vec3; 2]| {
            let share = share_of_nearest(ends, point);
            let feature = match share {
                0.0 => Feature::Corner(edge),
                1.0 => Feature::Corner((edge + 1) % 3),
                _ => Feature::Edge(edge),
            };
            NearestPoint { feature, apart: point - (ends[0] + (ends[1] - ends[0]) * share) }
        };
        let square = |one: &NearestPoint| one.apart.dot(one.apart);
        let nearer = |one, other| if square(&other) < square(&one) { other } else { one };
        nearer(nearer(on_edge(0, [a, b]), on_edge(1, [b, c])), on_edge(2, [c, a]))
    }

    /// False if the plane or an edge separates the triangle from a box. A box beside a corner may count as
    /// near.
    pub(super) fn meets(&self, bounds: &Bounds) -> bool {
        let (min, max) = (Vec3::from_array(bounds.min), Vec3::from_array(bounds.max));
        let (center, half) = ((min + max) * 0.5, (max - min) * 0.5);
        let reach = |direction: Vec3| direction.abs().dot(half);
        let height = self.normal.dot(center - self.corners[0]);
        let edges = self.inwards.iter().zip(&self.corners);
        height.abs() <= reach(self.normal)
            && edges
                .into_iter()
                .all(|(inwards, corner)| inwards.dot(center - *corner) >= -reach(*inwards))
    }

    /// Finds the contact of a path: where it passes through the triangle, or where its end is nearer
    /// than the distance. The particle stays on the side on which the path starts.
    pub(super) fn touch(&self, path: &MeshPath, gap: Gap) -> Option<Touch> {
        let above = self.normal.dot(path.start - self.corners[0]);
        let (height, normal) =
            if above < 0.0 { (-above, -self.normal) } else { (above, self.normal) };
        // The motion is added last, so that it keeps its digits.
        let height_at_end = height + normal.dot(path.motion);
        let may_touch = height_at_end < gap.distance;
        if !may_touch {
            return None;
        }
        if height_at_end < 0.0 {
            let time = height / (height - height_at_end);
            if time < 1.0 && self.is_at(path.start + path.motion * time, gap.tolerance) {
                return Some(Touch { normal, depth: gap.distance - height_at_end, time });
            }
        }
        let near = |normal, height: f32| {
            let depth = gap.distance - height;
            (depth > 0.0).then_some(Touch { normal, depth, time: 1.0 })
        };
        let end = path.end();
        if !self.has_beside(end, gap.distance) {
            return None;
        }
        if !self.has_beside(end, 0.0) {
            let arm = end - self.nearest_on_edges(end);
            let square = arm.dot(arm);
            if square >= f32::MIN_POSITIVE {
                let length = square.sqrt();
                return near(arm / length, length);
            }
        }
        // A path around the edge ends on the other side.
        if height_at_end < 0.0 {
            near(-normal, -height_at_end)
        } else {
            near(normal, height_at_end)
        }
    }

    /// True if a point on the plane is inside, or at most `distance` away from the triangle. The edges alone would
    /// accept points far beyond a sharp corner, which are not in the search box.
    fn is_at(&self, point: Vec3, distance: f32) -> bool {
        if self.has_beside(point, 0.0) {
            return true;
        }
        if !self.has_beside(point, distance) {
            return false;
        }
        let arm = point - self.nearest_on_edges(point);
        arm.dot(arm) <= distance * distance
    }

    /// True if the foot of a point on the plane is inside, or beside an edge by at most `distance`.
    fn has_beside(&self, point: Vec3, distance: f32) -> bool {
        let edges = self.inwards.iter().zip(&self.corners);
        edges.fold(true, |is_beside, (inwards, corner)| {
            is_beside & (inwards.dot(point - *corner) >= -distance)
        })
    }

    fn nearest_on_edges(&self, point: Vec3) -> Vec3 {
        let [a, b, c] = self.corners;
        let [first, second, third] =
            [[a, b], [b, c], [c, a]].map(|edge| nearest_on_segment(edge, point));
        let square = |one: Vec3| (point - one).dot(point - one);
        let nearer = |one, other| if square(other) < square(one) { other } else { one };
        nearer(nearer(first, second), third)
    }
}

fn unit(vector: DVec3) -> DVec3 {
    vector * (1.0 / vector.dot(vector).sqrt())
}

fn nearest_on_segment([a, b]: [Vec3; 2], point: Vec3) -> Vec3 {
    a + (b - a) * share_of_nearest([a, b], point)
}

/// The part of the way along a segment at which it is nearest to a point, 0 to 1.
fn share_of_nearest([a, b]: [Vec3; 2], point: Vec3) -> f32 {
    let edge = b - a;
    let along = edge.dot(point - a) / edge.dot(edge);
    let share = if along > 0.0 { along } else { 0.0 };
    if share < 1.0 { share } else { 1.0 }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
mod tests {
    use super::*;

    #[test]
    fn a_path_beyond_a_sharp_corner_passes() {
        let corners = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.01, 0.0, 1e-5]];
        let triangle = Triangle::new(corners, 1e-9).unwrap();
        let gap = Gap { distance: 8e-7, tolerance: 1e-7 };
        let crosses = |x: f32| {
            let start = Vec3::new(x, 1e-3, 0.0);
            let path = MeshPath { start, motion: Vec3::new(0.0, -2e-3, 0.0), rounding: 0.0 };
            triangle.touch(&path, gap).is_some()
        };
        assert!(crosses(5e-3) && crosses(0.0));
        // Beyond the corner, both edges are nearer than the tolerance, but the triangle is not.
        assert!(!crosses(-2e-5));
    }
}
