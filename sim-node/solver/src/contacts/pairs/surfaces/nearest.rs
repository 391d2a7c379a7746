//! The point of a triangle that is nearest to a particle.

use glam::Vec3;

use crate::kernels::lanes::Lanes;
use crate::kernels::vectors::{difference, dot, scaled};

/// Part of a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Feature {
    Face,
    /// The edge from this corner to the next.
    Edge(usize),
    Corner(usize),
}

/// The nearest point of a triangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Nearest {
    /// Part of the triangle that holds the point.
    pub(super) feature: Feature,
    /// By corner: its share of the point. They add up to 1.
    pub(super) weights: [f32; 3],
}

impl Nearest {
    /// Finds the point of a triangle that is nearest to a particle. The corners are relative to the particle.
    /// (Ericson 2005, Real-Time Collision Detection, section 5.1.5.)
    ///
    /// A triangle without an area has no face: then the weights can be NaN.
    #[inline(always)]
    pub(super) fn new([a, b, c]: [Vec3; 3]) -> Self {
        let (ab, ac) = (b - a, c - a);
        let (ab_a, ac_a) = (-ab.dot(a), -ac.dot(a));
        if ab_a <= 0.0 && ac_a <= 0.0 {
            return Self::corner(0);
        }
        let (ab_b, ac_b) = (-ab.dot(b), -ac.dot(b));
        if ab_b >= 0.0 && ac_b <= ab_b {
            return Self::corner(1);
        }
        let (ab_c, ac_c) = (-ab.dot(c), -ac.dot(c));
        if ac_c >= 0.0 && ab_c <= ac_c {
            return Self::corner(2);
        }
        // Twice the areas of the triangles that the point forms with the edges, times the normal.
        let beside_ab = ab_a * ac_b - ab_b * ac_a;
        if beside_ab <= 0.0 && ab_a >= 0.0 && ab_b <= 0.0 {
            return Self::edge(0, ab_a / (ab_a - ab_b));
        }
        let beside_ca = ab_c * ac_a - ab_a * ac_c;
        if beside_ca <= 0.0 && ac_a >= 0.0 && ac_c <= 0.0 {
            return Self::edge(2, -ac_c / (ac_a - ac_c));
        }
        let beside_bc = ab_b * ac_c - ab_c * ac_b;
        let (along_b, along_c) = (ac_b - ab_b, ab_c - ac_c);
        if beside_bc <= 0.0 && along_b >= 0.0 && along_c >= 0.0 {
            return Self::edge(1, along_b / (along_b + along_c));
        }
        let scale = 1.0 / (beside_ab + beside_bc + beside_ca);
        let (b, c) = (beside_ca * scale, beside_ab * scale);
        Self { feature: Feature::Face, weights: [1.0 - b - c, b, c] }
    }

    fn corner(corner: usize) -> Self {
        let mut weights = [0.0; 3];
        weights[corner] = 1.0;
        Self { feature: Feature::Corner(corner), weights }
    }

    /// A point at this share of the way along an edge.
    fn edge(first: usize, share: f32) -> Self {
        let mut weights = [0.0; 3];
        weights[first] = 1.0 - share;
        weights[next(first)] = share;
        Self { feature: Feature::Edge(first), weights }
    }

    /// The weighted sum of the values of three corners.
    #[inline(always)]
    pub(super) fn mean(&self, [a, b, c]: [Vec3; 3]) -> Vec3 {
        let [u, v, w] = self.weights;
        a * u + b * v + c * w
    }
}

/// A share of the way along an edge, within 0..=1. 1 for NaN, which edges without a length have.
#[inline(always)]
pub(super) fn clamped<L: Lanes>(share: L) -> L {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let share = L::select(share.is_below(one), share, one);
    L::select(zero.is_below(share), share, zero)
}

/// The corner behind a corner.
pub(super) fn next(corner: usize) -> usize {
    if corner == 2 { 0 } else { corner + 1 }
}

/// Part of an edge's length by which a particle must be beside it to count as on one side. It exceeds the
/// rounding, so that one of two triangles is nearer, or none.
pub(super) const SIDE_TOLERANCE: f32 = 1e-5;

/// True if the origin is on the side of an edge on which a corner lies, in the plane of the three.
#[inline(always)]
pub(super) fn is_on_side_of([from, to]: [Vec3; 2], corner: Vec3) -> bool {
    let inwards = inwards([from, to].map(|end| end.to_array()), corner.to_array());
    let square = (to - from).dot(to - from);
    -from.dot(Vec3::from_array(inwards)) > SIDE_TOLERANCE * square * square
}

/// A vector across an edge to the side of a corner, in the plane of the three: the part of the line to the corner
/// across the edge, times the square of the edge's length. 0 if the corner is the start of the edge.
#[inline(always)]
pub(super) fn inwards<L: Lanes>([from, to]: [[L; 3]; 2], corner: [L; 3]) -> [L; 3] {
    let (edge, side) = (difference(to, from), difference(corner, from));
    difference(scaled(side, dot(edge, edge)), scaled(edge, dot(side, edge)))
}

#[cfg(test)]
mod tests {
    //! The nearest point against a search over the whole triangle.
    use super::*;

    const CORNERS: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.3, 0.8, 0.2]];

    /// Smallest distance of the origin from points of a grid over the triangle.
    fn sampled([a, b, c]: [Vec3; 3]) -> f32 {
        let count = 200;
        let points = (0..=count).flat_map(|i| (0..=count - i).map(move |j| [i, j]));
        let distances = points.map(|ij| {
            let [u, v] = ij.map(|one| one as f32 / count as f32);
            (a * (1.0 - u - v) + b * u + c * v).length()
        });
        distances.fold(f32::INFINITY, f32::min)
    }

    #[test]
    fn no_point_of_a_triangle_is_nearer_than_the_nearest() {
        let mut features = Vec::new();
        for index in 0..1000 {
            let axis = |step: i32| ((index * step) % 41) as f32 / 20.0 - 0.5;
            let point = Vec3::new(axis(7), axis(13), axis(29));
            let corners = CORNERS.map(|corner| Vec3::from_array(corner) - point);
            let nearest = Nearest::new(corners);
            let distance = nearest.mean(corners).length();
            assert!(nearest.weights.iter().all(|weight| (-1e-6..=1.0).contains(weight)));
            assert!((distance - sampled(corners)).abs() < 0.01, "{point} {nearest:?}");
            if !features.contains(&nearest.feature) {
                features.push(nearest.feature);
            }
        }
        assert_eq!(features.len(), 7, "{features:?}");
    }

    #[test]
    fn the_side_of_an_edge_is_that_of_the_corner() {
        let [a, b, c] = CORNERS.map(Vec3::from_array);
        for (point, expected) in [(c, true), (a + b - c, false), (c + Vec3::Z, true)] {
            assert_eq!(is_on_side_of([a - point, b - point], c - point), expected);
        }
    }
}
