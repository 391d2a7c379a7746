//! The same arithmetic, one number or eight at a time, chosen when the program starts.
//!
//! A piece of [`Work`] is written once, over [`Lanes`]. Each lane goes through the operations of the
//! scalar program in their order, and +, -, x, / and the square root are exact in every width, so
//! all kernels give the same bits.

mod avx2;
mod lanes;
mod portable;
mod scalar;

pub(crate) use lanes::{Body, Eight, Lanes, Wide, axes, each, eights, eights_mut};
pub(crate) use portable::Portable;

/// Which program makes the steps. All of them give the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernels {
    /// One constraint after the other, without structure: what the others are compared with.
    Reference,
    /// Eight at a time, on any processor.
    Portable,
    /// Eight at a time by AVX2.
    Avx2,
}

impl Kernels {
    /// The fastest for this processor.
    pub fn best() -> Self {
        if Self::has_avx2() { Self::Avx2 } else { Self::Portable }
    }

    /// Those that this processor has.
    pub fn available() -> impl Iterator<Item = Self> {
        let all = [Self::Reference, Self::Portable, Self::Avx2];
        all.into_iter().filter(|kernels| *kernels != Self::Avx2 || Self::has_avx2())
    }

    #[cfg(target_arch = "x86_64")]
    fn has_avx2() -> bool {
        is_x86_feature_detected!("avx2")
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn has_avx2() -> bool {
        false
    }

    /// Does some work, eight numbers at a time.
    #[inline]
    pub(crate) fn run<T: Work>(self, work: T) -> T::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 if Self::has_avx2() => avx2::run(work),
            _ => work.run::<Portable>(),
        }
    }
}

/// A loop that is compiled for each width. Everything in it is inlined, or it would be compiled for
/// the oldest processor.
pub(crate) trait Work {
    /// What it gives back.
    type Output;

    /// Does it.
    fn run<W: Wide>(self) -> Self::Output;
}
