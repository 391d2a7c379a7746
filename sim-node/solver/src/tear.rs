//! What is torn, why, and what tears in the running step.

use std::ops::Range;

use bytemuck::cast_slice;
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use crate::constraints::Constraints;
use crate::particles::Particles;
use crate::project::length_between;

/// Why a constraint tore.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum TearCause {
    /// Its force exceeded `tear_force`.
    Force = 0,
    /// Its length exceeded `tear_stretch` times its rest length.
    Stretch = 1,
    /// Its length exceeded its rest length by more than `tear_distance`.
    Distance = 2,
    /// A command cut it.
    Cut = 3,
}

/// What is torn since the load. Room for every constraint is made at the load, so that a step
/// which tears allocates nothing.
#[derive(Debug, Clone)]
pub(crate) struct Torn {
    /// By step, then by index.
    order: Vec<u32>,
    /// Entry by entry of `order`.
    causes: Vec<TearCause>,
    /// For the hash.
    ascending: Vec<u32>,
    /// How many at the end of `order` are new in the last step.
    new_count: usize,
    /// How many of `order` earlier steps have shown.
    shown_count: usize,
    /// 0 while nothing is torn, else the XXH3-64 of the ascending indices.
    hash_seed: u64,
    /// Constraints that tear at the end of the running step, with why.
    marked: Vec<(u32, TearCause)>,
    /// Slot by slot: whether it is among `marked`.
    is_marked: Vec<bool>,
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
            marked: Vec::with_capacity(constraint_count),
            is_marked: vec![false; constraint_count],
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

    /// Nothing is torn any more.
    pub(crate) fn clear(&mut self) {
        *self = Self::new(self.is_marked.len());
    }

    /// Takes over what a keyframe says.
    pub(crate) fn restore(&mut self, order: &[u32], causes: &[TearCause]) {
        self.clear();
        self.order.extend_from_slice(order);
        self.causes.extend_from_slice(causes);
        self.shown_count = order.len();
        self.sort_ascending();
    }

    /// Tears a constraint at the boundary before a step.
    pub(crate) fn cut(&mut self, constraints: &mut Constraints, index: u32) {
        constraints.tear(index);
        self.order.push(index);
        self.causes.push(TearCause::Cut);
    }

    /// Marks those of a group whose length, before their first projection of the substep, exceeds
    /// what they bear.
    pub(crate) fn mark_overstretched(
        &mut self,
        particles: &Particles,
        constraints: &Constraints,
        group: Range<usize>,
    ) {
        for slot in group {
            let tear_length = constraints.tear_lengths[slot];
            if tear_length.is_infinite() || self.is_marked[slot] {
                continue;
            }
            if length_between(particles, constraints.pairs[slot]) > tear_length {
                self.mark(constraints, slot, constraints.tear_causes[slot]);
            }
        }
    }

    /// Marks those whose force |lambda| / h^2 in this substep exceeds what they bear.
    pub(crate) fn mark_overloaded(&mut self, constraints: &Constraints) {
        let slots = constraints.multipliers.iter().zip(&constraints.tear_multipliers);
        for (slot, (multiplier, tear_multiplier)) in slots.enumerate() {
            if multiplier.abs() > *tear_multiplier && !self.is_marked[slot] {
                self.mark(constraints, slot, TearCause::Force);
            }
        }
    }

    fn mark(&mut self, constraints: &Constraints, slot: usize, cause: TearCause) {
        self.is_marked[slot] = true;
        self.marked.push((constraints.indices[slot], cause));
    }

    /// Tears what was marked during the step, by index. Whether anything is new in this step.
    pub(crate) fn end_step(&mut self, constraints: &mut Constraints) -> bool {
        for (index, cause) in &self.marked {
            constraints.tear(*index);
            self.order.push(*index);
            self.causes.push(*cause);
        }
        if !self.marked.is_empty() {
            self.is_marked.fill(false);
            self.marked.clear();
        }
        self.new_count = self.order.len() - self.shown_count;
        if self.new_count > 0 {
            self.sort_new();
            self.sort_ascending();
        }
        self.shown_count = self.order.len();
        self.new_count > 0
    }

    /// Those of one step stand by index, whatever tore them.
    fn sort_new(&mut self) {
        let (order, causes) =
            (&mut self.order[self.shown_count..], &mut self.causes[self.shown_count..]);
        // Both together, in place: the marked list is free by now.
        self.marked.extend(order.iter().copied().zip(causes.iter().copied()));
        self.marked.sort_unstable_by_key(|(index, _)| *index);
        for ((index, cause), (to_index, to_cause)) in
            self.marked.drain(..).zip(order.iter_mut().zip(causes))
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
