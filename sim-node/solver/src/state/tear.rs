//! Torn constraints, the causes of their tears, and the tears of the running step.

use bytemuck::cast_slice;
use sim_types::TearCause;
use xxhash_rust::xxh3::xxh3_64;

/// The torn constraints. It has room for every constraint, so that a tear does not
/// allocate.
#[derive(Debug, Clone)]
pub(crate) struct Torn {
    /// By step, then by index.
    order: Vec<u32>,
    /// Causes of the entries of `order`.
    causes: Vec<TearCause>,
    /// Torn constraints in ascending order, for the hash.
    ascending: Vec<u32>,
    /// Number of entries at the end of `order` that the last step added.
    new_count: usize,
    /// Number of entries of `order` that earlier steps published.
    shown_count: usize,
    /// 0 if nothing is torn, else the XXH3-64 of the ascending indices.
    hash_seed: u64,
    /// Scratch memory to sort new entries.
    sorted: Vec<(u32, TearCause)>,
    by_constraint: Vec<bool>,
}

impl Torn {
    pub(crate) fn new(constraint_count: usize) -> Self {
        Self {
            order: Vec::with_capacity(constraint_count),
            causes: Vec::with_capacity(constraint_count),
            ascending: Vec::with_capacity(constraint_count),
            new_count: 0,
            shown_count: 0,
            hash_seed: 0,
            sorted: Vec::with_capacity(constraint_count),
            by_constraint: vec![false; constraint_count],
        }
    }

    pub(crate) fn order(&self) -> &[u32] {
        &self.order
    }

    pub(crate) fn causes(&self) -> &[TearCause] {
        &self.causes
    }

    pub(crate) fn new_count(&self) -> usize {
        self.new_count
    }

    pub(crate) fn hash_seed(&self) -> u64 {
        self.hash_seed
    }

    /// Returns the hash seed at the end of this step.
    pub(crate) fn next_hash_seed(&self) -> u64 {
        if self.new_tears().is_empty() {
            return self.hash_seed;
        }
        let mut next = self.clone();
        next.end_step();
        next.hash_seed
    }

    /// Restores all constraints.
    pub(crate) fn clear(&mut self) {
        *self = Self::new(self.by_constraint.len());
    }

    /// Replaces the torn constraints by those of a keyframe.
    pub(crate) fn restore(&mut self, order: &[u32], causes: &[TearCause]) {
        self.clear();
        for (index, cause) in order.iter().zip(causes) {
            self.tear(*index, *cause);
        }
        self.shown_count = order.len();
        self.sort_ascending();
    }

    /// By constraint: true if it is torn.
    pub(crate) fn all(&self) -> &[bool] {
        &self.by_constraint
    }

    pub(crate) fn is_torn(&self, index: u32) -> bool {
        self.by_constraint[index as usize]
    }

    /// Tears a constraint, unless it is already torn.
    pub(crate) fn tear(&mut self, index: u32, cause: TearCause) {
        if !std::mem::replace(&mut self.by_constraint[index as usize], true) {
            self.order.push(index);
            self.causes.push(cause);
        }
    }

    /// Constraints torn since the last step.
    pub(crate) fn new_tears(&self) -> &[u32] {
        &self.order[self.shown_count..]
    }

    /// Ends a step. Returns true if it has new tears.
    pub(crate) fn end_step(&mut self) -> bool {
        self.new_count = self.order.len() - self.shown_count;
        if self.new_count > 0 {
            self.sort_new();
            self.sort_ascending();
        }
        self.shown_count = self.order.len();
        self.new_count > 0
    }

    /// Sorts the tears of a step by index, whatever their causes.
    fn sort_new(&mut self) {
        let (order, causes) =
            (&mut self.order[self.shown_count..], &mut self.causes[self.shown_count..]);
        self.sorted.extend(order.iter().copied().zip(causes.iter().copied()));
        self.sorted.sort_unstable_by_key(|(index, _)| *index);
        for ((index, cause), (to_index, to_cause)) in
            self.sorted.drain(..).zip(order.iter_mut().zip(causes))
        {
            (*to_index, *to_cause) = (index, cause);
        }
    }

    fn sort_ascending(&mut self) {
        self.ascending.clear();
        self.ascending.extend_from_slice(&self.order);
        self.ascending.sort_unstable();
        let bytes: &[u8] = cast_slice(&self.ascending);
        self.hash_seed = if bytes.is_empty() { 0 } else { xxh3_64(bytes) };
    }
}
