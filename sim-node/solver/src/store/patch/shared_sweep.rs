//! Takes a sheet through a pass on several threads.
#![allow(unsafe_code, reason = "bands and seams overlap; see `SharedSweep::sweep`")]

use std::ops::Range;

use super::band::{LentRows, PassSweep, SweepWork};
use super::bands::Bands;
use super::span::Span;
use crate::constraints::fields::Pass;
use crate::kernels::Kernels;
use crate::kernels::worker_pool::{Milestone, WORKERS_MAX};
use crate::step::schedule::ScheduledStage;
use crate::step::substep::SubstepInputs;
use crate::store::workers::{WorkerScratch, Workers};

/// A pass over all rows.
pub(crate) struct SharedSweep<'a> {
    pub(crate) rows: LentRows<'a>,
    pub(crate) is_measured: bool,
    pub(crate) stages: &'a [ScheduledStage],
    pub(crate) pass: Pass,
    pub(crate) inputs: &'a SubstepInputs<'a>,
    pub(crate) bands: Bands,
    pub(crate) kernels: Kernels,
}

/// The work of one thread.
struct Part {
    band: usize,
    is_marked: bool,
}

impl SharedSweep<'_> {
    /// Returns true if any constraint was marked as torn.
    pub(crate) fn run(self, workers: &mut Workers) -> bool {
        let left_heads = [const { Milestone::new() }; WORKERS_MAX];
        let work = |part: &mut Part, scratch: &mut WorkerScratch| {
            // SAFETY: each band is one part.
            part.is_marked = unsafe { self.sweep(part.band, &left_heads, scratch) };
        };
        let mut is_marked = false;
        let parts = (0..self.bands.count).map(|band| Part { band, is_marked: false });
        workers.for_each(parts, work, |part| is_marked |= part.is_marked);
        is_marked
    }

    /// Sweeps a band and the seam below it. `left_heads` are reached when the wave has left the head of a band.
    ///
    /// # Safety
    /// Each band must be swept once.
    unsafe fn sweep(
        &self,
        band: usize,
        left_heads: &[Milestone],
        scratch: &mut WorkerScratch,
    ) -> bool {
        const ALL: Range<usize> = 0..usize::MAX;
        let left_head = left_heads[band].reach_when_dropped();
        let (rows, span) = (self.bands.rows(band), self.bands.span(band));
        if self.bands.count == 1 {
            // SAFETY: no other thread has a part.
            return unsafe { self.sweep_span(rows, (span, ALL), scratch) };
        }
        let (head, front) = self.bands.head(band);
        let rest = head.end..rows.end;
        // SAFETY: the seam above has rows of this band, but its thread waits until this one has left them.
        let mut is_marked = unsafe { self.sweep_span(rows, (span.clone(), 0..front), scratch) };
        drop(left_head);
        // SAFETY: no other thread uses rows behind the head.
        is_marked |= unsafe { self.sweep_span(rest, (span, front..ALL.end), scratch) };
        if let Some((seam, span)) = self.bands.seam(band) {
            left_heads[band + 1].wait();
            // SAFETY: the seam has the end of this band, which is finished, and the head of the next one, which
            // its thread has left.
            is_marked |= unsafe { self.sweep_span(seam, (span, ALL), scratch) };
        }
        is_marked
    }

    /// # Safety
    /// As for [`LentRows::band`].
    unsafe fn sweep_span(
        &self,
        rows: Range<usize>,
        (span, fronts): (Span, Range<usize>),
        scratch: &mut WorkerScratch,
    ) -> bool {
        let Self { stages, pass, inputs, .. } = *self;
        // SAFETY: the same as that of this function.
        let band = unsafe { self.rows.band(rows) };
        let sweep = PassSweep { stages, pass, inputs, scratch };
        if self.is_measured {
            self.kernels.run(SweepWork::<true> { band, span, fronts, sweep })
        } else {
            self.kernels.run(SweepWork::<false> { band, span, fronts, sweep })
        }
    }
}
