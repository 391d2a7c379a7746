//! Separation of domains: the prefix and the directory of iceoryx2's files.

pub(crate) mod files;
pub(crate) mod root;

use std::path::PathBuf;
use std::sync::Once;
use std::time::Duration;

use iceoryx2::prelude::{
    Config, FileName, LogLevel, Path, SemanticString, SemanticStringError,
    set_log_level_from_env_or,
};
use sim_messages::{MIRROR_BORROWED_MIN, MIRROR_BUFFERED_MIN, MIRROR_PORTS_MAX, PARTICIPANTS_MAX};

/// Longest directory and prefix together, in bytes. A listener binds the Unix socket
/// `<directory>/<prefix><id>.event`. Its path has at most 107 bytes, up to 39 of them for the id.
pub(crate) const DIRECTORY_AND_PREFIX_MAX: usize = 60;

/// Time that iceoryx2 waits for a service which another process is creating or removing. Both take
/// milliseconds.
pub(crate) const CREATION_TIMEOUT: Duration = Duration::from_millis(200);

/// Returns the iceoryx2 configuration of a domain; `None` is iceoryx2's own.
///
/// Each domain has its own prefix and its own directory: the prefix separates shared memory, the
/// directory separates nodes and services.
pub(crate) fn configuration(domain: Option<&str>) -> Result<Config, SemanticStringError> {
    static LOG_LEVEL: Once = Once::new();
    // Failures are returned as errors, so iceoryx2's own warnings would repeat them.
    LOG_LEVEL.call_once(|| set_log_level_from_env_or(LogLevel::Error));
    let Some(domain) = domain else {
        let mut config = Config::global_config().clone();
        adapt(&mut config);
        return Ok(config);
    };
    let mut config = Config::default();
    adapt(&mut config);
    config.global.prefix = FileName::new(prefix(domain).as_bytes())?;
    let directory = directory(domain);
    config.global.set_root_path(&Path::new(directory.as_os_str().as_encoded_bytes())?);
    Ok(config)
}

/// Sets what all domains have in common.
fn adapt(config: &mut Config) {
    let Config { global, .. } = config;
    global.creation_timeout = CREATION_TIMEOUT;
    // The session does it, in a way that does not hang.
    global.node.cleanup_dead_nodes_on_creation = false;
    global.node.cleanup_dead_nodes_on_destruction = false;
    global.service.cleanup_dead_nodes_on_open = false;
    adapt_mirrors(config);
}

/// Sets the quality of service of the mirrors that a tunnel creates, and of other services without one of
/// their own. Those of the contract have it.
fn adapt_mirrors(config: &mut Config) {
    let services = &mut config.defaults.publish_subscribe;
    services.max_publishers = MIRROR_PORTS_MAX;
    services.max_subscribers = MIRROR_PORTS_MAX;
    services.max_nodes = PARTICIPANTS_MAX;
    services.subscriber_max_buffer_size = MIRROR_BUFFERED_MIN;
    services.subscriber_max_borrowed_samples = MIRROR_BORROWED_MIN;
    services.publisher_history_size = 1;
    let events = &mut config.defaults.event;
    events.max_notifiers = MIRROR_PORTS_MAX;
    events.max_listeners = MIRROR_PORTS_MAX;
    events.max_nodes = PARTICIPANTS_MAX;
}

/// Returns the prefix of the domain's files in `/dev/shm`.
pub(crate) fn prefix(domain: &str) -> String {
    format!("{domain}_")
}

/// Returns the directory of the domain's other files. It belongs to this user alone, and is short
/// enough for a socket path.
pub(crate) fn directory(domain: &str) -> PathBuf {
    let user = rustix::process::getuid().as_raw();
    let readable = format!("/tmp/catenary-{user}-{domain}");
    if readable.len() + prefix(domain).len() <= DIRECTORY_AND_PREFIX_MAX {
        PathBuf::from(readable)
    } else {
        PathBuf::from(format!("/tmp/catenary-{user}-{:08x}", fnv1a(domain)))
    }
}

/// FNV-1a with 32 bits. Unlike the hash of the standard library, it is the same in every program
/// and version.
fn fnv1a(text: &str) -> u32 {
    text.bytes().fold(0x811c_9dc5, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directory_and_prefix_of_the_longest_domain_fit_a_socket_path() {
        let domain = "abcdefghijklmnopqrstuvwx";
        let length = directory(domain).as_os_str().len() + prefix(domain).len();
        assert!(length <= DIRECTORY_AND_PREFIX_MAX, "{length}");
        assert_ne!(directory(domain), directory("abcdefghijklmnopqrstuvwy"));
    }

    #[test]
    fn two_domains_share_neither_prefix_nor_directory() {
        let configurations = ["a", "b"].map(|domain| configuration(Some(domain)).unwrap().global);
        assert_ne!(configurations[0].prefix, configurations[1].prefix);
        assert_ne!(configurations[0].root_path(), configurations[1].root_path());
    }
}
