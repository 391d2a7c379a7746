//! Publishing of forces: only while a client reads them.

use sim_messages::{ForceRow, ForcesHeader};

use crate::owner::Owner;
use crate::owner::error::OwnerError;
use crate::ports::connection;
use crate::ports::port::reader_count;
use crate::ports::service::{FORCES, ServiceError};
use crate::ports::writer::{Capacity, Writer};

impl Owner {
    /// Returns the number of readers of `forces`, counted like [`Owner::reader_count`]. Cheap.
    pub fn forces_reader_count(&self) -> usize {
        reader_count(&self.services.forces)
    }

    /// Returns `true` if a living process reads `forces`. As costly as [`Owner::connections`].
    pub fn has_living_forces_reader(&self) -> bool {
        connection::has_living_reader(&self.services.forces)
    }

    /// Publishes the impulses of a step: of each collider, then of each anchor, then of each fixed particle.
    /// Sets `count`. Call it before the particles of the same step, and only while there is a reader. The first
    /// call, and one with more rows than before, takes shared memory: 98 times the size of the rows.
    ///
    /// # Errors
    /// No memory, or no place for the writer.
    pub fn publish_forces(
        &self,
        header: ForcesHeader,
        rows: &[ForceRow],
    ) -> Result<(), OwnerError> {
        let mut slot = self.writers.forces.borrow_mut();
        let writer = slot.take().filter(|writer| writer.len_max() >= rows.len());
        let writer = writer.map_or_else(|| self.create_forces_writer(rows.len()), Ok)?;
        let count = u32::try_from(rows.len()).unwrap_or(u32::MAX);
        let header = ForcesHeader { count, ..header };
        Ok(slot.insert(writer).write(header, |index| rows[index])?)
    }

    /// Particles become fixed one by one, so the memory grows in leaps.
    fn create_forces_writer(
        &self,
        row_count: usize,
    ) -> Result<Writer<ForceRow, ForcesHeader>, ServiceError> {
        let len_max = row_count.next_power_of_two();
        let capacity = Capacity { len_max, samples: FORCES.samples_in_use_max() };
        Writer::create(&self.services.config, &self.services.forces, capacity)
    }

    /// Frees the memory of the forces, so that a later reader receives no old ones.
    pub fn end_forces(&self) {
        self.writers.forces.take();
    }

    /// Same as [`Owner::end_forces`], if no client reads them.
    pub(super) fn end_unread_forces(&self) {
        if self.forces_reader_count() == 0 {
            self.end_forces();
        }
    }
}
