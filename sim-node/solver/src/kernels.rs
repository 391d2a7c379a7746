//! The arithmetic of the step, for one number or eight at a time, selected when the program starts.
//!
//! Each lane performs the operations of the scalar program in the same order, and +, -, x, / and
//! the square root are exact in every width, so all kernels produce the same bits.

mod avx2;
pub(crate) mod huge_pages;
pub(crate) mod lanes;
pub(crate) mod lent_slice;
mod portable;
mod scalar;
pub(crate) mod stream;
pub(crate) mod vectors;
pub(crate) mod worker_pool;

use lanes::LaneWork;

/// Implementation of the step's arithmetic. All of them produce the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernels {
    /// One constraint after the other, without structure: the oracle for the others.
    Reference,
    /// Eight lanes in the baseline registers of any processor.
    Portable,
    /// Eight lanes in AVX2 registers.
    Avx2,
}

impl Kernels {
    /// Returns the fastest kernels for this processor.
    pub fn best() -> Self {
        if Self::has_avx2() { Self::Avx2 } else { Self::Portable }
    }

    /// Returns the kernels that this processor supports.
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

    /// Runs work on eight lanes.
    #[inline]
    pub(crate) fn run<T: LaneWork>(self, work: T) -> T::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 if Self::has_avx2() => avx2::run(work),
            _ => portable::run(work),
        }
    }
}
