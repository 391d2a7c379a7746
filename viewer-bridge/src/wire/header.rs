//! The header of every binary message.

/// Version of every kind of message.
pub const KIND_VERSION: u16 = 1;

/// Kind of a binary message: the first number of its header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u16)]
pub enum Kind {
    /// A load, with everything that does not change until the next one.
    Scene = 1,
    /// Positions as f32.
    FrameF32 = 2,
    /// Positions as u16: 65,536 steps across their bounding box.
    FrameU16 = 3,
    /// A change of the list of torn constraints.
    Tear = 4,
    /// All particles that are not free.
    Pins = 5,
    /// Statistics of the node and the scene.
    Stats = 6,
    /// All colliders.
    Colliders = 7,
    /// The impulses of a step.
    Forces = 8,
    /// The speeds of all particles.
    Speeds = 9,
    /// The exact states of some particles.
    Inspected = 10,
    /// The head of an earlier state.
    Past = 11,
    /// A state of another recording.
    Ghost = 12,
    /// A piece of a long message.
    Part = 13,
}

/// Load and step that a message belongs to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Stamp {
    /// Number of the load. Each SCENE begins a new one.
    pub epoch: u32,
    /// Step.
    pub step: u64,
}
