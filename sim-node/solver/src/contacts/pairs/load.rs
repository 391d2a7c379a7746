//! Pairs of particles that are near each other at load, and so have another contact distance, or none.

use sim_scene::model::Model;

use super::box_tree::Search;
use super::tile::{TILE, TILE_LENGTH};
use super::tile_tree::{Query, TileTree};
use crate::kernels::Kernels;

/// Particles of one connected body never touch if they are nearer than this at load, in contact
/// distances: a fold of two layers is a half circle of pi / 2 = 1.57.
pub(crate) const CONNECTED_REACH: f32 = 1.6;
/// Largest number of near pairs at load for each particle, on average. It bounds memory. Further pairs touch as all
/// others, so a contact distance with more of them is refused.
pub(crate) const PAIRS_PER_PARTICLE: usize = 32;

/// Returns the particles that take part in contacts in the order of their slots. Each tile, and each node
/// of the tree above, holds neighbours at load: it is one half of a cut across the longest side of the
/// node above.
pub(super) fn slots(model: &Model) -> Vec<u32> {
    let particles = (0_u32..).zip(&model.is_without_contact);
    let mut slots: Vec<_> =
        particles.filter(|(_, is_without)| !**is_without).map(|(index, _)| index).collect();
    in_tiles(&mut slots, &|particle, axis| model.particles[particle as usize].position[axis]);
    slots
}

/// Returns the triangles whose corners all have slots, with these slots as corners, in the order of their tiles.
pub(super) fn triangles(model: &Model, slots: &[u32]) -> Vec<[u32; 3]> {
    let mut slot_of = vec![None; model.particles.len()];
    for (slot, particle) in (0_u32..).zip(slots) {
        slot_of[*particle as usize] = Some(slot);
    }
    let corners = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|particle| slot_of[particle as usize]);
        Some([a?, b?, c?])
    };
    let triangles: Vec<_> = model.triangles.iter().filter_map(corners).collect();
    #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 triangles")]
    let mut order: Vec<_> = (0..triangles.len() as u32).collect();
    in_tiles(&mut order, &|triangle, axis| {
        let at = |slot: u32| model.particles[slots[slot as usize] as usize].position[axis];
        let [a, b, c] = triangles[triangle as usize].map(at);
        a + b + c
    });
    order.into_iter().map(|triangle| triangles[triangle as usize]).collect()
}

/// Returns, by tile, a bit for each particle that is a corner of no triangle.
pub(super) fn loose(model: &Model, slots: &[u32]) -> Vec<u16> {
    let mut is_corner = vec![false; model.particles.len()];
    for particle in model.triangles.iter().flatten() {
        is_corner[*particle as usize] = true;
    }
    let lanes = |tile: &[u32]| {
        let lanes = (0..).zip(tile).filter(|(_, particle)| !is_corner[**particle as usize]);
        lanes.fold(0, |lanes, (lane, _)| lanes | 1 << lane)
    };
    slots.chunks(TILE).map(lanes).collect()
}

/// Orders items so that each tile, and each node of the tree above, holds neighbours.
fn in_tiles(items: &mut [u32], coordinate: &dyn Fn(u32, usize) -> f32) {
    let mut size = TILE;
    while size < items.len() {
        size *= 2;
    }
    divide(items, size, coordinate);
}

/// Orders the particles of a node with room for `size` particles, a tile times a power of 2. Only the last
/// node of a level is not full.
fn divide(slots: &mut [u32], size: usize, coordinate: &dyn Fn(u32, usize) -> f32) {
    if size == TILE {
        // The cuts leave the order within a tile to the library.
        slots.sort_unstable();
        return;
    }
    let half = size / 2;
    if slots.len() <= half {
        return divide(slots, half, coordinate);
    }
    let length = |axis: usize| {
        let along = slots.iter().map(|slot| coordinate(*slot, axis));
        let (min, max) = along.fold((f32::INFINITY, f32::NEG_INFINITY), |(min, max), at| {
            (if at < min { at } else { min }, if at > max { at } else { max })
        });
        max - min
    };
    let lengths = [0, 1, 2].map(length);
    let mut longest = 0;
    for axis in 1..3 {
        if lengths[axis] > lengths[longest] {
            longest = axis;
        }
    }
    slots.select_nth_unstable_by(half, |a, b| {
        let at = |slot: &u32| coordinate(*slot, longest);
        at(a).total_cmp(&at(b)).then(a.cmp(b))
    });
    let (first, second) = slots.split_at_mut(half);
    divide(first, half, coordinate);
    divide(second, half, coordinate);
}

/// A bit for each entry of a tile, for each slot of another one.
pub(super) type LaneMasks = [u16; TILE];

/// The pairs of a slot and an entry of a tile, such as another slot, that are near each other at load.
#[derive(Debug, Clone, Default)]
pub(super) struct LoadPairs {
    /// Pairs that never touch.
    never: PairMasks,
    /// Pairs that touch at another distance, ascending, and the distance.
    closer: Vec<([u32; 2], f32)>,
    /// True if there were more near pairs than the list has room for.
    pub(super) is_overfull: bool,
}

/// A set of pairs of a slot and an entry of a tile.
#[derive(Debug, Clone, Default)]
pub(super) struct PairMasks {
    /// First entry in `tiles` of each tile of slots, and the end of the last one.
    starts: Vec<u32>,
    /// By tile of slots: the tiles with entries of the set.
    tiles: Vec<TileMasks>,
}

/// Entries of a tile that form pairs with the slots of another one.
#[derive(Debug, Clone, Copy)]
struct TileMasks {
    tile: u32,
    lanes: LaneMasks,
}

impl TileMasks {
    /// The pairs with the slots of a tile.
    fn pairs(&self, slot_tile: u32) -> impl Iterator<Item = [u32; 2]> + '_ {
        (TILE_LENGTH * slot_tile..).zip(&self.lanes).flat_map(move |(slot, lanes)| {
            let entries = (0..TILE_LENGTH).filter(move |lane| lanes & (1 << lane) != 0);
            entries.map(move |lane| [slot, TILE_LENGTH * self.tile + lane])
        })
    }
}

impl LoadPairs {
    /// Finds the pairs of particles that are near each other at load. For two tiles, `except` has a bit for each
    /// particle of the second one that one of the first leaves out.
    pub(super) fn new(
        model: &Model,
        slots: &[u32],
        (thickness, kernels): (f32, Kernels),
        except: &impl Fn([u32; 2]) -> LaneMasks,
    ) -> Self {
        let bodies = bodies(model);
        let mut tree = TileTree::at_load(model, slots, kernels);
        let query = Query { times: [0.0; 2], distance: CONNECTED_REACH * thickness };
        let count_max = PAIRS_PER_PARTICLE * slots.len();
        let (mut never, mut closer) = (Vec::new(), Vec::new());
        let found = tree.search(query, kernels, except, &mut |pair| {
            if never.len() + closer.len() == count_max {
                return Search::Break(());
            }
            let [a, b] = pair.map(|slot| slots[slot as usize]);
            let apart = model.distance(a, b);
            if bodies[a as usize] == bodies[b as usize] || apart == 0.0 {
                never.push(pair);
            } else if apart < thickness {
                closer.push((pair, apart));
            }
            Search::Continue(())
        });
        Self::from_pairs(never, closer, (slots.len(), found))
    }

    /// Enters pairs of a slot and an entry of a tile: those that never touch, and those that touch at
    /// another distance. The search has broken off where the list was full.
    pub(super) fn from_pairs(
        never: Vec<[u32; 2]>,
        mut closer: Vec<([u32; 2], f32)>,
        (slot_count, search): (usize, Search),
    ) -> Self {
        closer.sort_unstable_by_key(|(pair, _)| *pair);
        Self { never: PairMasks::new(never, slot_count), closer, is_overfull: search.is_break() }
    }

    /// Returns a bit for each entry of a tile that a slot never touches, for each slot of a tile.
    #[inline(always)]
    pub(super) fn untouchable(&self, tiles: [u32; 2]) -> LaneMasks {
        self.never.of_tiles(tiles)
    }

    /// Returns all pairs that never touch.
    pub(super) fn never(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.never.pairs()
    }

    /// True if a slot and an entry of a tile never touch.
    #[inline(always)]
    pub(super) fn never_touch(&self, slot: u32, entry: u32) -> bool {
        self.never.has(slot, entry)
    }

    /// Contact distance of a pair. Two slots ascend.
    #[inline(always)]
    pub(super) fn distance(&self, pair: [u32; 2], thickness: f32) -> f32 {
        if self.closer.is_empty() {
            return thickness;
        }
        let found = self.closer.binary_search_by_key(&pair, |(pair, _)| *pair);
        found.map_or(thickness, |index| self.closer[index].1)
    }
}

impl PairMasks {
    pub(super) fn new(mut pairs: Vec<[u32; 2]>, slot_count: usize) -> Self {
        pairs.sort_unstable_by_key(|pair| (pair.map(|one| one / TILE_LENGTH), *pair));
        pairs.dedup();
        let mut masks = Self::default();
        masks.enter(&pairs, slot_count.div_ceil(TILE));
        masks
    }

    /// Enters pairs that ascend by their tiles.
    #[allow(clippy::cast_possible_truncation, reason = "memory ends long before 2^32 tiles")]
    fn enter(&mut self, pairs: &[[u32; 2]], tile_count: usize) {
        let mut rest = pairs.iter().peekable();
        for slot_tile in 0..tile_count as u32 {
            let first = self.tiles.len();
            self.starts.push(first as u32);
            while let Some([slot, entry]) =
                rest.next_if(|[slot, _]| slot / TILE_LENGTH == slot_tile)
            {
                let tile = entry / TILE_LENGTH;
                if self.tiles[first..].last().is_none_or(|last| last.tile != tile) {
                    self.tiles.push(TileMasks { tile, lanes: [0; TILE] });
                }
                let last = self.tiles.len() - 1;
                self.tiles[last].lanes[(slot % TILE_LENGTH) as usize] |= 1 << (entry % TILE_LENGTH);
            }
        }
        self.starts.push(self.tiles.len() as u32);
    }

    fn pairs(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        (0..).zip(self.starts.windows(2)).flat_map(|(slot_tile, range)| {
            let tiles = &self.tiles[range[0] as usize..range[1] as usize];
            tiles.iter().flat_map(move |masks| masks.pairs(slot_tile))
        })
    }

    /// Returns a bit for each entry of a tile, for each slot of a tile.
    #[inline(always)]
    pub(super) fn of_tiles(&self, [slots, entries]: [u32; 2]) -> LaneMasks {
        let [first, end] = [slots, slots + 1].map(|tile| self.starts[tile as usize] as usize);
        let known = self.tiles[first..end].iter().find(|one| one.tile == entries);
        known.map_or([0; TILE], |one| one.lanes)
    }

    /// True if a slot and an entry of a tile are a pair of the set.
    #[inline(always)]
    pub(super) fn has(&self, slot: u32, entry: u32) -> bool {
        let masks = self.of_tiles([slot, entry].map(|one| one / TILE_LENGTH));
        masks[(slot % TILE_LENGTH) as usize] & (1 << (entry % TILE_LENGTH)) != 0
    }
}

/// Returns a number for each particle, the same for particles that constraints connect.
pub(super) fn bodies(model: &Model) -> Vec<u32> {
    let mut parents: Vec<_> = (0..model.particle_count()).collect();
    for constraint in &model.constraints {
        let [a, b] = [constraint.a, constraint.b].map(|end| root(&mut parents, end));
        parents[a.max(b) as usize] = a.min(b);
    }
    (0..model.particle_count()).map(|particle| root(&mut parents, particle)).collect()
}

fn root(parents: &mut [u32], particle: u32) -> u32 {
    let mut at = particle;
    while parents[at as usize] != at {
        parents[at as usize] = parents[parents[at as usize] as usize];
        at = parents[at as usize];
    }
    at
}
