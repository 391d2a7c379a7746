//! The topology and the surface of a recording.

use crate::log::index::IndexedLog;
use crate::log::message::Message;
use crate::log::read_error::ReadError;
use crate::log::rows::{SurfaceRow, TopologyRow};
use crate::log::topic::Topic;

/// The rows of a load, if the file has readable ones.
#[derive(Debug, Default)]
pub(super) struct Load {
    pub(super) topology: Option<TopologyRow>,
    pub(super) surface: Option<SurfaceRow>,
    /// A chunk that may have had them cannot be read.
    pub(super) has_damage: bool,
}

/// Reads the load. A file has one load, in its first chunks, before the first snapshot.
pub(super) fn read_load(log: &mut IndexedLog) -> Result<Load, ReadError> {
    let mut load = Load::default();
    for chunk in 0..log.chunks().len() {
        if load.topology.is_some() && load.surface.is_some() {
            break;
        }
        if !log.chunks()[chunk].has_any(&[Topic::Topology, Topic::Surface]) {
            continue;
        }
        let messages = match log.read_chunk(chunk) {
            Err(ReadError::DamagedChunk { .. } | ReadError::Malformed { .. }) => {
                load.has_damage = true;
                continue;
            }
            read => read?,
        };
        for logged in messages {
            match logged.message {
                Message::Topology(row) => _ = load.topology.get_or_insert(row),
                Message::Surface(row) => _ = load.surface.get_or_insert(row),
                _ => {}
            }
        }
    }
    Ok(load)
}
