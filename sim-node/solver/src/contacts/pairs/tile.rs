//! Tiles of sixteen particles with their straight paths.

use crate::contacts::bounds::Bounds;
use crate::kernels::lanes::{Lanes8, PackedParticle, Wide, axes, map_axes};

/// Number of particles in a tile: two groups of eight lanes.
pub(super) const TILE: usize = TILE_LENGTH as usize;
/// The same number for slots.
pub(super) const TILE_LENGTH: u32 = 16;
/// A number for each particle of a tile.
type TileColumn = [Lanes8; TILE / 8];

/// The particles of a tile: positions, and displacements in a substep. The padding is NaN, which is near
/// nothing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tile {
    x: [TileColumn; 3],
    d: [TileColumn; 3],
}

impl Tile {
    pub(super) const EMPTY: Self = Self { x: [[[f32::NAN; 8]; 2]; 3], d: [[[f32::NAN; 8]; 2]; 3] };

    pub(super) fn set(&mut self, lane: usize, position: [f32; 3], displacement: [f32; 3]) {
        let (group, lane) = (lane / 8, lane % 8);
        for axis in 0..3 {
            self.x[axis][group][lane] = position[axis];
            self.d[axis][group][lane] = displacement[axis];
        }
    }

    /// Positions of one group of lanes after `time` displacements, on one axis.
    #[inline(always)]
    fn position<W: Wide>(&self, axis: usize, group: usize, time: W) -> W {
        W::load(&self.x[axis][group], 0) + time * W::load(&self.d[axis][group], 0)
    }

    /// Positions after `time` displacements, by group and axis.
    #[inline(always)]
    pub(super) fn positions<W: Wide>(&self, time: f32) -> [[W; 3]; TILE / 8] {
        let time = W::splat(time);
        let [x, y, z] = [0, 1, 2];
        [
            [self.position(x, 0, time), self.position(y, 0, time), self.position(z, 0, time)],
            [self.position(x, 1, time), self.position(y, 1, time), self.position(z, 1, time)],
        ]
    }

    /// Replaces the paths by those on which the particles are now, after `time` displacements.
    #[inline(always)]
    pub(super) fn follow<W: Wide>(&mut self, states: &[PackedParticle; TILE], time: f32) {
        let (groups, _) = states.as_chunks();
        for (group, states) in groups.iter().enumerate() {
            let [[x, y, z, _], [dx, dy, dz, _]] = W::columns(states);
            let (x, d) = ([x, y, z], [dx, dy, dz]);
            for axis in 0..3 {
                let start = x[axis] - W::splat(time) * d[axis];
                start.store(&mut self.x[axis][group], 0);
                d[axis].store(&mut self.d[axis][group], 0);
            }
        }
    }

    /// Returns a bit for each particle that is in a box after `time` displacements.
    #[inline(always)]
    pub(super) fn lanes_in_box<W: Wide>(&self, time: f32, bounds: &Bounds) -> u32 {
        let mut bits = 0;
        for (group, at) in self.positions::<W>(time).into_iter().enumerate() {
            let [x, y, z] = at;
            let x = is_within(x, bounds.min[0], bounds.max[0]);
            let y = is_within(y, bounds.min[1], bounds.max[1]);
            let z = is_within(z, bounds.min[2], bounds.max[2]);
            bits |= W::bits(W::both(x, W::both(y, z))) << (8 * group);
        }
        bits
    }

    /// Position and displacement of a particle.
    #[inline(always)]
    pub(super) fn particle(&self, lane: usize) -> [[f32; 3]; 2] {
        let (group, lane) = (lane / 8, lane % 8);
        [axes(|axis| self.x[axis][group][lane]), axes(|axis| self.d[axis][group][lane])]
    }

    /// The box of where the paths begin.
    #[inline(always)]
    pub(super) fn starts<W: Wide>(&self) -> Bounds {
        bounds_of::<W>(&self.x)
    }

    /// The box of the displacements.
    #[inline(always)]
    pub(super) fn displacements<W: Wide>(&self) -> Bounds {
        bounds_of::<W>(&self.d)
    }
}

#[inline(always)]
fn is_within<W: Wide>(at: W, min: f32, max: f32) -> W::Mask {
    W::both(at.is_at_most(W::splat(max)), W::splat(min).is_at_most(at))
}

/// The box around points. NaN is left out.
#[inline(always)]
fn bounds_of<W: Wide>([x, y, z]: &[TileColumn; 3]) -> Bounds {
    let [(x_low, x_high), (y_low, y_high), (z_low, z_high)] =
        [highest::<W>(x), highest::<W>(y), highest::<W>(z)];
    let max = greatest([x_high, y_high, z_high]);
    let min = greatest([x_low, y_low, z_low]);
    Bounds { min: map_axes(min, |axis| -axis), max }
}

/// By lane, the largest of the negated numbers, and the largest of the numbers.
#[inline(always)]
fn highest<W: Wide>([first, second]: &TileColumn) -> (W, W) {
    let least = W::splat(f32::NEG_INFINITY);
    let (first, second) = (W::load(first, 0), W::load(second, 0));
    // NaN leaves the right-hand side.
    let low = (-second).max_or_rhs((-first).max_or_rhs(least));
    let high = second.max_or_rhs(first.max_or_rhs(least));
    (low, high)
}

/// The largest lane of each.
#[inline(always)]
fn greatest<W: Wide>([x, y, z]: [W; 3]) -> [f32; 3] {
    let larger = |[a, b]: [W; 2]| a.max_or_rhs(b);
    // Of pairs, then of fours: x, y, z, z and the same of the second four.
    let of_fours = larger(W::unzip(larger(W::unzip(x, y)), larger(W::unzip(z, z))));
    let mut lanes = [0.0; 8];
    of_fours.store(&mut lanes, 0);
    axes(|axis| if lanes[axis] > lanes[axis + 4] { lanes[axis] } else { lanes[axis + 4] })
}

/// Removes the lowest bit that is set, and returns its place.
#[inline(always)]
pub(super) fn take_lowest(bits: &mut u32) -> Option<u32> {
    let lowest = (*bits != 0).then_some(bits.trailing_zeros());
    *bits &= bits.wrapping_sub(1);
    lowest
}
