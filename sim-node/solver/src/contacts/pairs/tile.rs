//! Tiles of sixteen particles with their straight paths.

use super::lane_bounds::LaneBounds;
use crate::contacts::bounds::Bounds;
use crate::kernels::lanes::{Lanes8, PackedParticle, Wide, axes};

/// Number of particles in a tile: two groups of eight lanes.
pub(super) const TILE: usize = TILE_LENGTH as usize;
/// The same number for slots.
pub(super) const TILE_LENGTH: u32 = 16;
// The bits of a tile are a `u16`.
const _: () = assert!(TILE_LENGTH == u16::BITS);
/// A number for each entry of a tile.
pub(super) type TileColumn = [Lanes8; TILE / 8];

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

    /// Replaces all paths by those that begin now.
    #[inline(always)]
    pub(super) fn begin<W: Wide>(&mut self, states: &[PackedParticle; TILE]) {
        let (groups, _) = states.as_chunks();
        for (group, states) in groups.iter().enumerate() {
            let [[x, y, z, _], [dx, dy, dz, _]] = W::columns(states);
            let (x, d) = ([x, y, z], [dx, dy, dz]);
            for axis in 0..3 {
                x[axis].store(&mut self.x[axis][group], 0);
                d[axis].store(&mut self.d[axis][group], 0);
            }
        }
    }

    /// Replaces states by those on the paths after `time` displacements. Masses stay.
    #[inline(always)]
    pub(super) fn place<W: Wide>(&self, time: f32, states: &mut [PackedParticle; TILE]) {
        let positions = self.positions::<W>(time);
        let (groups, _) = states.as_chunks_mut();
        for (group, (states, positions)) in groups.iter_mut().zip(positions).enumerate() {
            W::set_positions(states, positions);
            W::set_displacements(states, axes(|axis| W::load(&self.d[axis][group], 0)));
        }
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

/// Returns a bit for each particle of a tile that is in a box. `positions` has them by group and axis.
#[inline(always)]
pub(super) fn lanes_in_box<W: Wide>(positions: &[[W; 3]; TILE / 8], bounds: &Bounds) -> u32 {
    let mut bits = 0;
    for (group, [x, y, z]) in positions.iter().enumerate() {
        let x = is_within(*x, bounds.min[0], bounds.max[0]);
        let y = is_within(*y, bounds.min[1], bounds.max[1]);
        let z = is_within(*z, bounds.min[2], bounds.max[2]);
        bits |= W::bits(W::both(x, W::both(y, z))) << (8 * group);
    }
    bits
}

#[inline(always)]
fn is_within<W: Wide>(at: W, min: f32, max: f32) -> W::Mask {
    W::both(at.is_at_most(W::splat(max)), W::splat(min).is_at_most(at))
}

/// The coordinates of the particles of a tile, by axis, from those by group and axis.
#[inline(always)]
pub(super) fn coordinates<W: Wide>(positions: &[[W; 3]; TILE / 8]) -> [[f32; TILE]; 3] {
    let mut coordinates = [[0.0; TILE]; 3];
    for (group, position) in positions.iter().enumerate() {
        for axis in 0..3 {
            let (lanes, _) = coordinates[axis].as_chunks_mut();
            position[axis].store(&mut lanes[group], 0);
        }
    }
    coordinates
}

/// The box around points. NaN is left out.
#[inline(always)]
fn bounds_of<W: Wide>([x, y, z]: &[TileColumn; 3]) -> Bounds {
    let mut bounds = LaneBounds::<W>::empty();
    for group in 0..TILE / 8 {
        bounds.include([W::load(&x[group], 0), W::load(&y[group], 0), W::load(&z[group], 0)]);
    }
    bounds.around_all()
}

/// Sets the bits of `count` members of tiles.
pub(super) fn mark_all(lanes: &mut [u16], count: usize) {
    for (tile, lanes) in lanes.iter_mut().enumerate() {
        *lanes = !0 >> (TILE - (count - TILE * tile).min(TILE));
    }
}

/// The members of tiles whose bits are set, ascending.
pub(super) fn members(lanes: &[u16]) -> impl Iterator<Item = u32> + '_ {
    (0_u32..).zip(lanes).flat_map(|(tile, lanes)| {
        let mut lanes = u32::from(*lanes);
        std::iter::from_fn(move || Some(TILE_LENGTH * tile + take_lowest(&mut lanes)?))
    })
}

/// Removes the lowest bit that is set, and returns its place.
#[inline(always)]
pub(super) fn take_lowest(bits: &mut u32) -> Option<u32> {
    let lowest = (*bits != 0).then_some(bits.trailing_zeros());
    *bits &= bits.wrapping_sub(1);
    lowest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_are_those_whose_bits_are_set() {
        let mut lanes = [0; 3];
        mark_all(&mut lanes, 35);
        assert_eq!(lanes, [0xffff, 0xffff, 0b111]);
        assert!(members(&lanes).eq(0..35));
        lanes = [0b100, 0, 1 << 15];
        assert!(members(&lanes).eq([2, 47]));
    }
}
