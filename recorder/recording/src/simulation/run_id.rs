//! The id of a simulated run.

use sim_contract::{Action, Command};
use xxhash_rust::xxh3::Xxh3;

/// A hash of the scene and of the commands that were applied, so that equal inputs have equal ids.
#[derive(Clone)]
pub(crate) struct RunId(Xxh3);

impl RunId {
    /// Starts with the text of the complete scene.
    pub(crate) fn new(scene: &[u8]) -> Self {
        let mut hash = Xxh3::new();
        hash.update(scene);
        Self(hash)
    }

    /// Adds a command, in the order of application.
    pub(crate) fn add(&mut self, step: u64, client_id: u64, sequence: u64, action: Action) {
        let wire = Command::new(client_id, sequence, action);
        self.0.update(&step.to_le_bytes());
        self.0.update(bytemuck::bytes_of(&wire));
    }

    /// Adds the place of a first state other than that of the scene.
    pub(crate) fn add_start(&mut self, step: u64, outcome_count: u64) {
        self.0.update(&step.to_le_bytes());
        self.0.update(&outcome_count.to_le_bytes());
    }

    /// Returns the id.
    pub(crate) fn value(&self) -> u64 {
        self.0.digest()
    }
}

impl std::fmt::Debug for RunId {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "RunId({:016x})", self.value())
    }
}
