//! Ports of killed processes that iceoryx2 forgets.
//!
//! iceoryx2 removes the tag of a dead port, then the port. If it finds no tag, it leaves the port where it
//! is, and forgets the dead node. So a process that is killed between the two, while it cleans up after
//! another one, leaves a place taken for as long as any process has the service open.

use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::prelude::{CallbackProgression, Config, Node, PortFactory, ipc_threadsafe};
use iceoryx2::service::port_factory::event;
use iceoryx2::service::service_hash::ServiceHash;

use crate::ports::domain::root;
use crate::ports::leftovers::unfinished::{self, is_alive, process};
use crate::ports::raw;

/// A port in the list of a service.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Port {
    node: UniqueNodeId,
    id: u128,
    service: ServiceHash,
}

/// Returns the publishers and subscribers of a service, living or dead.
pub(crate) fn ports(service: &raw::Service) -> Vec<Port> {
    let mut ports = Vec::new();
    let mut add = |node, id| {
        ports.push(Port { node, id, service: *service.service_hash() });
        CallbackProgression::Continue
    };
    let list = service.dynamic_config();
    list.list_publishers(|port| add(port.node_id, port.publisher_id.value()));
    list.list_subscribers(|port| add(port.node_id, port.subscriber_id.value()));
    ports
}

/// Permissions of a file that nobody writes again, and of one that processes lock.
const READ_ONLY: u32 = 0o400;
const WRITABLE: u32 = 0o600;

/// Returns the notifiers and listeners of a service, living or dead.
pub(crate) fn event_ports(service: &event::PortFactory<ipc_threadsafe::Service>) -> Vec<Port> {
    let mut ports = Vec::new();
    let mut add = |node, id| {
        ports.push(Port { node, id, service: *service.service_hash() });
        CallbackProgression::Continue
    };
    let list = service.dynamic_config();
    list.list_notifiers(|port| add(port.node_id, port.notifier_id.value()));
    list.list_listeners(|port| add(port.node_id, port.listener_id.value()));
    ports
}

/// Restores the files of the dead nodes that own some of these ports and are forgotten, so that iceoryx2
/// cleans up after them again. `own` is the id of the caller's node. The caller holds the lock of the name.
/// Returns `true` if there were such nodes.
pub(crate) fn restore_nodes(config: &Config, own: u128, ports: &[Port]) -> bool {
    let mut known = Vec::new();
    let listed = Node::<ipc_threadsafe::Service>::list(config, |node| {
        known.push(*node.node_id());
        CallbackProgression::Continue
    });
    // A process in a container may have its files in another root, but then it holds the lock.
    let is_orphan = |port: &&Port| !known.contains(&port.node) && !is_alive(process(port.id));
    if listed.is_err() {
        return false;
    }
    let orphans: Vec<_> = ports.iter().filter(is_orphan).collect();
    for port in &orphans {
        // If this fails, the place stays taken, and creating the port that needs it reports that.
        let _ = restore_node(config, own, port);
    }
    !orphans.is_empty()
}

/// Writes the files that a killed process with this one port would have left. The details of the node, which
/// hold the configuration of the domain, are those of the caller.
fn restore_node(config: &Config, own: u128, port: &Port) -> io::Result<()> {
    let Config { global, .. } = config;
    let prefix = &global.prefix;
    let id = port.node.value();
    let folder = root::to_std(&global.node_dir()).join(id.to_string());
    fs::create_dir_all(&folder)?;
    let details = fs::read(unfinished::details_file(config, own))?;
    create(&unfinished::details_file(config, id), READ_ONLY, &details)?;
    let service_tag = format!("{prefix}{}{}", port.service, global.node.service_tag_suffix);
    let port_tag = format!("{prefix}{}{}", port.id, global.node.port_tag_suffix);
    create(&folder.join(service_tag), READ_ONLY, &[])?;
    create(&folder.join(port_tag), READ_ONLY, &[])?;
    // The context, by which others find the process, comes last. It holds an id that no process has.
    let [state, context, owner_lock] = unfinished::monitor_files(config, &id.to_string());
    create(&state, WRITABLE, &[])?;
    create(&owner_lock, WRITABLE, &[])?;
    create(&context, READ_ONLY, &id.to_le_bytes())
}

fn create(path: &Path, mode: u32, bytes: &[u8]) -> io::Result<()> {
    match OpenOptions::new().write(true).create_new(true).mode(mode).open(path) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Ok(()),
        Err(error) => Err(error),
        Ok(mut file) => file.write_all(bytes),
    }
}
