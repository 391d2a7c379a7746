//! Tiles of triangles, to find those that particles come near.

use super::super::box_tree::{Between, BoxTree, NodePair, PairSearch, Search, SearchRoots};
use super::super::load::LaneMasks;
use super::super::pair_batch::PairBatch;
use super::super::tile::{
    TILE, TILE_LENGTH, coordinates, lanes_in_box, mark_all, members, take_lowest,
};
use super::super::tile_tree::TileTree;
use super::near_tiles::NearTiles;
use super::placed_tile::Moving;
use super::surface::Surface;
use super::triangle_tile::TriangleTile;
use crate::contacts::bounds::Bounds;
use crate::kernels::Kernels;
use crate::kernels::lanes::{LaneWork, PackedParticle, Wide, axes};
use crate::kernels::vectors::dot;
use crate::store::workers::Workers;

/// A bit for each triangle of a tile.
const ALL_LANES: u32 = (1 << TILE_LENGTH) - 1;
/// Fewest tiles that a worker refits.
const REFIT_MIN: usize = 64;

/// The tiles, and the boxes above them.
#[derive(Debug, Clone, Default)]
pub(super) struct TriangleTiles {
    /// Those with strays are fitted to the running search.
    tiles: Vec<TriangleTile>,
    boxes: BoxTree,
    /// By tile: a bit for each whole triangle with a stray at a corner. All triangles have one if all paths begin.
    strays: Vec<u16>,
    /// Where the running search begins.
    pub(super) roots: SearchRoots,
}

impl TriangleTiles {
    pub(super) fn new(surface: &Surface) -> Self {
        let count = surface.corners.len().div_ceil(TILE);
        Self {
            tiles: vec![TriangleTile::EMPTY; count],
            boxes: BoxTree::new(count),
            strays: vec![0; count],
            roots: SearchRoots::default(),
        }
    }

    /// Replaces the spheres and boxes of tiles with strays by those of their paths, and finds where the search begins.
    pub(super) fn prepare(
        &mut self,
        surface: &Surface,
        search: &SurfaceSearch<'_>,
        workers: &mut Workers,
    ) {
        self.mark_strays(surface, search);
        let Self { tiles, boxes, strays, roots } = self;
        boxes.mark(strays.iter().map(|lanes| *lanes != 0));
        boxes.refit(|leaves| {
            let kernels = workers.kernels;
            let length = workers.part_length(leaves.len(), REFIT_MIN);
            let tiles = tiles.chunks_mut(length).zip(leaves.chunks_mut(length));
            let triangles = surface.corners.chunks(TILE * length).zip(strays.chunks(length));
            workers.for_each(
                tiles.zip(triangles),
                |((tiles, leaves), (triangles, strays)), _| {
                    kernels.run(RefitWork { tiles, leaves, strays, triangles, search });
                },
                |_| {},
            );
        });
        roots.find(Between([&search.tree.boxes, boxes]), search.distance, workers.kernels);
    }

    /// Marks the triangles with strays at their corners.
    fn mark_strays(&mut self, surface: &Surface, search: &SurfaceSearch<'_>) {
        if search.begins_paths {
            return mark_all(&mut self.strays, surface.corners.len());
        }
        self.strays.fill(0);
        for slot in members(&search.tree.strays) {
            for triangle in surface.fan(slot) {
                self.strays[(triangle / TILE_LENGTH) as usize] |= 1 << (triangle % TILE_LENGTH);
            }
        }
    }

    /// Passes every particle and triangle below some of the roots to `accept` that may come nearer than the distance of the
    /// search, if there is a stray among the particle and the corners of the triangle. `at_load` tells, for a tile of
    /// particles and one of triangles, which were near each other at load.
    pub(super) fn search(
        &self,
        (roots, near_tiles): (&[NodePair], &mut NearTiles),
        (surface, search, wanted): (&Surface, &SurfaceSearch<'_>, Wanted),
        at_load: &impl Fn([u32; 2]) -> AtLoad,
        accept: &mut impl FnMut([u32; 2]) -> Search,
    ) -> Search {
        let Self { tiles, boxes, strays, .. } = self;
        let (distance, kernels) = (search.distance, search.kernels);
        let mut tile_pairs = PairBatch::new(|pairs| {
            let (near_tiles, accept) = (&mut *near_tiles, &mut *accept);
            kernels.run(SearchWork {
                tiles,
                strays,
                near_tiles,
                pairs,
                search,
                surface,
                wanted,
                at_load,
                accept,
            })
        });
        let nesting = Between([&search.tree.boxes, boxes]);
        let accept = &mut |pair| tile_pairs.add(pair);
        kernels.run(PairSearch { nesting, roots, distance, accept })?;
        tile_pairs.finish()
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

/// Bits of the triangles of a tile, for each particle of another one.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct AtLoad {
    /// The triangles that a particle leaves out.
    pub(super) never: LaneMasks,
    /// Their neighbours, with points that can be nearest although a triangle that is left out is nearer.
    pub(super) rim: LaneMasks,
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
    /// True if all paths begin now, so that all particles are strays.
    pub(in super::super) begins_paths: bool,
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
    strays: &'a [u16],
    triangles: &'a [[u32; 3]],
    search: &'a SurfaceSearch<'a>,
}

impl LaneWork for RefitWork<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Self { tiles, leaves, strays, triangles, search } = self;
        let half = 0.5 * search.span;
        let leaves = leaves.iter_mut().zip(strays);
        let triangles = triangles.chunks(TILE);
        for ((tile, (leaf, strays)), triangles) in tiles.iter_mut().zip(leaves).zip(triangles) {
            // The boxes of the others still hold, because they were made for a longer time.
            if *strays != 0 {
                tile.refit::<W>(triangles, search.states, half);
                *leaf = tile.path_box(half);
            }
        }
    }
}

/// Examines pairs of a tile of particles and a tile of triangles.
struct SearchWork<'a, A, F> {
    tiles: &'a [TriangleTile],
    strays: &'a [u16],
    near_tiles: &'a mut NearTiles,
    pairs: &'a [[u32; 2]],
    search: &'a SurfaceSearch<'a>,
    surface: &'a Surface,
    wanted: Wanted,
    at_load: &'a A,
    accept: &'a mut F,
}

impl<A: Fn([u32; 2]) -> AtLoad, F: FnMut([u32; 2]) -> Search> LaneWork for SearchWork<'_, A, F> {
    type Output = Search;

    #[inline(always)]
    fn run<W: Wide>(self) -> Search {
        let Self { tiles, strays, near_tiles, pairs, search, surface, wanted, at_load, accept } =
            self;
        let SurfaceSearch { tree, states, passed, span, distance, .. } = *search;
        let half = 0.5 * span;
        let middle_time = passed + half;
        for &[left, right] in pairs {
            let first_triangle = TILE_LENGTH * right;
            let [stray_lanes, stray_triangles] =
                [tree.strays[left as usize], strays[right as usize]].map(u32::from);
            let tile = &tree.tiles[left as usize];
            let triangles = if stray_triangles == 0 {
                let triangles = (right, tile_of(surface, first_triangle));
                near_tiles.spheres::<W>(triangles, states, half)
            } else {
                &tiles[right as usize]
            };
            // A particle and a triangle that meet at any time are at most this far apart in the middle of the time.
            let relative =
                tree.displacements[left as usize].distances_max(&triangles.displacements);
            let reach = axes(|axis| distance + half * relative[axis]);
            let middles = tile.positions::<W>(middle_time);
            let mut lanes = lanes_in_box(&middles, &triangles.bounds.grown_by(reach));
            if stray_triangles == 0 {
                lanes &= stray_lanes;
            }
            if lanes == 0 {
                continue;
            }
            let AtLoad { never, rim } = at_load([left, right]);
            let spheres = triangles.grown::<W>(distance + half * dot(relative, relative).sqrt());
            let [x, y, z] = coordinates(&middles);
            while let Some(lane) = take_lowest(&mut lanes) {
                let is_stray = stray_lanes & (1 << lane) != 0;
                let (slot, lane) = (TILE_LENGTH * left + lane, lane as usize);
                let wanted_lanes = if is_stray { ALL_LANES } else { stray_triangles };
                let mut near = !u32::from(never[lane]) & wanted_lanes;
                if near != 0 {
                    near &= spheres.lanes_around([x[lane], y[lane], z[lane]]);
                }
                if near != 0 && wanted == Wanted::Nearest {
                    let placed = near_tiles.placed::<W>(right, surface, states);
                    let PackedParticle([x, y, z, _, dx, dy, dz, _]) = states[slot as usize];
                    let position = [x, y, z];
                    let moving = Moving { position, displacement: [dx, dy, dz] };
                    let on_rim = near & u32::from(rim[lane]);
                    near = placed.lanes_with_edges_near::<W>(on_rim, moving, (distance, span))
                        | placed.lanes_nearest::<W>(near, position);
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
