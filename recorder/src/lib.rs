//! The format of a recording: standard MCAP, written append-only and read as far as it goes.
//!
//! A recording is one run of a simulation, or a part of it: the scene, every snapshot with its
//! bytes unchanged, a hash of each, every command with its outcome, and keyframes. From these it
//! can be simulated again and proved bit-identical.
//!
//! ```
//! use recorder::{Closing, FrameReader, LogOptions, LogReader, LogWriter, Message};
//! use recorder::{RunDescription, StepRow};
//! use sim_contract::ParticleState;
//!
//! let run = RunDescription {
//!     run_id: 1,
//!     epoch_ns: 0,
//!     scene_name: "point".to_owned(),
//!     origin: [0.0; 3],
//!     rate_hz: 240,
//!     method: 0,
//!     particle_count: 1,
//!     constraint_count: 0,
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
//! };
//! log.write(&Message::Step(row), 0)?;
//! log.write(&Message::Particles { step: 0, particles: vec![ParticleState::default()] }, 0)?;
//! let file: Vec<u8> = log.finish(&Closing::default())?;
//!
//! let mut frames = FrameReader::new(LogReader::new(file.as_slice())?);
//! let frame = frames.next_frame()?.expect("one snapshot");
//! assert_eq!((frame.row, frame.particles.len()), (row, 1));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`LogReader`] and [`FrameReader`] read a file from its start, [`Tape`] at any step. mcap's own types
//! stay inside.
#![forbid(unsafe_code)]

mod collider_rows;
mod descriptor;
mod encoding;
mod frames;
mod index;
mod keyframe_tears;
mod message;
mod part_file;
mod protobuf;
mod reader;
mod records;
mod rows;
mod run;
mod state_hash;
mod tape;
mod tears;
mod topic;
mod writer;

pub use collider_rows::{ColliderRow, CollidersRow, ShapeRow};
pub use encoding::{MessageEncoder, TopicFormat, TopicSchema};
pub use frames::{Frame, FrameReader};
pub use index::{ChunkEntry, IndexedLog};
pub use keyframe_tears::KeyframeTears;
pub use message::Message;
pub use part_file::{Existing, PartFile, PartFileError};
pub use protobuf::{WORLD_FRAME, encode_transform};
pub use reader::{LogReader, Logged, ReadError};
pub use records::LogEnd;
pub use rows::{
    EventRow, OutcomeRow, Softness, StatusRow, StepRow, SurfaceRow, TearsRow, TopologyRow,
};
pub use run::{Closing, FORMAT_VERSION, RunDescription};
pub use state_hash::state_hash;
pub use tape::{Tape, TapeError, TapeState};
pub use tears::{Torn, TornFollower};
pub use topic::{AllCounts, Topic, TopicCounts};
pub use writer::{Compression, LogOptions, LogWriter, WriteError};
