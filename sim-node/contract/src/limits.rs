//! The constants of the contract: its version, and a limit on every queue with the reason for it.

/// Version of the layouts, service names and quality of service; a service attribute, checked by
/// everyone who opens a service. It changes with any change of the bytes in shared memory.
pub const CONTRACT_VERSION: u32 = 3;

/// Most particles, and most constraints, of a scene (2^24: their indices are exact in f32).
pub const ELEMENTS_MAX: usize = 1 << 24;
/// Longest scene text, in bytes.
pub const SCENE_SIZE_BYTES_MAX: usize = 16 << 20;
/// Most colliders of a scene: every free particle meets every one of them in every substep.
pub const COLLIDERS_MAX: usize = 1 << 16;
/// Most commands that a node applies at one step boundary; the rest waits for the next one.
pub const COMMANDS_PER_STEP_MAX: usize = 1024;

/// Publishers of a service that only the owner writes: one, a second one while a load replaces the
/// first, and one spare for a network tunnel.
pub const OWNER_PUBLISHERS_MAX: usize = 3;
/// Readers of a service at the same time.
pub const READERS_MAX: usize = 16;
/// Samples that one reader may hold at the same time; it takes no more before it gives one back.
pub const BORROWED_SAMPLES_MAX: usize = 4;
/// Snapshots that wait for one reader before the oldest is overwritten (64 ms at 1 kHz), and as
/// many keyframes: each step with commands has one.
pub const SNAPSHOTS_BUFFERED: usize = 64;
/// Tears, colliders and statuses that wait for one reader.
pub const UPDATES_BUFFERED: usize = 4;
/// Outcomes that wait for one reader: two steps' worth of the most that a step can produce.
pub const OUTCOMES_BUFFERED: usize = 2 * COMMANDS_PER_STEP_MAX;
/// Clients that can send commands at the same time.
pub const CLIENTS_MAX: usize = 32;
/// Commands of one client that wait for the node; a further one is refused at the sender.
pub const COMMANDS_BUFFERED: usize = 256;
/// Readers of the outcomes: every client that sends commands, and every other reader.
pub const OUTCOME_READERS_MAX: usize = CLIENTS_MAX + READERS_MAX;
/// Readers of the commands: the owner, and one spare for a network tunnel.
pub const COMMAND_READERS_MAX: usize = 2;
/// Writers of the status: the owner alone; this is what keeps a second one from the name.
pub const STATUS_PUBLISHERS_MAX: usize = 1;
/// Processes that wait for the wake-up event at the same time.
pub const LISTENERS_MAX: usize = 32;
/// Processes that have a service open at the same time: clients, readers, the owner and spares.
pub const PARTICIPANTS_MAX: usize = 64;
