//! Tiles of triangles, to find those that particles come near.

use super::super::box_tree::{BoxTree, Search};
use super::super::tile::{TILE, TILE_LENGTH, take_lowest};
use super::super::tile_tree::TileTree;
use super::placed_tile::PlacedTile;
use super::surface::Surface;
use crate::contacts::bounds::Bounds;
use crate::kernels::Kernels;
use crate::kernels::lanes::{LaneWork, Lanes8, PackedParticle, Wide, axes};

/// Number of pairs of tiles that are examined together.
const TILE_PAIRS_MAX: usize = 4096;

/// The boxes of the triangles of a tile in the middle of the time. An empty box is near nothing.
#[derive(Debug, Clone, Copy)]
struct TriangleTile {
    /// By axis.
    min: [[Lanes8; TILE / 8]; 3],
    max: [[Lanes8; TILE / 8]; 3],
    /// Box of all triangles.
    bounds: Bounds,
    /// Box of the displacements of all corners.
    displacements: Bounds,
}

impl TriangleTile {
    const EMPTY: Self = Self {
        min: [[[f32::INFINITY; 8]; TILE / 8]; 3],
        max: [[[f32::NEG_INFINITY; 8]; TILE / 8]; 3],
        bounds: Bounds::EMPTY,
        displacements: Bounds::EMPTY,
    };

    /// Replaces the boxes by those of triangles after `time` displacements.
    fn refit(&mut self, triangles: &[[u32; 3]], states: &[PackedParticle], time: f32) {
        (self.bounds, self.displacements) = (Bounds::EMPTY, Bounds::EMPTY);
        for (lane, corners) in triangles.iter().enumerate() {
            let corners = corners.map(|slot| states[slot as usize].0);
            let position = |state: [f32; 8]| axes(|axis| state[axis] + time * state[axis + 4]);
            let bounds = Bounds::around(corners.map(position));
            for axis in 0..3 {
                self.min[axis][lane / 8][lane % 8] = bounds.min[axis];
                self.max[axis][lane / 8][lane % 8] = bounds.max[axis];
            }
            self.bounds = self.bounds.union(&bounds);
            let displacements = corners.map(|state| axes(|axis| state[axis + 4]));
            self.displacements = self.displacements.union(&Bounds::around(displacements));
        }
    }

    /// Box of all triangles from `time` displacements before to as many after.
    fn path_box(&self, time: f32) -> Bounds {
        let longest = self.displacements.distances_max(&Bounds::around([[0.0; 3]]));
        self.bounds.grown_by(axes(|axis| time * longest[axis]))
    }

    /// Returns a bit for each triangle whose box meets another box.
    #[inline(always)]
    fn lanes_near<W: Wide>(&self, bounds: &Bounds) -> u32 {
        let mut bits = 0;
        for group in 0..TILE / 8 {
            let x = self.meets_on_axis::<W>(0, group, bounds);
            let y = self.meets_on_axis::<W>(1, group, bounds);
            let z = self.meets_on_axis::<W>(2, group, bounds);
            bits |= W::bits(W::both(x, W::both(y, z))) << (8 * group);
        }
        bits
    }

    #[inline(always)]
    fn meets_on_axis<W: Wide>(&self, axis: usize, group: usize, bounds: &Bounds) -> W::Mask {
        let min = W::load(&self.min[axis][group], 0);
        W::both(
            min.is_at_most(W::splat(bounds.max[axis])),
            W::splat(bounds.min[axis]).is_at_most(W::load(&self.max[axis][group], 0)),
        )
    }
}

/// The tiles, and the boxes above them.
#[derive(Debug, Clone, Default)]
pub(super) struct TriangleTiles {
    tiles: Vec<TriangleTile>,
    boxes: BoxTree,
    /// Where the triangles of each tile are, if the running search has needed it.
    placed: Vec<PlacedTile>,
    /// Tiles of particles and of triangles that are near each other, to be examined.
    tile_pairs: Vec<[u32; 2]>,
}

impl TriangleTiles {
    pub(super) fn new(triangle_count: usize) -> Self {
        let tiles = vec![TriangleTile::EMPTY; triangle_count.div_ceil(TILE)];
        let boxes = BoxTree::new(tiles.len());
        let placed = vec![PlacedTile::default(); tiles.len()];
        Self { tiles, boxes, placed, tile_pairs: Vec::with_capacity(TILE_PAIRS_MAX) }
    }

    /// Replaces the boxes of all triangles by those of their paths.
    pub(super) fn refit(&mut self, surface: &Surface, search: &SurfaceSearch<'_>) {
        let Self { tiles, boxes, .. } = self;
        let half = 0.5 * search.span;
        boxes.refit(|leaves| {
            let triangles = surface.corners.chunks(TILE);
            for ((tile, leaf), triangles) in tiles.iter_mut().zip(leaves).zip(triangles) {
                tile.refit(triangles, search.states, half);
                *leaf = tile.path_box(half);
            }
        });
    }

    /// Passes every particle and triangle to `accept` whose boxes are nearer than a distance on each axis.
    pub(super) fn search(
        &mut self,
        search: &SurfaceSearch<'_>,
        accept: &mut impl FnMut([u32; 2]) -> Search,
    ) -> Search {
        self.examine_near(search, None, &|_| [0; TILE], accept)
    }

    /// Like [`Self::search`], but only where the nearest point of the triangle may be a local minimum of the
    /// distance. For a tile of particles and one of triangles, `except` has a bit for each triangle that a
    /// particle leaves out.
    pub(super) fn search_nearest(
        &mut self,
        search: &SurfaceSearch<'_>,
        surface: &Surface,
        except: &impl Fn([u32; 2]) -> [u16; TILE],
        accept: &mut impl FnMut([u32; 2]) -> Search,
    ) -> Search {
        self.placed.iter_mut().for_each(PlacedTile::clear);
        self.examine_near(search, Some(surface), except, accept)
    }

    fn examine_near(
        &mut self,
        search: &SurfaceSearch<'_>,
        surface: Option<&Surface>,
        except: &impl Fn([u32; 2]) -> [u16; TILE],
        accept: &mut impl FnMut([u32; 2]) -> Search,
    ) -> Search {
        let Self { tiles, boxes, placed, tile_pairs } = self;
        let mut examine = |pairs: &mut Vec<[u32; 2]>| {
            let (placed, accept) = (&mut *placed, &mut *accept);
            let work = SearchWork { tiles, placed, pairs, search, surface, except, accept };
            let found = search.kernels.run(work);
            pairs.clear();
            found
        };
        let mut found = search.tree.boxes.search_between(boxes, search.distance, &mut |pair| {
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

/// Particles that come near triangles.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct SurfaceSearch<'a> {
    /// Particles in the tiles of slots, refitted for the span.
    pub(in super::super) tree: &'a TileTree,
    /// By slot.
    pub(in super::super) states: &'a [PackedParticle],
    /// By slot: the particle.
    pub(in super::super) particles: &'a [u32],
    /// Number of displacements that a path has.
    pub(in super::super) span: f32,
    /// Particles and triangles that come nearer than this are found.
    pub(in super::super) distance: f32,
    pub(in super::super) kernels: Kernels,
}

/// Examines pairs of a tile of particles and a tile of triangles.
struct SearchWork<'a, E, F> {
    tiles: &'a [TriangleTile],
    placed: &'a mut [PlacedTile],
    pairs: &'a [[u32; 2]],
    search: &'a SurfaceSearch<'a>,
    /// If given, triangles whose nearest point is no local minimum are left out.
    surface: Option<&'a Surface>,
    except: &'a E,
    accept: &'a mut F,
}

impl<E: Fn([u32; 2]) -> [u16; TILE], F: FnMut([u32; 2]) -> Search> LaneWork
    for SearchWork<'_, E, F>
{
    type Output = Search;

    #[inline(always)]
    fn run<W: Wide>(self) -> Search {
        let Self { tiles, placed, pairs, search, surface, except, accept } = self;
        let SurfaceSearch { tree, states, span, distance, .. } = *search;
        let half = 0.5 * span;
        for &[left, right] in pairs {
            let (tile, triangles) = (&tree.tiles[left as usize], &tiles[right as usize]);
            // A particle and a triangle that meet at any time are at most this far apart in the middle of the time.
            let relative =
                tree.displacements[left as usize].distances_max(&triangles.displacements);
            let reach = axes(|axis| distance + half * relative[axis]);
            let mut lanes = tile.lanes_in_box::<W>(half, &triangles.bounds.grown_by(reach));
            if lanes == 0 {
                continue;
            }
            let left_out = except([left, right]);
            while let Some(lane) = take_lowest(&mut lanes) {
                let [start, motion] = tile.particle(lane as usize);
                let middle = axes(|axis| start[axis] + half * motion[axis]);
                let bounds = Bounds { min: middle, max: middle }.grown_by(reach);
                let mut near = triangles.lanes_near::<W>(&bounds);
                let slot = TILE_LENGTH * left + lane;
                near &= !u32::from(left_out[lane as usize]);
                if near != 0
                    && let Some(surface) = surface
                {
                    let placed = &mut placed[right as usize];
                    placed.place_if_clear(surface, TILE_LENGTH * right, states);
                    near = placed.lanes_nearest::<W>(near, start);
                }
                while let Some(other) = take_lowest(&mut near) {
                    accept([slot, TILE_LENGTH * right + other])?;
                }
            }
        }
        Search::Continue(())
    }
}
