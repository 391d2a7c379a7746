//! Which chunk a step is in, found with as few readings as can be.

use std::sync::Arc;

use super::{Digest, Tape};
use crate::index::ChunkEntry;
use crate::reader::ReadError;
use crate::topic::Topic;

/// The chunks of a file by what they have, and which steps are in those that were read.
#[derive(Debug)]
pub(super) struct Chunks {
    by_topic: Vec<ChunkList>,
    changes: ChunkList,
    /// First and last step of the snapshots in each chunk; `None` until it is read.
    spans: Vec<Option<Span>>,
}

/// The steps in a chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Span {
    Empty,
    Steps { first: u64, last: u64 },
}

/// Numbers of chunks, ascending.
#[derive(Debug, Clone)]
pub(super) struct ChunkList(Arc<[usize]>);

impl ChunkList {
    fn new(chunks: &[ChunkEntry], topics: &[Topic]) -> Self {
        let all = chunks.iter().enumerate();
        Self(all.filter(|(_, chunk)| chunk.has_any(topics)).map(|(number, _)| number).collect())
    }

    /// From a chunk on.
    pub(super) fn from(self, chunk: usize) -> impl Iterator<Item = usize> {
        let begin = self.0.partition_point(|one| *one < chunk);
        (begin..self.0.len()).map(move |place| self.0[place])
    }

    /// From a chunk back to the beginning.
    pub(super) fn back_from(self, chunk: usize) -> impl Iterator<Item = usize> {
        let end = self.0.partition_point(|one| *one <= chunk);
        (0..end).rev().map(move |place| self.0[place])
    }
}

impl Chunks {
    pub(super) fn new(chunks: &[ChunkEntry]) -> Self {
        Self {
            by_topic: Topic::ALL.iter().map(|topic| ChunkList::new(chunks, &[*topic])).collect(),
            changes: ChunkList::new(chunks, &[Topic::Tears, Topic::Outcomes]),
            spans: vec![None; chunks.len()],
        }
    }

    /// Those with messages of a topic.
    pub(super) fn of(&self, topic: Topic) -> ChunkList {
        self.by_topic[topic.index()].clone()
    }

    /// Those that may change what is torn.
    pub(super) fn of_changes(&self) -> ChunkList {
        self.changes.clone()
    }

    /// Whether a chunk was read.
    pub(super) fn is_known(&self, chunk: usize) -> bool {
        self.spans[chunk].is_some()
    }

    /// Remembers the steps of a chunk.
    pub(super) fn set_span(&mut self, chunk: usize, steps: &[u64]) {
        self.spans[chunk] = Some(match (steps.first(), steps.last()) {
            (Some(first), Some(last)) => Span::Steps { first: *first, last: *last },
            _ => Span::Empty,
        });
    }
}

/// Where in a list of chunks a step may be: the chunk at `low` begins at or before it, that at
/// `high`, if there is one, behind it.
#[derive(Debug, Clone, Copy)]
struct Range {
    low: usize,
    low_step: u64,
    high: usize,
    high_step: u64,
}

impl Range {
    /// A place between both ends: where the step would be in an even recording, and in every other
    /// try the middle, for one that is not.
    fn guess(&self, step: u64, is_middle: bool) -> usize {
        let width = self.high - self.low;
        let steps = u128::from(self.high_step.saturating_sub(self.low_step)).max(1);
        let offset = if is_middle {
            width / 2
        } else {
            let passed = u128::from(step.saturating_sub(self.low_step));
            usize::try_from(width as u128 * passed / steps).unwrap_or(usize::MAX)
        };
        self.low + offset.clamp(1, width - 1)
    }
}

impl Tape {
    /// The chunk with the snapshot of a step, or else of the last one before it, and the step of
    /// that. `None` if there is none.
    pub(super) fn find(&mut self, step: u64) -> Result<Option<(usize, u64)>, ReadError> {
        let list = self.chunks.of(Topic::Particles).0;
        let mut range = Range {
            low: 0,
            low_step: self.first_step,
            high: list.len(),
            high_step: self.last_step,
        };
        let mut is_middle = false;
        while range.high - range.low > 1 {
            let guess = range.guess(step, is_middle);
            is_middle = !is_middle;
            // Chunks that cannot be read have no steps: the next one that has decides.
            match self.steps_from(&list[guess..range.high])? {
                Some((offset, first, last)) if first <= step => {
                    (range.low, range.low_step) = (guess + offset, first);
                    if step <= last {
                        break;
                    }
                }
                Some((_, first, _)) => (range.high, range.high_step) = (guess, first),
                None => range.high = guess,
            }
        }
        for chunk in list[..range.low.saturating_add(1).min(list.len())].iter().rev() {
            let found = self.digest(*chunk)?.snapshots.iter().rfind(|one| **one <= step).copied();
            if let Some(found) = found {
                return Ok(Some((*chunk, found)));
            }
        }
        Ok(None)
    }

    /// The first of these chunks that has snapshots: its place, its first and its last step.
    fn steps_from(&mut self, chunks: &[usize]) -> Result<Option<(usize, u64, u64)>, ReadError> {
        for (place, chunk) in chunks.iter().enumerate() {
            if self.chunks.spans[*chunk].is_none() {
                self.digest(*chunk)?;
            }
            if let Some(Span::Steps { first, last }) = self.chunks.spans[*chunk] {
                return Ok(Some((place, first, last)));
            }
        }
        Ok(None)
    }

    /// The first snapshots from the beginning, and the step of the last one.
    pub(super) fn ends(&mut self) -> Result<Option<(Vec<u64>, u64)>, ReadError> {
        let list = self.chunks.of(Topic::Particles).0;
        let Some((place, ..)) = self.steps_from(&list)? else { return Ok(None) };
        let first: Vec<_> = self.digest(list[place])?.snapshots.clone();
        for chunk in list.iter().rev() {
            let last = |digest: &Digest| digest.snapshots.last().copied();
            if let Some(last) = last(self.digest(*chunk)?) {
                return Ok(Some((first, last)));
            }
        }
        Ok(None)
    }
}
