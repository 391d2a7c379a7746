//! A line of particles.

use serde::Serialize;

use super::{Builder, Pinned, between, decimal};
use crate::constraints::families::Family;
use sim_types::ConstraintKind;

/// A line of particles; constraint i joins particles i and i + 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rope {
    /// Particles, at least 2.
    pub count: u32,
    /// Position of the first.
    #[serde(with = "decimal::vector")]
    pub from: [f32; 3],
    /// Position of the last.
    #[serde(with = "decimal::vector")]
    pub to: [f32; 3],
}

/// The words for pinned particles of a line.
pub(crate) const PINS: [&str; 4] = ["first", "last", "both", "none"];

/// Whether one of `count` places in a line is pinned.
pub(super) fn is_end_pinned(pinned: &Pinned, place: u32, count: u32) -> bool {
    let (is_first, is_last) = (place == 0, place == count - 1);
    match pinned {
        Pinned::Word("first") => is_first,
        Pinned::Word("last") => is_last,
        Pinned::Word("both") => is_first || is_last,
        Pinned::Word(_) => false,
        Pinned::List(list) => list.binary_search(&place).is_ok(),
    }
}

impl Rope {
    pub(super) fn particle_count(&self) -> u64 {
        u64::from(self.count)
    }

    pub(super) fn constraint_count(&self) -> u64 {
        u64::from(self.count) - 1
    }

    pub(super) fn build(&self, builder: &mut Builder<'_>) {
        for index in 0..self.count {
            let share = f64::from(index) / f64::from(self.count - 1);
            let is_pinned = is_end_pinned(builder.pinned(), index, self.count);
            builder.particle(between(self.from, self.to, share), is_pinned);
        }
        builder.sheet(self.count, 1);
        for index in 0..self.count - 1 {
            let family = Family::Horizontal.group(0, index as usize);
            builder.family_link([index, index + 1], ConstraintKind::Structural, Some(family));
        }
    }
}
