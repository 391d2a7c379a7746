//! Tiles of triangles, to find those that particles come near.

use super::super::box_tree::{BoxTree, Search};
use super::super::tile::{TILE, TILE_LENGTH, coordinates, lanes_in_box, take_lowest};
use super::super::tile_tree::TileTree;
use super::placed_tile::PlacedTile;
use super::surface::Surface;
use super::triangle_tile::TriangleTile;
use crate::contacts::bounds::Bounds;
use crate::kernels::Kernels;
use crate::kernels::lanes::{LaneWork, PackedParticle, Wide, axes};
use crate::kernels::vectors::dot;

/// A bit for each triangle of a tile.
const ALL_LANES: u32 = (1 << TILE_LENGTH) - 1;
/// Number of pairs of tiles that are examined together.
const TILE_PAIRS_MAX: usize = 4096;

/// The tiles, and the boxes above them.
#[derive(Debug, Clone, Default)]
pub(super) struct TriangleTiles {
    tiles: Vec<TriangleTile>,
    boxes: BoxTree,
    /// By tile: first entry in `particle_tiles`, and the end of the last one.
    starts: Vec<u32>,
    /// By tile: the tiles of the particles at its corners.
    particle_tiles: Vec<u32>,
    /// By tile: a particle at a corner is in a tile with strays.
    has_stray: Vec<bool>,
    /// Where the triangles of each tile are, if the running search has needed it.
    placed: Vec<PlacedTile>,
    /// Tiles of particles and of triangles that are near each other, to be examined.
    tile_pairs: Vec<[u32; 2]>,
}

impl TriangleTiles {
    pub(super) fn new(surface: &Surface) -> Self {
        let count = surface.corners.len().div_ceil(TILE);
        let mut tiles = Self {
            tiles: vec![TriangleTile::EMPTY; count],
            boxes: BoxTree::new(count),
            starts: Vec::with_capacity(count + 1),
            has_stray: vec![true; count],
            placed: vec![PlacedTile::default(); count],
            tile_pairs: Vec::with_capacity(TILE_PAIRS_MAX),
            ..Self::default()
        };
        tiles.enter_particle_tiles(surface);
        tiles
    }

    #[allow(clippy::cast_possible_truncation, reason = "at most 3 for each of 2^24 triangles")]
    fn enter_particle_tiles(&mut self, surface: &Surface) {
        for triangles in surface.corners.chunks(TILE) {
            self.starts.push(self.particle_tiles.len() as u32);
            let mut tiles: Vec<_> =
                triangles.iter().flatten().map(|slot| slot / TILE_LENGTH).collect();
            tiles.sort_unstable();
            tiles.dedup();
            self.particle_tiles.extend(tiles);
        }
        self.starts.push(self.particle_tiles.len() as u32);
    }

    /// True if a corner of the tile of a triangle may have left its path since the last search.
    pub(super) fn has_stray_near(&self, triangle: u32) -> bool {
        self.has_stray[(triangle / TILE_LENGTH) as usize]
    }

    /// Replaces the spheres and boxes of tiles with strays by those of their paths.
    pub(super) fn refit(&mut self, surface: &Surface, search: &SurfaceSearch<'_>) {
        self.mark(&search.tree.has_stray);
        let Self { tiles, boxes, has_stray, .. } = self;
        boxes.refit(|leaves| {
            search.kernels.run(RefitWork { tiles, leaves, has_stray, surface, search });
        });
    }

    /// Marks tiles at whose corners a tile of particles has strays.
    fn mark(&mut self, has_stray: &[bool]) {
        for (is_marked, range) in self.has_stray.iter_mut().zip(self.starts.windows(2)) {
            let particle_tiles = &self.particle_tiles[range[0] as usize..range[1] as usize];
            *is_marked = particle_tiles.iter().any(|tile| has_stray[*tile as usize]);
        }
        self.boxes.mark(&self.has_stray);
    }

    /// Passes every particle and triangle to `accept` that may come nearer than the distance of the search, if one of
    /// their tiles has strays. `except` has, for a tile of particles and one of triangles, a bit for each triangle
    /// that a particle leaves out.
    pub(super) fn search(
        &mut self,
        (surface, wanted): (&Surface, Wanted),
        search: &SurfaceSearch<'_>,
        except: &impl Fn([u32; 2]) -> [u16; TILE],
        accept: &mut impl FnMut([u32; 2]) -> Search,
    ) -> Search {
        let Self { tiles, boxes, placed, tile_pairs, .. } = self;
        placed.iter_mut().for_each(PlacedTile::clear);
        let mut examine = |pairs: &mut Vec<[u32; 2]>| {
            let (tiles, placed, accept) = (&mut *tiles, &mut *placed, &mut *accept);
            let work = SearchWork { tiles, placed, pairs, search, surface, wanted, except, accept };
            let found = search.kernels.run(work);
            pairs.clear();
            found
        };
        let conditions = (search.distance, search.kernels);
        let mut found = search.tree.boxes.search_between(boxes, conditions, &mut |pair| {
            tile_pairs.push(pair);
            let has_room = tile_pairs.len() < TILE_PAIRS_MAX;
            if has_room { Search::Continue(()) } else { examine(tile_pairs) }
        });
        if found.is_continue() {
            found = examine(tile_pairs);
        }
        tile_pairs.clear();
        found
    }
}

/// The triangles that a search passes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wanted {
    /// All triangles in reach.
    All,
    /// Only those whose nearest point may be a local minimum of the distance.
    Nearest,
}

/// Particles that come near triangles.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct SurfaceSearch<'a> {
    /// Particles in the tiles of slots, refitted for the span.
    pub(in super::super) tree: &'a TileTree,
    /// By slot: the state on the path, now.
    pub(in super::super) states: &'a [PackedParticle],
    /// By slot: the particle.
    pub(in super::super) particles: &'a [u32],
    /// Number of displacements from the beginning of the paths until now.
    pub(in super::super) passed: f32,
    /// Number of displacements that are left.
    pub(in super::super) span: f32,
    /// Particles and triangles that come nearer than this are found.
    pub(in super::super) distance: f32,
    pub(in super::super) kernels: Kernels,
}

/// Computes the spheres and boxes of tiles with strays.
struct RefitWork<'a> {
    tiles: &'a mut [TriangleTile],
    leaves: &'a mut [Bounds],
    has_stray: &'a [bool],
    surface: &'a Surface,
    search: &'a SurfaceSearch<'a>,
}

impl LaneWork for RefitWork<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Self { tiles, leaves, has_stray, surface, search } = self;
        let half = 0.5 * search.span;
        let leaves = leaves.iter_mut().zip(has_stray);
        let triangles = surface.corners.chunks(TILE);
        for ((tile, (leaf, has_stray)), triangles) in tiles.iter_mut().zip(leaves).zip(triangles) {
            // The boxes of the others still hold, because they were made for a longer time.
            tile.is_fitted = *has_stray;
            if *has_stray {
                tile.refit::<W>(triangles, search.states, half);
                *leaf = tile.path_box(half);
            }
        }
    }
}

/// Examines pairs of a tile of particles and a tile of triangles.
struct SearchWork<'a, E, F> {
    tiles: &'a mut [TriangleTile],
    placed: &'a mut [PlacedTile],
    pairs: &'a [[u32; 2]],
    search: &'a SurfaceSearch<'a>,
    surface: &'a Surface,
    wanted: Wanted,
    except: &'a E,
    accept: &'a mut F,
}

impl<E: Fn([u32; 2]) -> [u16; TILE], F: FnMut([u32; 2]) -> Search> LaneWork
    for SearchWork<'_, E, F>
{
    type Output = Search;

    #[inline(always)]
    fn run<W: Wide>(self) -> Search {
        let Self { tiles, placed, pairs, search, surface, wanted, except, accept } = self;
        let SurfaceSearch { tree, states, passed, span, distance, .. } = *search;
        let half = 0.5 * span;
        let middle_time = passed + half;
        for &[left, right] in pairs {
            let (tile, triangles) = (&tree.tiles[left as usize], &mut tiles[right as usize]);
            let first_triangle = TILE_LENGTH * right;
            if !triangles.is_fitted {
                triangles.refit::<W>(tile_of(surface, first_triangle), states, half);
            }
            // A particle and a triangle that meet at any time are at most this far apart in the middle of the time.
            let relative =
                tree.displacements[left as usize].distances_max(&triangles.displacements);
            let reach = axes(|axis| distance + half * relative[axis]);
            let middles = tile.positions::<W>(middle_time);
            let mut lanes = lanes_in_box(&middles, &triangles.bounds.grown_by(reach));
            if lanes == 0 {
                continue;
            }
            let left_out = except([left, right]);
            let spheres = triangles.grown::<W>(distance + half * dot(relative, relative).sqrt());
            let [x, y, z] = coordinates(&middles);
            while let Some(lane) = take_lowest(&mut lanes) {
                let (slot, lane) = (TILE_LENGTH * left + lane, lane as usize);
                let mut near = !u32::from(left_out[lane]) & ALL_LANES;
                if near != 0 {
                    near &= spheres.lanes_around([x[lane], y[lane], z[lane]]);
                }
                if near != 0 && wanted == Wanted::Nearest {
                    let placed = &mut placed[right as usize];
                    placed.place_if_clear::<W>(surface, first_triangle, states);
                    let PackedParticle([x, y, z, ..]) = states[slot as usize];
                    near = placed.lanes_nearest::<W>(near, [x, y, z]);
                }
                while let Some(other) = take_lowest(&mut near) {
                    accept([slot, first_triangle + other])?;
                }
            }
        }
        Search::Continue(())
    }
}

/// The triangles of a tile, of which the first one is given.
#[inline(always)]
fn tile_of(surface: &Surface, first: u32) -> &[[u32; 3]] {
    let first = first as usize;
    &surface.corners[first..surface.corners.len().min(first + TILE)]
}
