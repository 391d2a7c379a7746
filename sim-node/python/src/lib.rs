//! The native part of the Python module `catenary`.
//!
//! It wraps the client, the solver and the reader of recordings in Python classes. Particles stay where
//! they are: arrays are views of shared memory, or of the memory of a [`data::snapshot::Snapshot`]. Every call
//! that waits or computes lets other threads of the interpreter run. A signal ends the waits for snapshots and
//! outcomes and the steps of a simulation early; joining the lockstep and putting a state in place last for their
//! timeout at most.

mod arguments;
mod convert;
mod data;
mod error;
mod lockstep;
mod node;
mod patience;
mod process;
mod recording;
mod simulation;
mod verification;

/// Registers the classes. Their texts are those of `_catenary.pyi`; a test compares them.
#[pyo3::pymodule]
mod _catenary {
    #[pymodule_export]
    use crate::data::action::Action;
    #[pymodule_export]
    use crate::data::outcome::Outcome;
    #[pymodule_export]
    use crate::data::scene::{Topology, scene_names};
    #[pymodule_export]
    use crate::data::snapshot::Snapshot;
    #[pymodule_export]
    use crate::data::state::State;
    #[pymodule_export]
    use crate::lockstep::Lockstep;
    #[pymodule_export]
    use crate::node::Node;
    #[pymodule_export]
    use crate::recording::Recording;
    #[pymodule_export]
    use crate::simulation::Simulation;
    #[pymodule_export]
    use crate::verification::{Verification, verify};
}
