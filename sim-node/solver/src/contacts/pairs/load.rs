//! Pairs of particles that are near each other at load, and so have another contact distance, or none.

use super::tile_tree::{NearPair, Query, Search, SearchWork, TILE, TileTree};
use crate::kernels::Kernels;
use crate::scene::model::Model;

/// Particles of one connected body never touch if they are nearer than this at load, in contact
/// distances: a fold of two layers is a half circle of pi / 2 = 1.57.
const CONNECTED_REACH: f32 = 1.6;
/// Largest number of near pairs at load for each particle, on average. Further pairs touch as all others.
const PAIRS_PER_PARTICLE: usize = 32;

/// The slots of the particles that take part in contacts: neighbours at load have neighbouring slots.
pub(super) fn slots(model: &Model) -> Vec<u32> {
    let particles = (0_u32..).zip(&model.particles).zip(&model.is_without_contact);
    let mut slots: Vec<_> = particles
        .filter(|(_, is_without)| !**is_without)
        .map(|((index, particle), _)| (index, particle.position))
        .collect();
    let mut min = [f32::INFINITY; 3];
    let mut max = [f32::NEG_INFINITY; 3];
    for (_, position) in &slots {
        for axis in 0..3 {
            min[axis] = if position[axis] < min[axis] { position[axis] } else { min[axis] };
            max[axis] = if position[axis] > max[axis] { position[axis] } else { max[axis] };
        }
    }
    let size = (0..3).fold(0.0_f32, |size, axis| {
        if max[axis] - min[axis] > size { max[axis] - min[axis] } else { size }
    });
    let scale = if size > 0.0 { 1023.0 / size } else { 0.0 };
    slots.sort_by_key(|(index, position)| {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 1023")]
        let cell = |axis: usize| ((position[axis] - min[axis]) * scale) as u32;
        (morton(cell(0)) | morton(cell(1)) << 1 | morton(cell(2)) << 2, *index)
    });
    slots.into_iter().map(|(index, _)| index).collect()
}

/// Spreads the lower 10 bits to every third bit (Morton 1966).
fn morton(cell: u32) -> u32 {
    (0..10).fold(0, |code, bit| code | ((cell >> bit) & 1) << (3 * bit))
}

/// By slot: the slots behind it that are near it at load.
#[derive(Debug, Clone, Default)]
pub(super) struct LoadPairs {
    /// First entry of each slot, and the end of the last one.
    starts: Vec<u32>,
    entries: Vec<LoadPair>,
}

#[derive(Debug, Clone, Copy)]
struct LoadPair {
    other: u32,
    /// Contact distance; 0 for a pair that never touches.
    distance: f32,
}

impl LoadPairs {
    /// Finds the pairs of particles that are near each other at load.
    pub(super) fn new(model: &Model, slots: &[u32], thickness: f32, kernels: Kernels) -> Self {
        let bodies = bodies(model);
        let mut tree = TileTree::new(slots.len());
        for (slot, particle) in slots.iter().enumerate() {
            let position = model.particles[*particle as usize].position;
            let tile = &mut tree.tiles[slot / TILE];
            for axis in 0..3 {
                tile.x[axis][slot % TILE] = position[axis];
                tile.d[axis][slot % TILE] = 0.0;
            }
        }
        tree.refit(0.0);
        let query = Query { span: 0.0, distance: CONNECTED_REACH * thickness };
        let count_max = PAIRS_PER_PARTICLE * slots.len();
        let mut pairs = Vec::new();
        let accept = |NearPair { slots: [a, b] }: NearPair| {
            let particles = [a, b].map(|slot| slots[slot as usize]);
            let is_connected = bodies[particles[0] as usize] == bodies[particles[1] as usize];
            let apart = model.distance(particles[0], particles[1]);
            let distance = match is_connected {
                true => 0.0,
                false if apart < thickness => apart,
                false => return Search::Continue(()),
            };
            pairs.push((a, LoadPair { other: b, distance }));
            if pairs.len() < count_max { Search::Continue(()) } else { Search::Break(()) }
        };
        let _is_complete = kernels.run(SearchWork { tree: &tree, query, accept });
        pairs.sort_by_key(|(slot, pair)| (*slot, pair.other));
        let mut starts = vec![0; slots.len() + 1];
        for (slot, _) in &pairs {
            starts[*slot as usize + 1] += 1;
        }
        for slot in 0..slots.len() {
            starts[slot + 1] += starts[slot];
        }
        Self { starts, entries: pairs.into_iter().map(|(_, pair)| pair).collect() }
    }

    /// Contact distance of two slots in ascending order; 0 if they never touch.
    #[inline(always)]
    pub(super) fn distance(&self, [a, b]: [u32; 2], thickness: f32) -> f32 {
        let range = self.starts[a as usize] as usize..self.starts[a as usize + 1] as usize;
        let known = self.entries[range].iter().find(|pair| pair.other == b);
        known.map_or(thickness, |pair| pair.distance)
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
