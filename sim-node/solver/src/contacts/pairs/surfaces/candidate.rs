//! Particles that can touch layers of cloth.

/// A particle that can touch a layer of cloth within the step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub(super) slot: u32,
    /// The triangle at the nearest point in the last substep.
    pub(super) triangle: u32,
    /// The candidate of this particle that was found before.
    pub(super) previous: Option<u32>,
    pub(super) key: u8,
}

/// Adds a candidate, and links it to the one of its particle that was added before.
#[inline(always)]
pub(super) fn add_candidate(
    candidates: &mut Vec<Candidate>,
    newest: &mut [Option<u32>],
    candidate: Candidate,
) {
    #[allow(clippy::cast_possible_truncation, reason = "at most 8 for each particle")]
    let index = candidates.len() as u32;
    let previous = newest[candidate.slot as usize].replace(index);
    candidates.push(Candidate { previous, ..candidate });
}

/// True if a particle, whose newest candidate is given, has a candidate on a triangle that fulfils a condition.
pub(super) fn has_candidate(
    candidates: &[Candidate],
    newest: Option<u32>,
    condition: impl Fn(u32) -> bool,
) -> bool {
    let mut at = newest;
    while let Some(candidate) = at.map(|index| &candidates[index as usize]) {
        if condition(candidate.triangle) {
            return true;
        }
        at = candidate.previous;
    }
    false
}
