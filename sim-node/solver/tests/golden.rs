//! The bits of this solver version against the stored ones. They may change only together with the
//! solver's version and a line in docs/formats-history.md. A recording of another version is refused, not
//! re-simulated.

use std::num::NonZero;

#[allow(dead_code, reason = "its main function is the example's")]
#[path = "../examples/state_hashes.rs"]
mod state_hashes;

const STORED: &str = include_str!("state_hashes.txt");

#[test]
fn every_scene_has_the_stored_hash_of_this_solver_version() {
    let found = state_hashes::lines(NonZero::<u32>::MIN).unwrap();
    assert_eq!(
        found, STORED,
        "\nthe arithmetic has changed: raise SOLVER_VERSION, say so in docs/formats-history.md, and store\n\
         cargo run --release -p sim-solver --example state_hashes > sim-node/solver/tests/state_hashes.txt"
    );
}
