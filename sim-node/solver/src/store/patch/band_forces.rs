//! Forces of the particles of some rows on colliders and fixed particles.

use std::ops::Range;

use crate::kernels::lent_slice::LentSlice;
use crate::store::pulls::{LentPulls, PullsPart};
use crate::store::rows::RowForces;
use crate::store::rows::particles::TetherPulls;

/// The forces of consecutive rows.
#[derive(Debug)]
pub(crate) struct BandForces<'a> {
    /// Index of the first row.
    first: usize,
    /// By row of the sheet: bit n is set if its projection n has pulls.
    pull_masks: &'a [u32],
    /// Number of projections in a row.
    pull_groups: usize,
    /// Number of tether pulls of a row.
    tether_length: usize,
    pub(crate) pulls: PullsPart<'a>,
    tether_pulls: &'a mut [TetherPulls],
}

/// The forces of all rows, parts of which go from thread to thread.
#[derive(Debug)]
pub(crate) struct LentForces<'a> {
    /// By row: bit n is set if its projection n has pulls.
    pull_masks: &'a [u32],
    /// Number of projections in a row.
    pull_groups: usize,
    /// Number of tether pulls of a row.
    tether_length: usize,
    pulls: LentPulls<'a>,
    tether_pulls: LentSlice<'a, TetherPulls>,
}

impl<'a> LentForces<'a> {
    /// `pull_masks` is empty while nobody asks for forces.
    pub(crate) fn new(
        forces: &'a mut RowForces,
        pull_masks: &'a [u32],
        pull_groups: usize,
    ) -> Self {
        let RowForces { pulls, tether_pulls, tether_length, .. } = forces;
        Self {
            pull_masks,
            pull_groups,
            tether_length: *tether_length,
            pulls: pulls.lend(),
            tether_pulls: LentSlice::new(tether_pulls),
        }
    }

    /// Returns the forces of some rows.
    ///
    /// # Safety
    /// As for [`LentSlice::part`], with rows as elements.
    #[allow(unsafe_code, reason = "lends on")]
    pub(crate) unsafe fn rows(&self, rows: Range<usize>) -> BandForces<'_> {
        let Self { pull_masks, pull_groups, tether_length, .. } = *self;
        let of_rows = |count: usize| rows.start * count..rows.end * count;
        // SAFETY: no two rows share a projection, and the caller has these rows.
        let pulls = unsafe { self.pulls.part(of_rows(pull_groups)) };
        // SAFETY: as above.
        let tether_pulls = unsafe { self.tether_pulls.part(of_rows(tether_length)) };
        BandForces {
            first: rows.start,
            pull_masks,
            pull_groups,
            tether_length,
            pulls,
            tether_pulls,
        }
    }
}

impl BandForces<'_> {
    /// Number of a projection: group `group` of a row.
    #[inline(always)]
    pub(crate) fn projection(&self, row: usize, group: usize) -> usize {
        row * self.pull_groups + group
    }

    /// Returns true if the projection of a group of a row has pulls.
    #[inline(always)]
    pub(crate) fn has_pulls(&self, row: usize, group: usize) -> bool {
        self.pull_masks[row] >> group & 1 != 0
    }

    /// The tether pulls of a row.
    #[inline(always)]
    pub(crate) fn tether_pulls(&mut self, row: usize) -> &mut [TetherPulls] {
        &mut self.tether_pulls[(row - self.first) * self.tether_length..][..self.tether_length]
    }
}
