//! The segment in which iceoryx2 counts the nodes of a domain. Every process of the domain opens it
//! when it joins.

use std::fs::{self, Permissions};
use std::os::unix::fs::{MetadataExt, PermissionsExt};

use iceoryx2::prelude::Config;

use crate::ports::domain::files::segments;
use crate::ports::domain::root::RootError;

/// Checks that the counter of a named domain is this user's own, or does not exist yet.
///
/// The counter of iceoryx2's own domain stays open to all users: their other programs may share it under
/// a root of their own.
pub(crate) fn check(config: &Config) -> Result<(), RootError> {
    let user = rustix::process::geteuid().as_raw();
    for path in segments(config, &config.global.node.global_mgmt_suffix) {
        match fs::metadata(&path).map(|metadata| metadata.uid()) {
            Ok(owner) if owner != user => return Err(RootError::OtherOwner { path, owner, user }),
            _ => {}
        }
    }
    Ok(())
}

/// Takes the permission to write the counter from other users. iceoryx2 gives it to everybody, and
/// another user who truncates the segment ends every process that opens it.
pub(crate) fn narrow(config: &Config) {
    for path in segments(config, &config.global.node.global_mgmt_suffix) {
        // Without the permission to change it, it is not this user's segment.
        let _ = fs::set_permissions(&path, Permissions::from_mode(0o600));
    }
}
