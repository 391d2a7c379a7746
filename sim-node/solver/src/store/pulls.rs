//! The pulls of constraints and bends on fixed particles.
//!
//! A projection does not move a fixed particle, so its pull is measured at a free one: no two constraints of a
//! group share a particle, so one that a group moves is moved by the constraint with the fixed particle
//! alone. The measured changes are those that the particle really makes, so impulses and momentum agree up to
//! the rounding of a sum.

use std::ops::Range;

use glam::DVec3;

use crate::kernels::lanes::axes;
use crate::kernels::lent_slice::LentSlice;

/// A constraint or bend with a fixed particle, measured at a free one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pull {
    /// Number of the projection that moves the free particle: a group of the graph, or of a row.
    pub(crate) projection: usize,
    /// Where the x displacement of the free particle is among the numbers of all.
    pub(crate) at: usize,
    /// Index of the fixed particle among those that are fixed.
    pub(crate) receiver: usize,
    /// Impulse on the fixed particle over the change of the free one's velocity, in kg.
    pub(crate) factor: f32,
}

/// The pulls in the graph or in a sheet. Empty while nobody asks for forces.
#[derive(Debug, Clone, Default)]
pub(crate) struct Pulls {
    /// By projection: its pulls.
    ranges: Vec<PullRange>,
    /// In the order of the projections.
    all: Vec<Pull>,
    /// By pull.
    changes: Vec<Change>,
}

/// Indices of the first pull of a projection, and of the first one behind them.
type PullRange = [u32; 2];

/// Change of a free particle by a projection.
#[derive(Debug, Clone, Copy)]
struct Change {
    /// Where the x displacement is among the numbers of all.
    place: u32,
    /// The displacement before the projection.
    before: [f32; 3],
    /// The sum of its changes in this step.
    sum: [f32; 3],
}

impl Pulls {
    /// Sorts pulls for projections with numbers below `projection_count`.
    #[allow(clippy::cast_possible_truncation, reason = "fewer than 2^32 pulls and numbers")]
    pub(crate) fn new(mut pulls: Vec<Pull>, projection_count: usize) -> Self {
        pulls.sort_unstable_by_key(|pull| (pull.projection, pull.at, pull.receiver));
        let first = |number| pulls.partition_point(|pull| pull.projection < number) as u32;
        let change =
            |pull: &Pull| Change { place: pull.at as u32, before: [0.0; 3], sum: [0.0; 3] };
        Self {
            ranges: (0..projection_count)
                .map(|number| [first(number), first(number + 1)])
                .collect(),
            changes: pulls.iter().map(change).collect(),
            all: pulls,
        }
    }

    /// Returns true if a projection has pulls.
    #[inline(always)]
    pub(crate) fn has(&self, projection: usize) -> bool {
        self.ranges.get(projection).is_some_and(|[first, end]| first < end)
    }

    /// All projections, for threads that take them one after the other.
    pub(crate) fn lend(&mut self) -> LentPulls<'_> {
        LentPulls { ranges: &self.ranges, changes: LentSlice::new(&mut self.changes) }
    }

    /// All projections.
    pub(crate) fn whole(&mut self) -> PullsPart<'_> {
        PullsPart { ranges: &self.ranges, changes: &mut self.changes, first: 0 }
    }

    /// Moves the impulses of a step, times the length of a substep, to those of the fixed particles.
    pub(crate) fn take(&mut self, impulses: &mut [DVec3]) {
        for (pull, change) in self.all.iter().zip(&mut self.changes) {
            let sum = DVec3::from_array(change.sum.map(f64::from));
            impulses[pull.receiver] += sum * f64::from(pull.factor);
            change.sum = [0.0; 3];
        }
    }
}

/// The pulls of consecutive projections.
#[derive(Debug)]
pub(crate) struct PullsPart<'a> {
    /// By projection of the graph or the sheet.
    ranges: &'a [PullRange],
    changes: &'a mut [Change],
    /// Index of the first pull in `changes`.
    first: usize,
}

/// The pulls of all projections, parts of which go from thread to thread.
#[derive(Debug)]
pub(crate) struct LentPulls<'a> {
    /// By projection.
    ranges: &'a [PullRange],
    changes: LentSlice<'a, Change>,
}

impl LentPulls<'_> {
    /// Returns the pulls of some projections.
    ///
    /// # Safety
    /// As for [`LentSlice::part`], with projections as elements.
    #[allow(unsafe_code, reason = "lends on")]
    pub(crate) unsafe fn part(&self, projections: Range<usize>) -> PullsPart<'_> {
        let end = self.ranges.last().map_or(0, |[_, end]| *end as usize);
        let first = |projection: usize| {
            self.ranges.get(projection).map_or(end, |[first, _]| *first as usize)
        };
        let changes = first(projections.start)..first(projections.end);
        // SAFETY: no two projections share a change.
        let part = unsafe { self.changes.part(changes.clone()) };
        PullsPart { ranges: self.ranges, changes: part, first: changes.start }
    }
}

/// The numbers of particles in memory.
#[derive(Clone, Copy)]
pub(crate) struct Numbers<'a> {
    pub(crate) part: &'a [f32],
    /// Where the part begins among the numbers of all.
    pub(crate) first: usize,
    /// Distance of the components of a vector.
    pub(crate) stride: usize,
}

impl<'a> PullsPart<'a> {
    /// Splits before a projection.
    pub(crate) fn split_at(self, projection: usize) -> (PullsPart<'a>, PullsPart<'a>) {
        let Self { ranges, changes, first } = self;
        let end = first + changes.len();
        let next = ranges.get(projection).map_or(end, |[next, _]| *next as usize);
        let (before, behind) = changes.split_at_mut(next - first);
        let part = |changes, first| PullsPart { ranges, changes, first };
        (part(before, first), part(behind, next))
    }

    /// Returns true if a projection has pulls.
    #[inline(always)]
    pub(crate) fn has(&self, projection: usize) -> bool {
        self.ranges.get(projection).is_some_and(|[first, end]| first < end)
    }

    /// Notes the displacements before a projection.
    #[inline(always)]
    pub(crate) fn note(&mut self, projection: usize, numbers: Numbers<'_>) {
        for change in self.of(projection) {
            change.before = numbers.vector(change.place);
        }
    }

    /// Adds the changes since [`Self::note`].
    #[inline(always)]
    pub(crate) fn add_changes(&mut self, projection: usize, numbers: Numbers<'_>) {
        for Change { place, before, sum } in self.of(projection) {
            let after = numbers.vector(*place);
            *sum = axes(|axis| sum[axis] + (after[axis] - before[axis]));
        }
    }

    #[inline(always)]
    fn of(&mut self, projection: usize) -> &mut [Change] {
        let [first, end] = self.ranges[projection].map(|index| index as usize);
        &mut self.changes[first - self.first..end - self.first]
    }
}

impl Numbers<'_> {
    #[inline(always)]
    fn vector(&self, place: u32) -> [f32; 3] {
        let numbers = &self.part[place as usize - self.first..];
        axes(|axis| numbers[axis * self.stride])
    }
}

/// A tether as the store knows it.
pub(crate) struct TetherEnds {
    pub(crate) particle: u32,
    /// Number of nearer roots.
    pub(crate) slot: usize,
    pub(crate) root: u32,
}
