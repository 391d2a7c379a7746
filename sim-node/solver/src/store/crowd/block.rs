//! Takes blocks of figures through a substep.

use super::figures::Figures;
use crate::constraints::columns::{ConstraintColumns, FullPass};
use crate::constraints::fields::Pass;
use crate::constraints::parameters::PassSoftness;
use crate::constraints::projection::Projection;
use crate::kernels::lanes::{LaneWork, Wide};
use crate::step::particle_stages::run_stage;
use crate::step::schedule::{Schedule, ScheduledStage};
use crate::step::stage::Stage;
use crate::step::substep::SubstepInputs;
use crate::store::pulls::{Numbers, PullsPart};
use crate::store::rows::ends::{Ends, project_down};
use crate::store::rows::particles::{RowParticles, TetherPulls};
use crate::store::rows::{RowForces, RowLayout};
use crate::store::workers::WorkerScratch;

/// Consecutive blocks of figures in memory, each of them a row, and their forces.
pub(crate) struct Blocks<'a> {
    numbers: &'a mut [f32],
    /// Index of the first block.
    first: usize,
    layout: &'a RowLayout,
    figures: &'a Figures,
    pulls: PullsPart<'a>,
    tether_pulls: &'a mut [TetherPulls],
    tether_length: usize,
}

impl<'a> Blocks<'a> {
    pub(crate) fn new(
        figures: &'a Figures,
        (layout, numbers, forces): (&'a RowLayout, &'a mut [f32], &'a mut RowForces),
    ) -> Self {
        let RowForces { pulls, tether_pulls, tether_length, .. } = forces;
        Self {
            numbers,
            first: 0,
            layout,
            figures,
            pulls: pulls.whole(),
            tether_pulls,
            tether_length: *tether_length,
        }
    }

    /// Divides the blocks into parts of `count`, the last one shorter.
    pub(crate) fn parts(self, count: usize) -> impl Iterator<Item = Self> {
        let mut rest = Some(self);
        std::iter::from_fn(move || {
            let all = rest.take()?;
            if all.numbers.len() <= count * all.layout.length {
                return Some(all);
            }
            let (part, others) = all.split_at(count);
            rest = Some(others);
            Some(part)
        })
    }

    fn split_at(self, count: usize) -> (Self, Self) {
        let Self { first, layout, figures, tether_length, .. } = self;
        let next = first + count;
        let (numbers, other_numbers) = self.numbers.split_at_mut(count * layout.length);
        let (pulls, other_pulls) = self.pulls.split_at(next * figures.pairs.len());
        let (tether_pulls, other_tether_pulls) =
            self.tether_pulls.split_at_mut(count * tether_length);
        let part = |first, numbers, pulls, tether_pulls| Self {
            numbers,
            first,
            layout,
            figures,
            pulls,
            tether_pulls,
            tether_length,
        };
        (
            part(first, numbers, pulls, tether_pulls),
            part(next, other_numbers, other_pulls, other_tether_pulls),
        )
    }
}

/// The passes of a substep, or the stages behind the division of its sweep.
#[derive(Clone, Copy)]
pub(crate) struct BlockSweep<'a> {
    pub(crate) schedule: &'a Schedule,
    /// None behind the division.
    pub(crate) pass_count: Option<u32>,
    pub(crate) softness: PassSoftness,
    pub(crate) inputs: &'a SubstepInputs<'a>,
}

impl<'a> BlockSweep<'a> {
    /// The passes, each with its stages.
    fn passes(self) -> impl Iterator<Item = (Pass, &'a [ScheduledStage])> {
        Pass::all(self.pass_count.unwrap_or(1)).map(move |pass| match self.pass_count {
            Some(_) => (pass, self.schedule.of_pass(pass)),
            None => (pass, self.schedule.ending()),
        })
    }
}

/// Takes blocks through a sweep, one after the other, because a block stays in the nearest cache. The output is
/// true if any constraint was marked as torn.
pub(crate) struct BlockWork<'a, 'b, 'c, const IS_MEASURED: bool> {
    pub(crate) blocks: &'b mut Blocks<'a>,
    pub(crate) sweep: BlockSweep<'c>,
    pub(crate) scratch: &'b mut WorkerScratch,
}

impl<const IS_MEASURED: bool> LaneWork for BlockWork<'_, '_, '_, IS_MEASURED> {
    type Output = bool;

    #[inline(always)]
    fn run<W: Wide>(self) -> bool {
        let Self { blocks, sweep, scratch } = self;
        let mut is_marked = false;
        for block in 0..blocks.numbers.len() / blocks.layout.length {
            for (pass, stages) in sweep.passes() {
                if sweep.inputs.is_given_up() {
                    return is_marked;
                }
                for one in stages {
                    let stage = (one.stage, pass);
                    is_marked |= blocks.run::<W, IS_MEASURED>(block, stage, &sweep, scratch);
                }
            }
        }
        is_marked
    }
}

impl Blocks<'_> {
    /// Runs a stage of a pass on a block. Returns true if any constraint was marked as torn.
    #[inline(always)]
    fn run<W: Wide, const IS_MEASURED: bool>(
        &mut self,
        block: usize,
        (stage, pass): (Stage, Pass),
        sweep: &BlockSweep<'_>,
        scratch: &mut WorkerScratch,
    ) -> bool {
        if matches!(stage, Stage::Project | Stage::LimitStretch) {
            return self.run_projection::<W, IS_MEASURED>(block, (stage, pass), sweep, scratch);
        }
        self.run_stage::<W>(block, stage, sweep, scratch);
        false
    }

    /// Runs a stage of single particles.
    #[inline(always)]
    fn run_stage<W: Wide>(
        &mut self,
        block: usize,
        stage: Stage,
        sweep: &BlockSweep<'_>,
        scratch: &mut WorkerScratch,
    ) {
        let Self { layout, tether_length, .. } = *self;
        let numbers = &mut self.numbers[block * layout.length..][..layout.length];
        let tether_pulls = &mut self.tether_pulls[block * tether_length..][..tether_length];
        let mut particles = RowParticles::new(numbers, layout, self.first + block, tether_pulls);
        run_stage::<W>(stage, &mut particles, sweep.inputs, &mut scratch.contacts);
    }

    #[inline(always)]
    fn run_projection<W: Wide, const IS_MEASURED: bool>(
        &mut self,
        block: usize,
        (stage, pass): (Stage, Pass),
        sweep: &BlockSweep<'_>,
        scratch: &mut WorkerScratch,
    ) -> bool {
        let RowLayout { length, stride, constraints_at, ref fields, .. } = *self.layout;
        let numbers = &mut self.numbers[block * length..][..length];
        let (state, memory) = numbers.split_at_mut(constraints_at * stride);
        let width = self.layout.columns / self.figures.size;
        let column_length = self.figures.pairs.len() * width;
        let columns = ConstraintColumns::new(memory, column_length, fields.constraints);
        let (groups, used) = (0..column_length / 8, fields.used);
        let mut projected = ProjectedBlock::<IS_MEASURED> {
            state,
            stride,
            figures: self.figures,
            width,
            pulls: &mut self.pulls,
            first: (self.first + block) * length,
            first_projection: (self.first + block) * self.figures.pairs.len(),
            scratch,
        };
        if stage == Stage::LimitStretch {
            projected.project::<W>(columns.stretch_limit(&groups))
        } else if used.are_rigid(sweep.softness.scaled_compliance) {
            projected.project::<W>(columns.rigid(&groups, sweep.softness.share))
        } else {
            let full_pass = FullPass { used, softness: sweep.softness, pass };
            projected.project::<W>(columns.full(&groups, &full_pass))
        }
    }
}

/// The particles of a block whose constraints are projected.
struct ProjectedBlock<'a, 'b, const IS_MEASURED: bool> {
    state: &'a mut [f32],
    stride: usize,
    figures: &'a Figures,
    /// Number of figures, with those that are missing in the last block.
    width: usize,
    pulls: &'a mut PullsPart<'b>,
    /// Where the block begins among the numbers of all.
    first: usize,
    /// Number of its first projection.
    first_projection: usize,
    scratch: &'a mut WorkerScratch,
}

impl<const IS_MEASURED: bool> ProjectedBlock<'_, '_, IS_MEASURED> {
    /// Projects the constraints one after the other, each in all figures. Returns true if any was marked as torn.
    #[inline(always)]
    fn project<W: Wide>(&mut self, projection: impl Projection) -> bool {
        let mut is_marked = false;
        let mut rest = projection;
        for (number, pair) in self.figures.pairs.iter().enumerate() {
            let (mut one, others) = rest.split(self.width / 8);
            rest = others;
            let projection = self.first_projection + number;
            let has_pulls = IS_MEASURED && self.pulls.has(projection);
            if has_pulls {
                self.note_pulls(projection);
            }
            let columns = pair.map(|particle| particle as usize * self.width);
            let [a, b] = Ends::pair(self.state, self.stride, columns, self.width / 8);
            project_down::<W>(a, b, &mut one, &mut self.scratch.block);
            is_marked |= one.is_marked();
            if has_pulls {
                self.add_pulls(projection);
            }
        }
        is_marked
    }

    #[inline(never)]
    fn note_pulls(&mut self, projection: usize) {
        let numbers = Numbers { part: self.state, first: self.first, stride: self.stride };
        self.pulls.note(projection, numbers);
    }

    #[inline(never)]
    fn add_pulls(&mut self, projection: usize) {
        let numbers = Numbers { part: self.state, first: self.first, stride: self.stride };
        self.pulls.add_changes(projection, numbers);
    }
}
