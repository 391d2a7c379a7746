//! The chunks of a file by topic, and the steps in the chunks that have been read.

use std::sync::Arc;

use crate::log::index::ChunkEntry;
use crate::log::topic::Topic;

/// The chunks of a file by topic, and the steps in the chunks that have been read.
#[derive(Debug)]
pub(super) struct Chunks {
    by_topic: Vec<ChunkList>,
    tears: ChunkList,
    /// Steps of the snapshots in each chunk. `None` until the chunk is read.
    spans: Vec<Option<Span>>,
}

/// The steps of the snapshots in a chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Span {
    Empty,
    Steps { first: u64, last: u64 },
}

/// Chunk numbers, ascending.
#[derive(Debug, Clone)]
pub(super) struct ChunkList(pub(super) Arc<[usize]>);

impl ChunkList {
    fn new(chunks: &[ChunkEntry], topics: &[Topic]) -> Self {
        let all = chunks.iter().enumerate();
        Self(all.filter(|(_, chunk)| chunk.has_any(topics)).map(|(number, _)| number).collect())
    }

    /// Returns the chunks from `chunk` to the end.
    pub(super) fn forward_from(self, chunk: usize) -> impl Iterator<Item = usize> {
        let begin = self.0.partition_point(|one| *one < chunk);
        (begin..self.0.len()).map(move |place| self.0[place])
    }

    /// Returns the chunks from `chunk` back to the start.
    pub(super) fn backward_from(self, chunk: usize) -> impl Iterator<Item = usize> {
        let end = self.0.partition_point(|one| *one <= chunk);
        (0..end).rev().map(move |place| self.0[place])
    }
}

impl Chunks {
    pub(super) fn new(chunks: &[ChunkEntry]) -> Self {
        Self {
            by_topic: Topic::ALL.iter().map(|topic| ChunkList::new(chunks, &[*topic])).collect(),
            tears: ChunkList::new(chunks, &[Topic::Tears, Topic::Outcomes]),
            spans: vec![None; chunks.len()],
        }
    }

    /// Returns the chunks with messages on a topic.
    pub(super) fn with_topic(&self, topic: Topic) -> ChunkList {
        self.by_topic[topic.index()].clone()
    }

    /// Returns the chunks with tears or resets.
    pub(super) fn with_tear_changes(&self) -> ChunkList {
        self.tears.clone()
    }

    /// Returns the steps in a chunk, or `None` if it has not been read.
    pub(super) fn span(&self, chunk: usize) -> Option<Span> {
        self.spans[chunk]
    }

    /// Stores the steps in a chunk.
    pub(super) fn set_span(&mut self, chunk: usize, steps: &[u64]) {
        self.spans[chunk] = Some(match (steps.first(), steps.last()) {
            (Some(first), Some(last)) => Span::Steps { first: *first, last: *last },
            _ => Span::Empty,
        });
    }
}
