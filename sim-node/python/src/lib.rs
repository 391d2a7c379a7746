//! The native part of the Python module `catenary`.
//!
//! It wraps the client, the solver and the reader of recordings in Python classes. Particles stay where
//! they are: arrays are views of shared memory, or of the memory of a [`data::snapshot::Snapshot`]. Every call
//! that waits or computes lets other threads of the interpreter run, and a signal such as Ctrl-C ends it early.
#![deny(unsafe_code)]
#![allow(
    clippy::doc_markdown,
    clippy::needless_pass_by_value,
    clippy::unnecessary_wraps,
    reason = "texts for Python are not Markdown; PyO3 passes arguments by value and wants results of methods that may raise"
)]

mod arguments;
mod attach;
mod convert;
mod data;
mod error;
mod lockstep;
mod node;
mod patience;
mod picture;
mod process;
mod recording;
mod simulation;
mod verification;

/// Registers the classes. Their texts are those of `_catenary.pyi`; a test compares them.
#[pyo3::pymodule]
mod _catenary {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::data::action::Action;
    #[pymodule_export]
    use crate::data::forces::{AnchorForces, ColliderForces, Forces};
    #[pymodule_export]
    use crate::data::outcome::Outcome;
    #[pymodule_export]
    use crate::data::scene::{Bends, Topology, scene_names};
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

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        crate::process::watch_forks(module)
    }
}
