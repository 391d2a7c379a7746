//! A tree of boxes over the paths of particles, to find those that come near each other.
//!
//! Sixteen particles that are neighbours at load form a tile. Four tiles form a node, and so on. The
//! tree keeps its form from load to load: only the boxes follow the particles.

use crate::contacts::bounds::Bounds;
use crate::kernels::Kernels;
use crate::kernels::lanes::{LaneWork, Lanes8, Wide, axes};

/// Number of particles in a tile: two groups of eight lanes.
pub(super) const TILE: usize = TILE_LENGTH as usize;
/// The same number for slots.
pub(super) const TILE_LENGTH: u32 = 16;
/// Number of children of a node.
const ARITY: usize = 4;
/// Number of pairs of tiles that are examined together.
const TILE_PAIRS_MAX: usize = 4096;

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
    const EMPTY: Self = Self { x: [[[f32::NAN; 8]; 2]; 3], d: [[[f32::NAN; 8]; 2]; 3] };

    pub(super) fn set(&mut self, lane: usize, position: [f32; 3], displacement: [f32; 3]) {
        let (group, lane) = (lane / 8, lane % 8);
        for axis in 0..3 {
            self.x[axis][group][lane] = position[axis];
            self.d[axis][group][lane] = displacement[axis];
        }
    }

    /// Ends of the paths of one group of lanes, on one axis.
    #[inline(always)]
    fn path<W: Wide>(&self, axis: usize, group: usize, span: W) -> [W; 2] {
        let x = W::load(&self.x[axis][group], 0);
        [x, x + span * W::load(&self.d[axis][group], 0)]
    }
}

/// The tiles and the boxes above them.
#[derive(Debug, Clone, Default)]
pub(super) struct TileTree {
    pub(super) tiles: Vec<Tile>,
    /// Boxes of the tiles, of the nodes above them, and so on up to the root.
    levels: Vec<Vec<Bounds>>,
    /// Pairs of tiles that are near each other, to be examined.
    tile_pairs: Vec<[u32; 2]>,
}

/// Leaves nothing out of a search.
const NONE: fn(u32, u32) -> u32 = |_, _| 0;

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
        Self { tiles, levels, tile_pairs: Vec::with_capacity(TILE_PAIRS_MAX) }
    }

    /// Recomputes all boxes for paths of `span` displacements.
    pub(super) fn refit(&mut self, span: f32, kernels: Kernels) {
        let Self { tiles, levels, .. } = self;
        let Some((leaves, nodes)) = levels.split_first_mut() else { return };
        kernels.run(RefitWork { tiles, leaves, span });
        let mut below = &*leaves;
        for level in nodes {
            for (bounds, children) in level.iter_mut().zip(below.chunks(ARITY)) {
                *bounds = children.iter().fold(Bounds::EMPTY, Bounds::union);
            }
            below = level;
        }
    }

    /// Passes every pair of particles whose straight paths come nearer than the query's distance to
    /// `accept`, as slots in ascending order. The order of two pairs depends only on the tree, not on the
    /// other pairs.
    pub(super) fn search(
        &mut self,
        query: Query,
        kernels: Kernels,
        accept: &mut impl FnMut([u32; 2]) -> Search,
    ) -> Search {
        self.search_except(query, kernels, &NONE, accept)
    }

    /// Like [`Self::search`], without the pairs that `except` returns: it has a bit for each particle of a
    /// tile that a slot of this or an earlier tile leaves out.
    pub(super) fn search_except(
        &mut self,
        query: Query,
        kernels: Kernels,
        except: &impl Fn(u32, u32) -> u32,
        accept: &mut impl FnMut([u32; 2]) -> Search,
    ) -> Search {
        let Some(root) = self.levels.len().checked_sub(1) else { return Search::Continue(()) };
        let mut pairs = std::mem::take(&mut self.tile_pairs);
        let tree = &*self;
        let mut examine = |pairs: &mut Vec<[u32; 2]>| {
            let search =
                kernels.run(SearchWork { tree, pairs, query, except, accept: &mut *accept });
            pairs.clear();
            search
        };
        let mut found = tree.search_nodes(root, [0, 0], query.distance, &mut |pair| {
            pairs.push(pair);
            if pairs.len() < TILE_PAIRS_MAX { Search::Continue(()) } else { examine(&mut pairs) }
        });
        if found.is_continue() {
            found = examine(&mut pairs);
        }
        pairs.clear();
        self.tile_pairs = pairs;
        found
    }

    /// Passes pairs of tiles that are near each other to `accept`.
    fn search_nodes(
        &self,
        level: usize,
        [a, b]: [usize; 2],
        distance: f32,
        accept: &mut impl FnMut([u32; 2]) -> Search,
    ) -> Search {
        let bounds = &self.levels[level];
        if !bounds[a].are_near(&bounds[b], distance) {
            return Search::Continue(());
        }
        if level == 0 {
            #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 particles")]
            return accept([a as u32, b as u32]);
        }
        let count = self.levels[level - 1].len();
        let children = |node: usize| ARITY * node..count.min(ARITY * (node + 1));
        for left in children(a) {
            let first = if a == b { left } else { ARITY * b };
            for right in first..children(b).end {
                self.search_nodes(level - 1, [left, right], distance, accept)?;
            }
        }
        Search::Continue(())
    }
}

/// Computes the boxes of the tiles.
struct RefitWork<'a> {
    tiles: &'a [Tile],
    leaves: &'a mut [Bounds],
    span: f32,
}

impl LaneWork for RefitWork<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        for (tile, bounds) in self.tiles.iter().zip(self.leaves) {
            for axis in 0..3 {
                [bounds.min[axis], bounds.max[axis]] = extent::<W>(tile, axis, self.span);
            }
        }
    }
}

/// The smallest and the largest coordinate of the paths of a tile on an axis.
#[inline(always)]
fn extent<W: Wide>(tile: &Tile, axis: usize, span: f32) -> [f32; 2] {
    let least = W::splat(f32::NEG_INFINITY);
    let (mut low, mut high) = (least, least);
    for group in 0..TILE / 8 {
        // NaN leaves them as they are.
        for end in tile.path(axis, group, W::splat(span)) {
            low = (-end).max_or_rhs(low);
            high = end.max_or_rhs(high);
        }
    }
    [-greatest(low), greatest(high)]
}

#[inline(always)]
fn greatest<W: Wide>(numbers: W) -> f32 {
    let mut lanes = [0.0; 8];
    numbers.store(&mut lanes, 0);
    lanes.into_iter().fold(f32::NEG_INFINITY, |most, lane| if lane > most { lane } else { most })
}

/// Condition of [`TileTree::search`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Query {
    /// Number of displacements that a path has.
    pub(super) span: f32,
    pub(super) distance: f32,
}

/// Examines pairs of tiles.
struct SearchWork<'a, E, F> {
    tree: &'a TileTree,
    pairs: &'a [[u32; 2]],
    query: Query,
    except: &'a E,
    accept: &'a mut F,
}

impl<E: Fn(u32, u32) -> u32, F: FnMut([u32; 2]) -> Search> LaneWork for SearchWork<'_, E, F> {
    type Output = Search;

    #[inline(always)]
    fn run<W: Wide>(self) -> Search {
        let Self { tree, pairs, query, except, accept } = self;
        for &[a, b] in pairs {
            let [left, right] = [a, b].map(|tile| &tree.tiles[tile as usize]);
            let bounds = &tree.levels[0][b as usize];
            let mut lanes = query.lanes_near::<W>(left, bounds);
            while let Some(lane) = take_lowest(&mut lanes) {
                let mut near = query.lanes_near_lane::<W>(right, (left, lane as usize));
                if a == b {
                    // Each pair once: the particles behind this one.
                    near &= (!0_u32 << lane) << 1;
                }
                if near != 0 {
                    near &= !except(TILE_LENGTH * a + lane, b);
                }
                while let Some(other) = take_lowest(&mut near) {
                    accept([TILE_LENGTH * a + lane, TILE_LENGTH * b + other])?;
                }
            }
        }
        Search::Continue(())
    }
}

/// Removes the lowest bit that is set, and returns its place.
#[inline(always)]
fn take_lowest(bits: &mut u32) -> Option<u32> {
    let lowest = (*bits != 0).then_some(bits.trailing_zeros());
    *bits &= bits.wrapping_sub(1);
    lowest
}

impl Query {
    /// Returns a bit for each particle of a tile whose path comes near a box.
    #[inline(always)]
    fn lanes_near<W: Wide>(self, tile: &Tile, bounds: &Bounds) -> u32 {
        let span = W::splat(self.span);
        let mut bits = 0;
        for group in 0..TILE / 8 {
            let [x, y, z] = [0, 1, 2];
            let x = self.is_near_on_axis::<W>(tile.path(x, group, span), x, bounds);
            let y = self.is_near_on_axis::<W>(tile.path(y, group, span), y, bounds);
            let z = self.is_near_on_axis::<W>(tile.path(z, group, span), z, bounds);
            bits |= W::bits(W::both(x, W::both(y, z))) << (8 * group);
        }
        bits
    }

    #[inline(always)]
    fn is_near_on_axis<W: Wide>(self, path: [W; 2], axis: usize, bounds: &Bounds) -> W::Mask {
        let [start, end] = path;
        let low = -(-start).max_or_rhs(-end);
        let high = start.max_or_rhs(end);
        W::both(
            low.is_at_most(W::splat(bounds.max[axis] + self.distance)),
            W::splat(bounds.min[axis] - self.distance).is_at_most(high),
        )
    }

    /// Returns a bit for each particle of a tile that comes near one particle of another tile.
    #[inline(always)]
    fn lanes_near_lane<W: Wide>(self, tile: &Tile, (other, lane): (&Tile, usize)) -> u32 {
        let (other_group, other_lane) = (lane / 8, lane % 8);
        let x = axes(|axis| W::splat(other.x[axis][other_group][other_lane]));
        let d = axes(|axis| W::splat(other.d[axis][other_group][other_lane]));
        let (zero, span) = (W::splat(0.0), W::splat(self.span));
        let limit = W::splat(self.distance * self.distance);
        let mut bits = 0;
        for group in 0..TILE / 8 {
            let r = axes(|axis| W::load(&tile.x[axis][group], 0) - x[axis]);
            let v = axes(|axis| W::load(&tile.d[axis][group], 0) - d[axis]);
            // The time at which straight paths are nearest; NaN where the particles move alike.
            let time = (-dot(r, v) / dot(v, v)).max_or_rhs(zero);
            let time = W::select(time.is_below(span), time, span);
            let apart = axes(|axis| r[axis] + time * v[axis]);
            bits |= W::bits(dot(apart, apart).is_below(limit)) << (8 * group);
        }
        bits
    }
}

#[inline(always)]
fn dot<W: Wide>(a: [W; 3], b: [W; 3]) -> W {
    let [x, y, z] = axes(|axis| a[axis] * b[axis]);
    x + y + z
}
