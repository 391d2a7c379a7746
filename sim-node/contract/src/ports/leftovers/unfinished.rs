//! Files of iceoryx2 that their process was killed in the middle of creating. iceoryx2 waits for them
//! to be finished, and never removes them.

use std::collections::BTreeSet;
use std::fs::{self, DirEntry, Metadata};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use iceoryx2::node::NodeView;
use iceoryx2::prelude::{
    CallbackProgression, Config, Node, NodeState, ServiceName, ipc_threadsafe,
};
use iceoryx2::service::service_hash::ServiceHash;
use iceoryx2::service::{Service, ServiceDetails};
use sim_host::clock::{self, Deadline};

use crate::ports::domain::files::{entries, segment, segments};
use crate::ports::domain::root;
use crate::ports::service::{SERVICES, ServiceSpec};

/// Permissions of a static configuration while it is written; afterwards nobody may write it.
const STATIC_UNFINISHED_MODE: u32 = 0o600;
/// Permission that a segment of shared memory, or the context of a node, receives once it is complete.
const READABLE: u32 = 0o400;
/// Time after which the creator of an unfinished file counts as dead. Creation takes microseconds,
/// or milliseconds where files are written to a disk.
const CREATION_MAX: Duration = Duration::from_secs(2);
/// The same for a node, whose creation includes the cleanup after other nodes.
const NODE_CREATION_MAX: Duration = Duration::from_secs(10);
/// Time that a segment which counts nodes stays unfinished at most, unless its creator is dead. If
/// that creator is only slow, two counters exist for a while, and ids of nodes still differ in their
/// process and time.
const COUNTER_CREATION_MAX: Duration = Duration::from_millis(20);
/// Pause between two looks at an unfinished file.
const PAUSE_NS: u64 = clock::SECOND_NS / 500;

/// Removes unfinished segments that would keep a new process from joining the domain. Waits for those
/// that another process may be about to finish.
pub(crate) fn remove_segments(config: &Config) {
    for path in segments(config, &config.global.node.global_mgmt_suffix) {
        wait_or_remove(&path, COUNTER_CREATION_MAX);
    }
    for path in segments(config, &config.global.service.dynamic_config_storage_suffix) {
        wait_or_remove(&path, CREATION_MAX);
    }
}

/// Removes connections of two ports that are unfinished because a process was killed. A connection of
/// a dead process is of no use, even if the living one is about to finish it.
pub(crate) fn remove_connections(config: &Config) {
    let suffix = config.global.service.connection_suffix;
    for path in segments(config, &suffix) {
        let is_unfinished = fs::metadata(&path).is_ok_and(|file| is_unfinished_segment(&file));
        if is_unfinished {
            let is_useless = ports(&path).any(|port| !is_alive(process(port)));
            wait_or_remove(&path, if is_useless { Duration::ZERO } else { CREATION_MAX });
        }
    }
}

/// Removes the segments of listeners that a process was killed in the middle of creating: iceoryx2 only
/// removes those of the listeners that a service lists. Call it after iceoryx2's cleanup, which removes
/// the tags of dead ports.
pub(crate) fn remove_listeners(config: &Config) {
    let suffix = listener_suffix(config);
    for path in segments(config, &suffix) {
        if ports(&path).any(|port| is_dead_port(config, port)) {
            remove(&path);
        }
    }
}

/// Returns `true` if the process of a port is dead, and no node names the port as its own.
pub(crate) fn is_dead_port(config: &Config, port: u128) -> bool {
    !is_alive(process(port)) && !has_tag(config, port)
}

/// Returns the unfinished segments whose creator must be dead, because they are old.
pub(crate) fn old_segments(config: &Config) -> Vec<PathBuf> {
    let Config { global, .. } = config;
    let service = &global.service;
    let all = segments(config, &global.node.global_mgmt_suffix)
        .chain(segments(config, &service.dynamic_config_storage_suffix))
        .chain(segments(config, &service.connection_suffix));
    let is_old =
        |file: &Metadata| is_unfinished_segment(file) && clock::age(file) > NODE_CREATION_MAX;
    all.filter(|path| fs::metadata(path).is_ok_and(|file| is_old(&file))).collect()
}

/// Calls `each` with the services of the domain, unless one of them is unfinished: iceoryx2 waits for its
/// creator without a limit, even for a dead one. An error ends the list.
pub(crate) fn list_services(
    config: &Config,
    each: impl FnMut(ServiceDetails<ipc_threadsafe::Service>) -> CallbackProgression,
) {
    let mut segments = segments(config, &config.global.service.dynamic_config_storage_suffix);
    let is_unfinished =
        |path: PathBuf| fs::metadata(path).is_ok_and(|file| is_unfinished_segment(&file));
    if !segments.any(is_unfinished) {
        let _ = ipc_threadsafe::Service::list(config, each);
    }
}

/// Returns the ending of the segment in which a listener counts its events.
pub(crate) fn listener_suffix(config: &Config) -> String {
    format!("{}_mgmt", config.global.service.event_connection_suffix)
}

/// Returns `true` if a node names a port as its own, from before its creation until after its removal.
/// The node may belong to a process in a container, whose id means nothing here.
fn has_tag(config: &Config, port: u128) -> bool {
    let Config { global, .. } = config;
    let tag = format!("{}{port}{}", global.prefix, global.node.port_tag_suffix);
    entries(&root::to_std(&global.node_dir())).any(|node| node.path().join(&tag).exists())
}

/// Returns the ids of the ports in the name of a segment, which ends in `_<port><suffix>`, or for a
/// connection in `_<port>_<port><suffix>`.
pub(crate) fn ports(path: &Path) -> impl Iterator<Item = u128> {
    let name = path.file_stem().and_then(|name| name.to_str()).unwrap_or_default();
    name.rsplit('_').take(2).filter_map(|port| port.parse().ok())
}

/// Returns the id of the process in the id of a port: seconds, nanoseconds, process, counter, with 32
/// bits each.
pub(crate) fn process(port: u128) -> u128 {
    (port >> 64) & u128::from(u32::MAX)
}

/// Returns `true` for a process that has not ended. A zombie has.
pub(crate) fn is_alive(process: u128) -> bool {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    // The name in parentheses may contain anything; the state follows it.
    let state = stat.rsplit_once(") ").and_then(|(_, rest)| rest.chars().next());
    state.is_some_and(|state| !matches!(state, 'Z' | 'X'))
}

/// Waits until a segment is finished or gone, and removes it if it stays unfinished for `limit`.
fn wait_or_remove(path: &Path, limit: Duration) {
    let deadline = Deadline::after(limit);
    while let Ok(metadata) = fs::metadata(path)
        && is_unfinished_segment(&metadata)
    {
        // The age alone would not do: the clock may have been set back since.
        if clock::age(&metadata) > limit || deadline.remaining().is_zero() {
            remove(path);
            return;
        }
        clock::sleep_until(clock::monotonic_ns() + PAUSE_NS);
    }
}

/// Removes the unfinished services of a name. The caller holds the lock of the name, so their creator
/// is dead.
pub(crate) fn remove_services(config: &Config, name: &str) {
    for path in static_files(config, name) {
        let Ok(file) = fs::metadata(&path) else { continue };
        let segment = dynamic_segment(config, &path);
        let is_unfinished =
            |path| fs::metadata(path).is_ok_and(|file| is_unfinished_segment(&file));
        if file.mode() & 0o777 == STATIC_UNFINISHED_MODE || segment.is_some_and(is_unfinished) {
            remove_files(config, &path);
        }
    }
}

/// Removes a service, unfinished or not. The caller holds the lock of the name, and no process uses
/// the service.
pub(crate) fn remove_service(config: &Config, spec: &ServiceSpec, name: &str) {
    if let Some(path) = static_file(config, spec, name) {
        remove_files(config, &path);
    }
}

/// Removes the files of a service, the one that names the other last.
pub(crate) fn remove_files(config: &Config, static_file: &Path) {
    if let Some(segment) = dynamic_segment(config, static_file) {
        remove(&segment);
    }
    remove(static_file);
}

/// Returns the paths of the static configurations of all services of a name, existing or not.
pub(crate) fn static_files(config: &Config, name: &str) -> Vec<PathBuf> {
    SERVICES.iter().filter_map(|spec| static_file(config, spec, name)).collect()
}

/// Returns the path of the static configuration of a service, existing or not.
pub(crate) fn static_file(config: &Config, spec: &ServiceSpec, name: &str) -> Option<PathBuf> {
    let directory = root::to_std(&config.global.service_dir());
    let service = ServiceName::new(&spec.service_name(name)).ok()?;
    let hash = ServiceHash::new::<<ipc_threadsafe::Service as Service>::ServiceNameHasher>(
        &service,
        spec.pattern,
    );
    let Config { global, .. } = config;
    let suffix = &global.service.static_config_storage_suffix;
    Some(directory.join(format!("{}{hash}{suffix}", global.prefix)))
}

/// Returns the segments of all services of the domain whose static configurations can be read.
pub(crate) fn dynamic_segments(config: &Config) -> Vec<PathBuf> {
    let directory = root::to_std(&config.global.service_dir());
    entries(&directory).filter_map(|entry| dynamic_segment(config, &entry.path())).collect()
}

/// Returns the segment of a service that its static configuration names: its file name ends in the
/// id of the service.
pub(crate) fn dynamic_segment(config: &Config, static_file: &Path) -> Option<PathBuf> {
    let text = fs::read_to_string(static_file).ok()?;
    let number = |key: &str| -> Option<u128> {
        let (_, rest) = text.split_once(key)?;
        rest.lines().next()?.trim().parse().ok()
    };
    let id = number("unique_value = ")? << 64 | number("payload_value = ")?;
    segment(config, &config.global.service.dynamic_config_storage_suffix, id)
}

/// Removes what is left of nodes whose process was killed while it created or removed them. Call it
/// after joining, which cleans up after all other dead nodes.
pub(crate) fn remove_nodes(config: &Config) {
    // iceoryx2 cannot clean up after a dead node without details: they hold its configuration.
    let mut ids = Vec::new();
    let listed = Node::<ipc_threadsafe::Service>::list(config, |node| {
        if let NodeState::Dead(dead) = node
            && dead.details().is_none()
        {
            ids.push(dead.id().value().to_string());
        }
        CallbackProgression::Continue
    });
    if listed.is_ok() {
        for id in &ids {
            remove_node(config, id);
        }
    }
    for id in incomplete_nodes(config) {
        remove_node(config, &id);
    }
}

/// Returns the ids of the nodes that lack a file although they are old, so their process is dead.
fn incomplete_nodes(config: &Config) -> BTreeSet<String> {
    let directory = root::to_std(&config.global.node_dir());
    let incomplete = |entry: DirEntry| {
        let is_old = entry.metadata().is_ok_and(|file| clock::age(&file) > NODE_CREATION_MAX);
        let id = entry.file_name().to_str().and_then(|name| node_id(config, name))?;
        (is_old && !is_complete_node(config, &id)).then_some(id)
    };
    entries(&directory).filter_map(incomplete).collect()
}

/// Returns the files and folders of such nodes.
pub(crate) fn incomplete_node_files(config: &Config) -> Vec<PathBuf> {
    let directory = root::to_std(&config.global.node_dir());
    let files = |id: String| {
        let folder = directory.join(&id);
        monitor_files(config, &id).into_iter().chain([folder]).filter(|path| path.exists())
    };
    incomplete_nodes(config).into_iter().flat_map(files).collect()
}

/// Returns the id of the node that a file in the directory of nodes belongs to: `<id>`, or
/// `<prefix><id><suffix>`.
fn node_id(config: &Config, file_name: &str) -> Option<String> {
    let prefix = config.global.prefix.to_string();
    let name = file_name.strip_prefix(&prefix).unwrap_or(file_name);
    let id = name.split_once('.').map_or(name, |(id, _)| id);
    let is_id = !id.is_empty() && id.bytes().all(|byte| byte.is_ascii_digit());
    is_id.then(|| id.to_owned())
}

/// Returns `true` if a node has its details, and iceoryx2 can tell whether its process lives.
fn is_complete_node(config: &Config, id: &str) -> bool {
    let files = files_of_node(config, id);
    files.iter().all(|path| fs::metadata(path).is_ok_and(|file| file.mode() & READABLE != 0))
}

/// Returns the paths of the files by which other processes know a node.
pub(crate) fn node_files(config: &Config, id: u128) -> Vec<PathBuf> {
    files_of_node(config, &id.to_string())
}

fn files_of_node(config: &Config, id: &str) -> Vec<PathBuf> {
    let mut files = Vec::from(monitor_files(config, id));
    files.push(details_of_node(config, id));
    files
}

/// Returns the path of the details of a node.
pub(crate) fn details_file(config: &Config, id: u128) -> PathBuf {
    details_of_node(config, &id.to_string())
}

fn details_of_node(config: &Config, id: &str) -> PathBuf {
    let Config { global, .. } = config;
    let details = format!("{}node{}", global.prefix, global.node.static_config_suffix);
    root::to_std(&global.node_dir()).join(id).join(details)
}

fn remove_node(config: &Config, id: &str) {
    let _ = fs::remove_dir_all(root::to_std(&config.global.node_dir()).join(id));
    for path in monitor_files(config, id) {
        remove(&path);
    }
}

/// Returns the paths of the files that tell whether the process of a node lives: its state, its context,
/// and the lock of the process that cleans up.
pub(crate) fn monitor_files(config: &Config, id: &str) -> [PathBuf; 3] {
    let directory = root::to_std(&config.global.node_dir());
    let Config { global, .. } = config;
    let monitor = format!("{}{id}{}", global.prefix, global.node.monitor_suffix);
    ["", "_context", "_owner_lock"].map(|ending| directory.join(format!("{monitor}{ending}")))
}

/// Returns `true` for a segment of shared memory without its final size or permissions.
fn is_unfinished_segment(metadata: &Metadata) -> bool {
    metadata.len() == 0 || metadata.mode() & READABLE == 0
}

/// Removes a file. Another process of the domain may have removed it first.
fn remove(path: &Path) {
    let _ = fs::remove_file(path);
}

#[cfg(test)]
mod tests {
    use std::fs::{File, Permissions};
    use std::os::unix::fs::PermissionsExt;

    use super::*;
    use crate::client::Client;
    use crate::owner::Owner;
    use crate::owner::load::Load;
    use crate::ports::domain;
    use crate::ports::service::STATUS;
    use crate::testing::TestDomain;

    const NAME: &str = "sim";

    fn config(domain: &TestDomain) -> Config {
        domain::configuration(Some(domain.name())).unwrap()
    }

    fn create_owner(domain: &TestDomain) -> Owner {
        let load = Load::default();
        Owner::create(&domain.endpoint(), &load).unwrap()
    }

    fn assert_works(domain: &TestDomain) {
        let owner = create_owner(domain);
        Client::attach(&domain.endpoint()).unwrap();
        drop(owner);
    }

    #[test]
    fn a_service_whose_configuration_is_unwritten_does_not_keep_an_owner_from_its_name() {
        let domain = TestDomain::new();
        let config = config(&domain);
        drop(create_owner(&domain));
        for path in static_files(&config, NAME) {
            File::create_new(&path).unwrap();
            fs::set_permissions(&path, Permissions::from_mode(STATIC_UNFINISHED_MODE)).unwrap();
        }
        let error = Client::attach(&domain.endpoint()).unwrap_err().to_string();
        assert!(error.starts_with("no node runs as"), "{error}");
        assert_works(&domain);
    }

    #[test]
    fn a_service_whose_segment_is_unwritten_does_not_keep_an_owner_from_its_name() {
        let domain = TestDomain::new();
        let config = config(&domain);
        let owner = create_owner(&domain);
        let path = static_file(&config, &STATUS, NAME).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        let segment = dynamic_segment(&config, &path).unwrap();
        drop(owner);
        for (size_bytes, mode) in [(0, 0o200), (4096, 0o200)] {
            fs::write(&path, &text).unwrap();
            fs::set_permissions(&path, Permissions::from_mode(0o400)).unwrap();
            File::create_new(&segment).unwrap().set_len(size_bytes).unwrap();
            fs::set_permissions(&segment, Permissions::from_mode(mode)).unwrap();
            // It would wait without end.
            list_services(&config, |_| panic!("an unfinished service was listed"));
            assert_works(&domain);
            assert!(!segment.exists());
        }
    }

    #[test]
    fn the_segment_of_a_dead_listener_is_removed_unless_a_node_names_it() {
        let domain = TestDomain::new();
        let config = config(&domain);
        let owner = create_owner(&domain);
        let mut client = Client::attach(&domain.endpoint()).unwrap();
        client.next_snapshot(Duration::from_millis(1)).unwrap();
        let living = segments(&config, &listener_suffix(&config)).next().unwrap();
        let living_id = ports(&living).next().unwrap();
        let create = |id: u128| {
            let name = living.to_str().unwrap().replace(&living_id.to_string(), &id.to_string());
            File::create_new(&name).unwrap();
            PathBuf::from(name)
        };
        // No process has this id.
        let dead_id = living_id | u128::from(u32::MAX) << 64;
        let (dead, elsewhere) = (create(dead_id), create(dead_id + 1));
        let Config { global, .. } = &config;
        let directory = root::to_std(&global.node_dir());
        let node = entries(&directory).find(|entry| entry.path().is_dir()).unwrap().path();
        let tag = format!("{}{}{}", global.prefix, dead_id + 1, global.node.port_tag_suffix);
        let tag = node.join(tag);
        File::create_new(&tag).unwrap();
        remove_listeners(&config);
        assert!(living.exists() && elsewhere.exists() && !dead.exists());
        fs::remove_file(tag).unwrap();
        drop(client);
        assert!(!elsewhere.exists());
        drop(owner);
    }

    #[test]
    fn an_unwritten_counter_of_nodes_keeps_nobody_from_the_domain() {
        let domain = TestDomain::new();
        let config = config(&domain);
        drop(create_owner(&domain));
        let suffix = &config.global.node.global_mgmt_suffix;
        let path = segments(&config, suffix).next().unwrap();
        for size_bytes in [0, 16] {
            fs::remove_file(&path).unwrap();
            File::create_new(&path).unwrap().set_len(size_bytes).unwrap();
            fs::set_permissions(&path, Permissions::from_mode(0o200)).unwrap();
            assert_works(&domain);
        }
        // Only this user can write to the finished counter.
        assert_eq!(fs::metadata(&path).unwrap().mode() & 0o777, 0o600);
    }

    #[test]
    fn a_half_created_node_is_removed_once_it_is_old_and_a_living_one_stays() {
        let domain = TestDomain::new();
        let config = config(&domain);
        let _owner = create_owner(&domain);
        let directory = root::to_std(&config.global.node_dir());
        let living: Vec<_> = entries(&directory).map(|entry| entry.path()).collect();
        let half = directory.join("4294967297");
        fs::create_dir(&half).unwrap();
        // A network file system renames a removed file that is still open to such a name.
        let foreign = directory.join(".nfs0001");
        File::create_new(&foreign).unwrap();
        remove_nodes(&config);
        assert!(half.exists());
        let old = std::time::SystemTime::UNIX_EPOCH;
        for path in living.iter().chain([&half, &foreign]) {
            // A file without the permission to write needs none for its times.
            File::open(path).unwrap().set_modified(old).unwrap();
        }
        remove_nodes(&config);
        assert!(!half.exists());
        assert!(living.iter().chain([&foreign]).all(|path| path.exists()));
    }
}
