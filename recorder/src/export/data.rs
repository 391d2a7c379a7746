//! Writes states as numbers and meshes for other programs.

mod colliders;
pub(crate) mod csv;
pub(crate) mod energy;
mod faces;
pub(crate) mod foxglove;
pub(crate) mod npz;
pub(crate) mod obj;
pub(crate) mod pc2;
mod polydata;
mod recording_copy;
pub(crate) mod ros2;
pub(crate) mod usda;
pub(crate) mod vtk;
pub(crate) mod written_files;
