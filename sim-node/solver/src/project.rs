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
/// is |R|^2, and what the substep changes, (R + r) D, keeps all of its digits beside it.
#[derive(Clone, Copy)]
pub(crate) struct Size<L> {
    base: L,
    change: L,
}

/// Share of |R|^2 below which base and change have cancelled to noise: |r| is a thousandth of |R|.
const NOISE: f32 = 1.0 / (1 << 20) as f32;

impl<L: Lanes> Gap<L> {
    /// From R and D.
    #[inline(always)]
    pub(crate) fn new(start: [L; 3], moved: [L; 3]) -> Self {
        let separation = sum(start, moved);
        let size = Size { base: dot(start, start), change: dot(sum(start, separation), moved) };
        Self { separation, size }
    }
}

impl<L: Lanes> Size<L> {
    /// |r|^2; at least what is not noise, so that a collapsed gap is not pushed apart by it.
    #[inline(always)]
    pub(crate) fn squared(&self) -> L {
        (L::splat(NOISE) * self.base).or_at_least(self.base + self.change)
    }

    /// |r|^2 - L^2.
    #[inline(always)]
    fn excess(&self, square: L) -> L {
        (self.base - square) + self.change
    }

    /// -`delta_lambda` / |r| of a rigid constraint in one division: with
    /// C = (|r|^2 - L^2) / (|r| + L), both sides of (C / w) / |r| times |r| + L.
    ///
    /// No number where there is nothing to correct by; see [`divide`].
    #[inline(always)]
    pub(crate) fn scale(&self, rest: Rest<L>, weight: L, share: L) -> L {
        let length = self.squared().sqrt();
        divide(share * self.excess(rest.square), weight * ((length + rest.length) * length))
    }
}

/// A scale: a division by the weight of a correction. It is no number, and [`correction`] makes
/// nothing of it, where both ends are fixed, where they coincide and there is no direction, where
/// the constraint is torn (of infinite length), and where the state is no longer finite. Else it is
/// finite, so that an end without weight has no part in it, whatever happens to the other.
#[inline(always)]
fn divide<L: Lanes>(numerator: L, weight: L) -> L {
    let is_enough = L::splat(f32::MIN_POSITIVE).is_at_most(weight);
    let scale = L::splat(-f32::MAX).or_at_least(numerator / weight);
    L::choose(is_enough, scale, L::splat(f32::NAN))
}

/// What is made of a scale: nothing where it is no number, so that a state that blows up reaches
/// neither its neighbours nor what is held.
#[inline(always)]
pub(crate) fn correction<L: Lanes>(separation: [L; 3], scale: L) -> Correction<L> {
    let is_made = scale.is_number();
    let separation = each(separation, |along| along.only(is_made));
    Correction { separation, scale: scale.only(is_made) }
}

/// A correction: an end of inverse mass w moves by w scale r, the other one in reverse.
#[derive(Clone, Copy)]
pub(crate) struct Correction<L> {
    pub(crate) separation: [L; 3],
    pub(crate) scale: L,
}

impl<L: Lanes> Correction<L> {
    /// What the first end moves by, or the second in reverse.
    #[inline(always)]
    pub(crate) fn way(&self, w: L) -> [L; 3] {
        let scale = w * self.scale;
        each(self.separation, |along| scale * along)
    }
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
    /// move by `d_a` += `w_a` scale r, `d_b` -= `w_b` scale r; not where it is no number.
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
    base: [Eight; BLOCK],
    change: [Eight; BLOCK],
    scales: [Eight; BLOCK],
}

/// Eights of a block.
pub(crate) const BLOCK: usize = 16;

impl Default for Block {
    fn default() -> Self {
        let zeros = [[0.0; 8]; BLOCK];
        Self { separations: [zeros; 3], base: zeros, change: zeros, scales: zeros }
    }
}

impl Block {
    #[inline(always)]
    pub(crate) fn set_gap<W: Wide>(&mut self, eight: usize, gap: &Gap<W>) {
        for (axis, along) in gap.separation.into_iter().enumerate() {
            along.store(&mut self.separations[axis][eight], 0);
        }
        gap.size.base.store(&mut self.base[eight], 0);
        gap.size.change.store(&mut self.change[eight], 0);
    }

    /// Works out the scales of constraints `eight` of the block, `at` in the run.
    #[inline(always)]
    pub(crate) fn solve<W: Wide>(
        &mut self,
        eight: usize,
        (law, at): (&mut impl Law, Spot),
        weight: W,
    ) {
        let (base, change) = (W::load(&self.base[eight], 0), W::load(&self.change[eight], 0));
        law.scale(at, &Size { base, change }, weight).store(&mut self.scales[eight], 0);
    }

    /// How constraints `eight` of the block move their ends.
    #[inline(always)]
    pub(crate) fn correction<W: Wide>(&self, eight: usize) -> Correction<W> {
        let separation = axes(|axis| W::load(&self.separations[axis][eight], 0));
        correction(separation, W::load(&self.scales[eight], 0))
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
        let length = size.squared().sqrt();
        let denominator = length + rest.length;
        let before = match &self.multipliers {
            Some(multipliers) if !self.is_first => load(multipliers, at),
            _ => L::splat(0.0),
        };
        let excess = size.excess(rest.square) + (softness * before) * denominator;
        let total = (weight + softness) * (denominator * length);
        let scale = divide(self.shares.load::<L>(at) * excess, total);
        let mut is_made = L::both(scale.is_number(), L::splat(0.0).is_below(weight));
        if let Some(floors) = self.floors {
            is_made = L::both(is_made, load::<L>(floors, at).is_below(length));
        }
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
        L::choose(is_made, scale, L::splat(f32::NAN))
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
