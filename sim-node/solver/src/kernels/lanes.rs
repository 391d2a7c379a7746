//! The operations that kernels are written in.
//!
//! A kernel is written once over [`Lanes`] and compiled for one lane and for eight.
#![allow(unsafe_code, reason = "the contracts of `differences` and `subtract_displacements`")]

use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// One value for each of eight lanes, as it lies in memory.
pub(crate) type Lanes8 = [f32; 8];

/// One particle of the graph: x, y, z, inverse mass, displacement x, y, z, and 0.
///
/// 32 bytes, one aligned load, within one cache line.
#[derive(Debug, Clone, Copy, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(32))]
pub(crate) struct PackedParticle(pub(crate) Lanes8);

const _: () = assert!(size_of::<PackedParticle>() == 32);

/// One number, or eight side by side. Lanes never interact.
pub(crate) trait Lanes:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// One boolean per lane.
    type Mask: Copy;

    fn splat(number: f32) -> Self;
    /// Loads all eight numbers, or `from[lane]` if the type has a single lane.
    fn load(from: &Lanes8, lane: usize) -> Self;
    /// Stores all eight numbers, or `to[lane]` if the type has a single lane.
    fn store(self, to: &mut Lanes8, lane: usize);
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    /// The larger of the two. Returns `rhs` if they are equal or if either is NaN.
    fn max_or_rhs(self, rhs: Self) -> Self;
    /// self < other. False if either is NaN.
    fn is_below(self, other: Self) -> Self::Mask;
    /// self <= other. False if either is NaN.
    fn is_at_most(self, other: Self) -> Self::Mask;
    fn is_not_nan(self) -> Self::Mask;
    fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// `yes` where the mask is set, `no` elsewhere, bit for bit.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// `self` where the mask is set, +0 elsewhere, even for NaN.
    fn masked(self, mask: Self::Mask) -> Self;
    fn any(mask: Self::Mask) -> bool;
}

/// Eight lanes.
pub(crate) trait Wide: Lanes {
    /// Separates sixteen numbers into those of even and of odd index, in the order
    /// 0 2 8 10 4 6 12 14 and 1 3 9 11 5 7 13 15. [`Self::zip`] is the inverse.
    fn unzip(low: Self, high: Self) -> [Self; 2];
    fn zip(even: Self, odd: Self) -> [Self; 2];
    /// Bit n is set where the mask is set in lane n.
    fn bits(mask: Self::Mask) -> u32;
    /// Separates sixteen numbers into even and odd pairs, in the order 0 1 8 9 4 5 12 13 and
    /// 2 3 10 11 6 7 14 15. [`Self::zip_pairs`] is the inverse.
    fn unzip_pairs(low: Self, high: Self) -> [Self; 2];
    fn zip_pairs(even: Self, odd: Self) -> [Self; 2];
    /// Separates twenty-four numbers by their index modulo 3, in the order 0 9 18 3 12 21 6 15 and its
    /// successors. [`Self::zip_thirds`] is the inverse.
    fn unzip_thirds(numbers: [Self; 3]) -> [Self; 3];
    fn zip_thirds(thirds: [Self; 3]) -> [Self; 3];
    /// Transposes eight particles to columns: x, y, z and inverse mass, then the second half.
    fn columns(particles: &[PackedParticle; 8]) -> [[Self; 4]; 2];
    fn set_displacements(particles: &mut [PackedParticle; 8], displacements: [Self; 3]);
    fn set_positions(particles: &mut [PackedParticle; 8], positions: [Self; 3]);
    /// Component-wise `b - a` for eight pairs: x, y, z of the positions, then of the displacements.
    ///
    /// # Safety
    /// Every index in `a` and `b` must be below `particles.len()`.
    unsafe fn differences(
        particles: &[Cell<PackedParticle>],
        a: &[u32; 8],
        b: &[u32; 8],
    ) -> [[Self; 3]; 2];
    /// Subtracts one amount from the displacement of each of eight particles. Two lanes may name
    /// the same particle only if both amounts are 0.
    ///
    /// # Safety
    /// Every index must be below `particles.len()`.
    unsafe fn subtract_displacements(
        particles: &[Cell<PackedParticle>],
        indices: &[u32; 8],
        amounts: [Self; 3],
    );
}

/// A loop that is compiled once for each instruction set.
///
/// Everything that it calls must be inlined: a function of its own is compiled for the baseline
/// processor.
pub(crate) trait LaneWork {
    type Output;

    fn run<W: Wide>(self) -> Self::Output;
}

/// Lane groups of a row: `count` times eight numbers, starting at column `from`.
#[inline(always)]
pub(crate) fn lane_groups(row: &[f32], from: usize, count: usize) -> &[Lanes8] {
    let (groups, _) = row[from..from + 8 * count].as_chunks();
    &groups[..count]
}

/// Mutable counterpart of [`lane_groups`].
#[inline(always)]
pub(crate) fn lane_groups_mut(row: &mut [f32], from: usize, count: usize) -> &mut [Lanes8] {
    let (groups, _) = row[from..from + 8 * count].as_chunks_mut();
    &mut groups[..count]
}

/// Builds a vector axis by axis. (`array::from_fn` compiles to a call that spills the registers.)
#[inline(always)]
pub(crate) fn axes<T>(value: impl Fn(usize) -> T) -> [T; 3] {
    [value(0), value(1), value(2)]
}

/// Maps each component of a vector. (`array::map` compiles to a call that spills the registers.)
#[inline(always)]
pub(crate) fn map_axes<T, U>([x, y, z]: [T; 3], mut map: impl FnMut(T) -> U) -> [U; 3] {
    [map(x), map(y), map(z)]
}
