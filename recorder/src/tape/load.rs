//! What a tape knows once it is open: its scene, and where it begins and ends.

use super::{Tape, TapeError};
use crate::message::Message;
use crate::reader::ReadError;
use crate::rows::{Softness, SurfaceRow, TopologyRow};
use crate::topic::Topic;

/// Before the file is read.
pub(super) fn no_topology() -> TopologyRow {
    TopologyRow {
        step: 0,
        revision: 0,
        a: Vec::new(),
        b: Vec::new(),
        rest_length: Vec::new(),
        softness: Softness::Compliance(Vec::new()),
        kind: Vec::new(),
        torn: Vec::new(),
    }
}

/// Before the file is read.
pub(super) fn no_surface() -> SurfaceRow {
    SurfaceRow { step: 0, triangles: Vec::new() }
}

impl Tape {
    /// Reads the scene, and the first and the last snapshot.
    pub(super) fn read_ends(&mut self) -> Result<(), TapeError> {
        self.read_load()?;
        let end = self.log.end().clone();
        let (first_steps, last) = self.ends()?.ok_or(TapeError::NoSnapshot(end))?;
        self.first_step = first_steps[0];
        self.last_step = last.max(self.first_step);
        // The second snapshot may be in the chunk behind.
        let second = self.step_after(self.first_step)?;
        let pairs = first_steps.windows(2).map(|pair| pair[1].saturating_sub(pair[0]));
        let strides = pairs.chain([second.saturating_sub(self.first_step)]);
        self.stride = strides.filter(|stride| *stride > 0).min().unwrap_or(1);
        Ok(())
    }

    /// The scene stands before the first snapshot, in the first chunks; a file has one.
    fn read_load(&mut self) -> Result<(), TapeError> {
        let (mut topology, mut surface) = (None, None);
        for chunk in 0..self.log.chunks().len() {
            if topology.is_some() && surface.is_some() {
                break;
            }
            if !self.log.chunks()[chunk].has_any(&[Topic::Topology, Topic::Surface]) {
                continue;
            }
            let messages = match self.log.read_chunk(chunk) {
                Err(ReadError::DamagedChunk { .. } | ReadError::Malformed { .. }) => continue,
                read => read?,
            };
            for logged in messages {
                match logged.message {
                    Message::Topology(row) if topology.is_none() => topology = Some(row),
                    Message::Surface(row) if surface.is_none() => surface = Some(row),
                    _ => {}
                }
            }
        }
        self.topology = topology.ok_or(TapeError::NoLoad("/topology"))?;
        self.surface = surface.ok_or(TapeError::NoLoad("/surface"))?;
        Ok(())
    }
}
