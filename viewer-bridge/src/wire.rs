//! The binary messages, byte for byte as `PROTOCOL.md` describes them.
//!
//! All numbers are little-endian. Every array begins at a multiple of four bytes.

mod frame;
mod lists;
mod part;
mod scene;
mod statistics;
mod writer;

pub use frame::{Bounds, Format, FrameHead, FrameLimits, encode as encode_frame, frame_flag};
pub use lists::{
    Colliders, FlaggedParticle, Forces, Ghost, Inspected, InspectedParticle, Past, Pins, Speeds,
    Tear,
};
pub use part::Part;
pub use scene::{Scene, SceneText, ShapeText, scene_flag};
pub use statistics::{Percentiles, Statistics, statistics_flag};
pub use writer::{KIND_VERSION, Kind, Stamp};
pub(crate) use writer::{count_u32, microseconds, to_f32};
