//! The whole of a file, record by record and with the position of each: for checks and repairs.
//!
//! [`super::read`] reads a recording up to its first damage. This module goes on behind the damage.

pub(super) mod check;
mod content;
pub(super) mod finding;
mod head;
pub(super) mod losses;
pub(super) mod lost_load;
mod places;
pub(super) mod repair;
mod repair_writer;
