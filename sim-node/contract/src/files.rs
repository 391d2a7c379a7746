//! Files that programs read and write.

pub(crate) mod kind;
pub(crate) mod part_file;
pub(crate) mod place;
pub(crate) mod text_file;
