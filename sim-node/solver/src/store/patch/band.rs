//! Takes rows of a sheet through a pass.
//!
//! Stage by stage over the whole sheet, every row would be loaded from a distant cache for each
//! stage. Instead, each stage follows the one before, behind it by the rows that it reaches down,
//! and all of them run down the sheet like a wave: only a few rows are in work at a time, and they
//! stay in a near cache. Every constraint finds its ends as it would stage by stage, so the bits are
//! the same.

use std::ops::Range;

use sim_scene::constraints::families::Family;

use super::band_forces::{BandForces, LentForces};
use super::bends::project_bends;
use super::sheet_layout::{FamilyBlock, SheetLayout};
use super::span::Span;
use crate::constraints::bends::projection::BendPass;
use crate::constraints::columns::{ConstraintColumns, FullPass};
use crate::constraints::fields::Pass;
use crate::constraints::projection::Projection;
use crate::constraints::projection_block::ProjectionBlock;
use crate::kernels::lanes::{LaneWork, Wide};
use crate::kernels::lent_slice::LentSlice;
use crate::step::particle_stages::run_stage;
use crate::step::schedule::ScheduledStage;
use crate::step::stage::Stage;
use crate::step::substep::SubstepInputs;
use crate::store::pulls::Numbers;
use crate::store::rows::ends::{ColumnUnit, Ends, project_across, project_down};
use crate::store::rows::particles::RowParticles;
use crate::store::rows::{LINE_LENGTH, RowLayout, STATE_FIELDS};
use crate::store::workers::WorkerScratch;

/// Largest number of stages in a pass: two halves of six families, projected and limited, ten groups of
/// bends, and four stages of single particles.
const STAGES_MAX: usize = 2 * 2 * Family::ALL.len() + 10 + 4;

/// Consecutive rows in memory.
pub(crate) struct Band<'a> {
    pub(crate) numbers: &'a mut [f32],
    /// Index of the first row.
    pub(crate) first: usize,
    pub(crate) layout: &'a RowLayout,
    pub(crate) sheet: &'a SheetLayout,
    pub(crate) forces: BandForces<'a>,
}

/// A pass over some rows.
pub(crate) struct PassSweep<'a, 'b> {
    pub(crate) stages: &'a [ScheduledStage],
    pub(crate) pass: Pass,
    pub(crate) inputs: &'a SubstepInputs<'a>,
    pub(crate) scratch: &'b mut WorkerScratch,
}

/// Takes a span of a band through a pass. The output is true if any constraint was marked as torn.
///
/// It is compiled with the measurement of forces and without, which therefore costs nothing.
pub(crate) struct SweepWork<'a, 'b, 'c, const IS_MEASURED: bool> {
    pub(crate) band: Band<'a>,
    pub(crate) span: Span,
    /// Rows of the first stage in this part of the sweep. The sweep extends past the last row by the lag of the last
    /// stage.
    pub(crate) fronts: Range<usize>,
    pub(crate) sweep: PassSweep<'b, 'c>,
}

impl<const IS_MEASURED: bool> LaneWork for SweepWork<'_, '_, '_, IS_MEASURED> {
    type Output = bool;

    #[inline(always)]
    fn run<W: Wide>(mut self) -> bool {
        self.band.sweep::<W, IS_MEASURED>((&self.span, &self.fronts), &mut self.sweep)
    }
}

/// All rows of a sheet, which threads take in turns.
pub(crate) struct LentRows<'a> {
    pub(crate) numbers: LentSlice<'a, f32>,
    pub(crate) layout: &'a RowLayout,
    pub(crate) sheet: &'a SheetLayout,
    pub(crate) forces: LentForces<'a>,
}

impl LentRows<'_> {
    /// Returns some rows.
    ///
    /// # Safety
    /// As for [`LentSlice::part`], with rows as elements.
    #[allow(unsafe_code, reason = "lends on")]
    pub(crate) unsafe fn band(&self, rows: Range<usize>) -> Band<'_> {
        let Self { layout, sheet, .. } = *self;
        let first = rows.start;
        let numbers = first * layout.length..rows.end * layout.length;
        // SAFETY: the caller has these rows.
        let numbers = unsafe { self.numbers.part(numbers) };
        // SAFETY: as above.
        let forces = unsafe { self.forces.rows(rows) };
        Band { numbers, first, layout, sheet, forces }
    }
}

impl Band<'_> {
    #[inline(always)]
    fn sweep<W: Wide, const IS_MEASURED: bool>(
        &mut self,
        (span, fronts): (&Span, &Range<usize>),
        sweep: &mut PassSweep<'_, '_>,
    ) -> bool {
        let stages = sweep.stages;
        let mut span = span.clone();
        let mut rows = [const { 0..0 }; STAGES_MAX];
        let (mut first, mut last) = (usize::MAX, 0);
        for (stage, rows) in stages.iter().zip(&mut rows) {
            *rows = span.advance(stage.reach);
            if rows.start < rows.end {
                (first, last) = (first.min(rows.start + stage.lag), last.max(rows.end + stage.lag));
            }
        }
        let mut is_marked = false;
        for front in first.max(fronts.start)..last.min(fronts.end) {
            if sweep.inputs.is_given_up() {
                break;
            }
            for (stage, rows) in stages.iter().zip(&rows) {
                // Above the first row it wraps to an index that no range contains.
                let row = front.wrapping_sub(stage.lag);
                if rows.contains(&row) {
                    is_marked |= self.run_stage::<W, IS_MEASURED>(stage, row, sweep);
                }
            }
        }
        is_marked
    }

    #[inline(always)]
    fn run_stage<W: Wide, const IS_MEASURED: bool>(
        &mut self,
        scheduled: &ScheduledStage,
        row: usize,
        sweep: &mut PassSweep<'_, '_>,
    ) -> bool {
        match scheduled.stage {
            Stage::Project | Stage::LimitStretch => {
                let has_pulls = IS_MEASURED && self.forces.has_pulls(row, scheduled.group);
                if has_pulls {
                    self.note_pulls(row, scheduled.group);
                }
                let is_marked = self.project::<W>(scheduled, row, sweep);
                if has_pulls {
                    self.add_pulls(row, scheduled.group);
                }
                return is_marked;
            }
            Stage::Bend => {
                let group = 2 * self.sheet.families.len() + scheduled.group;
                let has_pulls = IS_MEASURED && self.forces.has_pulls(row, group);
                if has_pulls {
                    self.note_pulls(row, group);
                }
                self.bend::<W>(scheduled, row, sweep);
                if has_pulls {
                    self.add_pulls(row, group);
                }
                return false;
            }
            _ => {}
        }
        let (layout, length) = (self.layout, self.layout.length);
        let numbers = &mut self.numbers[(row - self.first) * length..][..length];
        let is_measured = IS_MEASURED && scheduled.stage == Stage::Tether;
        let tether_pulls: &mut [_] =
            if is_measured { self.forces.tether_pulls(row) } else { &mut [] };
        let mut row = RowParticles::new(numbers, layout, row, tether_pulls);
        let contacts = &mut sweep.scratch.contacts;
        run_stage::<W>(scheduled.stage, &mut row, sweep.inputs, contacts);
        false
    }

    /// Notes the displacements before the projection of a group of a row. Not inlined: the loops around it would
    /// become so large that parts of them are no longer inlined.
    #[inline(never)]
    fn note_pulls(&mut self, row: usize, group: usize) {
        let projection = self.forces.projection(row, group);
        let RowLayout { length, stride, .. } = *self.layout;
        let numbers = Numbers { part: self.numbers, first: self.first * length, stride };
        self.forces.pulls.note(projection, numbers);
    }

    /// Adds the changes since [`Self::note_pulls`].
    #[inline(never)]
    fn add_pulls(&mut self, row: usize, group: usize) {
        let projection = self.forces.projection(row, group);
        let RowLayout { length, stride, .. } = *self.layout;
        let numbers = Numbers { part: self.numbers, first: self.first * length, stride };
        self.forces.pulls.add_changes(projection, numbers);
    }

    /// Projects the bends of a group that begin in a row.
    #[inline(always)]
    fn bend<W: Wide>(
        &mut self,
        scheduled: &ScheduledStage,
        row: usize,
        sweep: &mut PassSweep<'_, '_>,
    ) {
        let group = self.sheet.bends.groups[scheduled.group];
        if group.begins_in(row) {
            let rows = &mut self.numbers[(row - self.first) * self.layout.length..];
            let pass = BendPass::new(sweep.pass, sweep.inputs.relaxation);
            project_bends::<W>(
                rows,
                (self.layout, self.sheet),
                group,
                pass,
                &mut sweep.scratch.bends,
            );
        }
    }

    /// Projects the constraints of half a family that begin in a row.
    #[inline(always)]
    fn project<W: Wide>(
        &mut self,
        scheduled: &ScheduledStage,
        row: usize,
        sweep: &mut PassSweep<'_, '_>,
    ) -> bool {
        let (layout, row_length) = (self.layout, self.layout.length);
        let (block_index, half) = (scheduled.group / 2, scheduled.group % 2);
        let FamilyBlock { family, softness, is_rigid } = self.sheet.families[block_index];
        let (stride, reach) = (layout.stride, family.reach());
        if reach > 0 && family.half(row, 0) != half {
            return false;
        }
        let (upper, below) =
            self.numbers[(row - self.first) * row_length..].split_at_mut(row_length);
        let (state, rest) = upper.split_at_mut(STATE_FIELDS * stride);
        let length = self.sheet.family_length;
        let family_at = (layout.constraints_at - STATE_FIELDS) * stride + block_index * length;
        let memory = &mut rest[family_at..][..length];
        let columns = ConstraintColumns::new(memory, stride, layout.fields.constraints);
        let count = family.count(layout.columns);
        // First column of a half within the row, and its first lane group in the fields.
        let from = if reach == 0 { half * family.shifts()[1] } else { 0 };
        let (base, length) = if reach == 0 {
            (half * stride / LINE_LENGTH, count.saturating_sub(from).div_ceil(LINE_LENGTH))
        } else {
            (0, count.div_ceil(8))
        };
        let lane_groups = base..base + length;
        let ends = if reach == 0 {
            let unit = match family {
                Family::HorizontalBend => ColumnUnit::Pair,
                _ => ColumnUnit::Single,
            };
            ConstraintEnds::WithinRow(Ends::new(state, stride, from, 2 * length), unit)
        } else {
            let [a, b] = family.shifts();
            let lower = &mut below[(reach - 1) * row_length..];
            let upper = Ends::new(state, stride, a, length);
            ConstraintEnds::BetweenRows(upper, Ends::new(lower, stride, b, length))
        };
        let block = &mut *sweep.scratch.block;
        if scheduled.stage == Stage::LimitStretch {
            ends.project::<W>(columns.stretch_limit(&lane_groups), block)
        } else if is_rigid {
            ends.project::<W>(columns.rigid(&lane_groups, softness.share), block)
        } else {
            let full_pass = FullPass { used: layout.fields.used, softness, pass: sweep.pass };
            ends.project::<W>(columns.full(&lane_groups, &full_pass), block)
        }
    }
}

/// The ends of the constraints of a projection.
enum ConstraintEnds<'a> {
    BetweenRows(Ends<'a>, Ends<'a>),
    WithinRow(Ends<'a>, ColumnUnit),
}

impl ConstraintEnds<'_> {
    /// Returns true if any constraint was marked as torn.
    #[inline(always)]
    fn project<W: Wide>(
        self,
        mut projection: impl Projection,
        block: &mut ProjectionBlock,
    ) -> bool {
        match self {
            Self::BetweenRows(upper, lower) => {
                project_down::<W>(upper, lower, &mut projection, block);
            }
            Self::WithinRow(row, unit) => project_across::<W>(row, unit, &mut projection, block),
        }
        projection.is_marked()
    }
}
