//! Arithmetic of vectors in lanes: x, y, z of one particle, or of eight.

use super::lanes::{Lanes, Lanes8, Wide};

/// The same vector in every lane.
#[inline(always)]
pub(crate) fn splat<L: Lanes>(vector: [f32; 3]) -> [L; 3] {
    [L::splat(vector[0]), L::splat(vector[1]), L::splat(vector[2])]
}

#[inline(always)]
pub(crate) fn sum<L: Lanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a - b.
#[inline(always)]
pub(crate) fn difference<L: Lanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn scaled<L: Lanes>(vector: [L; 3], factor: L) -> [L; 3] {
    [vector[0] * factor, vector[1] * factor, vector[2] * factor]
}

#[inline(always)]
pub(crate) fn divided<L: Lanes>(vector: [L; 3], divisor: L) -> [L; 3] {
    [vector[0] / divisor, vector[1] / divisor, vector[2] / divisor]
}

#[inline(always)]
pub(crate) fn dot<L: Lanes>(a: [L; 3], b: [L; 3]) -> L {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(crate) fn cross<L: Lanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[1] * b[2] - b[1] * a[2], a[2] * b[0] - b[2] * a[0], a[0] * b[1] - b[0] * a[1]]
}

/// |x| + |y| + |z|.
#[inline(always)]
pub(crate) fn sum_of_magnitudes<L: Lanes>(vector: [L; 3]) -> L {
    vector[0].abs() + vector[1].abs() + vector[2].abs()
}

/// `yes` where the mask is set, `no` elsewhere.
#[inline(always)]
pub(crate) fn select<L: Lanes>(mask: L::Mask, yes: [L; 3], no: [L; 3]) -> [L; 3] {
    [L::select(mask, yes[0], no[0]), L::select(mask, yes[1], no[1]), L::select(mask, yes[2], no[2])]
}

/// The vector where the mask is set, +0 elsewhere.
#[inline(always)]
pub(crate) fn masked<L: Lanes>(vector: [L; 3], mask: L::Mask) -> [L; 3] {
    [vector[0].masked(mask), vector[1].masked(mask), vector[2].masked(mask)]
}

/// The vectors of eight particles.
#[inline(always)]
pub(crate) fn load<W: Wide>([x, y, z]: &[Lanes8; 3]) -> [W; 3] {
    [W::load(x, 0), W::load(y, 0), W::load(z, 0)]
}

/// Stores the vectors of eight particles.
#[inline(always)]
pub(crate) fn store<W: Wide>([x, y, z]: [W; 3], [to_x, to_y, to_z]: &mut [Lanes8; 3]) {
    x.store(to_x, 0);
    y.store(to_y, 0);
    z.store(to_z, 0);
}

/// The vector in one of eight lanes.
#[inline(always)]
pub(crate) fn lane_of([x, y, z]: &[Lanes8; 3], lane: usize) -> [f32; 3] {
    [x[lane], y[lane], z[lane]]
}

/// Sets the vector in one of eight lanes.
#[inline(always)]
pub(crate) fn set_lane(vectors: &mut [Lanes8; 3], lane: usize, [x, y, z]: [f32; 3]) {
    (vectors[0][lane], vectors[1][lane], vectors[2][lane]) = (x, y, z);
}
