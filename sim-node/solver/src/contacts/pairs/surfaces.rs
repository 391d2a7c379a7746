//! Contacts of particles with the triangles of cloths.
//!
//! A particle touches each layer of cloth at the point that is nearest to it: a local minimum of its distance from
//! the triangles. These points are found for the paths that the particles are about to take. In each substep they
//! move on across edges and around corners, so that a particle slides over the triangles without feeling them.

mod contact;
mod faces;
mod nearest;
mod placed_tile;
mod surface;
mod triangle_tile;
mod triangle_tiles;

use glam::Vec3;

use super::box_tree::Search;
use super::load::{self, LoadPairs};
use super::order::{order_by_key, order_key};
use super::tile::{TILE, TILE_LENGTH};
use super::tile_tree::TileTree;
use crate::kernels::Kernels;
use crate::kernels::lanes::{LaneWork, PackedParticle, Wide};
use crate::scene::model::Model;
use crate::state::tear::Torn;
use contact::SurfaceContact;
use faces::Faces;
use nearest::{Feature, Nearest};
use surface::{Found, Surface, View};
pub(super) use triangle_tiles::SurfaceSearch;
use triangle_tiles::{TriangleTiles, Wanted};

/// Largest number of triangles that a particle never touches, on average. Further ones touch it as all others.
const NEVER_PER_PARTICLE: usize = 128;

/// Finds and resolves the contacts of particles with triangles. Empty in other modes.
#[derive(Debug, Clone, Default)]
pub(super) struct SurfaceContacts {
    surface: Surface,
    tiles: TriangleTiles,
    /// Slots and triangles that are near each other at load.
    load_pairs: LoadPairs,
    candidate_count_max: usize,
    candidates: Vec<Candidate>,
    /// By slot: the candidate that was found last.
    newest: Vec<Option<u32>>,
    /// The candidates in the order of contact.
    ordered: Vec<Candidate>,
    /// The contacts of the running substep, in the order of contact.
    near: Vec<SurfaceContact>,
    /// Number of torn constraints and their hash, for which the torn triangles were looked up.
    torn: (usize, u64),
}

/// A particle that can touch a layer of cloth within the step.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    slot: u32,
    /// The triangle at the nearest point in the last substep.
    triangle: u32,
    /// The candidate of this particle that was found before.
    previous: Option<u32>,
    key: u8,
    /// True if the particle has come to a triangle that it never touches.
    never_touches: bool,
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
            passed: 0.0,
            span: 0.0,
            distance: load::CONNECTED_REACH * thickness,
            kernels,
        };
        let load_pairs = near_at_load(model, &surface, &mut tiles, (&search, thickness));
        Self {
            surface,
            tiles,
            load_pairs,
            candidate_count_max,
            newest: vec![None; particles.len()],
            candidates: Vec::with_capacity(candidate_count_max),
            ordered: Vec::with_capacity(candidate_count_max),
            near: Vec::with_capacity(candidate_count_max),
            torn: (0, 0),
        }
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
            self.surface.follow_tears(torn.all());
        }
    }

    pub(super) fn has_candidates(&self) -> bool {
        !self.ordered.is_empty()
    }

    /// Slots of the particles that the running substep may have pushed.
    pub(super) fn touched(&self) -> impl Iterator<Item = u32> + '_ {
        self.near.iter().flat_map(|contact| contact.slots)
    }

    /// Finds the candidates in tiles with strays, and orders all. Breaks if there are too many.
    pub(super) fn find(&mut self, search: &SurfaceSearch<'_>) -> Search {
        self.tiles.refit(&self.surface, search);
        self.keep_candidates(search);
        let Self { surface, tiles, load_pairs, candidates, newest, .. } = self;
        let (particles, count_max) = (search.particles, self.candidate_count_max);
        let mut accept = |[slot, triangle]: [u32; 2]| {
            let Some(feature) = near_feature(surface, search, [slot, triangle]) else {
                return Search::Continue(());
            };
            // Triangles that share the nearest point are one candidate.
            let is_known = has_candidate(candidates, newest[slot as usize], |known| {
                !known.never_touches && surface.shares(triangle, feature, known.triangle)
            });
            if is_known {
                return Search::Continue(());
            }
            let triangle = surface.first_sharing(triangle, feature, |one| {
                !surface.has_corner(one, slot) && !load_pairs.never_touch(slot, one)
            });
            if candidates.len() == count_max {
                return Search::Break(());
            }
            let first = surface.corners[triangle as usize][0];
            let key = order_key(particles[slot as usize], particles[first as usize]);
            let candidate = Candidate { slot, triangle, previous: None, key, never_touches: false };
            enter(candidates, newest, candidate);
            Search::Continue(())
        };
        let except = |tiles| load_pairs.untouchable(tiles);
        let wanted = Wanted::Nearest;
        let found = tiles.search((surface, wanted), search, &except, &mut accept);
        order_by_key(&self.candidates, &mut self.ordered, |candidate| candidate.key);
        found
    }

    /// Keeps the candidates whose particle and triangle are in tiles without strays. The search finds the others.
    ///
    /// The triangle is the one on the paths, as in the search: where the particle is now, it may be another one, and so
    /// in a tile that the search leaves out, or finds again.
    fn keep_candidates(&mut self, search: &SurfaceSearch<'_>) {
        let Self { surface, tiles, load_pairs, candidates, newest, ordered, .. } = self;
        candidates.clear();
        newest.fill(None);
        for candidate in ordered.iter() {
            let slot = candidate.slot;
            if search.tree.has_stray[(slot / TILE_LENGTH) as usize] {
                continue;
            }
            let view = View { particles: search.states, slot, time: 0.0 };
            let Found { triangle, nearest, .. } = surface.descend(candidate.triangle, view);
            let is_known = has_candidate(candidates, newest[slot as usize], |known| {
                !known.never_touches && surface.shares(triangle, nearest.feature, known.triangle)
            });
            if !is_known && !tiles.has_stray_near(triangle) {
                let never_touches = load_pairs.never_touch(slot, triangle);
                let kept = Candidate { triangle, never_touches, ..*candidate };
                enter(candidates, newest, kept);
            }
        }
    }

    /// Pushes particles and triangles apart that are nearer than `thickness` at the end of the substep.
    pub(super) fn push_apart(
        &mut self,
        states: &mut [PackedParticle],
        (thickness, reach): (f32, f32),
        (friction, kernels): (f32, Kernels),
    ) {
        let Self { surface, load_pairs, ordered, near, .. } = self;
        near.clear();
        let touching = Touching { surface, load_pairs, states, thickness, reach };
        kernels.run(TouchWork { touching, candidates: ordered, near });
        for contact in &*near {
            contact.push_apart(states, friction);
        }
    }
}

/// Finds the candidates that are near at the end of the substep, and moves them on to the nearest triangles.
struct TouchWork<'a> {
    touching: Touching<'a>,
    candidates: &'a mut [Candidate],
    near: &'a mut Vec<SurfaceContact>,
}

impl LaneWork for TouchWork<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Self { touching, candidates, near } = self;
        let mut faces = Faces::default();
        let (groups, rest) = candidates.as_chunks_mut::<8>();
        for group in groups {
            let (mut slots, mut triangles) = ([0; 8], [0; 8]);
            for (lane, candidate) in group.iter().enumerate() {
                (slots[lane], triangles[lane]) = (candidate.slot, candidate.triangle);
            }
            faces.find::<W>(touching.surface, touching.states, (slots, triangles));
            for (lane, candidate) in group.iter_mut().enumerate() {
                near.extend(if faces.lanes & (1 << lane) != 0 {
                    touching.on_face(candidate, &faces, lane)
                } else {
                    touching.anywhere(candidate)
                });
            }
        }
        near.extend(rest.iter_mut().filter_map(|candidate| touching.anywhere(candidate)));
    }
}

/// The conditions under which candidates touch.
struct Touching<'a> {
    surface: &'a Surface,
    load_pairs: &'a LoadPairs,
    states: &'a [PackedParticle],
    /// Contact distance of all that are not near at load.
    thickness: f32,
    /// Candidates within this number of contact distances touch.
    reach: f32,
}

impl Touching<'_> {
    /// Returns the contact of a candidate whose nearest point is on the face of its triangle.
    #[inline(always)]
    fn on_face(&self, candidate: &Candidate, faces: &Faces, lane: usize) -> Option<SurfaceContact> {
        let (weights, normal) = faces.lane(lane);
        let found = (Vec3::from_array(normal), faces.heights[lane]);
        self.contact(candidate, weights, found)
    }

    /// Moves a candidate on to the nearest triangle, and returns its contact.
    #[inline(never)]
    fn anywhere(&self, candidate: &mut Candidate) -> Option<SurfaceContact> {
        let Candidate { slot, triangle, .. } = *candidate;
        let view = View { particles: self.states, slot, time: 1.0 };
        let found = self.surface.descend(triangle, view);
        if found.triangle != triangle {
            candidate.triangle = found.triangle;
            candidate.never_touches = self.load_pairs.never_touch(slot, found.triangle);
        }
        self.contact(candidate, found.nearest.weights, separation(self.surface, &found, view))
    }

    #[inline(always)]
    fn contact(
        &self,
        candidate: &Candidate,
        weights: [f32; 3],
        (normal, height): (Vec3, f32),
    ) -> Option<SurfaceContact> {
        let Candidate { slot, triangle, never_touches, .. } = *candidate;
        let distance = self.load_pairs.distance([slot, triangle], self.thickness);
        // False for NaN.
        let is_near = height < self.reach * distance && !never_touches;
        let [a, b, c] = self.surface.corners[triangle as usize];
        let slots = [slot, a, b, c];
        is_near.then_some(SurfaceContact { slots, weights, normal, distance })
    }
}

/// Returns the direction from the nearest point to the side on which the path of the viewer starts, and its distance
/// along it. NaN if the particle is on the point.
#[inline(always)]
fn separation(surface: &Surface, found: &Found, view: View<'_>) -> (Vec3, f32) {
    let Found { triangle, ref nearest, corners } = *found;
    let apart = -nearest.mean(corners);
    let direction = if nearest.feature == Feature::Face {
        let before = surface.place(triangle, View { time: 0.0, ..view });
        let is_below = across(before).dot(-nearest.mean(before)) < 0.0;
        if is_below { -across(corners) } else { across(corners) }
    } else {
        apart
    };
    let normal = direction / direction.dot(direction).sqrt();
    (normal, normal.dot(apart))
}

/// A vector across a triangle.
#[inline(always)]
fn across([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a)
}

/// Adds a candidate, and links it to the one of its particle that was added before.
#[inline(always)]
fn enter(candidates: &mut Vec<Candidate>, newest: &mut [Option<u32>], candidate: Candidate) {
    #[allow(clippy::cast_possible_truncation, reason = "at most 8 for each particle")]
    let index = candidates.len() as u32;
    let previous = newest[candidate.slot as usize].replace(index);
    candidates.push(Candidate { previous, ..candidate });
}

/// True if one of the candidates of a particle, of which the newest is given, fulfils a condition.
fn has_candidate(
    candidates: &[Candidate],
    newest: Option<u32>,
    condition: impl Fn(&Candidate) -> bool,
) -> bool {
    let mut at = newest;
    while let Some(candidate) = at.map(|index| &candidates[index as usize]) {
        if condition(candidate) {
            return true;
        }
        at = candidate.previous;
    }
    false
}

/// Returns the part of a triangle with the nearest point, if that is a local minimum of the distance and comes near
/// the particle.
#[inline(always)]
fn near_feature(
    surface: &Surface,
    search: &SurfaceSearch<'_>,
    [slot, triangle]: [u32; 2],
) -> Option<Feature> {
    let SurfaceSearch { states, span, distance, .. } = *search;
    let view = View { particles: states, slot, time: 0.0 };
    let corners = surface.place(triangle, view);
    let nearest = Nearest::new(corners);
    let is_separate = surface.is_whole(triangle) && !surface.has_corner(triangle, slot);
    if !is_separate || surface.nearer(triangle, &nearest, view).is_some() {
        return None;
    }
    let later = surface.place(triangle, View { time: span, ..view });
    let apart = -nearest.mean(corners);
    let length = apart.dot(apart).sqrt();
    // The distance along the direction in which they are apart now.
    let at_end = apart.dot(-nearest.mean(later)) / length;
    let least = if at_end < length { at_end } else { length };
    let is_free = states[slot as usize].0[3] > 0.0
        || surface.corners[triangle as usize].iter().any(|one| states[*one as usize].0[3] > 0.0);
    (is_free && least < distance).then_some(nearest.feature)
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
    tiles.refit(surface, search);
    let _is_complete = tiles.search((surface, Wanted::All), search, &|_| [0; TILE], &mut |pair| {
        let [slot, triangle] = pair;
        let corners = surface.place(triangle, View { particles: states, slot, time: 0.0 });
        let apart = Nearest::new(corners).mean(corners).length();
        let is_of_body = body(slot) == body(surface.corners[triangle as usize][0]);
        if (is_of_body && apart < distance) || apart == 0.0 {
            never.push(pair);
        } else if apart < thickness {
            closer.push((pair, apart));
        }
        let is_full = never.len() + closer.len() >= count_max;
        if is_full { Search::Break(()) } else { Search::Continue(()) }
    });
    LoadPairs::from_pairs(never, closer, particles.len())
}
