//! A slice whose parts go from thread to thread within a job.
#![allow(unsafe_code, reason = "only the threads know when they are done with a part")]

use std::marker::PhantomData;
use std::ops::Range;

/// A slice whose parts threads use in turn. Parts may overlap, which safe splitting does not allow, but no two
/// overlapping parts are in use at once.
#[derive(Debug)]
pub(crate) struct LentSlice<'a, T> {
    first: *mut T,
    length: usize,
    slice: PhantomData<&'a mut [T]>,
}

// SAFETY: a shared `LentSlice` gives access only by `LentSlice::part`, whose callers keep its elements to one thread at
// a time, so they are sent, not shared.
unsafe impl<T: Send> Sync for LentSlice<'_, T> {}

impl<'a, T> LentSlice<'a, T> {
    pub(crate) fn new(slice: &'a mut [T]) -> Self {
        Self { first: slice.as_mut_ptr(), length: slice.len(), slice: PhantomData }
    }

    /// Returns a part.
    ///
    /// # Panics
    /// If the range is not within the slice.
    ///
    /// # Safety
    /// While the part is in use, no overlapping part may be. If another thread has used one, that must have happened
    /// before, as [`super::worker_pool::Milestone`] ensures.
    #[allow(clippy::mut_from_ref, reason = "the caller ensures that no two parts overlap")]
    pub(crate) unsafe fn part(&self, range: Range<usize>) -> &mut [T] {
        assert!(range.start <= range.end && range.end <= self.length, "{range:?} is outside");
        let first = self.first.wrapping_add(range.start);
        // SAFETY: the range is within the slice, which is borrowed for `'a`, and the caller ensures that nobody else uses
        // these elements.
        unsafe { std::slice::from_raw_parts_mut(first, range.len()) }
    }
}

#[cfg(test)]
mod tests {
    //! Parts that overlap are used one after the other.
    use super::*;
    use crate::kernels::worker_pool::{Milestone, WorkerPool};

    #[test]
    fn a_part_goes_to_another_thread_after_a_milestone() {
        let mut numbers = [0_u32; 6];
        let mut pool = WorkerPool::new(2);
        for round in 1..=200 {
            let lent = LentSlice::new(&mut numbers);
            let milestone = Milestone::new();
            pool.for_each(&mut [0, 1], |worker: &mut usize| {
                let own = if *worker == 0 { 0..3 } else { 3..6 };
                let on_the_way = (*worker == 1).then(|| milestone.reach_when_dropped());
                // SAFETY: the parts are disjoint.
                unsafe { lent.part(own) }.iter_mut().for_each(|one| *one += 1);
                drop(on_the_way);
                if *worker == 0 {
                    milestone.wait();
                    // SAFETY: the other thread has finished its part.
                    unsafe { lent.part(2..5) }.iter_mut().for_each(|one| *one += 1);
                }
            });
            let [once, twice] = [round, 2 * round];
            assert_eq!(numbers, [once, once, twice, twice, twice, once]);
        }
    }

    #[test]
    #[should_panic(expected = "is outside")]
    fn a_part_beyond_the_slice_is_refused() {
        let mut numbers = [0_u32; 6];
        let lent = LentSlice::new(&mut numbers);
        // SAFETY: nobody else uses the slice.
        let _part = unsafe { lent.part(4..7) };
    }
}
