//! Contacts of particles with each other and with colliders.

pub(crate) mod bodies;
mod bounds;
pub(crate) mod colliders;
pub(crate) mod contact;
pub(crate) mod contact_substep;
pub(crate) mod hit;
pub(crate) mod mesh;
pub(crate) mod obstacle;
pub(crate) mod pairs;
pub(crate) mod path;
pub(crate) mod placed_frame;
pub(crate) mod placed_shape;
pub(crate) mod solid;
pub(crate) mod zone;
