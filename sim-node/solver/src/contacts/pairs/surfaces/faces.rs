//! The nearest points of eight particles on the faces of their triangles.

use super::surface::Surface;
use super::triangle_tile::gather;
use crate::kernels::lanes::{Lanes8, PackedParticle, Wide};
use crate::kernels::vectors::{
    cross, difference, divided, dot, lane_of, scaled, select, store, sum,
};

/// The nearest points of eight particles on their triangles, where they lie on the face. Bit for bit those of
/// [`Nearest`](super::nearest::Nearest).
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Faces {
    /// A bit for each particle whose nearest point is on the face.
    pub(super) lanes: u32,
    /// By corner: its share of the point.
    weights: [Lanes8; 3],
    /// Direction from the point to the side on which the path of the particle starts.
    normals: [Lanes8; 3],
    /// Distance of the particle from the point along it.
    pub(super) heights: Lanes8,
}

/// The corners of eight triangles relative to a particle each.
pub(super) struct Corners<W> {
    /// Where the paths start.
    pub(super) starts: [[W; 3]; 3],
    /// Where they end.
    pub(super) ends: [[W; 3]; 3],
}

impl<W: Wide> Corners<W> {
    /// Gathers the corners. `slots` has those of the particles, and `triangles` their triangles. The paths end after
    /// `time` displacements.
    #[inline(always)]
    pub(super) fn new(
        surface: &Surface,
        states: &[PackedParticle],
        (slots, triangles): ([u32; 8], [u32; 8]),
        time: f32,
    ) -> Self {
        let [a, b, c] = corner_slots(surface, triangles);
        let [origins, displacements] = split(W::columns(&gather(states, slots.into_iter())));
        let mut corners = Self { starts: [[W::splat(0.0); 3]; 3], ends: [[W::splat(0.0); 3]; 3] };
        for (corner, slots) in [a, b, c].into_iter().enumerate() {
            let [at, moved] = split(W::columns(&gather(states, slots.into_iter())));
            let way = scaled(difference(moved, displacements), W::splat(time));
            corners.starts[corner] = difference(at, origins);
            corners.ends[corner] = sum(corners.starts[corner], way);
        }
        corners
    }
}

/// Returns a bit for each particle whose nearest point is on the face of its triangle, and the shares of the corners in
/// that point (Ericson 2005, Real-Time Collision Detection, section 5.1.5).
#[inline(always)]
pub(super) fn nearest_on_faces<W: Wide>([a, b, c]: [[W; 3]; 3]) -> (u32, [W; 3]) {
    let (zero, one) = (W::splat(0.0), W::splat(1.0));
    let (ab, ac) = (difference(b, a), difference(c, a));
    let (ab_a, ac_a) = (-dot(ab, a), -dot(ac, a));
    let (ab_b, ac_b) = (-dot(ab, b), -dot(ac, b));
    let (ab_c, ac_c) = (-dot(ab, c), -dot(ac, c));
    let mut beside = W::bits(W::both(ab_a.is_at_most(zero), ac_a.is_at_most(zero)));
    beside |= W::bits(W::both(zero.is_at_most(ab_b), ac_b.is_at_most(ab_b)));
    beside |= W::bits(W::both(zero.is_at_most(ac_c), ab_c.is_at_most(ac_c)));
    let beside_ab = ab_a * ac_b - ab_b * ac_a;
    let along_ab = W::both(zero.is_at_most(ab_a), ab_b.is_at_most(zero));
    beside |= W::bits(W::both(beside_ab.is_at_most(zero), along_ab));
    let beside_ca = ab_c * ac_a - ab_a * ac_c;
    let along_ca = W::both(zero.is_at_most(ac_a), ac_c.is_at_most(zero));
    beside |= W::bits(W::both(beside_ca.is_at_most(zero), along_ca));
    let beside_bc = ab_b * ac_c - ab_c * ac_b;
    let along_bc = W::both(zero.is_at_most(ac_b - ab_b), zero.is_at_most(ab_c - ac_c));
    beside |= W::bits(W::both(beside_bc.is_at_most(zero), along_bc));
    let scale = one / (beside_ab + beside_bc + beside_ca);
    let (v, w) = (beside_ca * scale, beside_ab * scale);
    (!beside & 0xff, [one - v - w, v, w])
}

impl Faces {
    /// Finds the points at the ends of the paths. `slots` has those of the particles, and `triangles` their triangles.
    #[inline(always)]
    pub(super) fn find<W: Wide>(
        &mut self,
        surface: &Surface,
        states: &[PackedParticle],
        (slots, triangles): ([u32; 8], [u32; 8]),
    ) {
        let Corners { starts, ends } = Corners::<W>::new(surface, states, (slots, triangles), 1.0);
        let (lanes, weights) = nearest_on_faces(ends);
        self.lanes = lanes;
        let across = normals(ends);
        let is_below = dot(normals(starts), negated(mean(weights, starts))).is_below(W::splat(0.0));
        let direction = select(is_below, negated(across), across);
        let normal = divided(direction, dot(direction, direction).sqrt());
        store(weights, &mut self.weights);
        store(normal, &mut self.normals);
        dot(normal, negated(mean(weights, ends))).store(&mut self.heights, 0);
    }

    /// Shares of the corners, and the direction away from the triangle.
    pub(super) fn lane(&self, lane: usize) -> ([f32; 3], [f32; 3]) {
        (lane_of(&self.weights, lane), lane_of(&self.normals, lane))
    }
}

/// The slots of the corners of eight triangles, by corner.
#[inline(always)]
fn corner_slots(surface: &Surface, triangles: [u32; 8]) -> [[u32; 8]; 3] {
    let mut slots = [[0; 8]; 3];
    for (lane, triangle) in triangles.into_iter().enumerate() {
        let [a, b, c] = surface.corners[triangle as usize];
        (slots[0][lane], slots[1][lane], slots[2][lane]) = (a, b, c);
    }
    slots
}

/// Positions and displacements of eight particles.
#[inline(always)]
fn split<W: Wide>([[x, y, z, _], [dx, dy, dz, _]]: [[W; 4]; 2]) -> [[W; 3]; 2] {
    [[x, y, z], [dx, dy, dz]]
}

/// Normals of triangles, of any length.
#[inline(always)]
fn normals<W: Wide>([a, b, c]: [[W; 3]; 3]) -> [W; 3] {
    cross(difference(b, a), difference(c, a))
}

/// The weighted sum of three vectors.
#[inline(always)]
pub(super) fn mean<W: Wide>([u, v, w]: [W; 3], [a, b, c]: [[W; 3]; 3]) -> [W; 3] {
    sum(sum(scaled(a, u), scaled(b, v)), scaled(c, w))
}

#[inline(always)]
fn negated<W: Wide>([x, y, z]: [W; 3]) -> [W; 3] {
    [-x, -y, -z]
}

#[cfg(test)]
mod tests {
    //! Eight nearest points at once against one after the other.
    use super::super::nearest::{Feature, Nearest};
    use super::super::samples::{Random, sheet, surface_of};
    use super::super::surface::{Found, View, separation};
    use super::*;
    use crate::kernels::Kernels;
    use crate::kernels::lanes::LaneWork;

    struct Work<'a>(&'a Surface, &'a [PackedParticle], ([u32; 8], [u32; 8]));

    impl LaneWork for Work<'_> {
        type Output = Faces;

        #[inline(always)]
        fn run<W: Wide>(self) -> Faces {
            let mut faces = Faces::default();
            faces.find::<W>(self.0, self.1, self.2);
            faces
        }
    }

    /// The bits of weights, direction and distance, if the point is on the face.
    type OnFace = Option<([u32; 3], [u32; 3], u32)>;

    fn bits(weights: [f32; 3], normal: [f32; 3], height: f32) -> ([u32; 3], [u32; 3], u32) {
        (weights.map(f32::to_bits), normal.map(f32::to_bits), height.to_bits())
    }

    fn one(surface: &Surface, states: &[PackedParticle], slot: u32, triangle: u32) -> OnFace {
        let view = View { particles: states, slot, time: 1.0 };
        let corners = surface.place(triangle, view);
        let nearest = Nearest::new(corners);
        let (feature, weights) = (nearest.feature, nearest.weights);
        let (normal, height) = separation(surface, &Found { triangle, nearest, corners }, view);
        (feature == Feature::Face).then_some(bits(weights, normal.to_array(), height))
    }

    fn one_of(faces: &Faces, lane: usize) -> OnFace {
        let (weights, normal) = faces.lane(lane);
        (faces.lanes & (1 << lane) != 0).then_some(bits(weights, normal, faces.heights[lane]))
    }

    #[test]
    fn eight_points_at_once_have_the_bits_of_one_after_the_other() {
        // 18 triangles.
        let (surface, _) = surface_of(&sheet(4, 0.5));
        let (mut random, mut on_face_count) = (Random(1), 0);
        for _ in 0..500 {
            let states = [0; 16].map(|_| PackedParticle([0; 8].map(|_| random.number())));
            let pairs = ([0; 8].map(|_| random.below(16)), [0; 8].map(|_| random.below(18)));
            let expected: Vec<_> =
                (0..8).map(|lane| one(&surface, &states, pairs.0[lane], pairs.1[lane])).collect();
            on_face_count += expected.iter().flatten().count();
            for kernels in Kernels::available() {
                let faces = kernels.run(Work(&surface, &states, pairs));
                let found: Vec<_> = (0..8).map(|lane| one_of(&faces, lane)).collect();
                assert_eq!(found, expected, "{kernels:?}");
            }
        }
        assert!(on_face_count > 100, "{on_face_count}");
    }
}
