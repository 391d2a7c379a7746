//! Forces of the particles of some rows on colliders and fixed particles.

use crate::contacts::contact::reaction::BlockReaction;
use crate::store::pulls::PullsPart;
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
    /// Number of reactions of a row.
    reaction_count: usize,
    /// Number of tether pulls of a row.
    tether_length: usize,
    pub(crate) pulls: PullsPart<'a>,
    reactions: &'a mut [BlockReaction],
    tether_pulls: &'a mut [TetherPulls],
}

impl<'a> BandForces<'a> {
    /// All rows. `pull_masks` is empty while nobody asks for forces.
    pub(crate) fn new(
        forces: &'a mut RowForces,
        pull_masks: &'a [u32],
        pull_groups: usize,
    ) -> Self {
        let RowForces { pulls, reactions, reaction_count, tether_pulls, tether_length, .. } =
            forces;
        Self {
            first: 0,
            pull_masks,
            pull_groups,
            reaction_count: *reaction_count,
            tether_length: *tether_length,
            pulls: pulls.whole(),
            reactions,
            tether_pulls,
        }
    }

    /// Splits before a row.
    pub(crate) fn split_at(self, row: usize) -> (BandForces<'a>, BandForces<'a>) {
        let Self { first, pull_masks, pull_groups, reaction_count, tether_length, .. } = self;
        let count = row - first;
        let (pulls, other_pulls) = self.pulls.split_at(row * pull_groups);
        let (reactions, other_reactions) = self.reactions.split_at_mut(count * reaction_count);
        let (tether_pulls, other_tether_pulls) =
            self.tether_pulls.split_at_mut(count * tether_length);
        let part = |first, pulls, reactions, tether_pulls| BandForces {
            first,
            pull_masks,
            pull_groups,
            reaction_count,
            tether_length,
            pulls,
            reactions,
            tether_pulls,
        };
        let before = part(first, pulls, reactions, tether_pulls);
        (before, part(row, other_pulls, other_reactions, other_tether_pulls))
    }

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

    /// The reactions and the tether pulls of a row.
    #[inline(always)]
    pub(crate) fn of_row(&mut self, row: usize) -> (&mut [BlockReaction], &mut [TetherPulls]) {
        let row = row - self.first;
        (
            &mut self.reactions[row * self.reaction_count..][..self.reaction_count],
            &mut self.tether_pulls[row * self.tether_length..][..self.tether_length],
        )
    }
}
