//! Pairs that are examined together.

use super::box_tree::Search;

/// Number of pairs that are examined together: few enough to stay in a near cache.
const PAIRS_MAX: usize = 512;

/// Collects pairs, and examines them when there is no room for another one.
pub(super) struct PairBatch<F> {
    pairs: [[u32; 2]; PAIRS_MAX],
    count: usize,
    examine: F,
}

impl<F: FnMut(&[[u32; 2]]) -> Search> PairBatch<F> {
    pub(super) fn new(examine: F) -> Self {
        Self { pairs: [[0; 2]; PAIRS_MAX], count: 0, examine }
    }

    #[inline(always)]
    pub(super) fn add(&mut self, pair: [u32; 2]) -> Search {
        self.pairs[self.count] = pair;
        self.count += 1;
        if self.count < PAIRS_MAX { Search::Continue(()) } else { self.finish() }
    }

    /// Examines the pairs that are left.
    pub(super) fn finish(&mut self) -> Search {
        let count = std::mem::take(&mut self.count);
        (self.examine)(&self.pairs[..count])
    }
}
