//! What constraints are like, in fields of numbers that the kernels read eight at a time.

use std::ops::Range;

use crate::kernels::{Eight, eights, eights_mut};
use crate::project::{General, Rest, Rigid, Values};

/// What one constraint is like.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Term {
    /// Infinite where it is torn.
    pub(crate) rest: Rest<f32>,
    /// It acts only above this length.
    pub(crate) floor: f32,
    /// How soft it is.
    pub(crate) give: Give,
    /// It never exceeds this length; infinite where it is not limited.
    pub(crate) max_length: f32,
    /// It tears above this length; infinite where it does not.
    pub(crate) tear_length: f32,
    /// It tears above this multiplier, force times h^2; infinite where it does not.
    pub(crate) tear_multiplier: f32,
}

/// How soft a constraint is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Give {
    /// xpbd: compliance / h^2, in 1/kg. pbd: 0.
    pub(crate) softness: f32,
    /// Share of each correction that is made: in pbd k', times the relaxation factor in both.
    pub(crate) share: f32,
}

impl Default for Give {
    /// Rigid.
    fn default() -> Self {
        Self { softness: 0.0, share: 1.0 }
    }
}

impl Term {
    /// A constraint that does nothing: it is torn, or is padding.
    pub(crate) const NONE: Self = Self {
        rest: Rest { length: f32::INFINITY, square: f32::INFINITY },
        floor: -1.0,
        give: Give { softness: 0.0, share: 0.0 },
        max_length: f32::INFINITY,
        tear_length: f32::INFINITY,
        tear_multiplier: f32::INFINITY,
    };
}

/// What any constraint of a scene has beside a length. What none has takes no room and no time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[allow(clippy::struct_excessive_bools, reason = "each is a field of numbers, there or not")]
pub(crate) struct Features {
    /// They differ in their softness or share.
    pub(crate) gives: bool,
    pub(crate) floors: bool,
    pub(crate) max_lengths: bool,
    pub(crate) tear_lengths: bool,
    pub(crate) tear_multipliers: bool,
    /// Somebody asks for lambda: a limit of force, or a later pass over soft constraints.
    pub(crate) multipliers: bool,
}

impl Features {
    /// Whether constraints of that softness need no more than [`Rigid`].
    pub(crate) fn are_plain(self, softness: f32) -> bool {
        let plain = Self { max_lengths: self.max_lengths, ..Self::default() };
        self == plain && softness == 0.0
    }

    /// Fields that constraints with these features need, in the order of [`Fields::new`].
    pub(crate) fn field_count(self) -> usize {
        let tears = self.tear_lengths || self.tear_multipliers;
        let [gives, floors, limits] = [self.gives, self.floors, self.max_lengths].map(usize::from);
        let [lengths, forces, multipliers, marks] =
            [self.tear_lengths, self.tear_multipliers, self.multipliers, tears].map(usize::from);
        2 + 2 * gives + floors + 2 * limits + lengths + forces + multipliers + marks
    }
}

/// The passes of a substep over all constraints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pass {
    /// From 0.
    pub(crate) index: u32,
    /// Passes of a substep.
    pub(crate) count: u32,
}

/// The fields of some constraints, each as long as the others.
pub(crate) struct Fields<'a> {
    lengths: &'a mut [f32],
    squares: &'a mut [f32],
    gives: Option<[&'a mut [f32]; 2]>,
    floors: Option<&'a mut [f32]>,
    max_lengths: Option<[&'a mut [f32]; 2]>,
    tear_lengths: Option<&'a mut [f32]>,
    tear_multipliers: Option<&'a mut [f32]>,
    multipliers: Option<&'a mut [f32]>,
    marks: Option<&'a mut [f32]>,
}

impl<'a> Fields<'a> {
    /// Cuts a block into fields of `length` numbers.
    #[inline(always)]
    pub(crate) fn new(block: &'a mut [f32], length: usize, features: Features) -> Self {
        let mut rest = block;
        let mut next = || {
            let (field, others) = std::mem::take(&mut rest).split_at_mut(length);
            rest = others;
            field
        };
        let tears = features.tear_lengths || features.tear_multipliers;
        Self {
            lengths: next(),
            squares: next(),
            gives: features.gives.then(|| [next(), next()]),
            floors: features.floors.then(&mut next),
            max_lengths: features.max_lengths.then(|| [next(), next()]),
            tear_lengths: features.tear_lengths.then(&mut next),
            tear_multipliers: features.tear_multipliers.then(&mut next),
            multipliers: features.multipliers.then(&mut next),
            marks: tears.then(&mut next),
        }
    }

    pub(crate) fn set(&mut self, at: usize, term: &Term) {
        (self.lengths[at], self.squares[at]) = (term.rest.length, term.rest.square);
        if let Some([softness, shares]) = &mut self.gives {
            (softness[at], shares[at]) = (term.give.softness, term.give.share);
        }
        if let Some([lengths, squares]) = &mut self.max_lengths {
            (lengths[at], squares[at]) = (term.max_length, term.max_length * term.max_length);
        }
        for (field, value) in [
            (&mut self.floors, term.floor),
            (&mut self.tear_lengths, term.tear_length),
            (&mut self.tear_multipliers, term.tear_multiplier),
            (&mut self.multipliers, 0.0),
            (&mut self.marks, 0.0),
        ] {
            if let Some(field) = field {
                field[at] = value;
            }
        }
    }

    /// What has torn the constraint in this step, as `project` marks it; 0 from now on.
    pub(crate) fn take_mark(&mut self, at: usize) -> f32 {
        self.marks.as_mut().map_or(0.0, |marks| std::mem::take(&mut marks[at]))
    }

    /// Lengths alone.
    #[inline(always)]
    pub(crate) fn rigid(self, eights: &Range<usize>, share: f32) -> Rigid<'a> {
        let Self { lengths, squares, .. } = self;
        Rigid { lengths: cut(lengths, eights), squares: cut(squares, eights), share }
    }

    /// Everything; `give` is that of all constraints where they have none of their own.
    #[inline(always)]
    pub(crate) fn general(self, eights: &Range<usize>, give: Give, pass: Pass) -> General<'a> {
        let (is_first, is_last) = (pass.index == 0, pass.index + 1 == pass.count);
        let (softness, shares) = match self.gives {
            Some([softness, shares]) => {
                (Values::Each(cut(softness, eights)), Values::Each(cut(shares, eights)))
            }
            None => (Values::All(give.softness), Values::All(give.share)),
        };
        General {
            lengths: cut(self.lengths, eights),
            squares: cut(self.squares, eights),
            shares,
            softness,
            multipliers: self.multipliers.map(|field| cut_mut(field, eights)),
            is_first,
            floors: self.floors.map(|field| cut(field, eights)),
            tear_lengths: self.tear_lengths.filter(|_| is_first).map(|field| cut(field, eights)),
            tear_multipliers: self
                .tear_multipliers
                .filter(|_| is_last)
                .map(|field| cut(field, eights)),
            marks: self.marks.map(|field| cut_mut(field, eights)),
            is_marked: false,
        }
    }

    /// The longest lengths, as lengths that pull only.
    #[inline(always)]
    pub(crate) fn limit(self, eights: &Range<usize>) -> Option<General<'a>> {
        let [lengths, squares] = self.max_lengths?;
        let lengths = cut(lengths, eights);
        Some(General {
            lengths,
            squares: cut(squares, eights),
            shares: Values::All(1.0),
            softness: Values::All(0.0),
            multipliers: None,
            is_first: true,
            floors: Some(lengths),
            tear_lengths: None,
            tear_multipliers: None,
            marks: None,
            is_marked: false,
        })
    }
}

#[inline(always)]
fn cut<'a>(field: &'a [f32], range: &Range<usize>) -> &'a [Eight] {
    eights(field, 8 * range.start, range.len())
}

#[inline(always)]
fn cut_mut<'a>(field: &'a mut [f32], range: &Range<usize>) -> &'a mut [Eight] {
    eights_mut(field, 8 * range.start, range.len())
}
