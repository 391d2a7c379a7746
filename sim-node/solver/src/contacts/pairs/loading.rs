//! Copies particles from the store.

use super::tile::{TILE, take_lowest};
use crate::kernels::lanes::PackedParticle;
use crate::store::workers::Workers;
use crate::store::{Location, StoredParticles};

/// Fewest particles that a worker loads.
const LOADED_MIN: usize = 512;

/// Loads the particles for which `wanted` has a bit, by tile.
pub(super) fn load_states(
    states: &mut [PackedParticle],
    wanted: &[u32],
    (workers, stored, locations): (&mut Workers, StoredParticles<'_>, &[Location]),
) {
    let tile_count = workers.part_length(wanted.len(), LOADED_MIN / TILE);
    let locations = locations.chunks(TILE * tile_count).zip(wanted.chunks(tile_count));
    let parts = states.chunks_mut(TILE * tile_count).zip(locations);
    workers.for_each(
        parts,
        |(states, (locations, wanted)), _| {
            for (tile, mut lanes) in wanted.iter().copied().enumerate() {
                while let Some(lane) = take_lowest(&mut lanes) {
                    let slot = TILE * tile + lane as usize;
                    states[slot] = stored.packed(locations[slot]);
                }
            }
        },
        |_| {},
    );
}
