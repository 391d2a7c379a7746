//! Tiles of triangles that a search comes to again and again.

use super::super::tile::TILE_LENGTH;
use super::placed_tile::PlacedTile;
use super::surface::Surface;
use super::triangle_tile::TriangleTile;
use crate::kernels::lanes::{PackedParticle, Wide};

/// Number of tiles that are remembered: more than lie around a tile of particles, and few enough to stay in a near cache.
const REMEMBERED: u32 = 64;

/// Memory of a worker for the tiles of a search.
#[derive(Debug, Clone, Default)]
pub(super) struct NearTiles {
    /// Tile n is at n modulo [`REMEMBERED`].
    tiles: Vec<NearTile>,
}

/// A tile that the running search has come to.
#[derive(Debug, Clone)]
struct NearTile {
    /// None if the search has not needed a tile with this place.
    index: Option<u32>,
    has_spheres: bool,
    is_placed: bool,
    spheres: TriangleTile,
    placed: PlacedTile,
}

impl NearTiles {
    /// Makes room for tiles.
    pub(super) fn new() -> Self {
        let none = NearTile {
            index: None,
            has_spheres: false,
            is_placed: false,
            spheres: TriangleTile::EMPTY,
            placed: PlacedTile::default(),
        };
        Self { tiles: vec![none; REMEMBERED as usize] }
    }

    /// Forgets all tiles.
    pub(super) fn clear(&mut self) {
        for tile in &mut self.tiles {
            tile.index = None;
        }
    }

    #[inline(always)]
    fn remember(&mut self, index: u32) -> &mut NearTile {
        let tile = &mut self.tiles[(index % REMEMBERED) as usize];
        if tile.index != Some(index) {
            (tile.has_spheres, tile.is_placed) = (false, false);
            tile.index = Some(index);
        }
        tile
    }

    /// The spheres of a tile of these triangles, in the middle of a span of twice `half` displacements.
    #[inline(always)]
    pub(super) fn spheres<W: Wide>(
        &mut self,
        (index, triangles): (u32, &[[u32; 3]]),
        states: &[PackedParticle],
        half: f32,
    ) -> &TriangleTile {
        let tile = self.remember(index);
        if !std::mem::replace(&mut tile.has_spheres, true) {
            // The last tile may not be full: nothing may be left of the tile before in this place.
            tile.spheres = TriangleTile::EMPTY;
            tile.spheres.refit::<W>(triangles, states, half);
        }
        &tile.spheres
    }

    /// The edges of a tile.
    #[inline(always)]
    pub(super) fn placed<W: Wide>(
        &mut self,
        index: u32,
        surface: &Surface,
        states: &[PackedParticle],
    ) -> &PlacedTile {
        let tile = self.remember(index);
        if !std::mem::replace(&mut tile.is_placed, true) {
            tile.placed.place::<W>(surface, TILE_LENGTH * index, states);
        }
        &tile.placed
    }
}

#[cfg(test)]
mod tests {
    use sim_scene::model::Model;

    use super::super::super::tile::TILE;
    use super::super::samples::{sheet, surface_of};
    use super::*;
    use crate::kernels::Kernels;
    use crate::kernels::lanes::LaneWork;

    /// Counts the triangles of a tile that are within 100 m.
    struct Count<'a>(&'a mut NearTiles, (u32, &'a [[u32; 3]]), &'a [PackedParticle]);

    impl LaneWork for Count<'_> {
        type Output = u32;

        #[inline(always)]
        fn run<W: Wide>(self) -> u32 {
            let Self(near_tiles, tile, states) = self;
            let spheres = near_tiles.spheres::<W>(tile, states, 0.0).grown::<W>(100.0);
            spheres.lanes_around([0.0; 3]).count_ones()
        }
    }

    fn states(model: &Model, particles: &[u32]) -> Vec<PackedParticle> {
        let state = |particle: &u32| {
            let [x, y, z] = model.particles[*particle as usize].position;
            PackedParticle([x, y, z, 1.0, 0.0, 0.0, 0.0, 0.0])
        };
        particles.iter().map(state).collect()
    }

    #[test]
    fn a_tile_that_is_not_full_holds_nothing_of_the_one_before_in_its_place() {
        let model = sheet(24, 0.5);
        let (surface, particles) = surface_of(&model);
        let states = states(&model, &particles);
        let last = u32::try_from(surface.corners.len() / TILE).unwrap();
        assert!(last >= REMEMBERED && surface.corners.len() % TILE == 2);
        for kernels in Kernels::available() {
            let mut near_tiles = NearTiles::new();
            for (tile, expected) in [(last % REMEMBERED, 16), (last, 2), (last - 1, 16)] {
                let triangles = surface.corners.chunks(TILE).nth(tile as usize).unwrap();
                let count = kernels.run(Count(&mut near_tiles, (tile, triangles), &states));
                assert_eq!(count, expected, "{kernels:?}, {tile}");
            }
        }
    }
}
