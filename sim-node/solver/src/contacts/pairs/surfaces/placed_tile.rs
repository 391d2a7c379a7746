//! The triangles of tiles where they are now, to tell which have a point nearest to a particle.

use super::super::tile::{TILE, TileColumn};
use super::nearest::{SIDE_TOLERANCE, clamped, inwards, next};
use super::surface::Surface;
use super::triangle_tile::gather;
use crate::kernels::lanes::{PackedParticle, Wide, axes};
use crate::kernels::vectors::{difference, dot, scaled, sum};

/// A vector for each triangle of a tile, by axis.
type TileVectors = [TileColumn; 3];

/// The edges of the triangles of a tile, and the half planes beside them.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PlacedTile {
    /// By edge, from each corner to the next.
    edges: [Edges; 3],
    /// Mean displacements of the corners.
    displacements: TileVectors,
    /// Largest differences of the displacement of a corner from the mean.
    spreads: TileColumn,
}

/// A particle on its path.
#[derive(Clone, Copy)]
pub(super) struct Moving {
    pub(super) position: [f32; 3],
    pub(super) displacement: [f32; 3],
}

/// One edge of each triangle.
#[derive(Debug, Clone, Copy, Default)]
struct Edges {
    /// The corner at which it starts.
    from: TileVectors,
    /// Vector to the corner at which it ends.
    along: TileVectors,
    /// 1 over its squared length.
    inverse_square: TileColumn,
    /// Vector across the edge, in the plane of the triangle, to its inside.
    inwards: TileVectors,
    /// The same of the other triangle at the edge. 0 at a border.
    neighbor_inwards: TileVectors,
    /// Product with `neighbor_inwards` from which a particle is on the side of the other triangle.
    tolerance: TileColumn,
}

impl PlacedTile {
    #[inline(always)]
    pub(super) fn place<W: Wide>(
        &mut self,
        surface: &Surface,
        first: u32,
        states: &[PackedParticle],
    ) {
        let first = first as usize;
        let end = surface.corners.len().min(first + TILE);
        for (group, from) in (first..end).step_by(8).enumerate() {
            let triangles = from..end.min(from + 8);
            let slots = &surface.corners[triangles.clone()];
            let opposites = &surface.opposites[triangles];
            // In a closure, the loads would be compiled for the baseline processor.
            let [[a, a_moved], [b, b_moved], [c, c_moved]] = [
                paths::<W>(states, slots.iter().map(|slots| slots[0])),
                paths::<W>(states, slots.iter().map(|slots| slots[1])),
                paths::<W>(states, slots.iter().map(|slots| slots[2])),
            ];
            self.set_displacements(group, [a_moved, b_moved, c_moved]);
            let corners = [a, b, c];
            for (edge, edges) in self.edges.iter_mut().enumerate() {
                let [opposite, _] = paths(states, opposites.iter().map(|slots| slots[edge]));
                let ends = [corners[edge], corners[next(edge)]];
                edges.set(group, ends, corners[next(next(edge))], opposite);
            }
        }
    }

    #[inline(always)]
    fn set_displacements<W: Wide>(&mut self, group: usize, [a, b, c]: [[W; 3]; 3]) {
        let mean = scaled(sum(sum(a, b), c), W::splat(1.0 / 3.0));
        let [a, b, c] = [difference(a, mean), difference(b, mean), difference(c, mean)];
        let square = dot(a, a).max_or_rhs(dot(b, b)).max_or_rhs(dot(c, c));
        square.sqrt().store(&mut self.spreads[group], 0);
        set(&mut self.displacements, group, mean);
    }

    /// Returns those of the triangles in `lanes` whose nearest point to a particle may be a local minimum of the
    /// distance.
    ///
    /// The nearest point is on the face if the particle is inside of all edges. Beyond an edge, the other triangle
    /// there is nearer if the particle is on its side.
    #[inline(always)]
    pub(super) fn lanes_nearest<W: Wide>(&self, lanes: u32, point: [f32; 3]) -> u32 {
        let mut bits = 0;
        for group in 0..TILE / 8 {
            if (lanes >> (8 * group)) & 0xff != 0 {
                let [first, second, third] = &self.edges;
                let first = first.sides::<W>(group, point);
                let second = second.sides::<W>(group, point);
                let third = third.sides::<W>(group, point);
                let beyond = first.beyond | second.beyond | third.beyond;
                let bent = first.bent | second.bent | third.bent;
                bits |= (!beyond & 0xff | bent) << (8 * group);
            }
        }
        bits & lanes
    }

    /// Returns those of the triangles in `lanes` with an edge that a particle may come nearer to than a distance within
    /// a number of displacements.
    #[inline(always)]
    pub(super) fn lanes_with_edges_near<W: Wide>(
        &self,
        lanes: u32,
        Moving { position, displacement }: Moving,
        (distance, span): (f32, f32),
    ) -> u32 {
        let mut bits = 0;
        for group in 0..TILE / 8 {
            if (lanes >> (8 * group)) & 0xff != 0 {
                let [a, b, c] = &self.edges;
                let relative = axes(|axis| {
                    W::splat(displacement[axis]) - W::load(&self.displacements[axis][group], 0)
                });
                let speed = dot(relative, relative).sqrt() + W::load(&self.spreads[group], 0);
                let reach = W::splat(distance) + W::splat(span) * speed;
                let a = a.lanes_near(group, position, reach);
                let b = b.lanes_near(group, position, reach);
                let c = c.lanes_near(group, position, reach);
                bits |= (a | b | c) << (8 * group);
            }
        }
        bits & lanes
    }
}

/// The triangles of a group of lanes that a particle is beside.
struct Sides {
    /// Bits of those beyond whose edge it is.
    beyond: u32,
    /// Bits of those where, in addition, it is not on the side of the other triangle.
    bent: u32,
}

impl Edges {
    /// Replaces a group of edges. `corner` is that of the triangle behind the ends, and `opposite` that of the other
    /// triangle.
    #[inline(always)]
    fn set<W: Wide>(&mut self, group: usize, ends: [[W; 3]; 2], corner: [W; 3], opposite: [W; 3]) {
        let edge = difference(ends[1], ends[0]);
        let square = dot(edge, edge);
        set(&mut self.from, group, ends[0]);
        set(&mut self.along, group, edge);
        (W::splat(1.0) / square).store(&mut self.inverse_square[group], 0);
        set(&mut self.inwards, group, inwards(ends, corner));
        set(&mut self.neighbor_inwards, group, inwards(ends, opposite));
        let tolerance = W::splat(SIDE_TOLERANCE) * square * square;
        tolerance.store(&mut self.tolerance[group], 0);
    }

    /// Returns a bit for each edge that is nearer to a particle than `reach`.
    #[inline(always)]
    fn lanes_near<W: Wide>(&self, group: usize, point: [f32; 3], reach: W) -> u32 {
        let along = axes(|axis| W::load(&self.along[axis][group], 0));
        let arm = axes(|axis| W::splat(point[axis]) - W::load(&self.from[axis][group], 0));
        let share = dot(arm, along) * W::load(&self.inverse_square[group], 0);
        let apart = difference(arm, scaled(along, clamped(share)));
        W::bits(dot(apart, apart).is_below(reach * reach))
    }

    #[inline(always)]
    fn sides<W: Wide>(&self, group: usize, point: [f32; 3]) -> Sides {
        let (mut inside, mut neighbor_side) = (W::splat(0.0), W::splat(0.0));
        for (axis, at) in point.into_iter().enumerate() {
            let arm = W::splat(at) - W::load(&self.from[axis][group], 0);
            inside = inside + arm * W::load(&self.inwards[axis][group], 0);
            neighbor_side = neighbor_side + arm * W::load(&self.neighbor_inwards[axis][group], 0);
        }
        let beyond = W::bits(inside.is_below(W::splat(0.0)));
        let tolerance = W::load(&self.tolerance[group], 0);
        Sides { beyond, bent: beyond & W::bits(neighbor_side.is_at_most(tolerance)) }
    }
}

#[inline(always)]
fn set<W: Wide>(vectors: &mut TileVectors, group: usize, vector: [W; 3]) {
    for axis in 0..3 {
        vector[axis].store(&mut vectors[axis][group], 0);
    }
}

/// The positions and displacements of eight particles.
#[inline(always)]
fn paths<W: Wide>(states: &[PackedParticle], slots: impl Iterator<Item = u32>) -> [[W; 3]; 2] {
    let [[x, y, z, _], [dx, dy, dz, _]] = W::columns(&gather(states, slots));
    [[x, y, z], [dx, dy, dz]]
}
