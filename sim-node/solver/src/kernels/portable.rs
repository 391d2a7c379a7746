//! Eight lanes in the baseline registers of any processor: SSE2, NEON, or SIMD of WebAssembly.

#![allow(
    unsafe_code,
    reason = "the trait's unsafe functions; this implementation checks every index"
)]

use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};

use wide::f32x8;

use super::lanes::{LaneWork, Lanes, Lanes8, PackedParticle, Wide, axes, map_axes};

/// Eight numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Portable(f32x8);

/// Eight booleans: all bits set, or none.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PortableMask(f32x8);

/// Indices of the first of three classes of numbers, by lane.
const THIRDS: [usize; 8] = [0, 9, 18, 3, 12, 21, 6, 15];

/// Runs work on baseline registers. Not inlined: it would be compiled again for each of its callers.
#[inline(never)]
pub(crate) fn run<T: LaneWork>(work: T) -> T::Output {
    work.run::<Portable>()
}

/// Builds eight lanes, lane by lane. (Loops over the lanes slow the compiler down.)
#[inline(always)]
fn by_lane(number: impl Fn(usize) -> f32) -> Portable {
    let (low, high) = ([0, 1, 2, 3].map(&number), [4, 5, 6, 7].map(&number));
    let ([a, b, c, d], [e, f, g, h]) = (low, high);
    Portable(f32x8::new([a, b, c, d, e, f, g, h]))
}

impl Portable {
    /// Numbers of `low`, from 0, and of `high`, from 8.
    #[inline(always)]
    fn pick(low: Self, high: Self, from: [usize; 8]) -> Self {
        let (low, high) = (low.0.to_array(), high.0.to_array());
        by_lane(|lane| match from[lane] {
            number @ 0..8 => low[number],
            number => high[number - 8],
        })
    }
}

impl Add for Portable {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl Sub for Portable {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}

impl Mul for Portable {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0)
    }
}

impl Div for Portable {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(self.0 / other.0)
    }
}

impl Neg for Portable {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Lanes for Portable {
    type Mask = PortableMask;

    #[inline(always)]
    fn splat(number: f32) -> Self {
        Self(f32x8::splat(number))
    }

    #[inline(always)]
    fn load(from: &Lanes8, _lane: usize) -> Self {
        Self(f32x8::new(*from))
    }

    #[inline(always)]
    fn store(self, to: &mut Lanes8, _lane: usize) {
        *to = self.0.to_array();
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs())
    }

    #[inline(always)]
    fn max_or_rhs(self, rhs: Self) -> Self {
        // Not a maximum of `wide`: instruction sets differ in the maximum of equal numbers and of NaN.
        Self(self.0.simd_gt(rhs.0).bitselect(self.0, rhs.0))
    }

    #[inline(always)]
    fn is_below(self, other: Self) -> PortableMask {
        PortableMask(self.0.simd_lt(other.0))
    }

    #[inline(always)]
    fn is_at_most(self, other: Self) -> PortableMask {
        PortableMask(self.0.simd_le(other.0))
    }

    #[inline(always)]
    fn is_not_nan(self) -> PortableMask {
        PortableMask(self.0.simd_eq(self.0))
    }

    #[inline(always)]
    fn both(a: PortableMask, b: PortableMask) -> PortableMask {
        PortableMask(a.0 & b.0)
    }

    #[inline(always)]
    fn select(mask: PortableMask, yes: Self, no: Self) -> Self {
        Self(mask.0.bitselect(yes.0, no.0))
    }

    #[inline(always)]
    fn masked(self, mask: PortableMask) -> Self {
        Self(self.0 & mask.0)
    }

    #[inline(always)]
    fn any(mask: PortableMask) -> bool {
        mask.0.any()
    }
}

impl Wide for Portable {
    #[inline(always)]
    fn bits(mask: PortableMask) -> u32 {
        mask.0.to_bitmask()
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
        let [a, b, c] = map_axes(numbers, |numbers| numbers.0.to_array());
        axes(|third| {
            by_lane(|lane| match THIRDS[lane] + third {
                index @ 0..8 => a[index],
                index @ 8..16 => b[index - 8],
                index => c[index - 16],
            })
        })
    }

    #[inline(always)]
    fn zip_thirds(thirds: [Self; 3]) -> [Self; 3] {
        let thirds = map_axes(thirds, |third| third.0.to_array());
        // A third of `THIRDS` is its own inverse.
        let number = |index: usize| thirds[index % 3][THIRDS[index / 3] / 3];
        axes(|numbers| by_lane(|lane| number(8 * numbers + lane)))
    }

    #[inline(always)]
    fn columns(particles: &[PackedParticle; 8]) -> [[Self; 4]; 2] {
        let column = |number: usize| by_lane(|lane| particles[lane].0[number]);
        [[column(0), column(1), column(2), column(3)], [column(4), column(5), column(6), column(7)]]
    }

    #[inline(always)]
    fn set_displacements(particles: &mut [PackedParticle; 8], displacements: [Self; 3]) {
        let displacements = map_axes(displacements, |along| along.0.to_array());
        for (lane, particle) in particles.iter_mut().enumerate() {
            for (axis, along) in displacements.iter().enumerate() {
                particle.0[4 + axis] = along[lane];
            }
        }
    }

    #[inline(always)]
    fn set_positions(particles: &mut [PackedParticle; 8], positions: [Self; 3]) {
        let positions = map_axes(positions, |along| along.0.to_array());
        for (lane, particle) in particles.iter_mut().enumerate() {
            for (axis, along) in positions.iter().enumerate() {
                particle.0[axis] = along[lane];
            }
        }
    }

    #[inline(always)]
    unsafe fn differences(
        particles: &[Cell<PackedParticle>],
        a: &[u32; 8],
        b: &[u32; 8],
    ) -> [[Self; 3]; 2] {
        let particle = |index: u32| particles[index as usize].get().0;
        let (from, to) = (a.map(particle), b.map(particle));
        let difference = |number: usize| by_lane(|lane| to[lane][number] - from[lane][number]);
        [axes(difference), axes(|axis| difference(4 + axis))]
    }

    #[inline(always)]
    unsafe fn subtract_displacements(
        particles: &[Cell<PackedParticle>],
        indices: &[u32; 8],
        amounts: [Self; 3],
    ) {
        let amounts = map_axes(amounts, |amount| amount.0.to_array());
        for (lane, index) in indices.iter().enumerate() {
            let particle = &particles[*index as usize];
            let mut numbers = particle.get();
            for (axis, amount) in amounts.iter().enumerate() {
                numbers.0[4 + axis] -= amount[lane];
            }
            particle.set(numbers);
        }
    }
}
