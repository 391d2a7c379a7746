//! The limits of a scene, for the reader of scenes and for the services that publish them.

/// Most particles, and most constraints, of a scene: indices below 2^24 are exact in f32.
pub const ELEMENTS_MAX: u32 = 1 << 24;
/// Most colliders of a scene: each substep tests every free particle against every collider.
pub const COLLIDERS_MAX: usize = 1 << 16;
/// Most work of a step: substeps x (constraints x iterations + particles x (colliders + 1)), as
/// projections of constraints, motions of particles and tests against colliders. One core needs some
/// seconds for it. A cloth of a million particles with 6 million constraints and 20 substeps needs about
/// an eighth of it. Beyond it, a single `set` could stop a node for minutes.
pub const STEP_WORK_MAX: u64 = 1 << 30;
/// Longest time of a motion, in seconds.
pub const OVER_S_MAX: f32 = 3600.0;
/// Most points of all motions of a scene that are on their way. A keyframe has room for as many.
pub const MOTION_POINTS_MAX: usize = 2048;
/// End of the ids of clients: ids are below 2^53, so that every reader of JSON has them exactly.
pub const CLIENT_ID_END: u64 = 1 << 53;
/// Longest text of a scene, in bytes: as a file, and with every default and mesh written out.
pub const SCENE_SIZE_BYTES_MAX: usize = 16 << 20;
