//! The flags of particles.

/// Bits of a particle's `flags`; all other bits are 0.
#[derive(Debug)]
pub struct ParticleFlags;

impl ParticleFlags {
    /// Held in place.
    pub const PINNED: u32 = 1;
    /// Moved to a client's target.
    pub const GRABBED: u32 = 1 << 1;
    /// Moved by an anchor.
    pub const ANCHORED: u32 = 1 << 2;
    /// Excluded from the simulation because its state was not finite.
    pub const FROZEN: u32 = 1 << 3;
    /// All flags. A particle with any of them has inverse mass 0 in the step.
    pub const ALL: u32 = Self::PINNED | Self::GRABBED | Self::ANCHORED | Self::FROZEN;

    /// Name of each flag, by ascending bit.
    pub const NAMES: [(u32, &'static str); 4] = [
        (Self::PINNED, "pinned"),
        (Self::GRABBED, "grabbed"),
        (Self::ANCHORED, "anchored"),
        (Self::FROZEN, "frozen"),
    ];
}
