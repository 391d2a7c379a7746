//! Pairs of particles that are near each other at load, and so have another contact distance, or none.

use super::box_tree::Search;
use super::tile_tree::{Query, TILE, TILE_LENGTH, TileTree};
use crate::kernels::Kernels;
use crate::scene::model::Model;

/// Particles of one connected body never touch if they are nearer than this at load, in contact
/// distances: a fold of two layers is a half circle of pi / 2 = 1.57.
const CONNECTED_REACH: f32 = 1.6;
/// Largest number of near pairs at load for each particle, on average. Further pairs touch as all others.
const PAIRS_PER_PARTICLE: usize = 32;

/// Returns the particles that take part in contacts in the order of their slots. Each tile, and each node
/// of the tree above, holds neighbours at load: it is one half of a cut across the longest side of the
/// node above.
pub(super) fn slots(model: &Model) -> Vec<u32> {
    let particles = (0_u32..).zip(&model.is_without_contact);
    let mut slots: Vec<_> =
        particles.filter(|(_, is_without)| !**is_without).map(|(index, _)| index).collect();
    let mut size = TILE;
    while size < slots.len() {
        size *= 2;
    }
    divide(&mut slots, size, &|particle, axis| model.particles[particle as usize].position[axis]);
    slots
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

/// The pairs of slots that are near each other at load.
#[derive(Debug, Clone, Default)]
pub(super) struct LoadPairs {
    /// First entry of each slot in `tiles`, and the end of the last one.
    starts: Vec<u32>,
    /// By slot: the particles of its own and later tiles that it never touches.
    tiles: Vec<Untouchable>,
    /// Pairs that touch at another distance: ascending slots, and the distance.
    closer: Vec<([u32; 2], f32)>,
}

/// Particles of a tile that a particle never touches.
#[derive(Debug, Clone, Copy)]
struct Untouchable {
    tile: u32,
    /// A bit for each particle.
    lanes: u32,
}

impl LoadPairs {
    /// Finds the pairs of particles that are near each other at load.
    pub(super) fn new(model: &Model, slots: &[u32], thickness: f32, kernels: Kernels) -> Self {
        let bodies = bodies(model);
        let mut tree = TileTree::new(slots.len());
        for (slot, particle) in slots.iter().enumerate() {
            let position = model.particles[*particle as usize].position;
            tree.tiles[slot / TILE].set(slot % TILE, position, [0.0; 3]);
        }
        tree.refit(0.0, kernels);
        let query = Query { span: 0.0, distance: CONNECTED_REACH * thickness };
        let count_max = PAIRS_PER_PARTICLE * slots.len();
        let (mut never, mut closer) = (Vec::new(), Vec::new());
        let _is_complete = tree.search(query, kernels, &mut |pair| {
            let [a, b] = pair.map(|slot| slots[slot as usize]);
            let apart = model.distance(a, b);
            if bodies[a as usize] == bodies[b as usize] || apart == 0.0 {
                never.push(pair);
            } else if apart < thickness {
                closer.push((pair, apart));
            }
            let is_full = never.len() + closer.len() >= count_max;
            if is_full { Search::Break(()) } else { Search::Continue(()) }
        });
        never.sort_unstable();
        closer.sort_unstable_by_key(|(pair, _)| *pair);
        let mut load_pairs = Self { starts: Vec::new(), tiles: Vec::new(), closer };
        load_pairs.enter(&never, slots.len());
        load_pairs
    }

    /// Enters the pairs that never touch, which ascend.
    #[allow(clippy::cast_possible_truncation, reason = "at most 32 for each of 2^24 particles")]
    fn enter(&mut self, never: &[[u32; 2]], slot_count: usize) {
        let mut rest = never.iter().peekable();
        for slot in 0..slot_count {
            let first = self.tiles.len();
            self.starts.push(first as u32);
            while let Some([_, other]) = rest.next_if(|[one, _]| *one as usize == slot) {
                let (tile, lane) = (other / TILE_LENGTH, other % TILE_LENGTH);
                match self.tiles[first..].last_mut() {
                    Some(last) if last.tile == tile => last.lanes |= 1 << lane,
                    _ => self.tiles.push(Untouchable { tile, lanes: 1 << lane }),
                }
            }
        }
        self.starts.push(self.tiles.len() as u32);
    }

    /// Returns a bit for each particle of a tile, its own or a later one, that a particle never touches.
    #[inline(always)]
    pub(super) fn untouchable(&self, slot: u32, tile: u32) -> u32 {
        let range = self.starts[slot as usize] as usize..self.starts[slot as usize + 1] as usize;
        let known = self.tiles[range].iter().find(|one| one.tile == tile);
        known.map_or(0, |one| one.lanes)
    }

    /// Contact distance of two slots in ascending order.
    #[inline(always)]
    pub(super) fn distance(&self, pair: [u32; 2], thickness: f32) -> f32 {
        if self.closer.is_empty() {
            return thickness;
        }
        let found = self.closer.binary_search_by_key(&pair, |(pair, _)| *pair);
        found.map_or(thickness, |index| self.closer[index].1)
    }
}

/// Returns a number for each particle, the same for particles that constraints connect.
fn bodies(model: &Model) -> Vec<u32> {
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
