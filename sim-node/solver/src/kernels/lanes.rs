//! The words that kernels are written in.
#![allow(unsafe_code, reason = "the promises of `differences` and `take`")]

use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Eight numbers in memory: a vector, whatever the processor calls it.
pub(crate) type Eight = [f32; 8];

/// One particle of a graph: x, y, z and the inverse mass, then its displacement and 0. Both are one
/// load, and lie in one cache line.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C, align(32))]
pub(crate) struct Body(pub(crate) Eight);

/// One number, or several side by side. No lane knows of another.
pub(crate) trait Lanes:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Yes or no, lane by lane.
    type Mask: Copy;

    fn splat(number: f32) -> Self;
    /// All eight numbers, or the one of a lane where there is only one.
    fn load(from: &Eight, lane: usize) -> Self;
    /// As [`Self::load`], the other way.
    fn store(self, to: &mut Eight, lane: usize);
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    /// The larger one; the other where either is no number.
    fn or_at_least(self, other: Self) -> Self;
    /// self < other; no where one of them is no number.
    fn is_below(self, other: Self) -> Self::Mask;
    /// self <= other; no where one of them is no number.
    fn is_at_most(self, other: Self) -> Self::Mask;
    fn is_number(self) -> Self::Mask;
    fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    fn choose(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// The number where the mask says yes, +0 elsewhere, whatever stands there.
    fn only(self, mask: Self::Mask) -> Self;
    fn any(mask: Self::Mask) -> bool;
}

/// Eight lanes.
pub(crate) trait Wide: Lanes {
    /// The even and the odd ones of sixteen, in an order that [`Self::zip`] takes back:
    /// 0 2 8 10 4 6 12 14 and one more each.
    fn unzip(low: Self, high: Self) -> [Self; 2];
    fn zip(even: Self, odd: Self) -> [Self; 2];
    /// As [`Self::unzip`], by pairs: 0 1 8 9 4 5 12 13 and two more each.
    fn unzip_pairs(low: Self, high: Self) -> [Self; 2];
    fn zip_pairs(even: Self, odd: Self) -> [Self; 2];
    /// Eight bodies, number by number: x, y, z and the inverse mass, and the same places of the
    /// second half.
    fn columns(bodies: &[Body; 8]) -> [[Self; 4]; 2];
    /// Sets the displacements of eight bodies.
    fn set_displacements(bodies: &mut [Body; 8], displacements: [Self; 3]);
    /// What body `b` has more than body `a`, for eight pairs: x, y, z of the first half, then of the
    /// second.
    ///
    /// # Safety
    /// There are bodies of these numbers.
    unsafe fn differences(bodies: &[Cell<Body>], a: &[u32; 8], b: &[u32; 8]) -> [[Self; 3]; 2];
    /// Takes x, y, z from the second half of eight different bodies (or of one, if that is 0).
    ///
    /// # Safety
    /// There are bodies of these numbers.
    unsafe fn take(bodies: &[Cell<Body>], from: &[u32; 8], amounts: [Self; 3]);
}

/// `count` vectors of a row, from a column on.
#[inline(always)]
pub(crate) fn eights(row: &[f32], from: usize, count: usize) -> &[Eight] {
    let (eights, _) = row[from..from + 8 * count].as_chunks();
    &eights[..count]
}

/// As [`eights`], to be changed.
#[inline(always)]
pub(crate) fn eights_mut(row: &mut [f32], from: usize, count: usize) -> &mut [Eight] {
    let (eights, _) = row[from..from + 8 * count].as_chunks_mut();
    &mut eights[..count]
}

/// Something of each axis. (The array's own `map` is a call, which no register survives.)
#[inline(always)]
pub(crate) fn axes<T>(of: impl Fn(usize) -> T) -> [T; 3] {
    [of(0), of(1), of(2)]
}

/// Something of each of three.
#[inline(always)]
pub(crate) fn each<T, U>([x, y, z]: [T; 3], mut of: impl FnMut(T) -> U) -> [U; 3] {
    [of(x), of(y), of(z)]
}
