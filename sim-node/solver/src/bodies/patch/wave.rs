//! The order in which the rows of a patch are taken through a pass.
//!
//! Family after family over the whole patch, every row would come from a far cache for each of
//! them. Instead, each family follows the one before it, a row behind where it reaches down a row,
//! and all of them run down the patch like a wave: a few rows are in work at a time, and stay near.
//! Every constraint finds its ends as it would family after family: the bits are the same.

use std::ops::Range;

use super::row::{Columns, Ends, project_across, project_down};
use super::{LINE, STATE_FIELDS, Shape, Strand};
use crate::bodies::motion::Motion;
use crate::bodies::team::Scratch;
use crate::bodies::terms::{Fields, Pass};
use crate::families::Family;
use crate::kernels::{Wide, Work};
use crate::project::{Block, Law};

/// Most stages of a pass: two halves of six families, twice, and what comes before and after.
const STAGES_MAX: usize = 2 * 2 * Family::ALL.len() + 2;

/// Something that is done to a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Deed {
    Predict,
    Project { strand: usize, half: usize },
    LimitStretch { strand: usize, half: usize },
    EndSubstep,
}

/// Rows by which a span narrows on each side in a pass.
pub(super) fn total_reach(stages: &[Stage]) -> usize {
    stages.iter().map(|stage| stage.reach).sum()
}

/// A deed, and how far behind the first it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stage {
    deed: Deed,
    /// Rows that it reaches down.
    reach: usize,
    /// Rows that it is behind the first.
    lag: usize,
}

/// The stages of a pass, in order.
pub(super) fn stages(families: &[Strand], pass: Pass, has_limits: bool) -> Vec<Stage> {
    let (is_first, is_last) = (pass.index == 0, pass.index + 1 == pass.count);
    let halves = || (0..families.len()).flat_map(|strand| [(strand, 0), (strand, 1)]);
    let mut deeds = Vec::new();
    deeds.extend(is_first.then_some(Deed::Predict));
    deeds.extend(halves().map(|(strand, half)| Deed::Project { strand, half }));
    if is_last && has_limits {
        deeds.extend(halves().map(|(strand, half)| Deed::LimitStretch { strand, half }));
    }
    deeds.extend(is_last.then_some(Deed::EndSubstep));
    let mut lag = 0;
    let stage = |deed| {
        let reach = match deed {
            Deed::Project { strand, .. } | Deed::LimitStretch { strand, .. } => {
                families[strand].family.reach()
            }
            Deed::Predict | Deed::EndSubstep => 0,
        };
        lag += reach;
        Stage { deed, reach, lag }
    };
    deeds.into_iter().map(stage).collect()
}

/// Rows of a patch that are worked on together.
///
/// Rows that others are not ready for cannot all be finished: after each family a span is narrower
/// by its reach on both sides, like the rows of a trapezoid. What is left between two spans is a
/// seam, which grows as they narrow.
#[derive(Debug, Clone)]
pub(super) struct Span {
    rows: Range<usize>,
    kind: SpanKind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SpanKind {
    /// It begins or ends with the patch where it says so.
    Rows {
        is_first: bool,
        is_last: bool,
    },
    Seam,
}

impl Span {
    /// Some of `count` rows.
    pub(super) fn new(rows: Range<usize>, count: usize) -> Self {
        let kind = SpanKind::Rows { is_first: rows.start == 0, is_last: rows.end == count };
        Self { rows, kind }
    }

    /// What is left where two spans meet.
    pub(super) fn seam(row: usize) -> Self {
        Self { rows: row..row, kind: SpanKind::Seam }
    }

    /// The rows at which the next stage begins; then they have been through it.
    fn advance(&mut self, reach: usize) -> Range<usize> {
        let Range { start, end } = self.rows;
        match self.kind {
            SpanKind::Rows { is_first, is_last } => {
                let last = end.saturating_sub(reach);
                let next = if is_first { start } else { start + reach };
                self.rows = next..if is_last { end } else { last };
                start..last
            }
            SpanKind::Seam => {
                self.rows = start - reach..end + reach;
                start - reach..end
            }
        }
    }
}

/// Some rows, one after the other in memory.
pub(super) struct Band<'a> {
    pub(super) numbers: &'a mut [f32],
    /// The first of them.
    pub(super) first: usize,
    pub(super) shape: &'a Shape,
}

impl Band<'_> {
    /// Takes a span through a pass. Whether anything has torn.
    #[inline(always)]
    fn sweep<W: Wide>(&mut self, stages: &[Stage], span: &Span, sweep: &mut Sweep<'_, '_>) -> bool {
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
        for moment in first..last {
            for (stage, rows) in stages.iter().zip(&rows) {
                // Before the first row it wraps to a row that there is not.
                let row = moment.wrapping_sub(stage.lag);
                if rows.contains(&row) {
                    is_marked |= self.take::<W>(stage.deed, row, sweep);
                }
            }
        }
        is_marked
    }

    #[inline(always)]
    fn take<W: Wide>(&mut self, deed: Deed, row: usize, sweep: &mut Sweep<'_, '_>) -> bool {
        let shape = self.shape;
        match deed {
            Deed::Predict => {
                self.columns(row).predict::<W>(sweep.motion);
                false
            }
            Deed::EndSubstep => {
                let mut columns = self.columns(row);
                columns.pull_back::<W>();
                let contacts = &mut sweep.scratch.contacts;
                contacts.end_substep::<W>(&mut columns, sweep.motion.obstacles);
                false
            }
            Deed::Project { strand, half } | Deed::LimitStretch { strand, half } => {
                let Strand { family, .. } = shape.families[strand];
                if family.reach() > 0 && family.half(row, 0) != half {
                    return false;
                }
                let is_limit = matches!(deed, Deed::LimitStretch { .. });
                self.project::<W>(row, (strand, half), (is_limit, sweep))
            }
        }
    }

    #[inline(always)]
    fn columns(&mut self, row: usize) -> Columns<'_> {
        let length = self.shape.row_length;
        let row = &mut self.numbers[(row - self.first) * length..][..length];
        Columns::new(row, self.shape)
    }

    /// Projects constraints of one half of a family that begin in a row.
    #[inline(always)]
    fn project<W: Wide>(
        &mut self,
        row: usize,
        (strand, half): (usize, usize),
        (is_limit, sweep): (bool, &mut Sweep<'_, '_>),
    ) -> bool {
        let (shape, row_length) = (self.shape, self.shape.row_length);
        let Strand { family, give, is_plain } = shape.families[strand];
        let (stride, reach) = (shape.stride, family.reach());
        let (upper, below) =
            self.numbers[(row - self.first) * row_length..].split_at_mut(row_length);
        let (state, rest) = upper.split_at_mut(STATE_FIELDS * stride);
        let length = shape.strand_length;
        let links_at = (shape.links_at - STATE_FIELDS) * stride + strand * length;
        let fields = Fields::new(&mut rest[links_at..][..length], stride, shape.features);
        let count = family.count(shape.columns);
        // The first of a half within the row, in memory and in its fields.
        let from = if reach == 0 { half * family.shifts()[1] } else { 0 };
        let (base, length) = if reach == 0 {
            (half * stride / LINE, count.saturating_sub(from).div_ceil(LINE))
        } else {
            (0, count.div_ceil(8))
        };
        let eights = base..base + length;
        let ways = if reach == 0 {
            Ways::Across(Ends::new(state, stride, from, 2 * length), family)
        } else {
            let [a, b] = family.shifts();
            let lower = &mut below[(reach - 1) * row_length..];
            let upper = Ends::new(state, stride, a, length);
            Ways::Down(upper, Ends::new(lower, stride, b, length))
        };
        let block = &mut *sweep.scratch.block;
        if is_limit {
            return fields.limit(&eights).is_some_and(|limit| ways.project::<W>(limit, block));
        }
        if is_plain {
            ways.project::<W>(fields.rigid(&eights, give.share), block)
        } else {
            ways.project::<W>(fields.general(&eights, give, sweep.pass), block)
        }
    }
}

/// The ends of the constraints that are projected.
enum Ways<'a> {
    Down(Ends<'a>, Ends<'a>),
    Across(Ends<'a>, Family),
}

impl Ways<'_> {
    /// Whether anything has torn.
    #[inline(always)]
    fn project<W: Wide>(self, mut law: impl Law, block: &mut Block) -> bool {
        match self {
            Self::Down(upper, lower) => project_down::<W>(upper, lower, (&mut law, block)),
            Self::Across(row, family) => {
                project_across::<W>(row, family == Family::HorizontalBend, (&mut law, block));
            }
        }
        law.is_marked()
    }
}

/// What is done to some rows.
pub(super) struct Sweep<'a, 'b> {
    pub(super) stages: &'a [Stage],
    pub(super) pass: Pass,
    pub(super) motion: &'a Motion<'a>,
    pub(super) scratch: &'b mut Scratch,
}

/// Takes a span through a pass. Whether anything has torn.
pub(super) struct SweepWork<'a, 'b, 'c> {
    pub(super) band: Band<'a>,
    pub(super) span: Span,
    pub(super) sweep: Sweep<'b, 'c>,
}

impl Work for SweepWork<'_, '_, '_> {
    type Output = bool;

    #[inline(always)]
    fn run<W: Wide>(mut self) -> bool {
        let stages = self.sweep.stages;
        self.band.sweep::<W>(stages, &self.span, &mut self.sweep)
    }
}
