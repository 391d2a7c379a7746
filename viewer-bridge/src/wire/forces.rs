//! FORCES.

use bytemuck::bytes_of;
use bytes::Bytes;
use sim_contract::ForceRow;

use super::header::{Kind, Stamp};
use super::writer::Writer;

/// The impulses of a step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Forces {
    /// Load and step.
    pub stamp: Stamp,
    /// Steps per second: a force is an impulse times this rate.
    pub rate_hz: u32,
    /// The rows in the layout and order of the contract.
    pub rows: Vec<ForceRow>,
}

impl Forces {
    /// Encodes the message.
    pub fn encode(&self) -> Bytes {
        let size = 24 + size_of::<ForceRow>() * self.rows.len();
        let mut writer = Writer::new(Kind::Forces, self.stamp, size);
        writer.count(&self.rows);
        writer.u32(self.rate_hz);
        self.rows.iter().for_each(|row| writer.bytes(bytes_of(row)));
        writer.finish()
    }
}
