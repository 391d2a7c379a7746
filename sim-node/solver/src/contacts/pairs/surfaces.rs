//! Contacts of particles with the triangles of cloths.
//!
//! A particle touches each layer of cloth at the point that is nearest to it: a local minimum of its distance from
//! the triangles that it may touch. These points are found for the paths that the particles are about to take. In each
//! substep they move on across edges and around corners, so that a particle slides over the triangles without feeling them.

mod candidate;
mod contact;
mod faces;
mod finding;
mod near_tiles;
mod nearby;
mod nearest;
mod placed_tile;
#[cfg(test)]
mod samples;
mod surface;
mod touching;
mod triangle_tile;
mod triangle_tiles;

use super::box_tree::Search;
use super::gathered::Gathered;
use super::load::{self, LoadPairs, PairMasks};
use super::order::order_by_key;
use super::tile_tree::TileTree;
use crate::kernels::Kernels;
use crate::kernels::lanes::PackedParticle;
use crate::state::tear::Torn;
use crate::store::workers::Workers;
use candidate::{Candidate, add_candidate, has_candidate};
use contact::SurfaceContact;
use finding::{Adding, Finding};
use near_tiles::NearTiles;
use nearby::NearPoint;
use nearest::{Feature, Nearest};
use sim_scene::model::Model;
use surface::{Found, Surface, View};
use touching::{TouchWork, Touching};
pub(super) use triangle_tiles::SurfaceSearch;
use triangle_tiles::{AtLoad, TriangleTiles, Wanted};

/// Largest number of triangles that a particle never touches, on average. Further ones touch it as all others, so a
/// contact distance with more of them is refused.
pub(crate) const NEVER_PER_PARTICLE: usize = 128;

/// Fewest candidates that a worker examines.
const TOUCH_MIN: usize = 128;

/// Finds and resolves the contacts of particles with triangles. Empty in other modes.
#[derive(Debug, Clone, Default)]
pub(super) struct SurfaceContacts {
    surface: Surface,
    tiles: TriangleTiles,
    /// Slots and triangles that are near each other at load.
    load_pairs: LoadPairs,
    /// Slots and the triangles at an edge of one that they never touch.
    rims: PairMasks,
    candidate_count_max: usize,
    candidates: Vec<Candidate>,
    /// By slot: the candidate that was found last.
    newest: Vec<Option<u32>>,
    /// The candidates in the order of contact.
    ordered: Vec<Candidate>,
    /// The candidates whose particle is on its path, and the nearest part of their triangle.
    kept: Gathered<(Candidate, Feature)>,
    /// The nearest points that several workers find.
    points: Gathered<NearPoint>,
    /// Memory of each worker.
    near_tiles: Vec<NearTiles>,
    /// The contacts of the running substep, in the order of contact.
    near: Gathered<SurfaceContact>,
    /// Number of torn constraints and their hash, for which the torn triangles were looked up.
    torn: (usize, u64),
}

impl SurfaceContacts {
    /// Derives what depends on the scene and the contact distance. `candidate_count_max` limits the memory.
    pub(super) fn new(
        model: &Model,
        particles: &[u32],
        (thickness, kernels): (f32, Kernels),
        candidate_count_max: usize,
    ) -> Self {
        let surface = Surface::new(model, particles, load::triangles(model, particles));
        let mut tiles = TriangleTiles::new(&surface);
        let tree = TileTree::at_load(model, particles, kernels);
        let states: Vec<_> = particles.iter().map(|one| at_load(model, *one)).collect();
        let search = SurfaceSearch {
            tree: &tree,
            states: &states,
            particles,
            begins_paths: true,
            passed: 0.0,
            span: 0.0,
            distance: load::CONNECTED_REACH * thickness,
            kernels,
        };
        let load_pairs = near_at_load(model, &surface, &mut tiles, (&search, thickness));
        let rims = rims(&surface, &load_pairs, particles.len());
        Self {
            surface,
            tiles,
            load_pairs,
            rims,
            candidate_count_max,
            newest: vec![None; particles.len()],
            candidates: Vec::with_capacity(candidate_count_max),
            ordered: Vec::with_capacity(candidate_count_max),
            kept: Gathered::new(candidate_count_max),
            points: Gathered::default(),
            near_tiles: vec![NearTiles::new()],
            near: Gathered::new(candidate_count_max),
            torn: (0, 0),
        }
    }

    /// Makes room for what each of these workers finds.
    pub(super) fn set_worker_count(&mut self, count: usize) {
        if !self.are_on() {
            return;
        }
        // One worker adds each point as soon as it is found.
        self.points = Gathered::new(if count > 1 { self.candidate_count_max } else { 0 });
        self.points.set_worker_count(count);
        self.near_tiles.resize_with(count, NearTiles::new);
        self.kept.set_worker_count(count);
        self.near.set_worker_count(count);
    }

    /// True if more triangles are near particles at load than the list has room for.
    pub(super) fn are_overfull(&self) -> bool {
        self.load_pairs.is_overfull
    }

    pub(super) fn are_on(&self) -> bool {
        !self.surface.corners.is_empty()
    }

    /// Takes torn triangles out.
    pub(super) fn begin_step(&mut self, torn: &Torn) {
        let now = (torn.order().len(), torn.hash_seed());
        // Cuts since the last step are in no hash yet.
        if self.torn != now || !torn.new_tears().is_empty() {
            self.torn = now;
            self.surface.follow_tears(torn.order());
        }
    }

    pub(super) fn has_candidates(&self) -> bool {
        !self.ordered.is_empty()
    }

    /// Slots of the particles that the running substep may have pushed.
    pub(super) fn touched(&self) -> impl Iterator<Item = u32> + '_ {
        self.near.items.iter().flat_map(|contact| contact.slots)
    }

    /// Finds the candidates of strays, and orders all. Breaks if there are too many.
    pub(super) fn find(&mut self, search: &SurfaceSearch<'_>, workers: &mut Workers) -> Search {
        self.tiles.prepare(&self.surface, search, workers);
        self.near_tiles.iter_mut().for_each(NearTiles::clear);
        self.keep_candidates(search, workers);
        let Self { surface, tiles, load_pairs, rims, candidates, newest, .. } = self;
        let (points, near_tiles) = (&mut self.points, &mut self.near_tiles);
        let finding = Finding { surface, tiles, load_pairs, rims, search };
        let count_max = self.candidate_count_max;
        let mut adding = Adding { surface, load_pairs, search, candidates, newest, count_max };
        let found =
            if workers.count() > 1 && finding.gather(points, near_tiles, workers).is_continue() {
                points.items.iter().try_for_each(|point| adding.add(*point))
            } else {
                finding.find(&tiles.roots.pairs, &mut near_tiles[0], &mut |point| adding.add(point))
            };
        order_by_key(&self.candidates, &mut self.ordered, |candidate| candidate.key);
        found
    }

    /// Keeps the candidates whose particle is on its path. The search finds the others.
    ///
    /// The triangle is the one on the paths, as in the search: where the particle is now, it may be another one, which the
    /// search would not recognize. It is kept even if it has a stray: its point may be a corner that the search finds only
    /// at another triangle, one without strays.
    fn keep_candidates(&mut self, search: &SurfaceSearch<'_>, workers: &mut Workers) {
        let Self { surface, load_pairs, candidates, newest, ordered, kept, .. } = self;
        let (surface, load_pairs) = (&*surface, &*load_pairs);
        kept.items.clear();
        let part_length = workers.part_length(ordered.len(), TOUCH_MIN);
        kept.filter(workers, ordered.chunks(part_length), |ordered, kept| {
            let mut on_paths = ordered.iter().filter(|one| !search.tree.is_stray(one.slot));
            on_paths.try_for_each(|candidate| {
                let view = View { particles: search.states, slot: candidate.slot, time: 0.0 };
                let Found { triangle, nearest, .. } =
                    surface.descend(candidate.triangle, (view, load_pairs));
                kept.add((Candidate { triangle, ..*candidate }, nearest.feature))
            })
        });
        candidates.clear();
        newest.fill(None);
        for (candidate, feature) in &kept.items {
            let is_known = has_candidate(candidates, newest[candidate.slot as usize], |known| {
                surface.shares(candidate.triangle, *feature, known)
            });
            if !is_known {
                add_candidate(candidates, newest, *candidate);
            }
        }
    }

    /// Pushes particles and triangles apart that are nearer than `thickness` at the end of the substep.
    pub(super) fn push_apart(
        &mut self,
        states: &mut [PackedParticle],
        (thickness, reach): (f32, f32),
        friction: f32,
        workers: &mut Workers,
    ) {
        let Self { surface, load_pairs, ordered, near, .. } = self;
        near.items.clear();
        let touching = Touching { surface, load_pairs, states, thickness, reach };
        let kernels = workers.kernels;
        // Eight candidates at once, with any number of workers.
        let part_length = workers.part_length(ordered.len(), TOUCH_MIN).next_multiple_of(8);
        near.filter(workers, ordered.chunks_mut(part_length), |candidates, near| {
            kernels.run(TouchWork { touching, candidates, near })
        });
        for contact in &near.items {
            contact.push_apart(states, friction);
        }
    }
}

fn at_load(model: &Model, particle: u32) -> PackedParticle {
    let [x, y, z] = model.particles[particle as usize].position;
    PackedParticle([x, y, z, 1.0, 0.0, 0.0, 0.0, 0.0])
}

/// Finds the particles and triangles that are near each other at load.
fn near_at_load(
    model: &Model,
    surface: &Surface,
    tiles: &mut TriangleTiles,
    (search, thickness): (&SurfaceSearch<'_>, f32),
) -> LoadPairs {
    let SurfaceSearch { states, particles, distance, .. } = *search;
    let bodies = load::bodies(model);
    let body = |slot: u32| bodies[particles[slot as usize] as usize];
    let count_max = NEVER_PER_PARTICLE * particles.len();
    let (mut never, mut closer) = (Vec::new(), Vec::new());
    tiles.prepare(surface, search, &mut Workers::new(search.kernels, 1));
    let (roots, mut near_tiles) = (&tiles.roots.pairs, NearTiles::new());
    let start = (roots.as_slice(), &mut near_tiles);
    let all = (surface, search, Wanted::All);
    let found = tiles.search(start, all, &|_| AtLoad::default(), &mut |pair| {
        if never.len() + closer.len() == count_max {
            return Search::Break(());
        }
        let [slot, triangle] = pair;
        let corners = surface.place(triangle, View { particles: states, slot, time: 0.0 });
        let apart = Nearest::new(corners).mean(corners).length();
        let is_of_body = body(slot) == body(surface.corners[triangle as usize][0]);
        if (is_of_body && apart < distance) || apart == 0.0 {
            never.push(pair);
        } else if apart < thickness {
            closer.push((pair, apart));
        }
        Search::Continue(())
    });
    LoadPairs::from_pairs(never, closer, (particles.len(), found))
}

/// Returns, for each slot, the triangles that it may touch and that have an edge with one that it never touches.
fn rims(surface: &Surface, load_pairs: &LoadPairs, slot_count: usize) -> PairMasks {
    let pairs = load_pairs.never().flat_map(|[slot, triangle]| {
        let neighbors = (0..3).filter_map(move |edge| surface.neighbor(triangle, edge));
        let touched = neighbors.filter(move |one| !load_pairs.never_touch(slot, one.triangle));
        touched.map(move |one| [slot, one.triangle])
    });
    PairMasks::new(pairs.collect(), slot_count)
}

#[cfg(test)]
mod tests {
    //! Searches for strays against searches for all.
    use super::super::REACH;
    use super::super::tile::TILE;
    use super::samples::{Random, sheet};
    use super::*;

    const SIDE: u32 = 24;
    const SPACING: f32 = 0.02;
    /// Substeps of the paths, and those that have passed when some particles leave theirs.
    const SPAN: f32 = 8.0;
    const PASSED: f32 = 3.0;

    fn workers() -> Workers {
        Workers::new(Kernels::Reference, 1)
    }

    /// A particle at rest in a rolled sheet whose layers are 25 mm apart, in disorder.
    fn rolled(particle: u32, random: &mut Random) -> PackedParticle {
        let (column, row) = (particle % SIDE, particle / SIDE);
        let pitch = 0.025 / std::f32::consts::TAU;
        // The length of the spiral up to an angle is about pitch angle^2 / 2.
        let angle = (2.0 * SPACING * (column as f32 + 3.0) / pitch).sqrt();
        let mut at = |value: f32| value + 0.009 * random.number();
        let [x, y] = [angle.cos(), angle.sin()].map(|part| at(pitch * angle * part));
        let z = at(SPACING * row as f32);
        PackedParticle([x, y, z, 1.0, 0.0, 0.0, 0.0, 0.0])
    }

    fn search<'a>(
        tree: &'a TileTree,
        (states, particles): (&'a [PackedParticle], &'a [u32]),
        (begins_paths, passed, span): (bool, f32, f32),
    ) -> SurfaceSearch<'a> {
        let kernels = Kernels::Reference;
        let distance = 1.4 * SPACING;
        SurfaceSearch { tree, states, particles, begins_paths, passed, span, distance, kernels }
    }

    /// Returns the particles and triangles with a local minimum of the distance among the triangles that a particle
    /// may touch, at most REACH contact distances away.
    fn minima<'a>(
        contacts: &'a SurfaceContacts,
        states: &'a [PackedParticle],
    ) -> impl Iterator<Item = (u32, u32, Feature)> + 'a {
        let SurfaceContacts { surface, load_pairs, .. } = contacts;
        let pairs = (0..).zip(states).flat_map(|(slot, _)| {
            let triangles = (0..).zip(&surface.corners);
            triangles.map(move |(triangle, _)| (slot, triangle))
        });
        pairs.filter_map(move |(slot, triangle)| {
            let view = View { particles: states, slot, time: 0.0 };
            let corners = surface.place(triangle, view);
            let nearest = Nearest::new(corners);
            let is_near = nearest.mean(corners).length() < REACH * SPACING;
            let may_touch = is_near
                && !surface.has_corner(triangle, slot)
                && !load_pairs.never_touch(slot, triangle);
            let is_minimum =
                may_touch && surface.nearer(triangle, &nearest, (view, load_pairs)).is_none();
            is_minimum.then_some((slot, triangle, nearest.feature))
        })
    }

    #[test]
    fn a_search_finds_the_nearest_points_also_beside_triangles_that_never_touch() {
        let model = sheet(SIDE, SPACING);
        let particles = load::slots(&model);
        let kernels = Kernels::Reference;
        let mut workers = workers();
        let (mut found_count, mut on_rim_count, mut missed) = (0, 0, 0);
        for seed in 0..4 {
            let mut random = Random(seed);
            let states: Vec<_> = particles.iter().map(|one| rolled(*one, &mut random)).collect();
            let mut tree = TileTree::new(particles.len());
            tree.begin_paths(&states, kernels);
            tree.refit([0.0, SPAN], kernels);
            let room = 8 * particles.len();
            let mut contacts = SurfaceContacts::new(&model, &particles, (SPACING, kernels), room);
            let all = search(&tree, (&states, &particles), (true, 0.0, SPAN));
            assert!(contacts.find(&all, &mut workers).is_continue());
            for (slot, triangle, feature) in minima(&contacts, &states) {
                let newest = contacts.newest[slot as usize];
                let is_known = has_candidate(&contacts.candidates, newest, |known| {
                    contacts.surface.shares(triangle, feature, known)
                });
                let is_on_rim = contacts.rims.has(slot, triangle);
                on_rim_count += usize::from(is_on_rim && feature != Feature::Face);
                found_count += 1;
                missed += usize::from(!is_known);
            }
        }
        assert!(found_count > 1_000 && on_rim_count > 20, "{found_count}, {on_rim_count}");
        assert_eq!(missed, 0, "of {found_count}");
    }

    #[test]
    fn workers_find_the_candidates_of_one_worker_whatever_has_room() {
        let model = sheet(SIDE, SPACING);
        let particles = load::slots(&model);
        let kernels = Kernels::best();
        let mut random = Random(5);
        let states: Vec<_> = particles.iter().map(|one| rolled(*one, &mut random)).collect();
        let mut tree = TileTree::new(particles.len());
        tree.begin_paths(&states, kernels);
        tree.refit([0.0, SPAN], kernels);
        let mut all = search(&tree, (&states, &particles), (true, 0.0, SPAN));
        all.kernels = kernels;
        let find = |room: usize, worker_count: usize| {
            let mut workers = Workers::new(kernels, worker_count);
            let mut contacts = SurfaceContacts::new(&model, &particles, (SPACING, kernels), room);
            contacts.set_worker_count(worker_count);
            let end = contacts.find(&all, &mut workers);
            let found = contacts.candidates.iter().map(|one| (one.slot, one.triangle));
            (found.collect::<Vec<_>>(), end, contacts.points.items.len())
        };
        let (expected, _, _) = find(8 * particles.len(), 1);
        let (_, _, point_count) = find(8 * particles.len(), 2);
        assert!(expected.len() > 600 && point_count > expected.len() + 200, "{point_count}");
        // There is no room for some of the candidates, for the share of a worker, or for one of the points.
        for room in [512, expected.len() - 1, expected.len(), point_count - 1, point_count] {
            for worker_count in [1, 2, 3, 8] {
                let (found, end, _) = find(room, worker_count);
                let fitting = expected.len().min(room);
                assert!(found == expected[..fitting], "{worker_count} workers, {room}");
                assert_eq!(end.is_continue(), fitting == expected.len(), "{worker_count}, {room}");
            }
        }
    }

    #[test]
    fn a_search_for_strays_misses_no_point_that_a_full_one_finds() {
        let model = sheet(SIDE, SPACING);
        let particles = load::slots(&model);
        let kernels = Kernels::Reference;
        let new =
            || SurfaceContacts::new(&model, &particles, (SPACING, kernels), 8 * particles.len());
        let (mut found_count, mut missed) = (0, 0);
        let mut workers = workers();
        for seed in 0..100 {
            let mut random = Random(seed);
            let mut states: Vec<_> =
                particles.iter().map(|one| rolled(*one, &mut random)).collect();
            let mut tree = TileTree::new(particles.len());
            tree.begin_paths(&states, kernels);
            tree.refit([0.0, SPAN], kernels);
            let mut contacts = new();
            let all = search(&tree, (&states, &particles), (true, 0.0, SPAN));
            assert!(contacts.find(&all, &mut workers).is_continue());

            tree.place(PASSED, kernels, &mut states);
            tree.strays.fill(0);
            for (slot, state) in states.iter_mut().enumerate() {
                if random.number() < 0.9 {
                    continue;
                }
                tree.strays[slot / TILE] |= 1 << (slot % TILE);
                for axis in 0..3 {
                    state.0[axis] += 0.006 * random.number();
                    state.0[axis + 4] = 0.0005 * random.number();
                }
            }
            tree.follow_strays(&states, PASSED);
            tree.refit([PASSED, SPAN], kernels);
            let rest = SPAN - PASSED;
            let some = search(&tree, (&states, &particles), (false, PASSED, rest));
            assert!(contacts.find(&some, &mut workers).is_continue());

            let mut fresh_tree = TileTree::new(particles.len());
            fresh_tree.begin_paths(&states, kernels);
            fresh_tree.refit([0.0, rest], kernels);
            let mut fresh = new();
            let all = search(&fresh_tree, (&states, &particles), (true, 0.0, rest));
            assert!(fresh.find(&all, &mut workers).is_continue());

            for Candidate { slot, triangle, .. } in &fresh.candidates {
                let view = View { particles: &states, slot: *slot, time: 0.0 };
                let corners = fresh.surface.place(*triangle, view);
                let nearest = Nearest::new(corners);
                if nearest.mean(corners).length() > REACH * SPACING {
                    continue;
                }
                let newest = contacts.newest[*slot as usize];
                let is_known = has_candidate(&contacts.candidates, newest, |known| {
                    contacts.surface.shares(*triangle, nearest.feature, known)
                });
                found_count += 1;
                missed += usize::from(!is_known);
            }
        }
        assert!(found_count > 4_000, "{found_count}");
        assert_eq!(missed, 0, "of {found_count}");
    }
}
