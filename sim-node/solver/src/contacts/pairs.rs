//! Contacts of particles with each other.
//!
//! In every substep the pairs that are near at its end are pushed apart one after the other, in an order
//! that a hash of the pair gives. Which pairs are near is exact: candidates are found for the paths that
//! the particles are about to take, and again around those that leave theirs. No list outlives its step,
//! so a snapshot with its keyframe is still the complete state.
//!
//! Where cloths touch as surfaces, a particle and a triangle take the place of most pairs.

mod box_tree;
mod gathered;
mod lane_bounds;
mod load;
mod loading;
pub(crate) mod order;
mod pair;
mod pair_batch;
mod push;
mod surfaces;
mod tile;
mod tile_tree;

use sim_scene::model::Model;
use sim_scene::scene::ContactMode;

use box_tree::Search;
use gathered::{Gathered, Room};
pub(crate) use load::{CONNECTED_REACH, PAIRS_PER_PARTICLE};
use load::{LaneMasks, LoadPairs};
use loading::load_states;
use order::{order_by_key, order_key};
use pair::Pair;
pub(crate) use surfaces::NEVER_PER_PARTICLE;
use surfaces::{SurfaceContacts, SurfaceSearch};
use tile::{TILE, TILE_LENGTH, members, take_lowest};
use tile_tree::{Query, TileTree, search_order};

use crate::kernels::Kernels;
use crate::kernels::lanes::PackedParticle;
use crate::state::tear::Torn;
use crate::step::substep::Substep;
use crate::store::strays::StrayMarks;
use crate::store::workers::Workers;
use crate::store::{Location, ParticleStore, Paths, Progress};

/// Pairs within this number of contact distances at the start of the stage take part in it, because
/// another contact may push them together.
const REACH: f32 = 1.1;
/// Distance by which two particles may come nearer than on their paths, in contact distances: each may leave its own by
/// half of it. A larger one finds more candidates, a smaller one finds them more often. No bit depends on it where
/// particles touch, unless there are too many candidates. Where cloths touch as surfaces, bits depend on when
/// candidates are found, and so on this margin.
const MARGIN: f32 = 0.3;
/// Fraction of the allowed distance from its path beyond which a particle is a stray. A search begins when one exceeds the
/// whole distance, and gives all strays new paths, because they would soon exceed it, too.
const STRAY_FROM: f32 = 0.5;
/// Part of the tiles with strays from which on all paths begin anew: a full search is then as fast.
const STRAY_PART_MAX: f32 = 0.5;
/// Largest number of candidates for each particle, on average. It bounds the time of a step in which
/// particles pile up in one point.
const CANDIDATES_PER_PARTICLE: usize = 8;

/// Fewest candidates that a worker examines.
const NEAR_MIN: usize = 256;

/// Finds and resolves the contacts of particles with each other. Empty while they are off.
#[derive(Debug, Clone, Default)]
pub(crate) struct ParticleContacts {
    /// Contact distance of all pairs that are not near at load; 0 while contacts are off.
    thickness: f32,
    /// Distance by which two particles may come nearer than on their paths before candidates are found anew.
    margin: f32,
    /// By slot: the particle.
    particles: Vec<u32>,
    /// By slot: where it is in the store.
    locations: Vec<Location>,
    /// By slot: the state in the running substep. NaN in the padding of the last tile.
    states: Vec<PackedParticle>,
    load_pairs: LoadPairs,
    /// By tile, where cloths touch as surfaces: a bit for each particle without triangles. Only these touch
    /// particles. Empty in other modes.
    loose: Vec<u16>,
    surfaces: SurfaceContacts,
    tree: TileTree,
    /// By slot, where cloths touch as surfaces: the state on the path for which the candidates were found. Empty in other
    /// modes.
    expected: Vec<PackedParticle>,
    /// The paths for which the candidates were found.
    paths: Paths,
    /// Substep in which the paths begin. None before the first one of a step.
    paths_begin_at: Option<Substep>,
    /// True if the newest search has found all candidates.
    is_complete: bool,
    /// By worker, without the first: the marks of strays that it sets.
    strays_of_others: Vec<Vec<u16>>,
    /// In the order of the search.
    candidates: Gathered<Pair>,
    /// The candidates in the order of contact. A merge uses it for those in the order of the search.
    ordered: Vec<Pair>,
    /// By tile: a bit for each particle.
    members: Vec<u32>,
    /// By tile: a bit for each particle that is part of a candidate.
    involved: Vec<u32>,
    /// The pairs of the running substep, in the order of contact.
    near: Gathered<Pair>,
    /// By tile: a bit for each particle that the running substep may have pushed.
    touched: Vec<u32>,
    /// Number of searches that were given up because there were too many candidates.
    pub(crate) overflow_count: u64,
}

impl ParticleContacts {
    /// Derives what depends on the scene and the contact distance. `None` turns contacts off.
    pub(crate) fn new(
        model: &Model,
        mode: ContactMode,
        thickness: Option<f32>,
        kernels: Kernels,
    ) -> Self {
        let Some(thickness) = thickness else { return Self::default() };
        let particles = load::slots(model);
        let count = particles.len();
        let candidate_count_max = CANDIDATES_PER_PARTICLE * count;
        let has_surfaces = mode == ContactMode::Surfaces;
        let surfaces = has_surfaces.then(|| {
            SurfaceContacts::new(model, &particles, (thickness, kernels), candidate_count_max)
        });
        let loose = if has_surfaces { load::loose(model, &particles) } else { Vec::new() };
        let loose_count: u32 = loose.iter().map(|lanes| lanes.count_ones()).sum();
        let pair_count_max = if has_surfaces {
            CANDIDATES_PER_PARTICLE * loose_count as usize
        } else {
            candidate_count_max
        };
        let states = vec![PackedParticle([f32::NAN; 8]); count.next_multiple_of(TILE)];
        let mut members = vec![0; count.div_ceil(TILE)];
        mark(&mut members, (0..).take(count));
        Self {
            thickness,
            margin: MARGIN * thickness,
            locations: vec![Location::default(); count],
            expected: if has_surfaces { states.clone() } else { Vec::new() },
            states,
            paths: Paths::default(),
            load_pairs: LoadPairs::new(model, &particles, (thickness, kernels), &|tiles| {
                if has_surfaces { without_corners([0; TILE], &loose, tiles) } else { [0; TILE] }
            }),
            loose,
            surfaces: surfaces.unwrap_or_default(),
            tree: TileTree::new(count),
            particles,
            paths_begin_at: None,
            is_complete: false,
            strays_of_others: Vec::new(),
            candidates: Gathered::new(pair_count_max),
            ordered: Vec::with_capacity(pair_count_max),
            members,
            involved: vec![0; count.div_ceil(TILE)],
            touched: vec![0; count.div_ceil(TILE)],
            near: Gathered::new(pair_count_max),
            overflow_count: 0,
        }
    }

    pub(crate) fn are_on(&self) -> bool {
        !self.particles.is_empty()
    }

    /// True if more neighbours are near each other at load than the lists of pairs that never touch have room for: further
    /// ones would repel each other.
    pub(crate) fn are_overfull(&self) -> bool {
        self.load_pairs.is_overfull || self.surfaces.are_overfull()
    }

    /// True if these contacts were derived for this contact distance.
    pub(crate) fn are_derived_from(&self, thickness: Option<f32>) -> bool {
        self.thickness.to_bits() == thickness.unwrap_or(0.0).to_bits()
    }

    /// Updates the locations of the particles, and makes room for what each worker finds.
    pub(crate) fn locate(&mut self, store: &ParticleStore) {
        if self.are_on() {
            store.prepare_paths(&mut self.paths);
            self.set_worker_count(store.thread_count());
        }
        let slots = self.locations.iter_mut().zip(&self.particles);
        for (slot, (location, particle)) in (0_u32..).zip(slots) {
            *location = store.location(*particle);
            store.set_slot(&mut self.paths, *location, slot);
        }
    }

    /// Makes room for what each of these workers finds.
    pub(crate) fn set_worker_count(&mut self, count: usize) {
        let tile_count = self.tree.tiles.len();
        self.strays_of_others.resize_with(count - 1, || vec![0; tile_count]);
        self.candidates.set_worker_count(count);
        self.near.set_worker_count(count);
        self.surfaces.set_worker_count(count);
    }

    /// Forgets the candidates of the step before, and takes torn triangles out.
    pub(crate) fn begin_step(&mut self, torn: &Torn) {
        self.paths_begin_at = None;
        self.surfaces.begin_step(torn);
    }

    /// Pushes particles apart that are too near each other at the end of the substep.
    pub(crate) fn push_apart(
        &mut self,
        store: &mut ParticleStore,
        substep: Substep,
        friction: f32,
    ) {
        let are_loaded = self.find_strays(store, substep) && self.find_candidates(store, substep);
        let (workers, stored) = store.with_workers();
        if !are_loaded {
            // Candidates may come to other triangles.
            let has_candidates = self.surfaces.has_candidates();
            let wanted = if has_candidates { &self.members } else { &self.involved };
            load_states(&mut self.states, wanted, (workers, stored, &self.locations));
        }
        let Self { states, ordered, near, surfaces, thickness, .. } = self;
        near.items.clear();
        let part_length = workers.part_length(ordered.len(), NEAR_MIN);
        near.filter(workers, ordered.chunks(part_length), |pairs, near| {
            let mut pairs = pairs.iter().filter(|pair| pair.is_near(states, REACH));
            pairs.try_for_each(|pair| near.add(*pair))
        });
        for pair in &near.items {
            pair.push_apart(states, friction);
        }
        surfaces.push_apart(states, (*thickness, REACH), friction, workers);
        self.touched.fill(0);
        let slots = near.items.iter().flat_map(|pair| pair.slots);
        mark(&mut self.touched, slots.chain(surfaces.touched()));
        self.save_touched(store);
    }

    /// Writes the paths of the particles back that may have been pushed, each once.
    fn save_touched(&self, store: &mut ParticleStore) {
        for (tile, mut lanes) in self.touched.iter().copied().enumerate() {
            while let Some(lane) = take_lowest(&mut lanes) {
                let slot = TILE * tile + lane as usize;
                let PackedParticle([x, y, z, _, dx, dy, dz, _]) = self.states[slot];
                store.set_path(self.locations[slot], [x, y, z], [dx, dy, dz]);
            }
        }
    }

    /// Finds the particles that are not where the candidates expect them at the end of the substep. Returns true if the
    /// candidates no longer hold.
    fn find_strays(&mut self, store: &mut ParticleStore, substep: Substep) -> bool {
        let Some(begin) = self.paths_begin_at else { return true };
        self.tree.strays.fill(0);
        let count = (substep.index - begin.index + 1) as f32;
        // Less than half of the margin for each particle, so that rounding loses no pair.
        let limit_max = 0.24 * self.margin * self.margin;
        let limit = STRAY_FROM * STRAY_FROM * limit_max;
        let progress = Progress { count, limit, limit_max };
        let strays =
            StrayMarks { all: &mut self.tree.strays, of_others: &mut self.strays_of_others };
        store.mark_strays(&self.paths, progress, strays)
    }

    /// Finds the candidates of strays for the rest of the step, and orders all. Returns true if it has loaded
    /// all particles.
    fn find_candidates(&mut self, store: &mut ParticleStore, substep: Substep) -> bool {
        let stray_count = self.tree.strays.iter().filter(|lanes| **lanes != 0).count();
        let are_few = (stray_count as f32) < STRAY_PART_MAX * self.tree.tiles.len() as f32;
        // An incomplete search has left out candidates of others.
        let is_partial = are_few && self.is_complete;
        let begin = self.paths_begin_at.filter(|_| is_partial);
        let passed = if let Some(begin) = begin {
            let passed = (substep.index - begin.index) as f32;
            self.follow_strays(store, passed);
            passed
        } else {
            self.begin_paths(store, substep);
            0.0
        };
        let (workers, _) = store.with_workers();
        let kernels = workers.kernels;
        let span = substep.left() as f32;
        let times = [passed, passed + span];
        self.tree.refit(times, kernels);
        let distance = REACH * self.thickness + self.margin;
        let mut is_complete = self.search(Query { times, distance }, workers).is_continue();
        if self.surfaces.are_on() {
            let Self { tree, expected: states, particles, .. } = self;
            let begins_paths = begin.is_none();
            let search = SurfaceSearch {
                tree,
                states,
                particles,
                begins_paths,
                passed,
                span,
                distance,
                kernels,
            };
            is_complete &= self.surfaces.find(&search, workers).is_continue();
        }
        self.is_complete = is_complete;
        self.overflow_count += u64::from(!is_complete);
        self.order_candidates();
        begin.is_none()
    }

    /// Gives all particles new paths, from this substep on.
    fn begin_paths(&mut self, store: &mut ParticleStore, substep: Substep) {
        self.paths_begin_at = Some(substep);
        store.save_paths(&mut self.paths);
        let (workers, stored) = store.with_workers();
        load_states(&mut self.states, &self.members, (workers, stored, &self.locations));
        self.tree.begin_paths(&self.states, workers.kernels);
        if self.surfaces.are_on() {
            self.expected.copy_from_slice(&self.states);
        }
        self.candidates.items.clear();
    }

    /// Gives the strays the paths that they take after this number of displacements, and drops their candidates. Those of
    /// the others still hold.
    fn follow_strays(&mut self, store: &ParticleStore, passed: f32) {
        let Self { tree, states, candidates, locations, paths, surfaces, expected, .. } = self;
        for slot in members(&tree.strays).map(|slot| slot as usize) {
            states[slot] = store.particles().packed(locations[slot]);
        }
        tree.follow_strays(states, passed);
        for slot in members(&tree.strays).map(|slot| slot as usize) {
            let path = tree.tiles[slot / TILE].particle(slot % TILE);
            store.set_saved_path(paths, locations[slot], path);
        }
        if surfaces.are_on() {
            tree.place(passed, store.kernels(), expected);
        }
        candidates.items.retain(|pair| !pair.slots.iter().any(|slot| tree.is_stray(*slot)));
    }

    /// Adds the candidates of strays, in the order of the search.
    fn search(&mut self, query: Query, workers: &mut Workers) -> Search {
        let Self { tree, states, particles, load_pairs, loose, candidates, thickness, .. } = self;
        let kept_count = candidates.items.len();
        let accept = |slots: [u32; 2], found: &mut Room<'_, Pair>| {
            let [a, b] = slots.map(|slot| slot as usize);
            let distance = load_pairs.distance(slots, *thickness);
            let is_free = states[a].0[3] + states[b].0[3] > 0.0;
            if !is_free {
                return Search::Continue(());
            }
            let (a, b) = (particles[a], particles[b]);
            let key = order_key(a.min(b), a.max(b));
            found.add(Pair { slots, distance, key })
        };
        let found = if loose.is_empty() {
            let except = |tiles| load_pairs.untouchable(tiles);
            tree.gather((query, workers), &except, (candidates, &accept))
        } else if loose.iter().any(|lanes| *lanes != 0) {
            let except = |tiles| without_corners(load_pairs.untouchable(tiles), loose, tiles);
            tree.gather((query, workers), &except, (candidates, &accept))
        } else {
            Search::Continue(())
        };
        self.merge_candidates(kept_count);
        found
    }

    /// Merges the candidates behind the first ones into these. Both are in the order of the search.
    fn merge_candidates(&mut self, kept_count: usize) {
        if kept_count == 0 {
            return;
        }
        let Self { candidates: Gathered { items: candidates, .. }, ordered, .. } = self;
        ordered.clear();
        let (kept, found) = candidates.split_at(kept_count);
        let mut kept = kept.iter().peekable();
        for pair in found {
            let order = search_order(pair.slots);
            while let Some(earlier) = kept.next_if(|kept| search_order(kept.slots) < order) {
                ordered.push(*earlier);
            }
            ordered.push(*pair);
        }
        ordered.extend(kept);
        std::mem::swap(candidates, ordered);
    }

    fn order_candidates(&mut self) {
        let candidates = &self.candidates.items;
        order_by_key(candidates, &mut self.ordered, |pair| pair.key);
        self.involved.fill(0);
        mark(&mut self.involved, candidates.iter().flat_map(|pair| pair.slots));
    }
}

/// Sets the bits of slots, by tile.
fn mark(tiles: &mut [u32], slots: impl Iterator<Item = u32>) {
    for slot in slots {
        tiles[(slot / TILE_LENGTH) as usize] |= 1 << (slot % TILE_LENGTH);
    }
}

/// Leaves all pairs out but those of particles without triangles, for which `loose` has a bit by tile.
fn without_corners(left_out: LaneMasks, loose: &[u16], tiles: [u32; 2]) -> LaneMasks {
    let [lanes, others] = tiles.map(|tile| loose[tile as usize]);
    let mut left_out = left_out;
    for (lane, mask) in left_out.iter_mut().enumerate() {
        *mask |= if lanes & (1 << lane) != 0 { !others } else { !0 };
    }
    left_out
}

#[cfg(test)]
mod tests {
    //! The search against the law: no result depends on how and when candidates are found.
    use sim_scene::scene::Scene;

    use super::*;
    use crate::solver::Solver;

    /// A cloth that falls on its edge and folds, and a rope that falls on it.
    const HEAP: &str = "version = 1\n[contact]\nmode = \"particles\"\n[[generate]]\nshape = \"cloth\"\n\
        columns = 20\nrows = 20\nspacing = 0.02\npinned = \"none\"\norigin = [0, 0.39, 0]\n\
        right = [1, 0, 0.01]\ndown = [0.02, -1, 0.01]\nmass = 0.001\n\
        [[generate]]\nshape = \"rope\"\ncount = 20\nfrom = [0.1, 0.5, 0]\nto = [0.3, 0.6, 0]\n\
        mass = 0.001\npinned = \"none\"\n\
        [[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0.01\nfriction = 0.3\n";

    /// Steps the scene for a second, with 960 substeps.
    fn hash(rate_hz: u32, kernels: Kernels, threads: usize, margin: f32) -> u64 {
        let substeps = 960 / rate_hz;
        let solver = format!("[solver]\nrate_hz = {rate_hz}\nsubsteps = {substeps}\n[contact]");
        let text = HEAP.replace("[contact]", &solver);
        let mut solver = Solver::with_kernels(&Scene::from_toml(&text, "test").unwrap(), kernels);
        solver.set_threads(threads);
        solver.particle_contacts.margin = margin * solver.particle_contacts.thickness;
        for _ in 0..rate_hz {
            solver.step();
        }
        assert!(solver.particle_contacts.near.items.len() > 50, "hardly anything touches");
        assert_eq!(solver.particle_contacts.overflow_count, 0);
        solver.state_hash()
    }

    #[test]
    fn the_bits_do_not_depend_on_the_margin_the_kernels_or_the_threads() {
        for rate_hz in [240, 60] {
            let expected = hash(rate_hz, Kernels::Reference, 1, 0.0);
            for kernels in Kernels::available() {
                for (margin, threads) in [(0.0, 1), (0.05, 2), (0.2, 1), (0.5, 8)] {
                    let hash = hash(rate_hz, kernels, threads, margin);
                    assert_eq!(hash, expected, "{rate_hz} {kernels:?} {margin}");
                }
            }
        }
    }

    /// Three tiles of particles at rest, 10 m apart. In the first two of them, two particles meet head on late in the
    /// step. In the first, another one is stopped by the floor before, so it gets a new path, and the tile new boxes.
    #[test]
    fn particles_meet_late_in_a_step_whether_others_have_left_their_paths_before_or_not() {
        let particle = |x: u32, place: u32| match (x, place) {
            (0 | 1, 0) => ([-0.08, 0.0, 0.0], [5, 0]),
            (0 | 1, 1) => ([0.08, 0.0, 0.0], [-5, 0]),
            (0, 2) => ([0.0, -0.97, 0.0], [0, -10]),
            _ => ([0.0, 0.0, 0.2 * f64::from(place)], [0, 0]),
        };
        let mut text = "version = 1\ngravity = [0, 0, 0]\n[solver]\nrate_hz = 60\nsubsteps = 16\n\
            [contact]\nmode = \"particles\"\nthickness = 0.02\n\
            [[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = -1\n"
            .to_owned();
        for index in 0..48 {
            let ([x, y, z], [vx, vy]) = particle(index / 16, index % 16);
            let x = x + f64::from(10 * (index / 16));
            text +=
                &format!("[[particle]]\nposition = [{x}, {y}, {z}]\nvelocity = [{vx}, {vy}, 0]\n");
        }
        let mut solver = Solver::new(&Scene::from_toml(&text, "test").unwrap());
        solver.step();
        let tiles = &solver.particle_contacts.particles;
        assert!(tiles[..16].iter().all(|particle| *particle < 16), "another tile");
        let velocity = |index: usize| solver.particles()[index].velocity;
        assert_eq!(velocity(2), [0.0; 3], "not stopped by the floor");
        for pair in [[0, 1], [16, 17]] {
            let [left, right] = pair.map(|index| velocity(index)[0]);
            assert!(left.abs() < 1e-3 && right.abs() < 1e-3, "{pair:?}: {left} {right}");
        }
    }
}
