//! The indices of particles in the scene and in the graph.

/// Index in the graph of a particle of the scene, where `indices` are the particles of the graph,
/// ascending. None for any other particle.
pub(crate) fn find_particle(indices: &[u32], particle: u32) -> Option<u32> {
    let place = indices.binary_search(&particle).ok()?;
    #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 particles")]
    Some(place as u32)
}
