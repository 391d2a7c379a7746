//! The projection of the constraints of one group.

use super::super::team::{Scratch, Team};
use super::{Group, part_count};
use crate::crew::Shared;
use crate::kernels::{Body, Eight, Kernels, Wide, Work, axes};
use crate::project::{BLOCK, Block, Gap, Law, Spot, correction};

/// Groups with fewer constraints are projected one after the other: an eight costs as much as a
/// few of them.
const BATCHED_MIN: usize = 4;

/// Constraints of one group, and what they move.
pub(super) struct Batch<'a> {
    pub(super) group: &'a Group,
    pub(super) bodies: &'a mut [Body],
    pub(super) ends: &'a [[[u32; 8]; 2]],
    pub(super) weights: &'a [[Eight; 2]],
}

impl Batch<'_> {
    /// Whether anything has torn.
    #[allow(unsafe_code, reason = "only this place knows that the constraints are independent")]
    pub(super) fn project<T: Law + Send>(self, law: T, team: &mut Team) -> bool {
        let is_big = self.group.is_independent && self.group.count >= BATCHED_MIN;
        if !is_big || team.kernels == Kernels::Reference {
            return self.project_singly(law);
        }
        // SAFETY: no two constraints of an independent group share a body; and the body of the
        // padding is in the last eight alone.
        let bodies = unsafe { Shared::new(self.bodies) };
        let whole = BatchPart { ends: self.ends, weights: self.weights, bodies };
        if part_count(self.group.count, team.members()) == 1 {
            return whole.project(law, (team.kernels, team.alone()));
        }
        whole.project_together(law, team)
    }

    fn project_singly(self, mut law: impl Law) -> bool {
        for place in 0..self.group.count {
            let at = Spot { eight: place / 8, lane: place % 8 };
            let ([a, b], [w_a, w_b]) = (&self.ends[at.eight], &self.weights[at.eight]);
            let (a, b) = (a[at.lane] as usize, b[at.lane] as usize);
            let (w_a, w_b) = (w_a[at.lane], w_b[at.lane]);
            let difference = |axis: usize| self.bodies[b].0[axis] - self.bodies[a].0[axis];
            let gap = Gap::new(axes(difference), axes(|axis| difference(4 + axis)));
            let scale = law.scale(at, &gap.size, w_a + w_b);
            let correction = correction(gap.separation, scale);
            let (way_a, way_b) = (correction.way(w_a), correction.way(w_b));
            for axis in 0..3 {
                self.bodies[a].0[4 + axis] += way_a[axis];
                self.bodies[b].0[4 + axis] -= way_b[axis];
            }
        }
        law.is_marked()
    }
}

/// Eights of a group that one member works on.
struct BatchPart<'a> {
    ends: &'a [[[u32; 8]; 2]],
    weights: &'a [[Eight; 2]],
    bodies: Shared<'a, Body>,
}

impl BatchPart<'_> {
    /// Whether anything has torn.
    fn project(&self, mut law: impl Law, (kernels, scratch): (Kernels, &mut Scratch)) -> bool {
        kernels.run(BatchWork { part: self, law: &mut law, block: &mut scratch.block });
        law.is_marked()
    }

    /// As [`Self::project`], by all members of the team.
    fn project_together<T: Law + Send>(&self, law: T, team: &mut Team) -> bool {
        let kernels = team.kernels;
        let length = self.ends.len().div_ceil(part_count(8 * self.ends.len(), team.members()));
        let mut rest = Some(law);
        let parts = self.ends.chunks(length).zip(self.weights.chunks(length));
        let parts = parts.map(|(ends, weights)| {
            let law = rest.take().map(|law| {
                if ends.len() < length {
                    return law;
                }
                let (law, others) = law.split(ends.len());
                rest = Some(others);
                law
            });
            (BatchPart { ends, weights, bodies: self.bodies }, law, false)
        });
        let mut is_any_marked = false;
        let work = |(part, law, is_marked): &mut (BatchPart<'_>, Option<T>, bool),
                    scratch: &mut _| {
            if let Some(law) = law.take() {
                *is_marked = part.project(law, (kernels, scratch));
            }
        };
        team.each(parts, work, |(.., is_marked)| is_any_marked |= is_marked);
        is_any_marked
    }
}

struct BatchWork<'a, 'b, T> {
    part: &'a BatchPart<'b>,
    law: &'a mut T,
    block: &'a mut Block,
}

impl<T: Law> Work for BatchWork<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    #[allow(unsafe_code, reason = "the check of each index would be a third of the work")]
    fn run<W: Wide>(self) {
        let Self { part: BatchPart { ends, weights, bodies }, law, block } = self;
        let bodies = bodies.cells();
        for first in (0..ends.len()).step_by(BLOCK) {
            let length = BLOCK.min(ends.len() - first);
            let ends = &ends[first..first + length];
            for (eight, [a, b]) in ends.iter().enumerate() {
                // SAFETY: `Graph::push` made the ends, of bodies that the graph has.
                let [start, moved] = unsafe { W::differences(bodies, a, b) };
                block.set_gap::<W>(eight, &Gap::new(start, moved));
            }
            for (eight, [w_a, w_b]) in weights[first..first + length].iter().enumerate() {
                let at = Spot { eight: first + eight, lane: 0 };
                block.solve(eight, (&mut *law, at), W::load(w_a, 0) + W::load(w_b, 0));
            }
            let weights = &weights[first..first + length];
            for (eight, ([a, b], [w_a, w_b])) in ends.iter().zip(weights).enumerate() {
                let correction = block.correction::<W>(eight);
                // SAFETY: as above.
                unsafe { W::take(bodies, a, correction.way(-W::load(w_a, 0))) };
                // SAFETY: as above.
                unsafe { W::take(bodies, b, correction.way(W::load(w_b, 0))) };
            }
        }
    }
}
