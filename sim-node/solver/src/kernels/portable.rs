//! Eight lanes as a plain array, which the compiler vectorises as far as the target allows.

#![allow(
    unsafe_code,
    reason = "the trait's unsafe functions; this implementation checks every index"
)]

use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::lanes::{LaneWork, Lanes, Lanes8, PackedParticle, Wide, axes};

/// Eight numbers in an array.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Portable(Lanes8);

/// Indices of the first of three classes of numbers, by lane.
const THIRDS: [usize; 8] = [0, 9, 18, 3, 12, 21, 6, 15];

/// An array of one expression for each lane.
///
/// Written out: loops over the lanes would be unrolled anyway, and the compiler takes minutes for thousands
/// of them in one function.
macro_rules! by_lane {
    (|$lane:ident| $value:expr) => {
        [
            by_lane!($lane = 0, $value),
            by_lane!($lane = 1, $value),
            by_lane!($lane = 2, $value),
            by_lane!($lane = 3, $value),
            by_lane!($lane = 4, $value),
            by_lane!($lane = 5, $value),
            by_lane!($lane = 6, $value),
            by_lane!($lane = 7, $value),
        ]
    };
    ($lane:ident = $number:literal, $value:expr) => {{
        let $lane = $number;
        $value
    }};
}

/// Runs work on arrays. Not inlined: it would be compiled again for each of its callers.
#[inline(never)]
pub(crate) fn run<T: LaneWork>(work: T) -> T::Output {
    work.run::<Portable>()
}

impl Portable {
    /// Numbers of `low`, from 0, and of `high`, from 8.
    #[inline(always)]
    fn pick(low: Self, high: Self, from: [usize; 8]) -> Self {
        Self(by_lane!(|lane| match from[lane] {
            number @ 0..8 => low.0[number],
            number => high.0[number - 8],
        }))
    }
}

impl Add for Portable {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(by_lane!(|lane| self.0[lane] + other.0[lane]))
    }
}

impl Sub for Portable {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(by_lane!(|lane| self.0[lane] - other.0[lane]))
    }
}

impl Mul for Portable {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(by_lane!(|lane| self.0[lane] * other.0[lane]))
    }
}

impl Div for Portable {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(by_lane!(|lane| self.0[lane] / other.0[lane]))
    }
}

impl Neg for Portable {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(by_lane!(|lane| -self.0[lane]))
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
        Self(by_lane!(|lane| self.0[lane].sqrt()))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(by_lane!(|lane| self.0[lane].abs()))
    }

    #[inline(always)]
    fn max_or_rhs(self, rhs: Self) -> Self {
        Self(by_lane!(|lane| match (self.0[lane], rhs.0[lane]) {
            (number, rhs) if number > rhs => number,
            (_, rhs) => rhs,
        }))
    }

    #[inline(always)]
    fn is_below(self, other: Self) -> [bool; 8] {
        by_lane!(|lane| self.0[lane] < other.0[lane])
    }

    #[inline(always)]
    fn is_at_most(self, other: Self) -> [bool; 8] {
        by_lane!(|lane| self.0[lane] <= other.0[lane])
    }

    #[inline(always)]
    fn is_not_nan(self) -> [bool; 8] {
        by_lane!(|lane| !self.0[lane].is_nan())
    }

    #[inline(always)]
    fn both(a: [bool; 8], b: [bool; 8]) -> [bool; 8] {
        by_lane!(|lane| a[lane] & b[lane])
    }

    #[inline(always)]
    fn select(mask: [bool; 8], yes: Self, no: Self) -> Self {
        Self(by_lane!(|lane| if mask[lane] { yes.0[lane] } else { no.0[lane] }))
    }

    #[inline(always)]
    fn masked(self, mask: [bool; 8]) -> Self {
        Self::select(mask, self, Self::splat(0.0))
    }

    #[inline(always)]
    fn any(mask: [bool; 8]) -> bool {
        Self::bits(mask) != 0
    }
}

impl Wide for Portable {
    #[inline(always)]
    fn bits(mask: [bool; 8]) -> u32 {
        let [a, b, c, d, e, f, g, h] = by_lane!(|lane| u32::from(mask[lane]) << lane);
        a | b | c | d | e | f | g | h
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
        axes(|third| {
            Self(by_lane!(|lane| {
                let index = THIRDS[lane] + third;
                numbers[index / 8].0[index % 8]
            }))
        })
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
        let column = |number: usize| Self(by_lane!(|lane| particles[lane].0[number]));
        [[column(0), column(1), column(2), column(3)], [column(4), column(5), column(6), column(7)]]
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
        let from = by_lane!(|lane| particles[a[lane] as usize].get().0);
        let to = by_lane!(|lane| particles[b[lane] as usize].get().0);
        let difference =
            |number: usize| Self(by_lane!(|lane| to[lane][number] - from[lane][number]));
        [axes(difference), axes(|axis| difference(4 + axis))]
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
