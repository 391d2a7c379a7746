//! The recording format: standard MCAP, written append-only and read as far as the file goes.
//!
//! A recording holds one run of a simulation or a part of it: the scene, every snapshot with its
//! bytes unchanged, a hash of each snapshot, every command with its outcome, and keyframes. From
//! these the run can be re-simulated and proved bit-identical.
//!
//! ```
//! use recording::{Closing, FrameReader, LogOptions, LogReader, LogWriter, Message};
//! use recording::{RunDescription, StepRow, Up};
//! use sim_messages::ParticleState;
//!
//! let run = RunDescription {
//!     run_id: 1,
//!     epoch_ns: 0,
//!     scene_name: "point".to_owned(),
//!     origin: [0.0; 3],
//!     up: Up::Y,
//!     rate_hz: 240,
//!     method: 0,
//!     particle_count: 1,
//!     constraint_count: 0,
//!     bend_count: 0,
//!     solver_version: 1,
//!     contract_version: 1,
//!     recorder_version: "0.1.0".to_owned(),
//! };
//! let mut log = LogWriter::create(Vec::new(), LogOptions::default(), &run, b"version = 1", 0)?;
//! let row = StepRow {
//!     step: 0,
//!     scene_step: 0,
//!     state_hash: 0,
//!     topology_revision: 0,
//!     torn_count: 0,
//!     outcome_count: 0,
//!     wake_late_ns: 0,
//!     solve_ns: 0,
//!     snapshot_index: 0,
//!     energy: None,
//! };
//! log.write(&Message::Step(row), 0)?;
//! log.write(&Message::Particles { step: 0, particles: vec![ParticleState::default()] }, 0)?;
//! let file: Vec<u8> = log.finish(&Closing::default())?;
//!
//! let mut frames = FrameReader::new(LogReader::new(file.as_slice())?);
//! let frame = frames.next_frame()?.expect("one snapshot");
//! assert_eq!((frame.row, frame.payload().len()), (row, 1));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`LogReader`] and [`FrameReader`] read a file from its start. [`Tape`] reads it at any step.
//! [`simulation`] writes the recording of a scene, and [`verification`] simulates a recording again and
//! compares every bit. No type of the mcap crate is part of this interface.
//!
//! # Features
//!
//! All features are on by default. Without them, the crate needs no C library and no operating system: it reads
//! recordings from memory (`LogReader::new` and `Tape::of_file`), and writes them to any [`std::io::Write`].
//!
//! - `files`: opens recordings in files, and writes them under a temporary name until they are complete.
//! - `pictures`: draws states as PNG and SVG.
//! - `zstd`: reads and writes compressed chunks with the C libraries of zstd and LZ4. Without this feature, the crate
//!   reads the same recordings with slower decompressors in Rust, and writes recordings without compression.
#![forbid(unsafe_code)]

mod complete_state;
mod counted;
#[cfg(feature = "files")]
mod intact_parts;
mod log;
#[cfg(feature = "pictures")]
pub mod pictures;
#[cfg(test)]
mod proof_tests;
mod scene_drawing;
mod scene_state;
pub mod simulation;
pub mod verification;

pub use complete_state::{
    CompleteState, CompleteStateError, FindStateError, StatePlace, Wanted, complete_state,
    find_state, state_at_place,
};
pub use counted::counted;
#[cfg(feature = "files")]
pub use intact_parts::{IntactParts, RepairedBytes, load_rows};
pub use log::*;
pub use scene_drawing::{DrawnMesh, SCENE_TOPIC, SceneDrawing};
pub use scene_state::{
    RecordedSceneError, SceneState, SceneStateError, SceneStates, recorded_scene, scene_to_simulate,
};
#[cfg(feature = "files")]
pub use sim_host::{Existing, PartFile, PartFileError};
pub use sim_solver::scene::Up;
