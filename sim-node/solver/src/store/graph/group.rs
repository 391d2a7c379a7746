//! Constraint groups of the graph, and their division among workers.

use std::ops::Range;

/// A group of the order of projection, as far as it lies in the graph.
#[derive(Debug, Clone)]
pub(crate) struct ConstraintGroup {
    pub(crate) lane_groups: Range<usize>,
    /// Number of constraints. The rest of the last lane group is padding.
    pub(crate) count: usize,
    /// True if no two constraints share a particle.
    pub(crate) is_independent: bool,
}

/// Number of constraints or particles from which on two threads are faster than one.
const SHARED_MIN: usize = 4096;

/// Number of parts into which `count` constraints or particles are divided.
pub(crate) fn part_count(count: usize, workers: usize) -> usize {
    if count < SHARED_MIN { 1 } else { workers.min(count / (SHARED_MIN / 2)) }
}
