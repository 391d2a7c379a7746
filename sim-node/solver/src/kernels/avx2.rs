//! Eight lanes in an AVX2 register.
//!
//! Every operation is the scalar one in each lane: no fused multiply-add, no estimates.
#![cfg(target_arch = "x86_64")]
#![allow(unsafe_code, reason = "intrinsics of AVX2; see the invariant of `Avx2`")]
#![allow(clippy::wildcard_imports, reason = "all of their names begin with _mm256")]

use std::arch::x86_64::*;
use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::lanes::{LaneWork, Lanes, Lanes8, PackedParticle, Wide, axes};

/// Eight numbers. Values of this type exist only within [`run`], on a processor with AVX2. Every
/// `unsafe` block of this file relies on that invariant.
#[derive(Clone, Copy)]
pub(crate) struct Avx2(__m256);

/// Eight booleans: all bits set, or none.
#[derive(Clone, Copy)]
pub(crate) struct Avx2Mask(__m256);

/// Runs work on AVX2 registers.
///
/// # Panics
/// If the processor lacks AVX2.
#[inline]
pub(crate) fn run<T: LaneWork>(work: T) -> T::Output {
    assert!(is_x86_feature_detected!("avx2"), "this processor lacks AVX2");
    // SAFETY: the assertion above proves that the processor has AVX2.
    unsafe { run_inlined(work) }
}

/// The work is inlined here and thus compiled for AVX2.
#[target_feature(enable = "avx2")]
fn run_inlined<T: LaneWork>(work: T) -> T::Output {
    work.run::<Avx2>()
}

/// Wraps one intrinsic on values whose type proves that the processor has AVX2.
macro_rules! avx2 {
    ($operation:expr) => {
        // SAFETY: values of `Avx2` and `Avx2Mask` exist only where AVX2 does; see `Avx2`.
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
    type Mask = Avx2Mask;

    #[inline(always)]
    fn splat(number: f32) -> Self {
        Self(avx2!(_mm256_set1_ps(number)))
    }

    #[inline(always)]
    fn load(from: &Lanes8, _lane: usize) -> Self {
        let pointer = from.as_ptr();
        // SAFETY: the array holds eight numbers, and this load needs no alignment.
        Self(unsafe { _mm256_loadu_ps(pointer) })
    }

    #[inline(always)]
    fn store(self, to: &mut Lanes8, _lane: usize) {
        let pointer = to.as_mut_ptr();
        // SAFETY: the array holds eight numbers, and this store needs no alignment.
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
    fn max_or_rhs(self, rhs: Self) -> Self {
        // The instruction returns its second operand on ties and NaN, as the trait requires.
        Self(avx2!(_mm256_max_ps(self.0, rhs.0)))
    }

    #[inline(always)]
    fn is_below(self, other: Self) -> Avx2Mask {
        Avx2Mask(avx2!(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)))
    }

    #[inline(always)]
    fn is_at_most(self, other: Self) -> Avx2Mask {
        Avx2Mask(avx2!(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)))
    }

    #[inline(always)]
    fn is_not_nan(self) -> Avx2Mask {
        Avx2Mask(avx2!(_mm256_cmp_ps::<_CMP_ORD_Q>(self.0, self.0)))
    }

    #[inline(always)]
    fn both(a: Avx2Mask, b: Avx2Mask) -> Avx2Mask {
        Avx2Mask(avx2!(_mm256_and_ps(a.0, b.0)))
    }

    #[inline(always)]
    fn select(mask: Avx2Mask, yes: Self, no: Self) -> Self {
        Self(avx2!(_mm256_blendv_ps(no.0, yes.0, mask.0)))
    }

    #[inline(always)]
    fn masked(self, mask: Avx2Mask) -> Self {
        Self(avx2!(_mm256_and_ps(self.0, mask.0)))
    }

    #[inline(always)]
    fn any(mask: Avx2Mask) -> bool {
        avx2!(_mm256_movemask_ps(mask.0)) != 0
    }
}

impl Avx2 {
    /// Component-wise `b - a`.
    ///
    /// # Safety
    /// `a` and `b` must be below `particles.len()`.
    #[inline(always)]
    unsafe fn difference(particles: &[Cell<PackedParticle>], a: u32, b: u32) -> Self {
        // SAFETY: guaranteed by the caller.
        let from = unsafe { particles.get_unchecked(a as usize) };
        // SAFETY: as above.
        let to = unsafe { particles.get_unchecked(b as usize) };
        Self::load(&to.get().0, 0) - Self::load(&from.get().0, 0)
    }

    /// Differences of four pairs, transposed to columns.
    ///
    /// # Safety
    /// Every index in `a` and `b` must be below `particles.len()`.
    #[inline(always)]
    unsafe fn four(
        particles: &[Cell<PackedParticle>],
        a: &[u32; 8],
        b: &[u32; 8],
        first: usize,
    ) -> [Self; 3] {
        let mut rows = [Self::splat(0.0); 4];
        for (lane, row) in rows.iter_mut().enumerate() {
            // SAFETY: guaranteed by the caller.
            *row = unsafe { Self::difference(particles, a[first + lane], b[first + lane]) };
        }
        Self::three_columns(rows)
    }

    #[inline(always)]
    fn low_halves(low: Self, high: Self) -> Self {
        Self(avx2!(_mm256_permute2f128_ps::<0x20>(low.0, high.0)))
    }

    #[inline(always)]
    fn high_halves(low: Self, high: Self) -> Self {
        Self(avx2!(_mm256_permute2f128_ps::<0x31>(low.0, high.0)))
    }

    /// Transposes four particles to x, y, z of their first halves (low lanes) and second halves
    /// (high lanes).
    #[inline(always)]
    fn three_columns([a, b, c, d]: [Self; 4]) -> [Self; 3] {
        // x and y of a and b, then of c and d; z of a and b, then of c and d.
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
    fn bits(mask: Avx2Mask) -> u32 {
        avx2!(_mm256_movemask_ps(mask.0)).cast_unsigned()
    }

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
    fn unzip_thirds([a, b, c]: [Self; 3]) -> [Self; 3] {
        // Numbers of one class lie in different lanes of the three registers.
        let [zero, one, two] = [
            Self::pick_thirds([a, b, c]),
            Self::pick_thirds([c, a, b]),
            Self::pick_thirds([b, c, a]),
        ];
        [zero, one.rotated::<1>(), two.rotated::<2>()]
    }

    #[inline(always)]
    fn zip_thirds([zero, one, two]: [Self; 3]) -> [Self; 3] {
        let (one, two) = (one.rotated::<7>(), two.rotated::<6>());
        [
            Self::pick_thirds([zero, one, two]),
            Self::pick_thirds([two, zero, one]),
            Self::pick_thirds([one, two, zero]),
        ]
    }

    #[inline(always)]
    fn columns(particles: &[PackedParticle; 8]) -> [[Self; 4]; 2] {
        let [a, b, c, d, e, f, g, h] = particles;
        let low = Self::transpose([a, b, c, d]);
        let high = Self::transpose([e, f, g, h]);
        let first = |number: usize| Self::low_halves(low[number], high[number]);
        let second = |number: usize| Self::high_halves(low[number], high[number]);
        [[first(0), first(1), first(2), first(3)], [second(0), second(1), second(2), second(3)]]
    }

    #[inline(always)]
    fn set_displacements(particles: &mut [PackedParticle; 8], displacements: [Self; 3]) {
        let rows = Self::rows(displacements);
        let [a, b, c, d, e, f, g, h] = particles;
        for (row, [low, high]) in rows.into_iter().zip([[a, e], [b, f], [c, g], [d, h]]) {
            row.low_as_second().set_second(low);
            row.high_as_second().set_second(high);
        }
    }

    #[inline(always)]
    fn set_positions(particles: &mut [PackedParticle; 8], positions: [Self; 3]) {
        let rows = Self::rows(positions);
        let [a, b, c, d, e, f, g, h] = particles;
        for (row, [low, high]) in rows.into_iter().zip([[a, e], [b, f], [c, g], [d, h]]) {
            row.set_position(low);
            Self::high_halves(row, row).set_position(high);
        }
    }

    #[inline(always)]
    unsafe fn differences(
        particles: &[Cell<PackedParticle>],
        a: &[u32; 8],
        b: &[u32; 8],
    ) -> [[Self; 3]; 2] {
        // SAFETY: guaranteed by the caller.
        let low = unsafe { Self::four(particles, a, b, 0) };
        // SAFETY: as above.
        let high = unsafe { Self::four(particles, a, b, 4) };
        [
            axes(|axis| Self::low_halves(low[axis], high[axis])),
            axes(|axis| Self::high_halves(low[axis], high[axis])),
        ]
    }

    #[inline(always)]
    unsafe fn subtract_displacements(
        particles: &[Cell<PackedParticle>],
        indices: &[u32; 8],
        amounts: [Self; 3],
    ) {
        for (lane, row) in Self::rows(amounts).into_iter().enumerate() {
            // SAFETY: guaranteed by the caller.
            let low = unsafe { particles.get_unchecked(indices[lane] as usize) };
            // SAFETY: as above.
            let high = unsafe { particles.get_unchecked(indices[lane + 4] as usize) };
            row.low_as_second().subtract_from(low);
            row.high_as_second().subtract_from(high);
        }
    }
}

impl Avx2 {
    /// Lanes 0, 3, 6 of the first, 1, 4, 7 of the second, and 2, 5 of the third.
    #[inline(always)]
    fn pick_thirds([a, b, c]: [Self; 3]) -> Self {
        let ab = avx2!(_mm256_blend_ps::<0b1001_0010>(a.0, b.0));
        Self(avx2!(_mm256_blend_ps::<0b0010_0100>(ab, c.0)))
    }

    /// Lane `i` becomes lane `i` + `BY` modulo 8 of the argument.
    #[inline(always)]
    fn rotated<const BY: i32>(self) -> Self {
        let lanes = avx2!(_mm256_setr_epi32(
            BY % 8,
            (BY + 1) % 8,
            (BY + 2) % 8,
            (BY + 3) % 8,
            (BY + 4) % 8,
            (BY + 5) % 8,
            (BY + 6) % 8,
            (BY + 7) % 8
        ));
        Self(avx2!(_mm256_permutevar8x32_ps(self.0, lanes)))
    }

    /// Transposes columns to rows of x, y, z, 0: particles 0 and 4, 1 and 5, 2 and 6, 3 and 7.
    #[inline(always)]
    fn rows([x, y, z]: [Self; 3]) -> [Self; 4] {
        let zero = Self::splat(0.0).0;
        let low_xy = avx2!(_mm256_unpacklo_ps(x.0, y.0));
        let high_xy = avx2!(_mm256_unpackhi_ps(x.0, y.0));
        let low_z = avx2!(_mm256_unpacklo_ps(z.0, zero));
        let high_z = avx2!(_mm256_unpackhi_ps(z.0, zero));
        [
            Self(avx2!(_mm256_shuffle_ps::<0x44>(low_xy, low_z))),
            Self(avx2!(_mm256_shuffle_ps::<0xEE>(low_xy, low_z))),
            Self(avx2!(_mm256_shuffle_ps::<0x44>(high_xy, high_z))),
            Self(avx2!(_mm256_shuffle_ps::<0xEE>(high_xy, high_z))),
        ]
    }

    /// Transposes four particles to columns: their first halves in the low lanes, their second
    /// halves in the high lanes.
    #[inline(always)]
    fn transpose([a, b, c, d]: [&PackedParticle; 4]) -> [Self; 4] {
        let (a, b) = (Self::load(&a.0, 0), Self::load(&b.0, 0));
        let (c, d) = (Self::load(&c.0, 0), Self::load(&d.0, 0));
        let high_ab = avx2!(_mm256_unpackhi_ps(a.0, b.0));
        let high_cd = avx2!(_mm256_unpackhi_ps(c.0, d.0));
        let [x, y, z] = Self::three_columns([a, b, c, d]);
        [x, y, z, Self(avx2!(_mm256_shuffle_ps::<0xEE>(high_ab, high_cd)))]
    }

    /// Four zeros, then the low half.
    #[inline(always)]
    fn low_as_second(self) -> Self {
        Self(avx2!(_mm256_permute2f128_ps::<0x08>(self.0, self.0)))
    }

    /// Four zeros, then the high half.
    #[inline(always)]
    fn high_as_second(self) -> Self {
        Self(avx2!(_mm256_permute2f128_ps::<0x18>(self.0, self.0)))
    }

    #[inline(always)]
    fn set_second(self, particle: &mut PackedParticle) {
        let before = Self::load(&particle.0, 0);
        Self(avx2!(_mm256_blend_ps::<0xF0>(before.0, self.0))).store(&mut particle.0, 0);
    }

    /// Stores the first three lanes.
    #[inline(always)]
    fn set_position(self, particle: &mut PackedParticle) {
        let before = Self::load(&particle.0, 0);
        Self(avx2!(_mm256_blend_ps::<0b0111>(before.0, self.0))).store(&mut particle.0, 0);
    }

    #[inline(always)]
    fn subtract_from(self, particle: &Cell<PackedParticle>) {
        let mut numbers = particle.get();
        (Self::load(&numbers.0, 0) - self).store(&mut numbers.0, 0);
        particle.set(numbers);
    }
}
