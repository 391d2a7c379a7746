//! The projection of the constraints of one group.

use super::forces::MovedParticles;
use super::group::{ConstraintGroup, part_count};
use crate::constraints::projection::{LaneIndex, Projection};
use crate::constraints::projection_block::{BLOCK_LENGTH, ProjectionBlock};
use crate::constraints::separation::{Separation, correction};
use crate::kernels::Kernels;
use crate::kernels::lanes::{LaneWork, Lanes8, PackedParticle, Wide, axes};
use crate::kernels::worker_pool::SharedSlice;
use crate::store::workers::{WorkerScratch, Workers};

/// Groups with fewer constraints are projected one by one: a lane group costs as much as a few
/// constraints.
const BATCHED_MIN: usize = 4;

/// Constraints of one group, and the particles that they move.
pub(crate) struct Batch<'a> {
    pub(crate) group: &'a ConstraintGroup,
    pub(crate) moved: MovedParticles<'a>,
    pub(crate) ends: &'a [[[u32; 8]; 2]],
    pub(crate) inverse_masses: &'a [[Lanes8; 2]],
}

impl Batch<'_> {
    /// Projects every constraint once. Returns true if any was marked as torn.
    pub(crate) fn project(
        mut self,
        mut projection: impl Projection + Send,
        workers: &mut Workers,
    ) -> bool {
        let ConstraintGroup { count, is_independent, .. } = *self.group;
        if !is_independent {
            return self.project_serially(projection);
        }
        self.moved.note(0);
        let is_marked = if count < BATCHED_MIN || workers.kernels == Kernels::Reference {
            (0..count).for_each(|place| self.project_one(&mut projection, place));
            projection.is_marked()
        } else {
            self.project_together(projection, workers)
        };
        self.moved.add_changes(0);
        is_marked
    }

    /// Projects the constraints of an independent group in eights.
    #[allow(unsafe_code, reason = "only this function knows that the constraints are independent")]
    fn project_together<T: Projection + Send>(
        &mut self,
        mut projection: T,
        workers: &mut Workers,
    ) -> bool {
        // SAFETY: no two constraints of an independent group share a particle, and only the last
        // lane group contains the particle of the padding.
        let particles = unsafe { SharedSlice::new(&mut *self.moved.particles) };
        let Self { ends, inverse_masses, .. } = *self;
        let whole = BatchPart { ends, inverse_masses, particles, kernels: workers.kernels };
        if part_count(self.group.count, workers.count()) == 1 {
            whole.project(&mut projection, workers.own_scratch());
            return projection.is_marked();
        }
        ProjectedPart { part: whole, projection }.project_by_all(workers)
    }

    /// Projects constraints that share particles.
    fn project_serially(&mut self, mut projection: impl Projection) -> bool {
        for place in 0..self.group.count {
            self.moved.note(place);
            self.project_one(&mut projection, place);
            self.moved.add_changes(place);
        }
        projection.is_marked()
    }

    #[inline(always)]
    fn project_one(&mut self, projection: &mut impl Projection, place: usize) {
        let particles = &mut *self.moved.particles;
        let index = LaneIndex { group: place / 8, lane: place % 8 };
        let ([a, b], [w_a, w_b]) = (&self.ends[index.group], &self.inverse_masses[index.group]);
        let (a, b) = (a[index.lane] as usize, b[index.lane] as usize);
        let (w_a, w_b) = (w_a[index.lane], w_b[index.lane]);
        let difference = |axis: usize| particles[b].0[axis] - particles[a].0[axis];
        let separation = Separation::new(axes(difference), axes(|axis| difference(4 + axis)));
        let scale = projection.scale(index, &separation.squared, w_a + w_b);
        let correction = correction(separation.vector, scale);
        let (change_a, change_b) = (correction.displacement(w_a), correction.displacement(w_b));
        for axis in 0..3 {
            particles[a].0[4 + axis] += change_a[axis];
            particles[b].0[4 + axis] -= change_b[axis];
        }
    }
}

/// Lane groups of a batch that one worker projects.
struct BatchPart<'a> {
    ends: &'a [[[u32; 8]; 2]],
    inverse_masses: &'a [[Lanes8; 2]],
    particles: SharedSlice<'a, PackedParticle>,
    kernels: Kernels,
}

impl BatchPart<'_> {
    fn project(&self, projection: &mut impl Projection, scratch: &mut WorkerScratch) {
        let block = &mut scratch.block;
        self.kernels.run(BatchWork { part: self, projection, block });
    }

    /// Splits the part after `count` lane groups.
    fn split(self, count: usize) -> (Self, Self) {
        let (ends, other_ends) = self.ends.split_at(count);
        let (inverse_masses, other_inverse_masses) = self.inverse_masses.split_at(count);
        let other = Self { ends: other_ends, inverse_masses: other_inverse_masses, ..self };
        (Self { ends, inverse_masses, ..self }, other)
    }
}

/// A part of a batch with its projection.
struct ProjectedPart<'a, T> {
    part: BatchPart<'a>,
    projection: T,
}

impl<T: Projection + Send> ProjectedPart<'_, T> {
    /// Divides the part among all workers. Returns true if any constraint was marked as torn.
    fn project_by_all(self, workers: &mut Workers) -> bool {
        let group_count = self.part.ends.len();
        let length = group_count.div_ceil(part_count(8 * group_count, workers.count()));
        let mut rest = Some(self);
        let parts = std::iter::from_fn(|| {
            let one = rest.take()?;
            if one.part.ends.len() <= length {
                return Some(one);
            }
            let (first, others) = one.split(length);
            rest = Some(others);
            Some(first)
        });
        let mut is_any_marked = false;
        let work = |one: &mut Self, scratch: &mut WorkerScratch| {
            one.part.project(&mut one.projection, scratch);
        };
        workers.for_each(parts, work, |one| is_any_marked |= one.projection.is_marked());
        is_any_marked
    }

    fn split(self, count: usize) -> (Self, Self) {
        let (part, other_part) = self.part.split(count);
        let (projection, other_projection) = self.projection.split(count);
        (Self { part, projection }, Self { part: other_part, projection: other_projection })
    }
}

struct BatchWork<'a, 'b, T> {
    part: &'a BatchPart<'b>,
    projection: &'a mut T,
    block: &'a mut ProjectionBlock,
}

impl<T: Projection> LaneWork for BatchWork<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    #[allow(unsafe_code, reason = "bounds checks would cost a third of the time")]
    fn run<W: Wide>(self) {
        let Self { part: BatchPart { ends, inverse_masses, particles, .. }, projection, block } =
            self;
        let particles = particles.cells();
        for first in (0..ends.len()).step_by(BLOCK_LENGTH) {
            let length = BLOCK_LENGTH.min(ends.len() - first);
            let ends = &ends[first..first + length];
            let inverse_masses = &inverse_masses[first..first + length];
            for (group, [a, b]) in ends.iter().enumerate() {
                // SAFETY: `Graph::push` checked that the ends are particles of the graph.
                let [start, change] = unsafe { W::differences(particles, a, b) };
                block.set_separation::<W>(group, &Separation::new(start, change));
            }
            for (group, [w_a, w_b]) in inverse_masses.iter().enumerate() {
                let index = LaneIndex { group: first + group, lane: 0 };
                block.solve(group, &mut *projection, index, W::load(w_a, 0) + W::load(w_b, 0));
            }
            for (group, ([a, b], [w_a, w_b])) in ends.iter().zip(inverse_masses).enumerate() {
                let correction = block.correction::<W>(group);
                let change_a = correction.displacement(-W::load(w_a, 0));
                // SAFETY: as above.
                unsafe { W::subtract_displacements(particles, a, change_a) };
                let change_b = correction.displacement(W::load(w_b, 0));
                // SAFETY: as above.
                unsafe { W::subtract_displacements(particles, b, change_b) };
            }
        }
    }
}
