//! Copies to memory that nobody reads soon.

use bytemuck::cast_slice;

use crate::state::particles::Particle;

/// Copies particles without reading the target into the caches first. It takes half the time of a copy
/// through them if the target is not in a cache, and keeps there what the next step needs.
///
/// # Panics
/// If the lengths differ.
pub(crate) fn copy_past_caches(target: &mut [Particle], source: &[Particle]) {
    assert_eq!(target.len(), source.len());
    let (target, source): (&mut [[f32; 4]], &[[f32; 4]]) =
        (bytemuck::cast_slice_mut(target), cast_slice(source));
    #[cfg(target_arch = "x86_64")]
    if is_aligned(target) {
        #[allow(unsafe_code, reason = "a function for a feature of the processor")]
        // SAFETY: every x86-64 processor has SSE.
        unsafe {
            stream(target, source);
        }
        return;
    }
    target.copy_from_slice(source);
}

/// Returns true if streaming stores can write to `target`.
#[cfg(target_arch = "x86_64")]
fn is_aligned(target: &[[f32; 4]]) -> bool {
    target.as_ptr().addr().is_multiple_of(16)
}

/// Copies with streaming stores.
///
/// # Panics
/// If `target` is not aligned to 16 bytes.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "sse")]
#[allow(unsafe_code, reason = "streaming stores have no safe form")]
fn stream(target: &mut [[f32; 4]], source: &[[f32; 4]]) {
    use std::arch::x86_64::{_mm_set_ps, _mm_sfence, _mm_stream_ps};

    assert!(is_aligned(target));
    for (to, [a, b, c, d]) in target.iter_mut().zip(source) {
        let value = _mm_set_ps(*d, *c, *b, *a);
        // SAFETY: `to` has 16 bytes, and is aligned to 16 because the first one is.
        unsafe { _mm_stream_ps(to.as_mut_ptr(), value) };
    }
    // Orders the stores before all that follows, as other stores are by themselves.
    _mm_sfence();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_is_copied_at_any_alignment() {
        for shift in 0..4 {
            let source: Vec<f32> = (0..800).map(|index| f32::from_bits(index * 7)).collect();
            let mut target = vec![0.0_f32; 804];
            let range = shift..shift + 800;
            copy_past_caches(
                bytemuck::cast_slice_mut(&mut target[range.clone()]),
                cast_slice(&source),
            );
            let bits =
                |numbers: &[f32]| numbers.iter().map(|one| one.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&target[range]), bits(&source), "{shift}");
        }
    }
}
