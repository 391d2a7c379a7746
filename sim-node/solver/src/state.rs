//! The state of a scene between two steps: particles, torn constraints, keyframes and the hash.

pub(crate) mod blocks;
pub(crate) mod energy;
pub(crate) mod forces;
pub(crate) mod hash;
pub(crate) mod keyframe;
pub(crate) mod particles;
pub(crate) mod restore;
pub(crate) mod tear;
