//! Contacts of particles with each other.
//!
//! In every substep the pairs that are near at its end are pushed apart one after the other, in an order
//! that a hash of the pair gives. Which pairs are near is exact: candidates are found for the paths that
//! the particles are about to take, and again when one of them leaves its path. No list outlives its step,
//! so a snapshot with its keyframe is still the complete state.

mod box_tree;
mod load;
mod pair;
mod tile_tree;

use box_tree::Search;
use load::LoadPairs;
use pair::Pair;
use tile_tree::{Query, TILE, TileTree, take_lowest};

use crate::kernels::Kernels;
use crate::kernels::lanes::PackedParticle;
use crate::scene::model::Model;
use crate::step::substep::Substep;
use crate::store::{Location, ParticleStore, Paths, Progress};

/// Pairs within this number of contact distances at the start of the stage take part in it, because
/// another contact may push them together.
const REACH: f32 = 1.1;
/// Largest number of candidates for each particle, on average. It bounds the time of a step in which
/// particles pile up in one point.
const CANDIDATES_PER_PARTICLE: usize = 8;

/// Finds and resolves the contacts of particles with each other. Empty while they are off.
#[derive(Debug, Clone, Default)]
pub(crate) struct ParticleContacts {
    /// Contact distance of all pairs that are not near at load; 0 while contacts are off.
    thickness: f32,
    /// Distance by which candidates may leave their paths before they are found anew.
    margin: f32,
    /// By slot: the particle.
    particles: Vec<u32>,
    /// By slot: where it is in the store.
    locations: Vec<Location>,
    /// By slot: the state in the running substep.
    states: Vec<PackedParticle>,
    load_pairs: LoadPairs,
    tree: TileTree,
    /// The paths for which the candidates were found.
    paths: Paths,
    /// Substep for which the candidates were found. None before the first one of a step.
    found_at: Option<Substep>,
    candidates: Vec<Pair>,
    /// The candidates in the order of contact.
    ordered: Vec<Pair>,
    /// By tile: a bit for each particle that is part of a candidate.
    involved: Vec<u32>,
    /// The pairs of the running substep, in the order of contact.
    near: Vec<Pair>,
    /// Number of searches that were given up because there were too many candidates.
    pub(crate) overflow_count: u64,
}

impl ParticleContacts {
    /// Derives what depends on the scene and the contact distance. `None` turns contacts off.
    pub(crate) fn new(model: &Model, thickness: Option<f32>, kernels: Kernels) -> Self {
        let Some(thickness) = thickness else { return Self::default() };
        let particles = load::slots(model);
        let count = particles.len();
        let candidate_count_max = CANDIDATES_PER_PARTICLE * count;
        Self {
            thickness,
            margin: 0.2 * thickness,
            locations: vec![Location::default(); count],
            states: vec![PackedParticle::default(); count],
            paths: Paths::default(),
            load_pairs: LoadPairs::new(model, &particles, thickness, kernels),
            tree: TileTree::new(count),
            particles,
            found_at: None,
            candidates: Vec::with_capacity(candidate_count_max),
            ordered: Vec::with_capacity(candidate_count_max),
            involved: vec![0; count.div_ceil(TILE)],
            near: Vec::with_capacity(candidate_count_max),
            overflow_count: 0,
        }
    }

    pub(crate) fn are_on(&self) -> bool {
        !self.particles.is_empty()
    }

    /// True if these contacts were derived for this contact distance.
    pub(crate) fn are_derived_from(&self, thickness: Option<f32>) -> bool {
        self.thickness.to_bits() == thickness.unwrap_or(0.0).to_bits()
    }

    /// Updates the locations of the particles.
    pub(crate) fn locate(&mut self, store: &ParticleStore) {
        if self.are_on() {
            // Makes room for them.
            store.save_paths(&mut self.paths);
        }
        for (location, particle) in self.locations.iter_mut().zip(&self.particles) {
            *location = store.location(*particle);
        }
    }

    /// Forgets the candidates of the step before.
    pub(crate) fn begin_step(&mut self) {
        self.found_at = None;
    }

    /// Pushes particles apart that are too near each other at the end of the substep.
    pub(crate) fn push_apart(
        &mut self,
        store: &mut ParticleStore,
        substep: Substep,
        friction: f32,
    ) {
        if self.are_on_their_paths(store, substep) {
            self.load_involved(store);
        } else {
            self.find_candidates(store, substep);
        }
        let Self { states, ordered, near, .. } = self;
        near.clear();
        near.extend(ordered.iter().filter(|pair| pair.is_near(states, REACH)));
        for pair in &*near {
            pair.push_apart(states, friction);
        }
        for slot in near.iter().flat_map(|pair| pair.slots) {
            let PackedParticle([x, y, z, _, dx, dy, dz, _]) = states[slot as usize];
            store.set_path(self.locations[slot as usize], [x, y, z], [dx, dy, dz]);
        }
    }

    fn load_involved(&mut self, store: &ParticleStore) {
        for (tile, mut lanes) in self.involved.iter().copied().enumerate() {
            while let Some(lane) = take_lowest(&mut lanes) {
                let slot = TILE * tile + lane as usize;
                self.states[slot] = store.packed_particle(self.locations[slot]);
            }
        }
    }

    /// True if all particles are where the candidates expect them at the end of the substep.
    fn are_on_their_paths(&self, store: &ParticleStore, substep: Substep) -> bool {
        let Some(found_at) = self.found_at else { return false };
        let count = (substep.index - found_at.index + 1) as f32;
        // Less than half of the margin for each particle, so that rounding loses no pair.
        let limit = 0.24 * self.margin * self.margin;
        !store.is_beside(&self.paths, Progress { count, limit })
    }

    /// Finds the candidates for the rest of the step, and orders them.
    fn find_candidates(&mut self, store: &ParticleStore, substep: Substep) {
        self.found_at = Some(substep);
        store.save_paths(&mut self.paths);
        let kernels = store.kernels();
        let Self { tree, states, locations, particles, load_pairs, candidates, .. } = self;
        let (thickness, count_max) = (self.thickness, CANDIDATES_PER_PARTICLE * particles.len());
        for (slot, (state, location)) in states.iter_mut().zip(locations).enumerate() {
            *state = store.packed_particle(*location);
            let PackedParticle([x, y, z, _, dx, dy, dz, _]) = *state;
            tree.tiles[slot / TILE].set(slot % TILE, [x, y, z], [dx, dy, dz]);
        }
        let span = substep.left() as f32;
        tree.refit(span, kernels);
        candidates.clear();
        let mut accept = |slots: [u32; 2]| {
            let [a, b] = slots.map(|slot| slot as usize);
            let distance = load_pairs.distance(slots, thickness);
            let is_free = states[a].0[3] + states[b].0[3] > 0.0;
            if !is_free {
                return Search::Continue(());
            }
            if candidates.len() == count_max {
                return Search::Break(());
            }
            let key = order_key([particles[a], particles[b]]);
            candidates.push(Pair { slots, distance, key });
            Search::Continue(())
        };
        let query = Query { span, distance: REACH * thickness + self.margin };
        let except = |slot, tile| load_pairs.untouchable(slot, tile);
        if tree.search_except(query, kernels, &except, &mut accept).is_break() {
            self.overflow_count += 1;
        }
        self.order_candidates();
    }

    /// Sorts the candidates by their keys. Those of one key keep the order of the search.
    fn order_candidates(&mut self) {
        let mut places = [0_usize; 257];
        for pair in &self.candidates {
            places[usize::from(pair.key) + 1] += 1;
        }
        for key in 0..256 {
            places[key + 1] += places[key];
        }
        self.ordered.clear();
        self.ordered.extend_from_slice(&self.candidates);
        for pair in &self.candidates {
            let place = &mut places[usize::from(pair.key)];
            self.ordered[*place] = *pair;
            *place += 1;
        }
        self.involved.fill(0);
        for slot in self.candidates.iter().flat_map(|pair| pair.slots) {
            self.involved[slot as usize / TILE] |= 1 << (slot as usize % TILE);
        }
    }
}

/// Returns 8 bits that look random, so that neighbouring pairs are far from each other in the order of
/// contact. In the order of the particles, a push would run through a stack in one direction.
fn order_key([a, b]: [u32; 2]) -> u8 {
    let (low, high) = (a.min(b), a.max(b));
    let mixed = low.wrapping_mul(0x9e37_79b1) ^ high.wrapping_mul(0x85eb_ca6b);
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x2c1b_3c6d);
    (mixed >> 24) as u8
}

#[cfg(test)]
mod tests {
    //! The search against the law: no result depends on how and when candidates are found.
    use super::*;
    use crate::scene::Scene;
    use crate::solver::Solver;

    /// A cloth that falls on its edge and folds, and a rope that falls on it.
    const HEAP: &str = "version = 1\n[contact]\nmode = \"particles\"\n[[generate]]\nshape = \"cloth\"\n\
        columns = 20\nrows = 20\nspacing = 0.02\npinned = \"none\"\norigin = [0, 0.39, 0]\n\
        right = [1, 0, 0.01]\ndown = [0.02, -1, 0.01]\nmass = 0.001\n\
        [[generate]]\nshape = \"rope\"\ncount = 20\nfrom = [0.1, 0.5, 0]\nto = [0.3, 0.6, 0]\n\
        mass = 0.001\npinned = \"none\"\n\
        [[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0.01\nfriction = 0.3\n";

    fn hash(kernels: Kernels, threads: usize, margin: f32) -> u64 {
        let mut solver = Solver::with_kernels(&Scene::from_toml(HEAP, "test").unwrap(), kernels);
        solver.set_threads(threads);
        solver.particle_contacts.margin = margin * solver.particle_contacts.thickness;
        for _ in 0..240 {
            solver.step();
        }
        assert!(solver.particle_contacts.near.len() > 50, "hardly anything touches");
        assert_eq!(solver.particle_contacts.overflow_count, 0);
        solver.state_hash()
    }

    #[test]
    fn the_bits_do_not_depend_on_the_margin_the_kernels_or_the_threads() {
        let expected = hash(Kernels::Reference, 1, 0.0);
        for kernels in Kernels::available() {
            for (margin, threads) in [(0.0, 1), (0.05, 2), (0.2, 1), (0.5, 8)] {
                assert_eq!(hash(kernels, threads, margin), expected, "{kernels:?} {margin}");
            }
        }
    }
}
