//! The triangles of a tile where they are now, to tell which have a point nearest to a particle.

use glam::Vec3;

use super::super::tile::TILE;
use super::nearest::{SIDE_TOLERANCE, inwards, next};
use super::surface::Surface;
use crate::kernels::lanes::{Lanes8, PackedParticle, Wide};

/// A number for each triangle of a tile.
type TileColumn = [Lanes8; TILE / 8];
/// A vector for each triangle of a tile, by axis.
type TileVectors = [TileColumn; 3];

/// The edges of the triangles of a tile, and the half planes beside them.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PlacedTile {
    is_placed: bool,
    /// By edge, from each corner to the next.
    edges: [Edges; 3],
}

/// One edge of each triangle.
#[derive(Debug, Clone, Copy, Default)]
struct Edges {
    /// The corner at which it starts.
    from: TileVectors,
    /// Vector across the edge, in the plane of the triangle, to its inside.
    inwards: TileVectors,
    /// The same of the other triangle at the edge; 0 at a border.
    neighbor_inwards: TileVectors,
    /// Product with `neighbor_inwards` from which a particle is on the side of the other triangle.
    tolerance: TileColumn,
}

impl PlacedTile {
    pub(super) fn clear(&mut self) {
        self.is_placed = false;
    }

    /// Computes the edges of the triangles from `first` on, unless they are known.
    #[inline(always)]
    pub(super) fn place_if_clear(
        &mut self,
        surface: &Surface,
        first: u32,
        particles: &[PackedParticle],
    ) {
        if !std::mem::replace(&mut self.is_placed, true) {
            self.place(surface, first, particles);
        }
    }

    #[inline(never)]
    fn place(&mut self, surface: &Surface, first: u32, particles: &[PackedParticle]) {
        let at = |slot: u32| {
            let PackedParticle([x, y, z, ..]) = particles[slot as usize];
            Vec3::new(x, y, z)
        };
        let rest = surface.corners[first as usize..].iter().take(TILE);
        for (lane, (triangle, slots)) in (first..).zip(rest).enumerate() {
            let corners = slots.map(at);
            for edge in 0..3 {
                let ends = [corners[edge], corners[next(edge)]];
                let square = (ends[1] - ends[0]).length_squared();
                let across = |corner: Vec3| inwards(ends, corner);
                let opposite = surface.neighbor(triangle, edge).map(|other| at(other.opposite));
                let edges = &mut self.edges[edge];
                set(&mut edges.from, lane, ends[0]);
                set(&mut edges.inwards, lane, across(corners[next(next(edge))]));
                set(&mut edges.neighbor_inwards, lane, opposite.map_or(Vec3::ZERO, across));
                edges.tolerance[lane / 8][lane % 8] = SIDE_TOLERANCE * square * square;
            }
        }
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
}

/// The triangles of a group of lanes that a particle is beside.
struct Sides {
    /// Bits of those beyond whose edge it is.
    beyond: u32,
    /// Bits of those where, in addition, it is not on the side of the other triangle.
    bent: u32,
}

impl Edges {
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

fn set(vectors: &mut TileVectors, lane: usize, vector: Vec3) {
    for (axis, column) in vectors.iter_mut().enumerate() {
        column[lane / 8][lane % 8] = vector[axis];
    }
}
