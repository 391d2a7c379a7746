//! The memory that a scene takes while it runs.

use thiserror::Error;

use super::definition::Scene;
use super::definition::contact::ContactMode;
use super::generate::Shape;

// Estimate of the memory of a solver for each element, in bytes, measured at a million particles. It only decides whether
// a scene is refused with a message, or the process tries to build it.

/// A particle, including its share of the triangles.
const PARTICLE_BYTES: u64 = 150;
const CONSTRAINT_BYTES: u64 = 48;
const BEND_BYTES: u64 = 100;
/// For each particle that touches others.
const PARTICLE_CONTACT_BYTES: u64 = 100;
const SURFACE_CONTACT_BYTES: u64 = 500;

/// Error of a scene that the process cannot run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error(
    "not enough memory: the scene takes about {needed_mib} MiB while it runs; free memory, raise the limit of the process \
     (`ulimit -v`), or make the scene smaller"
)]
pub struct NotEnoughMemory {
    /// The memory that the scene takes.
    pub needed_mib: usize,
}

impl Scene {
    /// Checks that the process gets about the memory that a solver of this scene takes.
    ///
    /// # Errors
    /// The process cannot reserve that much memory. Building the solver would abort the process.
    pub fn check_memory(&self) -> Result<(), NotEnoughMemory> {
        let needed_bytes = self.memory_bytes();
        let needed_mib = needed_bytes >> 20;
        // Reserved and given back, but never touched, so that it costs nothing.
        let reserved = Vec::<u8>::new().try_reserve_exact(needed_bytes);
        reserved.map_err(|_| NotEnoughMemory { needed_mib })
    }

    fn memory_bytes(&self) -> usize {
        let shapes = || self.generators.iter().map(|generator| &generator.shape);
        let constraints: u64 = shapes().map(Shape::constraint_count).sum();
        let bends: u64 = shapes().map(Shape::bend_count).sum();
        let contact_bytes = match self.contact.mode {
            ContactMode::Off => 0,
            ContactMode::Particles => PARTICLE_CONTACT_BYTES,
            ContactMode::Surfaces => SURFACE_CONTACT_BYTES,
        };
        let bytes = self.particle_count() * (PARTICLE_BYTES + contact_bytes)
            + (self.constraints.len() as u64 + constraints) * CONSTRAINT_BYTES
            + (self.bends.len() as u64 + bends) * BEND_BYTES;
        usize::try_from(bytes).unwrap_or(usize::MAX)
    }
}
