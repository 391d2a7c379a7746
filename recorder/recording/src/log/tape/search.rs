//! Finds the chunk of a step with few reads.

use super::chunk_reader::{ChunkReader, ChunkSpan};
use crate::log::read_error::ReadError;
use crate::log::topic::Topic;

/// The first and the last recorded step.
#[derive(Debug, Clone, Copy)]
pub(super) struct RecordedSteps {
    pub(super) first: u64,
    pub(super) last: u64,
}

/// A snapshot and the chunk that contains it.
#[derive(Debug, Clone, Copy)]
pub(super) struct SnapshotPosition {
    pub(super) chunk: usize,
    pub(super) step: u64,
}

/// The part of a list of chunks that may contain a step: the chunk at `low` starts at or before the
/// step, the chunk at `high` (if there is one) after it.
#[derive(Debug, Clone, Copy)]
struct Bracket {
    low: usize,
    low_step: u64,
    high: usize,
    high_step: u64,
}

/// The next chunk of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Guess {
    /// The position in a recording with evenly spaced steps.
    Interpolated,
    /// The middle, for recordings with unevenly spaced steps.
    Middle,
}

impl Bracket {
    /// Returns a position between both ends.
    fn guess(&self, step: u64, guess: Guess) -> usize {
        let width = self.high - self.low;
        let steps = u128::from(self.high_step.saturating_sub(self.low_step)).max(1);
        let offset = match guess {
            Guess::Middle => width / 2,
            Guess::Interpolated => {
                let passed = u128::from(step.saturating_sub(self.low_step));
                usize::try_from(width as u128 * passed / steps).unwrap_or(usize::MAX)
            }
        };
        self.low + offset.clamp(1, width - 1)
    }
}

/// Finds the snapshot of a step, or else the last one before it.
pub(super) fn find(
    reader: &mut ChunkReader,
    step: u64,
    range: RecordedSteps,
) -> Result<Option<SnapshotPosition>, ReadError> {
    let list = reader.chunks.with_topic(Topic::Particles).0;
    let mut bracket =
        Bracket { low: 0, low_step: range.first, high: list.len(), high_step: range.last };
    let mut guess = Guess::Interpolated;
    while bracket.high - bracket.low > 1 {
        let place = bracket.guess(step, guess);
        guess = match guess {
            Guess::Interpolated => Guess::Middle,
            Guess::Middle => Guess::Interpolated,
        };
        // Unreadable chunks have no steps. The next chunk with steps decides.
        match first_with_steps(reader, &list[place..bracket.high])? {
            Some((offset, span)) if span.first <= step => {
                (bracket.low, bracket.low_step) = (place + offset, span.first);
                if step <= span.last {
                    break;
                }
            }
            Some((_, span)) => (bracket.high, bracket.high_step) = (place, span.first),
            None => bracket.high = place,
        }
    }
    for chunk in list[..bracket.low.saturating_add(1).min(list.len())].iter().copied().rev() {
        let snapshot = reader.digest(chunk)?.snapshots.iter().rfind(|one| **one <= step).copied();
        if let Some(step) = snapshot {
            return Ok(Some(SnapshotPosition { chunk, step }));
        }
    }
    Ok(None)
}

/// Returns the first snapshots of the recording, and the step of the last one.
pub(super) fn first_and_last(
    reader: &mut ChunkReader,
) -> Result<Option<(Vec<u64>, u64)>, ReadError> {
    let list = reader.chunks.with_topic(Topic::Particles).0;
    let Some((place, _)) = first_with_steps(reader, &list)? else { return Ok(None) };
    let first = reader.digest(list[place])?.snapshots.clone();
    for chunk in list.iter().rev() {
        if let ChunkSpan::Steps { last, .. } = reader.span(*chunk)? {
            return Ok(Some((first, last)));
        }
    }
    Ok(None)
}

/// Returns the position and the steps of the first chunk with snapshots.
fn first_with_steps(
    reader: &mut ChunkReader,
    chunks: &[usize],
) -> Result<Option<(usize, RecordedSteps)>, ReadError> {
    for (place, chunk) in chunks.iter().enumerate() {
        if let ChunkSpan::Steps { first, last } = reader.span(*chunk)? {
            return Ok(Some((place, RecordedSteps { first, last })));
        }
    }
    Ok(None)
}
