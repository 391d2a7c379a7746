//! The rows of a patch, eight columns at a time.

use glam::Vec3;

use super::{Extras, STATE_FIELDS, Shape};
use crate::bodies::motion::{Motion, pull_back};
use crate::contact::Cells;
use crate::kernels::{Eight, Wide, axes, each, eights, eights_mut};
use crate::project::{BLOCK, Block, Gap, Law, Rest, Spot};
use crate::solid::{Way, Zone};

/// Positions, inverse masses and displacements of some columns of a row.
pub(super) struct Ends<'a> {
    x: [&'a [Eight]; 3],
    w: &'a [Eight],
    d: [&'a mut [Eight]; 3],
}

impl<'a> Ends<'a> {
    /// `state` is the fields that every row begins with.
    #[inline(always)]
    pub(super) fn new(state: &'a mut [f32], stride: usize, from: usize, count: usize) -> Self {
        let (fixed, d) = state[..STATE_FIELDS * stride].split_at_mut(4 * stride);
        let (dx, d) = d.split_at_mut(stride);
        let (dy, dz) = d.split_at_mut(stride);
        let field = |index: usize| eights(&fixed[index * stride..][..stride], from, count);
        Self {
            x: [field(0), field(1), field(2)],
            w: field(3),
            d: each([dx, dy, dz], |d| eights_mut(d, from, count)),
        }
    }
}

/// Projects constraints between two rows.
#[inline(always)]
pub(super) fn project_down<W: Wide>(
    upper: Ends<'_>,
    lower: Ends<'_>,
    (law, block): (&mut impl Law, &mut Block),
) {
    let count = upper.w.len();
    let (x_a, x_b) = (each(upper.x, |x| &x[..count]), each(lower.x, |x| &x[..count]));
    let (w_a, w_b) = (upper.w, &lower.w[..count]);
    let (d_a, d_b) = (each(upper.d, |d| &mut d[..count]), each(lower.d, |d| &mut d[..count]));
    for first in (0..count).step_by(BLOCK) {
        let length = BLOCK.min(count - first);
        for eight in 0..length {
            let load = |field: &[Eight]| W::load(&field[first + eight], 0);
            let start = axes(|axis| load(x_b[axis]) - load(x_a[axis]));
            let moved = axes(|axis| load(d_b[axis]) - load(d_a[axis]));
            block.set_gap(eight, &Gap::new(start, moved));
        }
        for eight in 0..length {
            let load = |field: &[Eight]| W::load(&field[first + eight], 0);
            let at = Spot { eight: first + eight, lane: 0 };
            block.solve(eight, (law, at), load(w_a) + load(w_b));
        }
        for eight in 0..length {
            let load = |field: &[Eight]| W::load(&field[first + eight], 0);
            let correction = block.correction::<W>(eight);
            let (way_a, way_b) = (correction.way(load(w_a)), correction.way(load(w_b)));
            for axis in 0..3 {
                let (d_a, d_b) = (&mut d_a[axis][first + eight], &mut d_b[axis][first + eight]);
                (W::load(d_a, 0) + way_a[axis]).store(d_a, 0);
                (W::load(d_b, 0) - way_b[axis]).store(d_b, 0);
            }
        }
    }
}

/// Projects constraints within a row, sixteen columns at a time.
#[inline(always)]
pub(super) fn project_across<W: Wide>(
    row: Ends<'_>,
    is_bend: bool,
    (law, block): (&mut impl Law, &mut Block),
) {
    let count = row.w.len() / 2;
    let x = each(row.x, |x| pairs(x, count));
    let w = pairs(row.w, count);
    let d = each(row.d, |d| pairs_mut(d, count));
    for first in (0..count).step_by(BLOCK) {
        let length = BLOCK.min(count - first);
        for eight in 0..length {
            let at = first + eight;
            let start = axes(|axis| difference(unzip(&x[axis][at], is_bend)));
            let moved = axes(|axis| difference(unzip(&d[axis][at], is_bend)));
            block.set_gap::<W>(eight, &Gap::new(start, moved));
        }
        for eight in 0..length {
            let at = Spot { eight: first + eight, lane: 0 };
            let [w_a, w_b]: [W; 2] = unzip(&w[at.eight], is_bend);
            block.solve(eight, (law, at), w_a + w_b);
        }
        for eight in 0..length {
            let correction = block.correction::<W>(eight);
            let [w_a, w_b]: [W; 2] = unzip(&w[first + eight], is_bend);
            let (way_a, way_b) = (correction.way(w_a), correction.way(-w_b));
            for axis in 0..3 {
                let [low, high] = zip([way_a[axis], way_b[axis]], is_bend);
                let [to_low, to_high] = &mut d[axis][first + eight];
                (W::load(to_low, 0) + low).store(to_low, 0);
                (W::load(to_high, 0) + high).store(to_high, 0);
            }
        }
    }
}

#[inline(always)]
fn unzip<W: Wide>([low, high]: &[Eight; 2], is_bend: bool) -> [W; 2] {
    let (low, high) = (W::load(low, 0), W::load(high, 0));
    if is_bend { W::unzip_pairs(low, high) } else { W::unzip(low, high) }
}

#[inline(always)]
fn zip<W: Wide>([a, b]: [W; 2], is_bend: bool) -> [W; 2] {
    if is_bend { W::zip_pairs(a, b) } else { W::zip(a, b) }
}

#[inline(always)]
fn difference<W: Wide>([a, b]: [W; 2]) -> W {
    b - a
}

#[inline(always)]
fn pairs(eights: &[Eight], count: usize) -> &[[Eight; 2]] {
    let (pairs, _) = eights.as_chunks();
    &pairs[..count]
}

#[inline(always)]
fn pairs_mut(eights: &mut [Eight], count: usize) -> &mut [[Eight; 2]] {
    let (pairs, _) = eights.as_chunks_mut();
    &mut pairs[..count]
}

/// The particles of a row, with what only some scenes have.
pub(super) struct Columns<'a> {
    x: [&'a mut [Eight]; 3],
    w: &'a [Eight],
    d: [&'a mut [Eight]; 3],
    predicted: Option<[&'a mut [Eight]; 3]>,
    wind: Option<[&'a [Eight]; 3]>,
    /// Of the root.
    root: Option<[&'a [Eight]; 3]>,
    /// Longest distance to the root, and its square.
    tether: Option<[&'a [Eight]; 2]>,
    /// Particles; what follows them in the last eight is padding.
    count: usize,
}

impl<'a> Columns<'a> {
    /// All columns of a row.
    #[inline(always)]
    pub(super) fn new(row: &'a mut [f32], shape: &Shape) -> Self {
        let count = shape.columns.div_ceil(8);
        let mut rest = row;
        let mut next = || {
            let (field, others) = std::mem::take(&mut rest).split_at_mut(shape.stride);
            rest = others;
            eights_mut(field, 0, count)
        };
        let Extras { colliders, wind, tethers } = shape.extras;
        let x = [next(), next(), next()];
        let (w, d) = (&*next(), [next(), next(), next()]);
        let predicted = colliders.then(|| [next(), next(), next()]);
        let wind = wind.then(|| [&*next(), &*next(), &*next()]);
        let root = tethers.then(|| [&*next(), &*next(), &*next()]);
        let tether = tethers.then(|| [&*next(), &*next()]);
        Self { x, w, d, predicted, wind, root, tether, count: shape.columns }
    }

    /// Lets every free particle fall.
    #[inline(always)]
    pub(super) fn predict<W: Wide>(&mut self, motion: &Motion<'_>) {
        for eight in 0..self.w.len() {
            let load = |field: &[Eight]| W::load(&field[eight], 0);
            let before = axes(|axis| load(self.d[axis]));
            let wind = match &self.wind {
                Some(wind) => axes(|axis| load(wind[axis])),
                None => [W::splat(0.0); 3],
            };
            let after = motion.fall.predict(before, wind, load(self.w));
            for (axis, after) in after.into_iter().enumerate() {
                after.store(&mut self.d[axis][eight], 0);
                if let Some(predicted) = &mut self.predicted {
                    after.store(&mut predicted[axis][eight], 0);
                }
            }
        }
    }

    /// Pulls every free particle back to within its tether.
    #[inline(always)]
    pub(super) fn pull_back<W: Wide>(&mut self) {
        let (Some(root), Some([length, square])) = (&self.root, &self.tether) else { return };
        for eight in 0..self.w.len() {
            let load = |field: &[Eight]| W::load(&field[eight], 0);
            let start = axes(|axis| load(self.x[axis]) - load(root[axis]));
            let before = axes(|axis| load(self.d[axis]));
            let rest = Rest { length: load(length), square: load(square) };
            let take = pull_back(start, before, rest, load(self.w));
            for axis in 0..3 {
                (before[axis] - take[axis]).store(&mut self.d[axis][eight], 0);
            }
        }
    }
}

fn vector(axes: &[&mut [Eight]; 3], index: usize) -> Vec3 {
    let (eight, lane) = (index / 8, index % 8);
    Vec3::new(axes[0][eight][lane], axes[1][eight][lane], axes[2][eight][lane])
}

fn set(axes: &mut [&mut [Eight]; 3], index: usize, vector: Vec3) {
    for (axis, number) in axes.iter_mut().zip(vector.to_array()) {
        axis[index / 8][index % 8] = number;
    }
}

impl Cells for Columns<'_> {
    fn count(&self) -> usize {
        self.count
    }

    fn inverse_mass(&self, index: usize) -> f32 {
        self.w[index / 8][index % 8]
    }

    fn way(&self, index: usize) -> Way {
        Way { start: vector(&self.x, index), displacement: vector(&self.d, index) }
    }

    fn predicted(&self, index: usize) -> Vec3 {
        self.predicted.as_ref().map_or(Vec3::ZERO, |predicted| vector(predicted, index))
    }

    fn set_displacement(&mut self, index: usize, displacement: Vec3) {
        set(&mut self.d, index, displacement);
    }

    fn set_position(&mut self, index: usize, position: Vec3) {
        set(&mut self.x, index, position);
    }

    #[inline(always)]
    fn may_touch<W: Wide>(&self, eight: usize, zone: &Zone) -> bool {
        let load = |field: &[Eight]| W::load(&field[eight], 0);
        let (x, d) = (axes(|axis| load(self.x[axis])), axes(|axis| load(self.d[axis])));
        let is_free = W::splat(0.0).is_below(load(self.w));
        W::any(W::both(zone.may_be_met(x, d), is_free))
    }

    #[inline(always)]
    fn advance<W: Wide>(&mut self) {
        for axis in 0..3 {
            for (x, d) in self.x[axis].iter_mut().zip(self.d[axis].iter()) {
                (W::load(x, 0) + W::load(d, 0)).store(x, 0);
            }
        }
    }
}
