//! A tree of boxes over the paths of particles, to find those that come near each other.
//!
//! Sixteen particles that are neighbours at load form a tile. The tree above the tiles keeps its form from load
//! to load: only the boxes follow the particles.

use sim_scene::model::Model;

use super::box_tree::{BoxTree, NodePair, PairSearch, Search, SearchRoots, Within, pair_order};
use super::gathered::{Gathered, NO_SCRATCHES, Room};
use super::pair_batch::PairBatch;
use super::tile::{TILE, TILE_LENGTH, Tile, coordinates, mark_all, members, take_lowest};
use crate::contacts::bounds::Bounds;
use crate::kernels::Kernels;
use crate::kernels::lanes::{LaneWork, PackedParticle, Wide, axes};
use crate::kernels::vectors::dot;
use crate::store::workers::Workers;

/// The tiles and the boxes above them.
#[derive(Debug, Clone, Default)]
pub(super) struct TileTree {
    pub(super) tiles: Vec<Tile>,
    /// Boxes of the paths of the tiles.
    pub(super) boxes: BoxTree,
    /// Boxes of where the paths of the tiles begin.
    starts: Vec<Bounds>,
    /// Boxes of the displacements of the tiles.
    pub(super) displacements: Vec<Bounds>,
    /// By tile: a bit for each particle that has left its path since the last search. All have at first.
    pub(super) strays: Vec<u16>,
    particle_count: usize,
    /// Where the running search begins.
    roots: SearchRoots,
}

impl TileTree {
    /// Makes a tree of empty tiles for `count` particles.
    pub(super) fn new(count: usize) -> Self {
        let tiles = vec![Tile::EMPTY; count.div_ceil(TILE)];
        let (starts, displacements) =
            (vec![Bounds::EMPTY; tiles.len()], vec![Bounds::EMPTY; tiles.len()]);
        let boxes = BoxTree::new(tiles.len());
        let mut strays = vec![0; tiles.len()];
        mark_all(&mut strays, count);
        Self {
            tiles,
            boxes,
            starts,
            displacements,
            strays,
            particle_count: count,
            roots: SearchRoots::default(),
        }
    }

    /// Makes a tree of particles at rest where they are at load.
    pub(super) fn at_load(model: &Model, particles: &[u32], kernels: Kernels) -> Self {
        let mut tree = Self::new(particles.len());
        for (slot, particle) in particles.iter().enumerate() {
            let position = model.particles[*particle as usize].position;
            tree.tiles[slot / TILE].set(slot % TILE, position, [0.0; 3]);
        }
        tree.refit([0.0; 2], kernels);
        tree
    }

    pub(super) fn is_stray(&self, slot: u32) -> bool {
        self.strays[(slot / TILE_LENGTH) as usize] & (1 << (slot % TILE_LENGTH)) != 0
    }

    /// Gives all particles the paths that begin now. They are strays to the next search.
    pub(super) fn begin_paths(&mut self, states: &[PackedParticle], kernels: Kernels) {
        let (states, _) = states.as_chunks();
        kernels.run(BeginWork { tiles: &mut self.tiles, states });
        mark_all(&mut self.strays, self.particle_count);
    }

    /// Replaces the paths of strays by those on which they are now, after `time` displacements.
    pub(super) fn follow_strays(&mut self, states: &[PackedParticle], time: f32) {
        for slot in members(&self.strays).map(|slot| slot as usize) {
            let PackedParticle([x, y, z, _, dx, dy, dz, _]) = states[slot];
            let start = [x - time * dx, y - time * dy, z - time * dz];
            self.tiles[slot / TILE].set(slot % TILE, start, [dx, dy, dz]);
        }
    }

    /// Replaces states by those on the paths after `time` displacements. Masses stay.
    pub(super) fn place(&self, time: f32, kernels: Kernels, states: &mut [PackedParticle]) {
        let (states, _) = states.as_chunks_mut();
        kernels.run(PlaceWork { tiles: &self.tiles, time, states });
    }

    /// Recomputes the boxes of tiles with strays for a part of the paths: from and to these numbers of displacements.
    pub(super) fn refit(&mut self, times: [f32; 2], kernels: Kernels) {
        let Self { tiles, boxes, starts, displacements, strays, .. } = self;
        kernels.run(BoundsWork { tiles, strays, starts, displacements });
        boxes.mark(strays.iter().map(|lanes| *lanes != 0));
        boxes.refit(|leaves| {
            let bounds = leaves.iter_mut().zip(starts.iter().zip(displacements.iter()));
            for ((leaf, (start, displacement)), strays) in bounds.zip(strays) {
                if *strays != 0 {
                    let [from, to] = times.map(|time| start.moved(displacement, time));
                    *leaf = from.union(&to);
                }
            }
        });
    }

    /// A box that holds the particles of a tile after `time` displacements.
    #[inline(always)]
    fn bounds_at(&self, tile: u32, time: f32) -> Bounds {
        self.starts[tile as usize].moved(&self.displacements[tile as usize], time)
    }

    /// Passes every pair of particles whose straight paths come nearer than the query's distance to
    /// `accept`, as slots in ascending order, if one of them is a stray. The order of two pairs depends only on the
    /// tree, not on the other pairs ([`search_order`]). `except` leaves pairs out: for two tiles, it has a bit for each
    /// particle of the second one that a particle of the first one leaves out.
    pub(super) fn search(
        &mut self,
        query: Query,
        kernels: Kernels,
        except: &impl Fn([u32; 2]) -> [u16; TILE],
        accept: &mut impl FnMut([u32; 2]) -> Search,
    ) -> Search {
        self.roots.find(Within(&self.boxes), query.distance, kernels);
        self.search_below(&self.roots.pairs, (query, kernels), except, accept)
    }

    /// Finds the pairs of [`Self::search`] with several workers. `accept` adds what it makes of a pair.
    pub(super) fn gather<T: Copy + Send>(
        &mut self,
        (query, workers): (Query, &mut Workers),
        except: &(impl Fn([u32; 2]) -> [u16; TILE] + Sync),
        (found, accept): (
            &mut Gathered<T>,
            &(impl Fn([u32; 2], &mut Room<'_, T>) -> Search + Sync),
        ),
    ) -> Search {
        let kernels = workers.kernels;
        self.roots.find(Within(&self.boxes), query.distance, kernels);
        let tree = &*self;
        let (roots, scratches) = (tree.roots.pairs.as_slice(), &mut NO_SCRATCHES.clone());
        found.extend(workers, roots, scratches, |roots, room, ()| {
            tree.search_below(roots, (query, kernels), except, &mut |pair| accept(pair, room))
        })
    }

    fn search_below(
        &self,
        roots: &[NodePair],
        (query, kernels): (Query, Kernels),
        except: &impl Fn([u32; 2]) -> [u16; TILE],
        accept: &mut impl FnMut([u32; 2]) -> Search,
    ) -> Search {
        let mut tile_pairs = PairBatch::new(|pairs| {
            kernels.run(SearchWork { tree: self, pairs, query, except, accept: &mut *accept })
        });
        let (nesting, distance) = (Within(&self.boxes), query.distance);
        let accept = &mut |pair| tile_pairs.add(pair);
        kernels.run(PairSearch { nesting, roots, distance, accept })?;
        tile_pairs.finish()
    }
}

/// Gives the particles of tiles the paths that begin now.
struct BeginWork<'a> {
    tiles: &'a mut [Tile],
    states: &'a [[PackedParticle; TILE]],
}

impl LaneWork for BeginWork<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        for (tile, states) in self.tiles.iter_mut().zip(self.states) {
            tile.begin::<W>(states);
        }
    }
}

/// Places the particles of tiles on their paths.
struct PlaceWork<'a> {
    tiles: &'a [Tile],
    time: f32,
    states: &'a mut [[PackedParticle; TILE]],
}

impl LaneWork for PlaceWork<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        for (tile, states) in self.tiles.iter().zip(self.states) {
            tile.place::<W>(self.time, states);
        }
    }
}

/// Computes the boxes of positions and displacements of the tiles with strays.
struct BoundsWork<'a> {
    tiles: &'a [Tile],
    strays: &'a [u16],
    starts: &'a mut [Bounds],
    displacements: &'a mut [Bounds],
}

impl LaneWork for BoundsWork<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Self { tiles, strays, starts, displacements } = self;
        let boxes = starts.iter_mut().zip(displacements);
        for ((tile, strays), (start, displacement)) in tiles.iter().zip(strays).zip(boxes) {
            if *strays != 0 {
                *start = tile.starts::<W>();
                *displacement = tile.displacements::<W>();
            }
        }
    }
}

/// A value that ascends over the pairs of slots of [`TileTree::search`].
#[inline(always)]
pub(super) fn search_order(slots: [u32; 2]) -> (u64, [u32; 2]) {
    (pair_order(slots.map(|slot| slot / TILE_LENGTH)), slots)
}

/// Condition of [`TileTree::search`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Query {
    /// The part of the paths: from and to these numbers of displacements.
    pub(super) times: [f32; 2],
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

impl<E: Fn([u32; 2]) -> [u16; TILE], F: FnMut([u32; 2]) -> Search> LaneWork
    for SearchWork<'_, E, F>
{
    type Output = Search;

    #[inline(always)]
    fn run<W: Wide>(self) -> Search {
        let Self { tree, pairs, query, except, accept } = self;
        for &[a, b] in pairs {
            let pair = TilePair::<W>::new(tree, [a, b], query);
            let [from, to] = query.times;
            let strays = [a, b].map(|tile| u32::from(tree.strays[tile as usize]));
            let mut lanes = pair.lanes_near_box(&tree.bounds_at(b, 0.5 * (from + to)));
            if strays[1] == 0 {
                lanes &= strays[0];
            }
            if lanes == 0 {
                continue;
            }
            let left_out = except([a, b]);
            while let Some(lane) = take_lowest(&mut lanes) {
                let mut near = pair.lanes_near_lane(lane as usize);
                if a == b {
                    // Each pair once: the particles behind this one.
                    near &= (!0_u32 << lane) << 1;
                }
                near &= !u32::from(left_out[lane as usize]);
                if strays[0] & (1 << lane) == 0 {
                    near &= strays[1];
                }
                let slot = TILE_LENGTH * a + lane;
                let mut near = pair.lanes_coming_near(lane as usize, near);
                while let Some(other) = take_lowest(&mut near) {
                    accept([slot, TILE_LENGTH * b + other])?;
                }
            }
        }
        Search::Continue(())
    }
}

/// Two tiles that are near each other.
///
/// Paths that come nearer than a distance D are, in the middle of the time, nearer than D and half of the way that
/// the particles move relative to each other. That is tested first, for eight particles at once, with one bound of
/// this way for all particles of the tiles.
struct TilePair<'a, W> {
    tiles: [&'a Tile; 2],
    query: Query,
    /// Distance in the middle of the time.
    distance: f32,
    /// The particles of the first tile in the middle of the time, on each axis.
    left: [[f32; TILE]; 3],
    /// Those of the second one, by group and axis.
    right: [[W; 3]; TILE / 8],
}

impl<'a, W: Wide> TilePair<'a, W> {
    #[inline(always)]
    fn new(tree: &'a TileTree, slots: [u32; 2], query: Query) -> Self {
        let tiles = slots.map(|tile| &tree.tiles[tile as usize]);
        let [a, b] = slots.map(|tile| &tree.displacements[tile as usize]);
        let [from, to] = query.times;
        let middle_time = 0.5 * (from + to);
        let distance = query.distance + 0.5 * (to - from) * a.distance_max(b);
        let left = coordinates(&tiles[0].positions::<W>(middle_time));
        Self { tiles, query, distance, left, right: tiles[1].positions(middle_time) }
    }

    /// Returns a bit for each particle of the first tile that is near a box in the middle of the time.
    #[inline(always)]
    fn lanes_near_box(&self, bounds: &Bounds) -> u32 {
        let mut bits = 0;
        for group in 0..TILE / 8 {
            let [x, y, z] = [0, 1, 2];
            let x = self.is_near_on_axis(x, group, bounds);
            let y = self.is_near_on_axis(y, group, bounds);
            let z = self.is_near_on_axis(z, group, bounds);
            bits |= W::bits(W::both(x, W::both(y, z))) << (8 * group);
        }
        bits
    }

    #[inline(always)]
    fn is_near_on_axis(&self, axis: usize, group: usize, bounds: &Bounds) -> W::Mask {
        let (lanes, _) = self.left[axis].as_chunks();
        let at = W::load(&lanes[group], 0);
        W::both(
            at.is_at_most(W::splat(bounds.max[axis] + self.distance)),
            W::splat(bounds.min[axis] - self.distance).is_at_most(at),
        )
    }

    /// Returns a bit for each particle of the second tile that is near one of the first in the middle of the time.
    #[inline(always)]
    fn lanes_near_lane(&self, lane: usize) -> u32 {
        let limit = W::splat(self.distance * self.distance);
        let mut bits = 0;
        for group in 0..TILE / 8 {
            let apart = axes(|axis| self.right[group][axis] - W::splat(self.left[axis][lane]));
            let [x, y, z] = axes(|axis| apart[axis] * apart[axis]);
            bits |= W::bits((x + y + z).is_below(limit)) << (8 * group);
        }
        bits
    }

    /// Returns the bits of the particles whose paths come nearer than the query's distance.
    #[inline(always)]
    fn lanes_coming_near(&self, lane: usize, others: u32) -> u32 {
        let (mut rest, mut bits) = (others, 0);
        while let Some(other) = take_lowest(&mut rest) {
            bits |= u32::from(self.come_near([lane, other as usize])) << other;
        }
        bits
    }

    #[inline(always)]
    fn come_near(&self, [left, right]: [usize; 2]) -> bool {
        let [[x_a, d_a], [x_b, d_b]] =
            [self.tiles[0].particle(left), self.tiles[1].particle(right)];
        let (r, v) = (axes(|axis| x_b[axis] - x_a[axis]), axes(|axis| d_b[axis] - d_a[axis]));
        // The time at which straight paths are nearest; NaN where the particles move alike.
        let time = -dot(r, v) / dot(v, v);
        let [from, to] = self.query.times;
        let time = if time > from { time } else { from };
        let time = if time < to { time } else { to };
        let apart = axes(|axis| r[axis] + time * v[axis]);
        dot(apart, apart) < self.query.distance * self.query.distance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 100 particles that move along a line, the last tile of which is not full.
    fn states() -> Vec<PackedParticle> {
        let state = |index: u16| {
            let (x, d) = (f32::from(index * 37 % 100), f32::from(index * 13 % 7) - 3.0);
            PackedParticle([x, 0.0, 0.0, 1.0, d, 0.0, 0.0, 0.0])
        };
        let padding = [PackedParticle([f32::NAN; 8]); 12];
        (0..100).map(state).chain(padding).collect()
    }

    fn found(tree: &mut TileTree, query: Query, kernels: Kernels) -> Vec<[u32; 2]> {
        let mut pairs = Vec::new();
        let search = tree.search(query, kernels, &|_| [0; TILE], &mut |pair| {
            pairs.push(pair);
            Search::Continue(())
        });
        assert!(search.is_continue());
        pairs
    }

    #[test]
    fn a_search_for_strays_finds_all_their_pairs_in_the_order_of_a_full_one() {
        let states = states();
        for kernels in Kernels::available() {
            let mut tree = TileTree::new(100);
            tree.begin_paths(&states, kernels);
            let query = Query { times: [0.0, 1.0], distance: 2.5 };
            tree.refit(query.times, kernels);
            let all = found(&mut tree, query, kernels);
            assert!(all.is_sorted_by_key(|pair| search_order(*pair)), "{kernels:?}");
            let near = |[a, b]: [u32; 2]| {
                let [[x_a, d_a], [x_b, d_b]] =
                    [a, b].map(|slot| [0, 4].map(|field| states[slot as usize].0[field]));
                let (now, later) = (x_b - x_a, x_b - x_a + d_b - d_a);
                now.signum() != later.signum() || now.abs().min(later.abs()) < query.distance
            };
            let pairs = (0..100).flat_map(|a| (a + 1..100).map(move |b| [a, b]));
            assert_eq!(all.len(), pairs.filter(|pair| near(*pair)).count(), "{kernels:?}");

            tree.strays = vec![0, 0b1001, 0, 1 << 15, 0, 0, 0b1000];
            let has_stray = |pair: &[u32; 2]| pair.iter().any(|slot| tree.is_stray(*slot));
            let expected: Vec<_> = all.iter().copied().filter(has_stray).collect();
            assert!(expected.len() > 10 && expected.len() < all.len());
            tree.refit(query.times, kernels);
            assert_eq!(found(&mut tree, query, kernels), expected, "{kernels:?}");
        }
    }
}
