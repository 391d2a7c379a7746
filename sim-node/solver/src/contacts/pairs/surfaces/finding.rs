//! Finds the candidates of a step: the nearest points of the triangles that particles come near.

use super::super::box_tree::{NodePair, Search};
use super::super::gathered::{Gathered, parts};
use super::super::load::{LoadPairs, PairMasks};
use super::super::order::order_key;
use super::candidate::{Candidate, add_candidate, has_candidate};
use super::nearby::{NearPoint, NearbyWork};
use super::placed_tile::NearTiles;
use super::surface::Surface;
use super::triangle_tiles::{AtLoad, SurfaceSearch, TriangleTiles, Wanted};
use crate::store::workers::Workers;

/// Number of particles and triangles in reach that are examined together.
const IN_REACH_MAX: usize = 1024;

/// Finds the nearest points of particles and triangles that come near each other.
#[derive(Clone, Copy)]
pub(super) struct Finding<'a> {
    pub(super) surface: &'a Surface,
    pub(super) tiles: &'a TriangleTiles,
    pub(super) load_pairs: &'a LoadPairs,
    /// Slots and the triangles at an edge of one that they never touch.
    pub(super) rims: &'a PairMasks,
    pub(super) search: &'a SurfaceSearch<'a>,
}

impl Finding<'_> {
    /// Passes those below some roots of the search to `accept`.
    pub(super) fn find(
        self,
        roots: &[NodePair],
        near_tiles: &mut NearTiles,
        accept: &mut impl FnMut(NearPoint) -> Search,
    ) -> Search {
        let Self { surface, tiles, load_pairs, rims, search } = self;
        let mut find = |pairs: &[[u32; 2]]| {
            let accept = &mut *accept;
            search.kernels.run(NearbyWork { surface, load_pairs, search, pairs, accept })
        };
        let mut in_reach = [[0; 2]; IN_REACH_MAX];
        let mut count = 0;
        let at_load =
            |tiles| AtLoad { never: load_pairs.untouchable(tiles), rim: rims.of_tiles(tiles) };
        let add = &mut |pair| {
            in_reach[count] = pair;
            count += 1;
            if count < IN_REACH_MAX {
                return Search::Continue(());
            }
            count = 0;
            find(&in_reach)
        };
        tiles.search((roots, near_tiles), (surface, search, Wanted::Nearest), &at_load, add)?;
        find(&in_reach[..count])
    }

    /// Replaces `points` by those that several workers find. Breaks if there are too many.
    pub(super) fn gather(
        self,
        points: &mut Gathered<NearPoint>,
        near_tiles: &mut [NearTiles],
        workers: &mut Workers,
    ) -> Search {
        points.items.clear();
        let roots = parts(&self.tiles.roots.pairs, workers);
        points.extend(workers, roots, near_tiles, |roots, points, near_tiles| {
            self.find(roots, near_tiles, &mut |point| points.add(point))
        })
    }
}

/// Adds the candidates among nearest points.
pub(super) struct Adding<'a> {
    pub(super) surface: &'a Surface,
    pub(super) load_pairs: &'a LoadPairs,
    pub(super) search: &'a SurfaceSearch<'a>,
    pub(super) candidates: &'a mut Vec<Candidate>,
    /// By slot: the candidate that was found last.
    pub(super) newest: &'a mut [Option<u32>],
    pub(super) count_max: usize,
}

impl Adding<'_> {
    /// Adds a candidate, unless its point is known. Breaks if there are too many.
    pub(super) fn add(&mut self, NearPoint { slot, triangle, feature }: NearPoint) -> Search {
        let Self { surface, load_pairs, search, candidates, newest, count_max } = self;
        // Triangles that share the nearest point are one candidate.
        let is_known = has_candidate(candidates, newest[slot as usize], |known| {
            surface.shares(triangle, feature, known)
        });
        if is_known {
            return Search::Continue(());
        }
        if candidates.len() == *count_max {
            return Search::Break(());
        }
        let triangle = surface.first_sharing(triangle, feature, |one| {
            !surface.has_corner(one, slot) && !load_pairs.never_touch(slot, one)
        });
        let first = surface.corners[triangle as usize][0];
        let [a, b] = [slot, first].map(|slot| search.particles[slot as usize]);
        let key = order_key(a, b);
        add_candidate(candidates, newest, Candidate { slot, triangle, previous: None, key });
        Search::Continue(())
    }
}
