//! The projection of distance constraints, and the limits of their stretch.

use crate::kernels::{Eight, Lanes, Wide, axes, each};

/// The way r from particle a to particle b in the middle of a substep.
#[derive(Clone, Copy)]
pub(crate) struct Gap<L> {
    pub(crate) separation: [L; 3],
    pub(crate) size: Size<L>,
}

/// The size of a gap, |r|^2 = base + change.
///
/// In small substeps h^2 g is of the size of one rounding of |r|, and the force lambda / h^2 would
/// be noise. So with R = `x_b` - `x_a` at the start of the substep and D = `d_b` - `d_a`, the base
/// is |R|^2, and what the substep changes, (R + r) D, keeps all of its digits beside it. Where it
/// changes much they may cancel; there the base is |r|^2 itself, and the change 0.
#[derive(Clone, Copy)]
pub(crate) struct Size<L> {
    pub(crate) squared: L,
    pub(crate) base: L,
    pub(crate) change: L,
}

impl<L: Lanes> Gap<L> {
    /// From R and D.
    #[inline(always)]
    pub(crate) fn new(start: [L; 3], moved: [L; 3]) -> Self {
        let separation = sum(start, moved);
        let (squared, start_squared) = (dot(separation, separation), dot(start, start));
        let change = dot(sum(start, separation), moved);
        let is_small = (L::splat(8.0) * change.abs()).is_below(start_squared);
        let base = L::choose(is_small, start_squared, squared);
        Self { separation, size: Size { squared, base, change: change.only(is_small) } }
    }
}

impl<L: Lanes> Size<L> {
    /// |r|^2 - L^2.
    #[inline(always)]
    fn excess(&self, square: L) -> L {
        (self.base - square) + self.change
    }

    /// -`delta_lambda` / |r| of a rigid constraint in one division: with
    /// C = (|r|^2 - L^2) / (|r| + L), both sides of (C / w) / |r| times |r| + L.
    #[inline(always)]
    pub(crate) fn scale(&self, rest: Rest<L>, weight: L, share: L) -> L {
        let length = self.squared.sqrt();
        let weight = weight * ((length + rest.length) * length);
        ((share * self.excess(rest.square)) / weight).only(is_normal(weight))
    }
}

/// Whether a division by that weight moves anything: not where both ends are fixed, where they
/// coincide and there is no direction, where the constraint is torn (of infinite length), and not
/// where the state is no longer finite, which must not reach its neighbours.
#[inline(always)]
fn is_normal<L: Lanes>(weight: L) -> L::Mask {
    let is_enough = L::splat(f32::MIN_POSITIVE).is_at_most(weight);
    L::both(is_enough, weight.is_at_most(L::splat(f32::MAX)))
}

/// The scales of the two ends of a constraint. An end without weight is left out: a state that
/// blows up gives 0 times infinity, and must not reach what is held.
#[inline(always)]
pub(crate) fn end_scales<L: Lanes>([w_a, w_b]: [L; 2], scale: L) -> [L; 2] {
    let zero = L::splat(0.0);
    [(w_a * -scale).only(zero.is_below(w_a)), (w_b * scale).only(zero.is_below(w_b))]
}

/// What an end is moved by, in reverse: nothing where the scale is 0, whatever the separation.
#[inline(always)]
pub(crate) fn amount<L: Lanes>(separation: [L; 3], scale: L) -> [L; 3] {
    let is_moved = scale.is_not_zero();
    each(separation, |along| (scale * along).only(is_moved))
}

/// The length that a constraint goes back to, and its square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rest<L> {
    pub(crate) length: L,
    pub(crate) square: L,
}

impl Rest<f32> {
    pub(crate) fn new(length: f32) -> Self {
        Self { length, square: length * length }
    }
}

/// How the constraints of a run push. A run is some eights of constraints of one group.
pub(crate) trait Law: Sized {
    /// -`delta_lambda` / |r| of the constraints `at` in the run; `weight` is `w_a` + `w_b`. The ends
    /// move by `d_a` += `w_a` scale r, `d_b` -= `w_b` scale r.
    fn scale<L: Lanes>(&mut self, at: Spot, size: &Size<L>, weight: L) -> L;

    /// The first eights of the run, and the others.
    fn split(self, eights: usize) -> (Self, Self);

    /// Whether any of them has torn.
    fn is_marked(&self) -> bool;
}

/// A place in a run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spot {
    pub(crate) eight: usize,
    /// Of one constraint; of no meaning where all eight are meant.
    pub(crate) lane: usize,
}

/// Rigid constraints with nothing else to them: most of all.
pub(crate) struct Rigid<'a> {
    pub(crate) lengths: &'a [Eight],
    pub(crate) squares: &'a [Eight],
    /// Share of each correction that is made.
    pub(crate) share: f32,
}

impl Law for Rigid<'_> {
    #[inline(always)]
    fn scale<L: Lanes>(&mut self, at: Spot, size: &Size<L>, weight: L) -> L {
        size.scale(rest(self.lengths, self.squares, at), weight, L::splat(self.share))
    }

    fn split(self, eights: usize) -> (Self, Self) {
        let Self { lengths, squares, share } = self;
        let (lengths, other_lengths) = lengths.split_at(eights);
        let (squares, other_squares) = squares.split_at(eights);
        let other = Self { lengths: other_lengths, squares: other_squares, share };
        (Self { lengths, squares, share }, other)
    }

    fn is_marked(&self) -> bool {
        false
    }
}

/// Constraints with everything that they can have.
///
/// w = inverse mass, a = compliance / h^2: `delta_lambda` = -(C + a lambda) / (`w_a` + `w_b` + a),
/// lambda from 0 in each substep (XPBD: Macklin, Mueller, Chentanez 2016, equation 18). In method
/// pbd a is 0, and the share is k' (Position Based Dynamics: Mueller et al. 2007, section 3.3).
pub(crate) struct General<'a> {
    pub(crate) lengths: &'a [Eight],
    pub(crate) squares: &'a [Eight],
    /// Share of each correction that is made.
    pub(crate) shares: Values<'a>,
    /// a, in 1/kg.
    pub(crate) softness: Values<'a>,
    /// Lambda, in kg m, where somebody asks for it.
    pub(crate) multipliers: Option<&'a mut [Eight]>,
    /// It is the first pass of the substep: lambda is 0 yet.
    pub(crate) is_first: bool,
    /// They act only above these lengths.
    pub(crate) floors: Option<&'a [Eight]>,
    /// They tear above these lengths.
    pub(crate) tear_lengths: Option<&'a [Eight]>,
    /// They tear above these multipliers.
    pub(crate) tear_multipliers: Option<&'a [Eight]>,
    /// What has torn in this step: [`BY_LENGTH`], [`BY_FORCE`], or 0.
    pub(crate) marks: Option<&'a mut [Eight]>,
    /// Anything has.
    pub(crate) is_marked: bool,
}

/// Constraints of a run that are worked on together.
///
/// A projection is one long chain, from the positions through a root and a division to the
/// displacements, and the processor holds less than two of them in its registers. In three loops
/// over a block, each short, it holds many: half the time.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct Block {
    separations: [[Eight; BLOCK]; 3],
    squared: [Eight; BLOCK],
    base: [Eight; BLOCK],
    change: [Eight; BLOCK],
    scales: [[Eight; BLOCK]; 2],
}

/// Eights of a block.
pub(crate) const BLOCK: usize = 16;

impl Default for Block {
    fn default() -> Self {
        let zeros = [[0.0; 8]; BLOCK];
        Self {
            separations: [zeros; 3],
            squared: zeros,
            base: zeros,
            change: zeros,
            scales: [zeros; 2],
        }
    }
}

impl Block {
    #[inline(always)]
    pub(crate) fn set_gap<W: Wide>(&mut self, eight: usize, gap: &Gap<W>) {
        for (axis, along) in gap.separation.into_iter().enumerate() {
            along.store(&mut self.separations[axis][eight], 0);
        }
        gap.size.squared.store(&mut self.squared[eight], 0);
        gap.size.base.store(&mut self.base[eight], 0);
        gap.size.change.store(&mut self.change[eight], 0);
    }

    /// Works out how far the ends of constraints `eight` of the block move, `at` in the run.
    #[inline(always)]
    pub(crate) fn solve<W: Wide>(
        &mut self,
        eight: usize,
        (law, at): (&mut impl Law, Spot),
        [w_a, w_b]: [W; 2],
    ) {
        let size = Size {
            squared: W::load(&self.squared[eight], 0),
            base: W::load(&self.base[eight], 0),
            change: W::load(&self.change[eight], 0),
        };
        let scale = law.scale(at, &size, w_a + w_b);
        for (end, scale) in end_scales([w_a, w_b], scale).into_iter().enumerate() {
            scale.store(&mut self.scales[end][eight], 0);
        }
    }

    /// What the two ends are moved by, in reverse.
    #[inline(always)]
    pub(crate) fn amounts<W: Wide>(&self, eight: usize) -> [[W; 3]; 2] {
        let separation = axes(|axis| W::load(&self.separations[axis][eight], 0));
        [
            amount(separation, W::load(&self.scales[0][eight], 0)),
            amount(separation, W::load(&self.scales[1][eight], 0)),
        ]
    }
}

/// A mark: longer than it may be.
pub(crate) const BY_LENGTH: f32 = 1.0;
/// A mark: pulled by more than it bears.
pub(crate) const BY_FORCE: f32 = 2.0;

/// One number for all constraints, or one for each.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Values<'a> {
    All(f32),
    Each(&'a [Eight]),
}

impl Values<'_> {
    fn split(self, eights: usize) -> (Self, Self) {
        match self {
            Self::All(value) => (Self::All(value), Self::All(value)),
            Self::Each(values) => {
                let (first, other) = values.split_at(eights);
                (Self::Each(first), Self::Each(other))
            }
        }
    }

    #[inline(always)]
    fn load<L: Lanes>(&self, at: Spot) -> L {
        match self {
            Self::All(value) => L::splat(*value),
            Self::Each(values) => L::load(&values[at.eight], at.lane),
        }
    }
}

impl Law for General<'_> {
    #[inline(always)]
    fn scale<L: Lanes>(&mut self, at: Spot, size: &Size<L>, weight: L) -> L {
        let rest: Rest<L> = rest(self.lengths, self.squares, at);
        let softness: L = self.softness.load(at);
        let length = size.squared.sqrt();
        let denominator = length + rest.length;
        let before = match &self.multipliers {
            Some(multipliers) if !self.is_first => load(multipliers, at),
            _ => L::splat(0.0),
        };
        let excess = size.excess(rest.square) + (softness * before) * denominator;
        let total = (weight + softness) * (denominator * length);
        let mut is_made = L::both(is_normal(total), L::splat(0.0).is_below(weight));
        if let Some(floors) = self.floors {
            is_made = L::both(is_made, load::<L>(floors, at).is_below(length));
        }
        let scale = ((self.shares.load::<L>(at) * excess) / total).only(is_made);
        if let Some(tear_lengths) = self.tear_lengths {
            self.mark::<L>(at, load::<L>(tear_lengths, at).is_below(length), BY_LENGTH);
        }
        if let Some(multipliers) = &mut self.multipliers {
            let after = before - (scale * length).only(is_made);
            after.store(&mut multipliers[at.eight], at.lane);
            if let Some(tear_multipliers) = self.tear_multipliers {
                self.mark::<L>(at, load::<L>(tear_multipliers, at).is_below(after.abs()), BY_FORCE);
            }
        }
        scale
    }

    fn split(mut self, eights: usize) -> (Self, Self) {
        let (lengths, other_lengths) = self.lengths.split_at(eights);
        let (squares, other_squares) = self.squares.split_at(eights);
        let (shares, other_shares) = self.shares.split(eights);
        let (softness, other_softness) = self.softness.split(eights);
        let other = Self {
            lengths: other_lengths,
            squares: other_squares,
            shares: other_shares,
            softness: other_softness,
            multipliers: split_off_mut(&mut self.multipliers, eights),
            floors: split_off(&mut self.floors, eights),
            tear_lengths: split_off(&mut self.tear_lengths, eights),
            tear_multipliers: split_off(&mut self.tear_multipliers, eights),
            marks: split_off_mut(&mut self.marks, eights),
            ..self
        };
        (Self { lengths, squares, shares, softness, ..self }, other)
    }

    fn is_marked(&self) -> bool {
        self.is_marked
    }
}

fn split_off<'a>(field: &mut Option<&'a [Eight]>, eights: usize) -> Option<&'a [Eight]> {
    let (first, other) = field.take()?.split_at(eights);
    *field = Some(first);
    Some(other)
}

fn split_off_mut<'a>(
    field: &mut Option<&'a mut [Eight]>,
    eights: usize,
) -> Option<&'a mut [Eight]> {
    let (first, other) = field.take()?.split_at_mut(eights);
    *field = Some(first);
    Some(other)
}

impl General<'_> {
    /// Marks constraints that tear at the end of the step, unless they are marked already.
    #[inline(always)]
    fn mark<L: Lanes>(&mut self, at: Spot, mask: L::Mask, mark: f32) {
        if !L::any(mask) {
            return;
        }
        let Some(marks) = &mut self.marks else { return };
        let before: L = load(marks, at);
        let is_new = L::both(mask, before.is_at_most(L::splat(0.0)));
        L::choose(is_new, L::splat(mark), before).store(&mut marks[at.eight], at.lane);
        self.is_marked = true;
    }
}

#[inline(always)]
fn rest<L: Lanes>(lengths: &[Eight], squares: &[Eight], at: Spot) -> Rest<L> {
    Rest { length: load(lengths, at), square: load(squares, at) }
}

#[inline(always)]
fn load<L: Lanes>(values: &[Eight], at: Spot) -> L {
    L::load(&values[at.eight], at.lane)
}

#[inline(always)]
fn sum<L: Lanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
fn dot<L: Lanes>(a: [L; 3], b: [L; 3]) -> L {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
