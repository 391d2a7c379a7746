//! The recording format, from the bytes of a message to the state at any step, and files of commands in
//! the form of its outcomes.

mod command_file;
mod compression;
mod container;
pub(crate) mod encoding;
mod index;
#[cfg(feature = "files")]
mod input_file;
mod message;
mod read;
mod read_error;
mod rows;
mod run;
mod scanner;
mod source;
mod state;
mod tape;
mod tears;
mod topic;
mod writer;

pub use command_file::{CommandFileError, TimedCommand, parse_commands, sort_commands};
pub use compression::Compression;
pub use container::check::check_file;
pub use container::finding::{
    AfterEnd, CheckExtent, CheckReport, Cure, Finding, Findings, RepairReport,
};
pub use container::losses::{Losses, LostSteps};
pub use container::lost_load::{LoadRows, LostLoad};
pub use container::repair::{RepairError, repair_file};
pub use encoding::{
    MAP_FRAME, MessageEncoder, ParticleBuffer, TopicFormat, TopicSchema, WORLD_FRAME,
    encode_transform, map_from_world, scene_format,
};
pub use index::{ChunkEntry, IndexedLog};
#[cfg(feature = "files")]
pub use input_file::{open_recording, open_regular_file};
pub use message::{Backlog, Message};
pub use read::decode::LoggedMessage;
pub use read::frames::{Frame, FrameReader};
pub use read::gaps::GapCounter;
pub use read::reader::LogReader;
pub use read_error::{LogEnd, ReadError};
pub use rows::{
    AnchorForceRow, BendColumns, ColliderBodyRow, ColliderDetails, ColliderForceRow, ColliderRow,
    CollidersRow, EnergyRow, EventRow, ForcesRow, MeshFile, OutcomeRow, ParametersRow,
    SceneColliders, ShapeRow, Softness, StatusRow, StepRow, SurfaceRow, TearsRow, TopologyRow,
    bend_state, constraint_state,
};
pub use run::selection::ContentSelection;
pub use run::{CLOSING_METADATA, Closing, FORMAT_VERSION, RunDescription, SCENE_ATTACHMENT};
pub use source::{FileSource, ReadAt};
pub use state::RecordedState;
pub use tape::{Tape, TapeError};
pub use tears::{HashSeeds, state_hash};
pub use topic::{AllCounts, Topic, TopicCounts};
#[cfg(feature = "files")]
pub(crate) use writer::replace_run_id;
pub use writer::{LogOptions, LogWriter, WriteError};
