//! Eight lanes as a plain array, which the compiler vectorises as far as the target allows.

#![allow(
    unsafe_code,
    reason = "the trait's unsafe functions; this implementation checks every index"
)]

use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::lanes::{Lanes, Lanes8, PackedParticle, Wide};

/// Eight numbers in an array.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Portable(Lanes8);

/// Indices of the first of three classes of numbers, by lane.
const THIRDS: [usize; 8] = [0, 9, 18, 3, 12, 21, 6, 15];

impl Portable {
    #[inline(always)]
    fn zip_with(self, other: Self, with: impl Fn(f32, f32) -> f32) -> Self {
        let mut result = self.0;
        for (number, other) in result.iter_mut().zip(other.0) {
            *number = with(*number, other);
        }
        Self(result)
    }

    #[inline(always)]
    fn compare(self, other: Self, with: impl Fn(f32, f32) -> bool) -> [bool; 8] {
        let mut result = [false; 8];
        for (yes, (number, other)) in result.iter_mut().zip(self.0.into_iter().zip(other.0)) {
            *yes = with(number, other);
        }
        result
    }

    #[inline(always)]
    fn pick(low: Self, high: Self, lanes: [usize; 8]) -> Self {
        Self(lanes.map(|lane| if lane < 8 { low.0[lane] } else { high.0[lane - 8] }))
    }
}

impl Add for Portable {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip_with(other, |a, b| a + b)
    }
}

impl Sub for Portable {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip_with(other, |a, b| a - b)
    }
}

impl Mul for Portable {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip_with(other, |a, b| a * b)
    }
}

impl Div for Portable {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip_with(other, |a, b| a / b)
    }
}

impl Neg for Portable {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|number| -number))
    }
}

impl Lanes for Portable {
    type Mask = [bool; 8];

    #[inline(always)]
    fn splat(number: f32) -> Self {
        Self([number; 8])
    }

    #[inline(always)]
    fn load(from: &Lanes8, _lane: usize) -> Self {
        Self(*from)
    }

    #[inline(always)]
    fn store(self, to: &mut Lanes8, _lane: usize) {
        *to = self.0;
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }

    #[inline(always)]
    fn max_or_rhs(self, rhs: Self) -> Self {
        self.zip_with(rhs, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn is_below(self, other: Self) -> [bool; 8] {
        self.compare(other, |a, b| a < b)
    }

    #[inline(always)]
    fn is_at_most(self, other: Self) -> [bool; 8] {
        self.compare(other, |a, b| a <= b)
    }

    #[inline(always)]
    fn is_not_nan(self) -> [bool; 8] {
        self.0.map(|number| !number.is_nan())
    }

    #[inline(always)]
    fn both(a: [bool; 8], b: [bool; 8]) -> [bool; 8] {
        let mut result = a;
        for (yes, other) in result.iter_mut().zip(b) {
            *yes &= other;
        }
        result
    }

    #[inline(always)]
    fn select(mask: [bool; 8], yes: Self, no: Self) -> Self {
        let mut result = no.0;
        for (number, (mask, yes)) in result.iter_mut().zip(mask.into_iter().zip(yes.0)) {
            *number = if mask { yes } else { *number };
        }
        Self(result)
    }

    #[inline(always)]
    fn masked(self, mask: [bool; 8]) -> Self {
        Self::select(mask, self, Self::splat(0.0))
    }

    #[inline(always)]
    fn any(mask: [bool; 8]) -> bool {
        mask.contains(&true)
    }
}

impl Wide for Portable {
    #[inline(always)]
    fn bits(mask: [bool; 8]) -> u32 {
        let lanes = mask.iter().enumerate();
        lanes.fold(0, |bits, (lane, is_set)| bits | (u32::from(*is_set) << lane))
    }

    #[inline(always)]
    fn unzip(low: Self, high: Self) -> [Self; 2] {
        let even = Self::pick(low, high, [0, 2, 8, 10, 4, 6, 12, 14]);
        [even, Self::pick(low, high, [1, 3, 9, 11, 5, 7, 13, 15])]
    }

    #[inline(always)]
    fn zip(even: Self, odd: Self) -> [Self; 2] {
        let low = Self::pick(even, odd, [0, 8, 1, 9, 4, 12, 5, 13]);
        [low, Self::pick(even, odd, [2, 10, 3, 11, 6, 14, 7, 15])]
    }

    #[inline(always)]
    fn unzip_pairs(low: Self, high: Self) -> [Self; 2] {
        let even = Self::pick(low, high, [0, 1, 8, 9, 4, 5, 12, 13]);
        [even, Self::pick(low, high, [2, 3, 10, 11, 6, 7, 14, 15])]
    }

    #[inline(always)]
    fn zip_pairs(even: Self, odd: Self) -> [Self; 2] {
        // The exchange is its own inverse.
        Self::unzip_pairs(even, odd)
    }

    #[inline(always)]
    fn unzip_thirds(numbers: [Self; 3]) -> [Self; 3] {
        let number = |index: usize| numbers[index / 8].0[index % 8];
        [0, 1, 2].map(|third| Self(THIRDS.map(|index| number(index + third))))
    }

    #[inline(always)]
    fn zip_thirds(thirds: [Self; 3]) -> [Self; 3] {
        let mut numbers = [Self([0.0; 8]); 3];
        for (third, from) in thirds.into_iter().enumerate() {
            for (lane, index) in THIRDS.into_iter().enumerate() {
                numbers[(index + third) / 8].0[(index + third) % 8] = from.0[lane];
            }
        }
        numbers
    }

    #[inline(always)]
    fn columns(particles: &[PackedParticle; 8]) -> [[Self; 4]; 2] {
        let column = |number: usize| Self(particles.map(|particle| particle.0[number]));
        [[0, 1, 2, 3].map(column), [4, 5, 6, 7].map(column)]
    }

    #[inline(always)]
    fn set_displacements(particles: &mut [PackedParticle; 8], displacements: [Self; 3]) {
        for (lane, particle) in particles.iter_mut().enumerate() {
            for (axis, along) in displacements.iter().enumerate() {
                particle.0[4 + axis] = along.0[lane];
            }
        }
    }

    #[inline(always)]
    fn set_positions(particles: &mut [PackedParticle; 8], positions: [Self; 3]) {
        for (lane, particle) in particles.iter_mut().enumerate() {
            for (axis, along) in positions.iter().enumerate() {
                particle.0[axis] = along.0[lane];
            }
        }
    }

    #[inline(always)]
    unsafe fn differences(
        particles: &[Cell<PackedParticle>],
        a: &[u32; 8],
        b: &[u32; 8],
    ) -> [[Self; 3]; 2] {
        let mut halves = [[[0.0; 8]; 3]; 2];
        for lane in 0..8 {
            let (from, to) =
                (particles[a[lane] as usize].get().0, particles[b[lane] as usize].get().0);
            for (half, axes) in halves.iter_mut().enumerate() {
                for (axis, numbers) in axes.iter_mut().enumerate() {
                    numbers[lane] = to[4 * half + axis] - from[4 * half + axis];
                }
            }
        }
        halves.map(|axes| axes.map(Self))
    }

    #[inline(always)]
    unsafe fn subtract_displacements(
        particles: &[Cell<PackedParticle>],
        indices: &[u32; 8],
        amounts: [Self; 3],
    ) {
        for (lane, index) in indices.iter().enumerate() {
            let particle = &particles[*index as usize];
            let mut numbers = particle.get();
            for (axis, amount) in amounts.iter().enumerate() {
                numbers.0[4 + axis] -= amount.0[lane];
            }
            particle.set(numbers);
        }
    }
}
