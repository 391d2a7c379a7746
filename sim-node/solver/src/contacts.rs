//! Contacts of particles with each other and with colliders.

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
pub(crate) mod solid_box;
pub(crate) mod zone;
