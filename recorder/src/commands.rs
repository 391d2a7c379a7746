//! The subcommands, one file each; `recorder state` is a form of `recorder record`.

pub(crate) mod check;
pub(crate) mod diff;
pub(crate) mod export;
pub(crate) mod info;
pub(crate) mod play;
pub(crate) mod record;
pub(crate) mod repair;
pub(crate) mod restore;
pub(crate) mod scene;
pub(crate) mod simulate;
pub(crate) mod verify;
