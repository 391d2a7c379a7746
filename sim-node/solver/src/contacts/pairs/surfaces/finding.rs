//! Finds the candidates of a step: the nearest points of the triangles that particles come near.

use super::super::box_tree::{NodePair, Search};
use super::super::gathered::Gathered;
use super::super::load::{LoadPairs, PairMasks};
use super::super::order::order_key;
use super::super::pair_batch::PairBatch;
use super::candidate::{Candidate, add_candidate, has_candidate};
use super::near_tiles::NearTiles;
use super::nearby::{NearPoint, NearbyWork};
use super::surface::Surface;
use super::triangle_tiles::{AtLoad, SurfaceSearch, TriangleTiles, Wanted};
use crate::store::workers::Workers;

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
    /// Passes the nearest points below some roots of the search to `accept`.
    pub(super) fn find(
        self,
        roots: &[NodePair],
        near_tiles: &mut NearTiles,
        accept: &mut impl FnMut(NearPoint) -> Search,
    ) -> Search {
        let Self { surface, tiles, load_pairs, rims, search } = self;
        let mut in_reach = PairBatch::new(|pairs| {
            let accept = &mut *accept;
            search.kernels.run(NearbyWork { surface, load_pairs, search, pairs, accept })
        });
        let at_load =
            |tiles| AtLoad { never: load_pairs.untouchable(tiles), rim: rims.of_tiles(tiles) };
        let (below, all) = ((roots, near_tiles), (surface, search, Wanted::Nearest));
        tiles.search(below, all, &at_load, &mut |pair| in_reach.add(pair))?;
        in_reach.finish()
    }

    /// Replaces `points` by those that several workers find. Breaks if there is no room for them.
    pub(super) fn gather(
        self,
        points: &mut Gathered<NearPoint>,
        near_tiles: &mut [NearTiles],
        workers: &mut Workers,
    ) -> Search {
        points.items.clear();
        let roots = &self.tiles.roots.pairs;
        let gathered =
            points.try_extend(workers, roots, near_tiles, |roots, points, near_tiles| {
                self.find(roots, near_tiles, &mut |point| points.add(point))
            });
        gathered.unwrap_or(Search::Break(()))
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
