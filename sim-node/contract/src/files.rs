//! Files that programs read and write.

pub(crate) mod kind;
mod mesh_format;
pub(crate) mod part_file;
pub(crate) mod place;
pub(crate) mod text_file;
