//! The projection of distance constraints, rigid ones and those with every property.

use super::separation::{RestLength, SquaredLength, divide};
use crate::kernels::lanes::{Lanes, Lanes8};

/// The constraints of a run, and how they correct their ends. A run is a sequence of lane groups
/// whose constraints belong to one group of the order of projection.
pub(crate) trait Projection: Sized {
    /// -`delta_lambda` / |r| of the constraints at `index`, where `weight` is `w_a` + `w_b`. The ends
    /// move by `d_a` += `w_a` scale r and `d_b` -= `w_b` scale r. NaN means no correction.
    fn scale<L: Lanes>(&mut self, index: LaneIndex, squared: &SquaredLength<L>, weight: L) -> L;

    /// Splits the run after `count` lane groups.
    fn split(self, count: usize) -> (Self, Self);

    /// True if any constraint of the run was marked as torn.
    fn is_marked(&self) -> bool;
}

/// Position of constraints in a run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LaneIndex {
    pub(crate) group: usize,
    /// Lane of a single constraint; ignored by types of eight lanes.
    pub(crate) lane: usize,
}

/// Rigid constraints without further properties, which most constraints are.
pub(crate) struct RigidProjection<'a> {
    pub(crate) lengths: &'a [Lanes8],
    pub(crate) squares: &'a [Lanes8],
    /// Fraction of each correction that is applied.
    pub(crate) share: f32,
}

impl Projection for RigidProjection<'_> {
    #[inline(always)]
    fn scale<L: Lanes>(&mut self, index: LaneIndex, squared: &SquaredLength<L>, weight: L) -> L {
        squared.scale(rest(self.lengths, self.squares, index), weight, L::splat(self.share))
    }

    fn split(self, count: usize) -> (Self, Self) {
        let Self { lengths, squares, share } = self;
        let (lengths, other_lengths) = lengths.split_at(count);
        let (squares, other_squares) = squares.split_at(count);
        let other = Self { lengths: other_lengths, squares: other_squares, share };
        (Self { lengths, squares, share }, other)
    }

    fn is_marked(&self) -> bool {
        false
    }
}

/// Constraints with every property that a scene can give them.
///
/// With w = inverse mass and a = compliance / h^2, the change of the multiplier is
/// `delta_lambda` = -(C + a lambda) / (`w_a` + `w_b` + a). Lambda starts at 0 in each substep (XPBD:
/// Macklin, Mueller, Chentanez 2016, equation 18). In method pbd a is 0, and the share is k'
/// (Position Based Dynamics: Mueller et al. 2007, section 3.3).
pub(crate) struct FullProjection<'a> {
    pub(crate) lengths: &'a [Lanes8],
    pub(crate) squares: &'a [Lanes8],
    /// Fraction of each correction that is applied.
    pub(crate) shares: Values<'a>,
    /// a, in 1/kg.
    pub(crate) scaled_compliances: Values<'a>,
    /// Lambda in kg m, if it is needed.
    pub(crate) multipliers: Option<&'a mut [Lanes8]>,
    /// True in the first pass of a substep, where lambda is still 0.
    pub(crate) is_first: bool,
    /// Lengths above which a constraint acts.
    pub(crate) floors: Option<&'a [Lanes8]>,
    /// Lengths above which a constraint tears.
    pub(crate) tear_lengths: Option<&'a [Lanes8]>,
    /// Multipliers above which a constraint tears.
    pub(crate) tear_multipliers: Option<&'a [Lanes8]>,
    /// By constraint, the mark of this step: [`TORN_BY_LENGTH`], [`TORN_BY_FORCE`], or 0.
    pub(crate) marks: Option<&'a mut [Lanes8]>,
    pub(crate) is_marked: bool,
}

/// Mark of a constraint that exceeded its length.
const TORN_BY_LENGTH: f32 = 1.0;
/// Mark of a constraint that exceeded its force.
const TORN_BY_FORCE: f32 = 2.0;

/// Limit that a marked constraint exceeded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TearMark {
    Length,
    Force,
}

impl TearMark {
    /// From a number in the marks of a [`FullProjection`].
    pub(crate) fn from_number(mark: f32) -> Option<Self> {
        match mark {
            TORN_BY_LENGTH => Some(Self::Length),
            TORN_BY_FORCE => Some(Self::Force),
            _ => None,
        }
    }
}

/// One number for all constraints, or one for each.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Values<'a> {
    All(f32),
    Each(&'a [Lanes8]),
}

impl Values<'_> {
    fn split(self, count: usize) -> (Self, Self) {
        match self {
            Self::All(value) => (Self::All(value), Self::All(value)),
            Self::Each(values) => {
                let (first, other) = values.split_at(count);
                (Self::Each(first), Self::Each(other))
            }
        }
    }

    #[inline(always)]
    fn load<L: Lanes>(&self, index: LaneIndex) -> L {
        match self {
            Self::All(value) => L::splat(*value),
            Self::Each(values) => load(values, index),
        }
    }
}

impl Projection for FullProjection<'_> {
    #[inline(always)]
    fn scale<L: Lanes>(&mut self, index: LaneIndex, squared: &SquaredLength<L>, weight: L) -> L {
        let rest: RestLength<L> = rest(self.lengths, self.squares, index);
        let scaled_compliance: L = self.scaled_compliances.load(index);
        let length = squared.value().sqrt();
        let denominator = length + rest.length;
        let before = match &self.multipliers {
            Some(multipliers) if !self.is_first => load(multipliers, index),
            _ => L::splat(0.0),
        };
        let excess = squared.excess(rest.square) + (scaled_compliance * before) * denominator;
        let total = (weight + scaled_compliance) * (denominator * length);
        let scale = divide(self.shares.load::<L>(index) * excess, total);
        let mut is_active = L::both(scale.is_not_nan(), L::splat(0.0).is_below(weight));
        if let Some(floors) = self.floors {
            is_active = L::both(is_active, load::<L>(floors, index).is_below(length));
        }
        if let Some(tear_lengths) = self.tear_lengths {
            let is_torn = load::<L>(tear_lengths, index).is_below(length);
            self.mark::<L>(index, is_torn, TORN_BY_LENGTH);
        }
        if let Some(multipliers) = &mut self.multipliers {
            let after = before - (scale * length).masked(is_active);
            after.store(&mut multipliers[index.group], index.lane);
            if let Some(tear_multipliers) = self.tear_multipliers {
                let is_torn = load::<L>(tear_multipliers, index).is_below(after.abs());
                self.mark::<L>(index, is_torn, TORN_BY_FORCE);
            }
        }
        L::select(is_active, scale, L::splat(f32::NAN))
    }

    fn split(mut self, count: usize) -> (Self, Self) {
        let (lengths, other_lengths) = self.lengths.split_at(count);
        let (squares, other_squares) = self.squares.split_at(count);
        let (shares, other_shares) = self.shares.split(count);
        let (scaled_compliances, other_scaled_compliances) = self.scaled_compliances.split(count);
        let other = Self {
            lengths: other_lengths,
            squares: other_squares,
            shares: other_shares,
            scaled_compliances: other_scaled_compliances,
            multipliers: split_off_mut(&mut self.multipliers, count),
            floors: split_off(&mut self.floors, count),
            tear_lengths: split_off(&mut self.tear_lengths, count),
            tear_multipliers: split_off(&mut self.tear_multipliers, count),
            marks: split_off_mut(&mut self.marks, count),
            ..self
        };
        (Self { lengths, squares, shares, scaled_compliances, ..self }, other)
    }

    fn is_marked(&self) -> bool {
        self.is_marked
    }
}

fn split_off<'a>(column: &mut Option<&'a [Lanes8]>, count: usize) -> Option<&'a [Lanes8]> {
    let (first, other) = column.take()?.split_at(count);
    *column = Some(first);
    Some(other)
}

fn split_off_mut<'a>(
    column: &mut Option<&'a mut [Lanes8]>,
    count: usize,
) -> Option<&'a mut [Lanes8]> {
    let (first, other) = column.take()?.split_at_mut(count);
    *column = Some(first);
    Some(other)
}

impl FullProjection<'_> {
    /// Marks constraints to tear at the end of the step. The first mark of a step stays.
    #[inline(always)]
    fn mark<L: Lanes>(&mut self, index: LaneIndex, is_torn: L::Mask, mark: f32) {
        if !L::any(is_torn) {
            return;
        }
        let Some(marks) = &mut self.marks else { return };
        let before: L = load(marks, index);
        let is_new = L::both(is_torn, before.is_at_most(L::splat(0.0)));
        L::select(is_new, L::splat(mark), before).store(&mut marks[index.group], index.lane);
        self.is_marked = true;
    }
}

#[inline(always)]
fn rest<L: Lanes>(lengths: &[Lanes8], squares: &[Lanes8], index: LaneIndex) -> RestLength<L> {
    RestLength { length: load(lengths, index), square: load(squares, index) }
}

#[inline(always)]
fn load<L: Lanes>(values: &[Lanes8], index: LaneIndex) -> L {
    L::load(&values[index.group], index.lane)
}
