//! A single lane: `f32` itself.

use super::lanes::{Lanes, Lanes8};

impl Lanes for f32 {
    type Mask = bool;

    #[inline(always)]
    fn splat(number: f32) -> Self {
        number
    }

    #[inline(always)]
    fn load(from: &Lanes8, lane: usize) -> Self {
        from[lane]
    }

    #[inline(always)]
    fn store(self, to: &mut Lanes8, lane: usize) {
        to[lane] = self;
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }

    #[inline(always)]
    fn max_or_rhs(self, rhs: Self) -> Self {
        if self > rhs { self } else { rhs }
    }

    #[inline(always)]
    fn is_below(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    fn is_at_most(self, other: Self) -> bool {
        self <= other
    }

    #[inline(always)]
    fn is_not_nan(self) -> bool {
        !self.is_nan()
    }

    #[inline(always)]
    fn both(a: bool, b: bool) -> bool {
        a & b
    }

    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    #[inline(always)]
    fn masked(self, mask: bool) -> Self {
        if mask { self } else { 0.0 }
    }

    #[inline(always)]
    fn any(mask: bool) -> bool {
        mask
    }
}
