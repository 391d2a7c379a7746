//! Hinges: two triangles of a mesh with a common edge.

use glam::{DVec2, DVec3};

use super::{Bend, BendShape, RestShape, round};

/// Two triangles with a common edge.
///
/// C is the sum of c x, where the coefficients c are cotangents of the angles at the edge. For every fold
/// that keeps the triangles, it lies along the sum n of their unit normals and has the size |e| 2 sin(t / 2),
/// where |e| is the length of the edge and t the angle of the fold. So the energy is quadratic in the
/// positions (isometric bending: Bergou, Wardetzky, Harmon, Zorin, Grinspun 2006; Wardetzky, Bergou,
/// Harmon, Zorin, Grinspun 2007).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hinge {
    /// The third corner of a triangle, the ends of the edge, and the third corner of the other triangle.
    particles: [u32; 4],
    positions: [DVec3; 4],
    /// By triangle: twice its area.
    double_areas: [f64; 2],
}

/// A triangle whose height is less than this share of its longest side is a line: in f32, the cotangents of
/// its angles have few digits.
const HEIGHT_MIN: f64 = 1e-3;

impl Hinge {
    /// Hinge of two triangles, given by a third corner, the ends of the edge, and the other third corner. None
    /// if one of the triangles is a line.
    pub(crate) fn new(particles: [u32; 4], positions: [DVec3; 4]) -> Option<Self> {
        let [a, p, q, d] = positions;
        let double_areas = [[a, p, q], [d, p, q]].map(double_area);
        let are_triangles = double_areas.iter().all(|area| *area > 0.0);
        are_triangles.then_some(Self { particles, positions, double_areas })
    }

    /// Areas of the triangles.
    pub(crate) fn areas(&self) -> [f64; 2] {
        self.double_areas.map(|area| area / 2.0)
    }

    /// Area of both triangles.
    pub(crate) fn area(&self) -> f64 {
        self.areas().into_iter().sum()
    }

    /// By triangle: the square of C where both triangles lie on a cylinder of the curvature 1, in the mean of
    /// two directions of its axis: that of the shortest side of the triangle, and the one across it.
    pub(crate) fn squares_on_cylinders(&self) -> [f64; 2] {
        let unfolded = self.unfolded();
        [0, 3].map(|corner| {
            let [from, to] = self.shortest_side(corner).map(|end| unfolded[end]);
            let along = (to - from).normalize();
            let square = |direction: DVec2| {
                // The height of a cylinder over its tangent plane is u^2 / 2.
                let heights = unfolded.map(|corner| corner.dot(direction).powi(2) / 2.0);
                let terms = heights.iter().zip(self.coefficients());
                terms.map(|(height, c)| height * c).sum::<f64>().powi(2)
            };
            f64::midpoint(square(along), square(along.perp()))
        })
    }

    /// The shortest side of the triangle with a third corner. It is the same for all hinges of a triangle.
    fn shortest_side(&self, corner: usize) -> [usize; 2] {
        let key = |side: [usize; 2]| {
            let [from, to] = side.map(|end| self.positions[end]);
            let mut ends = side.map(|end| self.particles[end]);
            ends.sort_unstable();
            (from.distance_squared(to), ends)
        };
        let shorter = |one, other| if key(other) < key(one) { other } else { one };
        [[corner, 1], [corner, 2]].into_iter().fold([1, 2], shorter)
    }

    /// The bend with the rigidity B and the energy `stiffness` B |C - rest|^2 / (2 A), where A is the area of
    /// both triangles.
    pub(crate) fn bend(&self, stiffness: f64, rest: RestShape, rigidity: f32) -> Bend {
        let rest = match rest {
            RestShape::Flat => 0.0,
            RestShape::Loaded => self.value_along_normal(),
        };
        let [first, second] = self.double_areas;
        Bend {
            particles: self.particles,
            coefficients: balanced(self.coefficients()),
            geometry: round(self.area() / stiffness),
            rigidity,
            shape: BendShape::Hinge { rest: round(rest), area_ratio: round(first / second) },
            block: None,
        }
    }

    fn coefficients(&self) -> [f64; 4] {
        let [a, p, q, d] = self.positions;
        let edge = q - p;
        let [first, second] = self.double_areas;
        // At the ends of the edge, in both triangles.
        let at_p = [edge.dot(a - p) / first, edge.dot(d - p) / second];
        let at_q = [edge.dot(q - a) / first, edge.dot(q - d) / second];
        [-(at_p[0] + at_q[0]), at_q[0] + at_q[1], at_p[0] + at_p[1], -(at_p[1] + at_q[1])]
    }

    /// The corners in a plane, with the first end of the edge at the origin.
    fn unfolded(&self) -> [DVec2; 4] {
        let [a, p, q, d] = self.positions;
        let length = p.distance(q);
        let place = |corner: DVec3, height| DVec2::new((corner - p).dot(q - p) / length, height);
        let [first, second] = self.double_areas.map(|area| area / length);
        [place(a, first), DVec2::ZERO, DVec2::new(length, 0.0), place(d, -second)]
    }

    /// C along n.
    fn value_along_normal(&self) -> f64 {
        let [a, p, q, d] = self.positions;
        let [first, second] = self.double_areas;
        let normal = (q - p).cross(a - p) / first + (d - p).cross(q - p) / second;
        let terms = self.positions.iter().zip(self.coefficients());
        let value: DVec3 = terms.map(|(corner, c)| c * (*corner - p)).sum();
        // 0 where the triangles lie on each other.
        value.dot(normal.normalize_or_zero())
    }
}

/// Twice the area of a triangle. 0 for a line.
fn double_area([a, b, c]: [DVec3; 3]) -> f64 {
    let sides = [a - b, b - c, c - a].map(DVec3::length_squared);
    let longest = sides.into_iter().fold(0.0, f64::max);
    let area = (b - a).cross(c - a).length();
    if area > HEIGHT_MIN * longest { area } else { 0.0 }
}

/// Rounds coefficients so that their sum is exactly 0, and with it that of the forces: to multiples of a
/// power of two of which each of them has less than 2^22.
fn balanced([a, p, q, d]: [f64; 4]) -> [f32; 4] {
    let largest = [a, p, q, d].into_iter().fold(0.0, |largest: f64, c| largest.max(c.abs()));
    let power_of_two = f64::from_bits(largest.to_bits() & f64::INFINITY.to_bits());
    let unit = power_of_two / f64::from(1 << 20);
    let [a, q, d] = [a, q, d].map(|c| (c / unit).round() * unit);
    [a, -(a + q + d), q, d].map(round)
}
