//! The leftovers of a domain as a list, and the removal of those that stay until somebody asks for it.

use std::collections::HashSet;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use iceoryx2::node::NodeView;
use iceoryx2::prelude::{CallbackProgression, Config, Node, NodeState, ipc_threadsafe};
use rustix::fs::{major, minor};
use sim_host::clock;

use crate::ports::domain::files::segments;
use crate::ports::domain::root;
use crate::ports::leftovers::lock::{self, OwnerLock};
use crate::ports::leftovers::unfinished;
use crate::ports::service::SERVICES;

/// Time after which a file that no living node names is one of a dead process. A process that is creating
/// it takes milliseconds.
const AGE_MIN: Duration = Duration::from_secs(10);

/// A file or folder of a dead process.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Leftover {
    /// The file or folder.
    pub path: PathBuf,
    /// Its kind.
    pub kind: LeftoverKind,
    /// Size in bytes; 0 for a folder.
    pub size_bytes: u64,
}

/// Kind of a file of a dead process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum LeftoverKind {
    /// The lock of a name, whose owner was killed.
    Lock,
    /// The files of a killed process in the root of the domain.
    Process {
        /// Its id.
        process_id: u32,
    },
    /// A file that its process was killed in the middle of creating.
    Unfinished,
    /// A service that no living process has open.
    Service,
    /// Shared memory of a killed process.
    Segment,
    /// The same, but it may belong to a living process in a container, or to one whose files a cleaner has
    /// removed. It stays while a node of this user owns a name that is missing in the root, and in the domain
    /// of all iceoryx2 programs where this process does not see all others.
    UncertainSegment,
}

/// Finds the leftovers of a domain, and changes nothing.
pub(crate) fn find(config: &Config) -> Vec<Leftover> {
    let mut paths = Vec::new();
    for name in lock::names(config) {
        let files = OwnerLock::left_files(config, &name);
        paths.extend(files.into_iter().map(|path| (LeftoverKind::Lock, path)));
    }
    if root::exists(&root::path(config)) == Ok(true) {
        paths.extend(dead_nodes(config));
        let unfinished = unfinished::incomplete_node_files(config).into_iter();
        paths.extend(unfinished.map(|path| (LeftoverKind::Unfinished, path)));
        let services = dead_services(config).into_iter();
        paths.extend(services.map(|service| (LeftoverKind::Service, service.path)));
    }
    let unfinished = unfinished::old_segments(config).into_iter();
    paths.extend(unfinished.map(|path| (LeftoverKind::Unfinished, path)));
    let is_uncertain = is_uncertain(config);
    let kind = if is_uncertain { LeftoverKind::UncertainSegment } else { LeftoverKind::Segment };
    paths.extend(dead_segments(config).into_iter().map(|path| (kind, path)));
    let mut found: Vec<_> = paths.into_iter().filter_map(describe).collect();
    found.sort_by(|one, other| (one.kind, &one.path).cmp(&(other.kind, &other.path)));
    found.dedup_by(|one, other| one.path == other.path);
    found
}

/// Removes the locks that killed owners have left, and the services of these and other names that no living
/// process has open. Call it after joining, which removes what iceoryx2 knows.
pub(crate) fn remove_names(config: &Config) {
    let dead = dead_services(config);
    let mut names = lock::names(config);
    names.retain(|name| !OwnerLock::left_files(config, name).is_empty());
    names.extend(dead.iter().map(|service| service.name.clone()));
    for name in names {
        // A name that another process takes meanwhile is that process's to clean.
        let Ok(_lock) = OwnerLock::take(config, &name) else { continue };
        unfinished::remove_services(config, &name);
        // Listed again: only now, no new owner can open them.
        for service in dead_services(config).iter().filter(|service| service.name == name) {
            unfinished::remove_files(config, &service.path);
        }
    }
}

/// Removes the segments that iceoryx2 does not know, because the files of their nodes are gone. Call it
/// after joining, which removes all others.
pub(crate) fn remove_segments(config: &Config) {
    if is_uncertain(config) {
        return;
    }
    for path in dead_segments(config) {
        // Another process of the domain may have removed it first.
        let _ = fs::remove_file(path);
    }
}

/// Returns `None` for a file that is gone, or belongs to another user.
fn describe((kind, path): (LeftoverKind, PathBuf)) -> Option<Leftover> {
    let file = fs::symlink_metadata(&path).ok()?;
    let size_bytes = if file.is_dir() { 0 } else { file.len() };
    (file.uid() == rustix::process::geteuid().as_raw()).then_some(Leftover {
        path,
        kind,
        size_bytes,
    })
}

/// Returns the folders of killed processes.
fn dead_nodes(config: &Config) -> Vec<(LeftoverKind, PathBuf)> {
    let directory = root::to_std(&config.global.node_dir());
    let mut dead = Vec::new();
    // After an error, the nodes that were not listed count as alive.
    let _ = Node::<ipc_threadsafe::Service>::list(config, |node| {
        if let NodeState::Dead(node) = node {
            let id = node.id().value();
            let process_id = u32::try_from(unfinished::process(id)).unwrap_or_default();
            dead.push((LeftoverKind::Process { process_id }, directory.join(id.to_string())));
        }
        CallbackProgression::Continue
    });
    dead
}

/// A service of this contract.
#[derive(Debug)]
struct ServiceFile {
    /// Its static configuration.
    path: PathBuf,
    /// Name of the node.
    name: String,
}

/// Returns the services of this contract that no living process has open.
fn dead_services(config: &Config) -> Vec<ServiceFile> {
    let mut dead = Vec::new();
    // The services that were not listed count as open.
    unfinished::list_services(config, |service| {
        if let Some(file) = service_file(config, service.static_details.name().as_str()) {
            let is_alive =
                |node: &NodeState<ipc_threadsafe::Service>| !matches!(node, NodeState::Dead(_));
            let is_open = match &service.dynamic_details {
                Some(details) => details.nodes.iter().any(is_alive),
                // Another version of iceoryx2 may have it open, unless its segment is gone.
                None => unfinished::dynamic_segment(config, &file.path).is_some(),
            };
            if !is_open && is_old(&file.path) {
                dead.push(file);
            }
        }
        CallbackProgression::Continue
    });
    dead
}

fn service_file(config: &Config, service: &str) -> Option<ServiceFile> {
    let (name, suffix) = service.rsplit_once('/')?;
    let spec = SERVICES.iter().find(|spec| spec.suffix == suffix)?;
    let path = unfinished::static_file(config, spec, name)?;
    Some(ServiceFile { path, name: name.to_owned() })
}

/// Returns the segments of dead processes that belong to no living node and no existing service.
fn dead_segments(config: &Config) -> Vec<PathBuf> {
    let service = &config.global.service;
    let listener = unfinished::listener_suffix(config);
    let of_ports = segments(config, &service.data_segment_suffix)
        .chain(segments(config, &service.connection_suffix))
        .chain(segments(config, &listener));
    let mut dead: Vec<_> = of_ports
        .filter(|path| unfinished::ports(path).all(|port| unfinished::is_dead_port(config, port)))
        .collect();
    let in_use = unfinished::dynamic_segments(config);
    let of_services = segments(config, &service.dynamic_config_storage_suffix);
    dead.extend(of_services.filter(|path| {
        !in_use.contains(path)
            && unfinished::ports(path).all(|id| !unfinished::is_alive(unfinished::process(id)))
    }));
    dead.retain(|path| is_old(path));
    remove_mapped(&mut dead);
    dead
}

/// Returns `true` if nothing tells which segments belong to living processes, because these may run in
/// containers or have lost their files to a cleaner.
fn is_uncertain(config: &Config) -> bool {
    let names = lock::names_in_shared_memory(config);
    let has_hidden_node = names.iter().any(|name| OwnerLock::is_hidden(config, name));
    let is_shared = config.global.prefix == Config::default().global.prefix;
    let namespace = fs::read_link("/proc/self/ns/pid").unwrap_or_default();
    has_hidden_node || is_shared && !sees_all_processes(&namespace)
}

fn is_old(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|file| clock::age(&file) > AGE_MIN)
}

/// A file of this host.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct FileId {
    device: (u32, u32),
    inode: u64,
}

/// Removes the files from a list that a process of this user has mapped, as far as this process sees others.
fn remove_mapped(paths: &mut Vec<PathBuf>) {
    if !paths.is_empty() {
        let mapped = mapped_files();
        paths.retain(|path| file_id(path).is_some_and(|file| !mapped.contains(&file)));
    }
}

fn file_id(path: &Path) -> Option<FileId> {
    let file = fs::metadata(path).ok()?;
    Some(FileId { device: (major(file.dev()), minor(file.dev())), inode: file.ino() })
}

fn mapped_files() -> HashSet<FileId> {
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    // The maps of other users' processes cannot be read, and these cannot map files of this user.
    let maps = processes.filter_map(|process| fs::read_to_string(process.path().join("maps")).ok());
    maps.flat_map(|maps| maps.lines().filter_map(parse).collect::<Vec<_>>()).collect()
}

/// Parses a line of `/proc/<process>/maps`: addresses, permissions, offset, device, inode and path.
fn parse(line: &str) -> Option<FileId> {
    let mut fields = line.split_ascii_whitespace().skip(3);
    let (major, minor) = fields.next()?.split_once(':')?;
    let number = |text| u32::from_str_radix(text, 16).ok();
    let inode = fields.next()?.parse().ok()?;
    Some(FileId { device: (number(major)?, number(minor)?), inode })
}

/// Returns `true` if this process sees all processes of the host, because it is in no container. `link` is
/// its namespace of processes: the target of `/proc/self/ns/pid`.
fn sees_all_processes(link: &Path) -> bool {
    // The number of the first namespace is fixed in the kernel (PROC_PID_INIT_INO).
    link == Path::new("pid:[4026531836]")
}

#[cfg(test)]
mod tests {
    use std::fs::{File, Permissions};
    use std::os::unix::fs::PermissionsExt;
    use std::time::SystemTime;

    use super::*;
    use crate::client::Client;
    use crate::domain::Domain;
    use crate::owner::Owner;
    use crate::owner::load::Load;
    use crate::ports::domain;
    use crate::testing::TestDomain;

    fn create_owner(domain: &TestDomain) -> Owner {
        let load = Load::default();
        Owner::create(&domain.endpoint(), &load).unwrap()
    }

    fn config(domain: &TestDomain) -> Config {
        domain::configuration(Some(domain.name())).unwrap()
    }

    fn make_old(path: &Path) {
        File::open(path).unwrap().set_modified(SystemTime::UNIX_EPOCH).unwrap();
    }

    /// Creates old segments beside those of a living process, as another process with an id that no
    /// process has would have left them.
    fn create_dead_segments(config: &Config) -> Vec<PathBuf> {
        let service = &config.global.service;
        let living = segments(config, &service.data_segment_suffix)
            .chain(segments(config, &service.connection_suffix))
            .chain(segments(config, &service.dynamic_config_storage_suffix));
        let create = |path: PathBuf| {
            let mut name = path.to_str().unwrap().to_owned();
            for port in unfinished::ports(&path) {
                let dead = port | u128::from(u32::MAX) << 64;
                name = name.replace(&port.to_string(), &dead.to_string());
            }
            fs::write(&name, [0; 100]).unwrap();
            make_old(Path::new(&name));
            make_old(&path);
            PathBuf::from(name)
        };
        let mut created: Vec<_> = living.map(create).collect();
        created.sort();
        created
    }

    #[test]
    fn segments_that_no_living_process_and_no_service_has_are_removed_and_others_stay() {
        let domain = TestDomain::new();
        let config = config(&domain);
        let owner = create_owner(&domain);
        let mut client = Client::attach(&domain.endpoint()).unwrap();
        client.status(Duration::ZERO).unwrap();
        let outside = Domain::new(&domain.endpoint()).unwrap();
        assert_eq!(outside.leftovers(), []);
        let dead = create_dead_segments(&config);
        assert!(dead.len() > 20, "{dead:?}");
        let found = outside.leftovers();
        assert!(found.iter().all(|one| (one.kind, one.size_bytes) == (LeftoverKind::Segment, 100)));
        let paths: Vec<_> = found.into_iter().map(|one| one.path).collect();
        assert_eq!(paths, dead);
        outside.remove_leftovers().unwrap();
        assert!(dead.iter().all(|path| !path.exists()));
        assert_eq!(outside.leftovers(), []);
        // Another client can still attach.
        Client::attach(&domain.endpoint()).unwrap().status(Duration::ZERO).unwrap();
        // Under another name, as a process of another container would have it.
        let suffix = &config.global.service.data_segment_suffix;
        let living = segments(&config, suffix).next().unwrap();
        let id = unfinished::ports(&living).next().unwrap();
        let dead_id = (id | u128::from(u32::MAX) << 64).to_string();
        let name = living.to_str().unwrap().replace(&id.to_string(), &dead_id);
        fs::hard_link(&living, &name).unwrap();
        assert_eq!(outside.leftovers(), []);
        drop((client, owner));
    }

    #[test]
    fn segments_stay_while_a_node_owns_a_name_that_is_missing_in_the_root() {
        let domain = TestDomain::new();
        let config = config(&domain);
        let owner = create_owner(&domain);
        let dead = create_dead_segments(&config);
        let lock = root::path(&config).join(format!("{}sim.owner", config.global.prefix));
        fs::remove_file(lock).unwrap();
        let outside = Domain::new(&domain.endpoint()).unwrap();
        let kinds: Vec<_> = outside.leftovers().iter().map(|one| one.kind).collect();
        assert_eq!(kinds, vec![LeftoverKind::UncertainSegment; dead.len()]);
        outside.remove_leftovers().unwrap();
        assert!(dead.iter().all(|path| path.exists()));
        drop(owner);
        outside.remove_leftovers().unwrap();
        assert!(dead.iter().all(|path| !path.exists()));
    }

    #[test]
    fn services_whose_segments_a_restart_of_the_system_has_removed_are_removed() {
        let domain = TestDomain::new();
        let config = config(&domain);
        let owner = create_owner(&domain);
        let texts: Vec<_> = unfinished::static_files(&config, "sim")
            .into_iter()
            .map(|path| (fs::read(&path).unwrap(), path))
            .collect();
        drop(owner);
        for (text, path) in &texts {
            fs::write(path, text).unwrap();
            fs::set_permissions(path, Permissions::from_mode(0o400)).unwrap();
        }
        let outside = Domain::new(&domain.endpoint()).unwrap();
        // Another process may be creating them.
        assert_eq!(outside.leftovers(), []);
        for (_, path) in &texts {
            make_old(path);
        }
        let found = outside.leftovers();
        assert_eq!(found.len(), SERVICES.len());
        assert!(found.iter().all(|one| one.kind == LeftoverKind::Service), "{found:?}");
        outside.remove_leftovers().unwrap();
        assert!(texts.iter().all(|(_, path)| !path.exists()));
    }

    #[test]
    fn a_line_of_maps_names_its_file_by_device_and_inode() {
        let line = "7f1c4a000000-7f1c4a021000 rw-s 00000000 00:1a 513  /dev/shm/lab_x y.data";
        assert_eq!(parse(line), Some(FileId { device: (0, 0x1a), inode: 513 }));
        assert_eq!(
            parse("7ffd1000-7ffd2000 r-xp 00000000 00:00 0  [vdso]").map(|it| it.inode),
            Some(0)
        );
        assert_eq!(parse(""), None);
    }

    #[test]
    fn only_files_that_are_mapped_are_removed() {
        let program = fs::read_link("/proc/self/exe").unwrap();
        let mut paths = vec![program, PathBuf::from("/dev/null"), PathBuf::from("/nowhere")];
        remove_mapped(&mut paths);
        assert_eq!(paths, [Path::new("/dev/null")]);
    }

    #[test]
    fn a_process_in_a_container_does_not_see_all() {
        assert!(sees_all_processes(Path::new("pid:[4026531836]")));
        assert!(!sees_all_processes(Path::new("pid:[4026532451]")));
    }
}
