//! Eight lanes as a register of AVX2: the one file of this crate, beside the threads' own, that
//! asks the processor for more than the language promises.
//!
//! Every operation stands for the scalar one in each lane: no fused multiply-add, no estimates.
#![cfg(target_arch = "x86_64")]
#![allow(unsafe_code, reason = "intrinsics of AVX2; see the invariant of `Avx2`")]
#![allow(clippy::wildcard_imports, reason = "all of their names begin with _mm256")]

use std::arch::x86_64::*;
use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::Work;
use super::lanes::{Eight, Lanes, Wide, axes};

/// Eight numbers. There are values of this type only within [`run`], on a processor with AVX2: that
/// is the invariant on which every block of this file rests.
#[derive(Clone, Copy)]
pub(crate) struct Avx2(__m256);

/// Eight times yes (all bits) or no.
#[derive(Clone, Copy)]
pub(crate) struct Mask(__m256);

/// Does some work by AVX2.
///
/// # Panics
/// If the processor has none.
#[inline]
pub(crate) fn run<T: Work>(work: T) -> T::Output {
    assert!(is_x86_feature_detected!("avx2"), "this processor has no AVX2");
    // SAFETY: the processor has AVX2, as was just seen.
    unsafe { run_there(work) }
}

/// Everything in the work is inlined here, and thus compiled for AVX2.
#[target_feature(enable = "avx2")]
fn run_there<T: Work>(work: T) -> T::Output {
    work.run::<Avx2>()
}

/// One intrinsic on values whose type proves the processor.
macro_rules! avx2 {
    ($operation:expr) => {
        // SAFETY: a value of `Avx2` or `Mask`, or `run` that makes them, needs AVX2; see `Avx2`.
        unsafe { $operation }
    };
}

impl Add for Avx2 {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(avx2!(_mm256_add_ps(self.0, other.0)))
    }
}

impl Sub for Avx2 {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(avx2!(_mm256_sub_ps(self.0, other.0)))
    }
}

impl Mul for Avx2 {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(avx2!(_mm256_mul_ps(self.0, other.0)))
    }
}

impl Div for Avx2 {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(avx2!(_mm256_div_ps(self.0, other.0)))
    }
}

impl Neg for Avx2 {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(avx2!(_mm256_xor_ps(self.0, Self::splat(-0.0).0)))
    }
}

impl Lanes for Avx2 {
    type Mask = Mask;

    #[inline(always)]
    fn splat(number: f32) -> Self {
        Self(avx2!(_mm256_set1_ps(number)))
    }

    #[inline(always)]
    fn load(from: &Eight, _lane: usize) -> Self {
        let pointer = from.as_ptr();
        // SAFETY: eight numbers lie there; this load takes any address.
        Self(unsafe { _mm256_loadu_ps(pointer) })
    }

    #[inline(always)]
    fn store(self, to: &mut Eight, _lane: usize) {
        let pointer = to.as_mut_ptr();
        // SAFETY: as in `load`.
        unsafe { _mm256_storeu_ps(pointer, self.0) };
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(avx2!(_mm256_sqrt_ps(self.0)))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(avx2!(_mm256_andnot_ps(Self::splat(-0.0).0, self.0)))
    }

    #[inline(always)]
    fn is_below(self, other: Self) -> Mask {
        Mask(avx2!(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)))
    }

    #[inline(always)]
    fn is_at_most(self, other: Self) -> Mask {
        Mask(avx2!(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)))
    }

    #[inline(always)]
    fn is_not_zero(self) -> Mask {
        Mask(avx2!(_mm256_cmp_ps::<_CMP_NEQ_UQ>(self.0, Self::splat(0.0).0)))
    }

    #[inline(always)]
    fn both(a: Mask, b: Mask) -> Mask {
        Mask(avx2!(_mm256_and_ps(a.0, b.0)))
    }

    #[inline(always)]
    fn choose(mask: Mask, yes: Self, no: Self) -> Self {
        Self(avx2!(_mm256_blendv_ps(no.0, yes.0, mask.0)))
    }

    #[inline(always)]
    fn only(self, mask: Mask) -> Self {
        Self(avx2!(_mm256_and_ps(self.0, mask.0)))
    }

    #[inline(always)]
    fn any(mask: Mask) -> bool {
        avx2!(_mm256_movemask_ps(mask.0)) != 0
    }
}

impl Avx2 {
    /// Half of a body for each of two lanes of 128 bits.
    #[inline(always)]
    fn difference(bodies: &[Cell<Eight>], a: u32, b: u32) -> Self {
        Self::load(&bodies[b as usize].get(), 0) - Self::load(&bodies[a as usize].get(), 0)
    }

    /// The differences of four pairs, by columns.
    #[inline(always)]
    fn four(bodies: &[Cell<Eight>], a: &[u32; 8], b: &[u32; 8], first: usize) -> [Self; 3] {
        Self::columns([
            Self::difference(bodies, a[first], b[first]),
            Self::difference(bodies, a[first + 1], b[first + 1]),
            Self::difference(bodies, a[first + 2], b[first + 2]),
            Self::difference(bodies, a[first + 3], b[first + 3]),
        ])
    }

    #[inline(always)]
    fn low_halves(low: Self, high: Self) -> Self {
        Self(avx2!(_mm256_permute2f128_ps::<0x20>(low.0, high.0)))
    }

    #[inline(always)]
    fn high_halves(low: Self, high: Self) -> Self {
        Self(avx2!(_mm256_permute2f128_ps::<0x31>(low.0, high.0)))
    }

    /// Four bodies to x, y, z of their first halves (low four lanes) and second halves (high).
    #[inline(always)]
    fn columns([a, b, c, d]: [Self; 4]) -> [Self; 3] {
        // x y of a and b, of c and d; z of a and b, of c and d.
        let low_ab = avx2!(_mm256_unpacklo_ps(a.0, b.0));
        let low_cd = avx2!(_mm256_unpacklo_ps(c.0, d.0));
        let high_ab = avx2!(_mm256_unpackhi_ps(a.0, b.0));
        let high_cd = avx2!(_mm256_unpackhi_ps(c.0, d.0));
        [
            Self(avx2!(_mm256_shuffle_ps::<0x44>(low_ab, low_cd))),
            Self(avx2!(_mm256_shuffle_ps::<0xEE>(low_ab, low_cd))),
            Self(avx2!(_mm256_shuffle_ps::<0x44>(high_ab, high_cd))),
        ]
    }
}

impl Wide for Avx2 {
    #[inline(always)]
    fn unzip(low: Self, high: Self) -> [Self; 2] {
        let even = avx2!(_mm256_shuffle_ps::<0x88>(low.0, high.0));
        [Self(even), Self(avx2!(_mm256_shuffle_ps::<0xDD>(low.0, high.0)))]
    }

    #[inline(always)]
    fn zip(even: Self, odd: Self) -> [Self; 2] {
        let low = avx2!(_mm256_unpacklo_ps(even.0, odd.0));
        [Self(low), Self(avx2!(_mm256_unpackhi_ps(even.0, odd.0)))]
    }

    #[inline(always)]
    fn unzip_pairs(low: Self, high: Self) -> [Self; 2] {
        let even = avx2!(_mm256_shuffle_ps::<0x44>(low.0, high.0));
        [Self(even), Self(avx2!(_mm256_shuffle_ps::<0xEE>(low.0, high.0)))]
    }

    #[inline(always)]
    fn zip_pairs(even: Self, odd: Self) -> [Self; 2] {
        Self::unzip_pairs(even, odd)
    }

    #[inline(always)]
    fn differences(bodies: &[Cell<Eight>], a: &[u32; 8], b: &[u32; 8]) -> [[Self; 3]; 2] {
        let (low, high) = (Self::four(bodies, a, b, 0), Self::four(bodies, a, b, 4));
        [
            axes(|axis| Self::low_halves(low[axis], high[axis])),
            axes(|axis| Self::high_halves(low[axis], high[axis])),
        ]
    }

    #[inline(always)]
    fn take(bodies: &[Cell<Eight>], from: &[u32; 8], [x, y, z]: [Self; 3]) {
        // Back to four numbers a body, for bodies 0 and 4, 1 and 5, 2 and 6, 3 and 7; before them,
        // four zeros for the first half of the body.
        let zero = Self::splat(0.0).0;
        let low_xy = avx2!(_mm256_unpacklo_ps(x.0, y.0));
        let high_xy = avx2!(_mm256_unpackhi_ps(x.0, y.0));
        let low_z = avx2!(_mm256_unpacklo_ps(z.0, zero));
        let high_z = avx2!(_mm256_unpackhi_ps(z.0, zero));
        let rows = [
            Self(avx2!(_mm256_shuffle_ps::<0x44>(low_xy, low_z))),
            Self(avx2!(_mm256_shuffle_ps::<0xEE>(low_xy, low_z))),
            Self(avx2!(_mm256_shuffle_ps::<0x44>(high_xy, high_z))),
            Self(avx2!(_mm256_shuffle_ps::<0xEE>(high_xy, high_z))),
        ];
        for (lane, row) in rows.into_iter().enumerate() {
            row.take_low(&bodies[from[lane] as usize]);
            row.take_high(&bodies[from[lane + 4] as usize]);
        }
    }
}

impl Avx2 {
    /// Takes the low half from the second half of a body.
    #[inline(always)]
    fn take_low(self, body: &Cell<Eight>) {
        // 0, 0, 0, 0, then the low half.
        Self(avx2!(_mm256_permute2f128_ps::<0x08>(self.0, self.0))).take_from(body);
    }

    /// Takes the high half from the second half of a body.
    #[inline(always)]
    fn take_high(self, body: &Cell<Eight>) {
        Self(avx2!(_mm256_permute2f128_ps::<0x18>(self.0, self.0))).take_from(body);
    }

    #[inline(always)]
    fn take_from(self, body: &Cell<Eight>) {
        let mut numbers = body.get();
        (Self::load(&numbers, 0) - self).store(&mut numbers, 0);
        body.set(numbers);
    }
}
