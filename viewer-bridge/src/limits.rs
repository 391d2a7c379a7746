//! Limits on everything that a client can request or leave unread, each with its reason.

use std::ops::RangeInclusive;
use std::time::Duration;

/// Protocol number. The server and a page with different numbers do not understand each other.
pub const PROTOCOL: u32 = 3;
/// Pages at a time, and Foxglove clients at a time: each costs memory and a share of the network.
pub const CLIENTS_MAX: usize = 16;
/// Connections at a time that are not clients: they request files, or have not sent a valid first
/// message. One more evicts the one that has been inactive for the longest time. A browser opens six
/// for a page, so twenty pages can load at once.
pub const VISITORS_MAX: usize = 128;
/// Such connections at a time where the system allows few files: those of one browser.
pub const VISITORS_MIN: usize = 8;
/// File descriptors of everything else: four for a pair of clients (a page one, a Foxglove client three),
/// about 100 for the link to a node, and a margin for the files of a node with many readers.
pub const DESCRIPTORS_RESERVED: usize = 4 * CLIENTS_MAX + 256;
/// File descriptors of a visitor of each server: one of the pages, and three of the Foxglove server.
pub const DESCRIPTORS_PER_VISITOR: usize = 4;
/// Size of the head of a request. Browsers send the cookies of every port of a host.
pub const HEAD_SIZE_BYTES_MAX: usize = 64 << 10;
/// Size of a message from a client. A cut of 256 constraints needs a few KiB.
pub const MESSAGE_SIZE_BYTES_MAX: usize = 64 << 10;
/// Messages of a client per second: one target and one acknowledgement per frame of a 120 Hz display.
pub const MESSAGES_PER_SECOND_MAX: u32 = 240;
/// Messages that a client can send at once after a pause.
pub const MESSAGES_BURST_MAX: u32 = 480;
/// Bytes that the server reads from a connection per second. A message that never ends counts as no
/// message, and its frames can be empty, so their bytes are limited. A page sends about 50 KiB per second.
pub const BYTES_PER_SECOND_MAX: u32 = 1 << 20;
/// Bytes that a client can send at once after a pause.
pub const BYTES_BURST_MAX: u32 = 4 << 20;
/// Frames that a page has not acknowledged. With one, the network latency halves the frame rate;
/// with more, a slow page lags.
pub const FRAMES_UNACKNOWLEDGED_MAX: u32 = 2;
/// Frames per second: the refresh rate of common displays.
pub const FRAMES_PER_SECOND_MAX: u32 = 60;
/// Largest binary message in one piece, and size of the pieces of a longer one: half a second of a line of 1 Mbit/s. A
/// multiple of four.
pub const PART_SIZE_BYTES: usize = 64 << 10;
/// Messages of a page that wait while it receives the pieces of a long one: what it may send at once after a pause.
pub(crate) const ARRIVED_MAX: usize = MESSAGES_BURST_MAX as usize;
/// Pieces that a page has not received. With one, the network latency would halve the rate.
pub const PARTS_UNANSWERED_MAX: u32 = 2;
/// Reliable messages that wait for one page. A page that lets more pile up is disconnected.
pub const RELIABLE_QUEUED_MAX: usize = 256;
/// Messages that wait for one Foxglove client. A new message replaces the oldest: a longer queue
/// would only deliver older states to a slow client.
pub const FOXGLOVE_QUEUED_MAX: usize = 8;
/// Recordings of one bridge that are open at a time: each has up to three threads, and parts of two files
/// in memory.
pub const REPLAYS_MAX: usize = 4;
/// Requests of all clients that wait for the source.
pub const REQUESTS_QUEUED_MAX: usize = 4096;
/// Requests for a state that wait for the source: one of each client. A Foxglove client can cause more
/// than a thousand per second, each with its subscriptions.
pub const DEMANDS_QUEUED_MAX: usize = 2 * CLIENTS_MAX;
/// Commands that wait for room in the node's queue.
pub const COMMANDS_QUEUED_MAX: usize = 4096;
/// Constraints in one cut.
pub const CONSTRAINTS_PER_CUT_MAX: usize = 256;
/// Particles that one client grabs at a time: ten fingers and a few spare.
pub const GRABS_PER_CLIENT_MAX: usize = 16;
/// Objects that are carried or glide at a time. Each needs a command in every step, and the node's queue for a
/// client has room for 256.
pub const CARRIED_MAX: usize = 64;
/// Particles that a page inspects at a time: a selection of a dozen constraints has two dozen ends.
pub const PARTICLES_INSPECTED_MAX: usize = 32;
/// Steps in one command.
pub const STEPS_AT_ONCE_MAX: u32 = 10_000;
/// Pace of a replay, in multiples of real time.
pub const REPLAY_RATES: RangeInclusive<f32> = 0.1..=10.0;
/// Largest scene whose positions are sent as f32 to a page that leaves the choice to the server.
pub const F32_PARTICLES_MAX: usize = 4096;
/// Shapes of a scene that pages learn of. They only draw the others more plainly.
pub const SHAPES_MAX: usize = 4096;
/// Memory of the past that pages can look back at: half an hour of a small scene, some hundred states
/// of one with 20,000 particles. Like the default of `sim-node run --history`.
pub const HISTORY_SIZE_BYTES_MAX: usize = 64 << 20;
/// Past states of one load: those of two minutes at full frame rate, and older ones at growing distances.
pub const HISTORY_STATES_MAX: usize = 8192;
/// Changes of all pages that can be undone.
pub const UNDO_MAX: usize = 64;
/// Memory of the complete states before them, for those that the node cannot rewind to.
pub const UNDO_SIZE_BYTES_MAX: usize = 64 << 20;
/// Marks on the timeline of a live simulation, which pages receive anew with each change.
pub const HISTORY_MARKS_MAX: usize = 256;
/// Marks on a timeline.
pub const MARKS_MAX: usize = 4096;
/// Recordings of a folder that a page can choose from.
pub const RECORDINGS_LISTED_MAX: usize = 256;
/// Commands that a mark on a timeline names.
pub const COMMANDS_PER_MARK_MAX: usize = 8;

/// Time without any message after which a client is disconnected, and the time in which it must
/// accept one message.
pub const SILENCE_MAX: Duration = Duration::from_secs(10);
/// Time between two pings to a client.
pub const PING_PERIOD: Duration = Duration::from_secs(3);
/// Time for the head of a request, and for the first message of a page.
pub const HELLO_TIMEOUT: Duration = Duration::from_secs(5);
/// Lifetime of a connection that does not become a WebSocket; browsers open another one. Time for the
/// first message of a Foxglove client.
pub const CONNECTION_TIMEOUT: Duration = Duration::from_mins(1);
/// Shortest time between two evictions of one server. However fast others reconnect, each of
/// [`VISITORS_MAX`] has half a second to become a client, which is enough for a browser.
pub const EVICTION_PERIOD: Duration = Duration::from_millis(4);
/// Time in which the node must answer a command.
pub const OUTCOME_TIMEOUT: Duration = Duration::from_secs(2);
/// Time in which the node must undo a change. It may have to load a scene first.
pub const UNDO_TIMEOUT: Duration = Duration::from_secs(10);
/// Time in which the node must release the clients' grabs when the server ends.
pub const RELEASE_TIMEOUT: Duration = Duration::from_millis(500);
/// Time for clients to close their connections when the server ends.
pub const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(2);
/// Pause after a failed `accept`.
pub const ACCEPT_PAUSE: Duration = Duration::from_millis(20);
