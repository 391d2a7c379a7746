//! A tree of boxes over the paths of particles, to find those that come near each other.
//!
//! Sixteen particles that are neighbours at load form a tile. Four tiles form a node, and so on. The
//! tree keeps its form from load to load: only the boxes follow the particles.

use crate::kernels::lanes::{LaneWork, Wide, axes};

/// Number of particles in a tile.
pub(super) const TILE: usize = 16;
/// Number of children of a node.
const ARITY: usize = 4;

/// The particles of a tile: positions, and displacements in a substep. The padding is NaN, which is near
/// nothing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tile {
    pub(super) x: [[f32; TILE]; 3],
    pub(super) d: [[f32; TILE]; 3],
}

impl Tile {
    pub(super) const EMPTY: Self = Self { x: [[f32::NAN; TILE]; 3], d: [[f32::NAN; TILE]; 3] };
}

/// Smallest and largest coordinate on each axis. An empty box has +infinity and -infinity.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    min: [f32; 3],
    max: [f32; 3],
}

impl Bounds {
    const EMPTY: Self = Self { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

    /// NaN changes nothing.
    #[inline(always)]
    fn add(&mut self, axis: usize, value: f32) {
        if value < self.min[axis] {
            self.min[axis] = value;
        }
        if value > self.max[axis] {
            self.max[axis] = value;
        }
    }

    fn union(self, other: &Self) -> Self {
        let mut union = self;
        for axis in 0..3 {
            union.add(axis, other.min[axis]);
            union.add(axis, other.max[axis]);
        }
        union
    }

    /// Returns true if the boxes are at most `distance` apart on every axis.
    #[inline(always)]
    fn are_near(&self, other: &Self, distance: f32) -> bool {
        (0..3).all(|axis| {
            self.min[axis] - distance <= other.max[axis]
                && other.min[axis] - distance <= self.max[axis]
        })
    }
}

/// The tiles and the boxes above them.
#[derive(Debug, Clone, Default)]
pub(super) struct TileTree {
    pub(super) tiles: Vec<Tile>,
    /// Boxes of the tiles, of the nodes above them, and so on up to the root.
    levels: Vec<Vec<Bounds>>,
}

/// A pair of particles that come near each other: a tile and a lane for each. The first is the lower one.
#[derive(Debug, Clone, Copy)]
pub(super) struct NearPair {
    pub(super) slots: [u32; 2],
}

/// Order to go on, or to give the search up.
pub(super) type Search = std::ops::ControlFlow<()>;

impl TileTree {
    /// Makes a tree of empty tiles for `count` particles.
    pub(super) fn new(count: usize) -> Self {
        let tiles = vec![Tile::EMPTY; count.div_ceil(TILE)];
        let mut levels = Vec::new();
        let mut length = tiles.len();
        while length > 0 {
            levels.push(vec![Bounds::EMPTY; length]);
            length = if length > 1 { length.div_ceil(ARITY) } else { 0 };
        }
        Self { tiles, levels }
    }

    /// Recomputes all boxes for paths of `span` times the displacement.
    pub(super) fn refit(&mut self, span: f32) {
        let Self { tiles, levels } = self;
        let Some((leaves, nodes)) = levels.split_first_mut() else { return };
        for (tile, bounds) in tiles.iter().zip(leaves.iter_mut()) {
            *bounds = Bounds::EMPTY;
            for axis in 0..3 {
                for (x, d) in tile.x[axis].iter().zip(&tile.d[axis]) {
                    bounds.add(axis, *x);
                    bounds.add(axis, x + span * d);
                }
            }
        }
        let mut below = &*leaves;
        for level in nodes {
            for (bounds, children) in level.iter_mut().zip(below.chunks(ARITY)) {
                *bounds = children.iter().fold(Bounds::EMPTY, |union, child| union.union(child));
            }
            below = level;
        }
    }

    /// Passes every pair of particles whose straight paths of `span` displacements come nearer than
    /// `distance` to `accept`. The order of two pairs depends only on the tree, not on the other pairs.
    #[inline(always)]
    pub(super) fn search<W: Wide>(
        &self,
        query: Query,
        accept: &mut impl FnMut(NearPair) -> Search,
    ) -> Search {
        match self.levels.len().checked_sub(1) {
            Some(root) => self.search_nodes::<W>(root, [0, 0], query, accept),
            None => Search::Continue(()),
        }
    }

    fn search_nodes<W: Wide>(
        &self,
        level: usize,
        [a, b]: [usize; 2],
        query: Query,
        accept: &mut impl FnMut(NearPair) -> Search,
    ) -> Search {
        let bounds = &self.levels[level];
        if !bounds[a].are_near(&bounds[b], query.distance) {
            return Search::Continue(());
        }
        if level == 0 {
            return self.search_tiles::<W>([a, b], query, accept);
        }
        let count = self.levels[level - 1].len();
        let children = |node: usize| ARITY * node..count.min(ARITY * (node + 1));
        for left in children(a) {
            let first = if a == b { left } else { ARITY * b };
            for right in first..children(b).end {
                self.search_nodes::<W>(level - 1, [left, right], query, accept)?;
            }
        }
        Search::Continue(())
    }

    #[inline(always)]
    fn search_tiles<W: Wide>(
        &self,
        [a, b]: [usize; 2],
        query: Query,
        accept: &mut impl FnMut(NearPair) -> Search,
    ) -> Search {
        let (left, right) = (&self.tiles[a], &self.tiles[b]);
        for lane in 0..TILE {
            let x = axes(|axis| left.x[axis][lane]);
            let d = axes(|axis| left.d[axis][lane]);
            let mut near = query.near_lanes(right, x, d);
            if a == b {
                // Each pair once: the particles behind this one.
                near &= (!0_u32 << lane) << 1;
            }
            while near != 0 {
                let other = near.trailing_zeros();
                near &= near - 1;
                #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 particles")]
                let slots = [(TILE * a + lane) as u32, (TILE * b) as u32 + other];
                accept(NearPair { slots })?;
            }
        }
        Search::Continue(())
    }
}

/// What [`TileTree::search`] looks for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Query {
    /// Number of displacements that a path has.
    pub(super) span: f32,
    pub(super) distance: f32,
}

impl Query {
    /// Returns a bit for each particle of a tile that comes near one particle.
    #[inline(always)]
    fn near_lanes(&self, tile: &Tile, x: [f32; 3], d: [f32; 3]) -> u32 {
        let limit = self.distance * self.distance;
        let mut squared = [0.0; TILE];
        for (lane, squared) in squared.iter_mut().enumerate() {
            let r = axes(|axis| tile.x[axis][lane] - x[axis]);
            let v = axes(|axis| tile.d[axis][lane] - d[axis]);
            let (rv, vv) = (dot(r, v), dot(v, v));
            // The time at which straight paths are nearest; NaN where the particles move alike.
            let time = -rv / vv;
            let time = if time > 0.0 { time } else { 0.0 };
            let time = if time < self.span { time } else { self.span };
            let apart = axes(|axis| r[axis] + time * v[axis]);
            *squared = dot(apart, apart);
        }
        let bits = squared.iter().enumerate();
        bits.fold(0, |bits, (lane, squared)| bits | (u32::from(*squared < limit) << lane))
    }
}

/// The search of a tree, compiled for each instruction set.
pub(super) struct SearchWork<'a, F> {
    pub(super) tree: &'a TileTree,
    pub(super) query: Query,
    pub(super) accept: F,
}

impl<F: FnMut(NearPair) -> Search> LaneWork for SearchWork<'_, F> {
    type Output = Search;

    #[inline(always)]
    fn run<W: Wide>(mut self) -> Search {
        self.tree.search::<W>(self.query, &mut self.accept)
    }
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
