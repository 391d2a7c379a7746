//! The constants of the contract: its version, and the limit of every queue with its reason.

/// Version of the layouts, service names and quality of service. It is an attribute of each
/// service, and is checked on open. It changes with any change of the bytes in shared memory.
pub const CONTRACT_VERSION: u32 = 7;

/// Most commands that a node applies in one poll; the others wait for the next one. A running node
/// polls once before each step. While it is paused, or waits for a distant step, it polls repeatedly
/// at the same boundary.
pub const COMMANDS_PER_STEP_MAX: usize = 1024;

/// Publishers of a service that only the owner writes: its own, a second while a load replaces the
/// first, and one spare for a network tunnel.
pub const OWNER_PUBLISHERS_MAX: usize = 3;
/// Most readers of a service at the same time.
pub const READERS_MAX: usize = 16;
/// Snapshots that one reader may hold at the same time. It receives no more until it drops one.
pub const BORROWED_SAMPLES_MAX: usize = 4;
/// Messages of any other service that one reader may hold at the same time.
pub const BORROWED_UPDATES_MAX: usize = 2;
/// Snapshots that wait for one reader before the oldest is overwritten: 64 ms at 1 kHz.
pub const SNAPSHOTS_BUFFERED: usize = 64;
/// Keyframes that wait for one reader. Each step with commands other than `move` has one.
pub const KEYFRAMES_BUFFERED: usize = 16;
/// Messages that wait for one reader at a service without a limit of its own, such as tears.
pub const UPDATES_BUFFERED: usize = 4;
/// Outcomes that wait for one reader: twice the most that one poll can produce.
pub const OUTCOMES_BUFFERED: usize = 2 * COMMANDS_PER_STEP_MAX;
/// Most clients that send commands at the same time.
pub const CLIENTS_MAX: usize = 32;
/// Commands of one client that wait for the node. Sending one more fails.
pub const COMMANDS_BUFFERED: usize = 256;
/// Most members of the lockstep.
pub const MEMBERS_MAX: usize = 16;
/// Changes of the members that a status names. A reader that misses statuses still receives each of the last
/// changes: one poll of the node can lose every member and admit as many others.
pub const MEMBER_CHANGES_KEPT: usize = 2 * MEMBERS_MAX;
/// Messages of one member that wait for the node. A member sends one for each step, and waits for the
/// step after it.
pub const READY_BUFFERED: usize = 4;
/// Most clients that give a state to the node at the same time.
pub const RESTORES_MAX: usize = 8;
/// Readers of the outcomes: each client that sends commands, and the other readers.
pub const OUTCOME_READERS_MAX: usize = CLIENTS_MAX + READERS_MAX;
/// Readers of the commands and of the members' messages: the owner, and one spare for a network tunnel.
pub const COMMAND_READERS_MAX: usize = 2;
/// Writers of the status: the owner, and one spare for a network tunnel.
pub const STATUS_PUBLISHERS_MAX: usize = 2;
/// Least messages of a mirror that wait for one reader: the tunnel holds as many.
pub const MIRROR_BUFFERED_MIN: usize = SNAPSHOTS_BUFFERED;
/// Least messages of a mirror that one reader may hold.
pub const MIRROR_BORROWED_MIN: usize = BORROWED_SAMPLES_MAX;
/// Publishers and readers of a mirror.
pub const MIRROR_PORTS_MAX: usize = 32;
/// Longest silence of the status at the far end of a network tunnel before the owner counts as gone, in
/// milliseconds: 30 periods of the status.
pub const FAR_SILENCE_MAX_MS: u64 = 3000;
/// Most processes that wait for the wake event at the same time.
pub const LISTENERS_MAX: usize = 32;
/// Most processes with a service open at the same time: clients, readers, the owner and spares.
pub const PARTICIPANTS_MAX: usize = 64;
