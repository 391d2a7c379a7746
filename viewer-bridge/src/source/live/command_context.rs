//! The state to which a command refers.

use sim_contract::ParticleState;

/// The state to which a command refers.
#[derive(Debug, Clone, Copy)]
pub(super) struct CommandContext<'a> {
    /// Number of the load on show.
    pub(super) epoch: u32,
    /// Steps per second.
    pub(super) rate_hz: u32,
    /// The scene has two dimensions.
    pub(super) is_planar: bool,
    /// A recording plays on the node's services.
    pub(super) is_replay: bool,
    pub(super) particles: &'a [ParticleState],
}
