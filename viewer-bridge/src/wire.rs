//! The binary messages, byte for byte as `PROTOCOL.md` describes them.
//!
//! All numbers are little-endian. Every array begins at a multiple of four bytes.

pub(crate) mod convert;
mod forces;
mod frame;
mod ghost;
mod header;
mod part;
mod past;
mod scene;
mod selected;
mod small;
mod statistics;
mod writer;

pub use forces::Forces;
pub use frame::{Bounds, Format, FrameHead, FrameLimits, encode as encode_frame, frame_flag};
pub use ghost::Ghost;
pub use header::{KIND_VERSION, Kind, Stamp};
pub use part::Part;
pub use past::Past;
pub use scene::{Scene, SceneText, ShapeText, scene_flag};
pub use selected::{Inspected, InspectedParticle, Speeds};
pub use small::{Colliders, FlaggedParticle, Pins, Tear};
pub use statistics::{Percentiles, Statistics, statistics_flag};
