//! A limit on everything that a page can ask for or leave lying, with the reason for it.

use std::time::Duration;

/// Number of the protocol; another one cannot talk to this server.
pub const PROTOCOL: u32 = 1;
/// Pages at the same time: each has a thread's worth of memory and a share of the network.
pub const CLIENTS_MAX: usize = 16;
/// Connections at the same time that ask for files, or have not become sockets yet.
pub const CONNECTIONS_MAX: usize = 128;
/// Sockets at the same time that have not said who they are.
pub const WAITING_MAX: usize = 64;
/// Longest message of a page: what a stroke that cuts 256 constraints takes, many times over.
pub const MESSAGE_SIZE_BYTES_MAX: usize = 64 << 10;
/// Messages of a page per second: a drag and an acknowledgement per frame of a 120 Hz display.
pub const MESSAGES_PER_SECOND_MAX: u32 = 240;
/// Messages that may come at once after a silence.
pub const MESSAGES_BURST_MAX: u32 = 480;
/// Frames that a page has not acknowledged. With one, the network's delay halves the rate; with
/// more, a slow page lags.
pub const FRAMES_UNACKNOWLEDGED_MAX: u32 = 2;
/// Most frames per second: that of common displays.
pub const FRAMES_PER_SECOND_MAX: u32 = 60;
/// Reliable messages that wait for one page before it is given up.
pub const RELIABLE_QUEUED_MAX: usize = 256;
/// Messages that wait for one Foxglove client; a new one replaces the oldest. More than a few are only
/// old when a client that was slow gets them.
pub const FOXGLOVE_QUEUED_MAX: usize = 8;
/// Requests of all pages that wait for the source.
pub const REQUESTS_QUEUED_MAX: usize = 4096;
/// Commands that wait for room at the node.
pub const COMMANDS_QUEUED_MAX: usize = 4096;
/// Constraints of one cut.
pub const CONSTRAINTS_PER_CUT_MAX: usize = 256;
/// Particles that one page holds: ten fingers, and some that it forgot.
pub const PARTICLES_HELD_MAX: usize = 16;
/// Steps of one command.
pub const STEPS_AT_ONCE_MAX: u32 = 10_000;
/// Scenes up to this size are sent as they are where the page leaves the choice.
pub const F32_PARTICLES_MAX: usize = 4096;
/// Most marks on a timeline.
pub const MARKS_MAX: usize = 4096;

/// How long a page that says nothing is believed in, and how long one message to it may take.
pub const SILENCE_MAX: Duration = Duration::from_secs(10);
/// How often a page is asked whether it is there.
pub const PING_PERIOD: Duration = Duration::from_secs(3);
/// How long a connection has for its first message, and for the head of a request.
pub const HELLO_TIMEOUT: Duration = Duration::from_secs(5);
/// How long a connection may last that is no socket: browsers open another one.
pub const CONNECTION_TIMEOUT: Duration = Duration::from_mins(1);
/// How long a command may go unanswered.
pub const OUTCOME_TIMEOUT: Duration = Duration::from_secs(2);
/// How long a server that ends waits for the node to let go of what pages hold.
pub const RELEASE_TIMEOUT: Duration = Duration::from_millis(500);
/// How long clients have to take their leave at the end.
pub const FAREWELL_TIMEOUT: Duration = Duration::from_secs(2);
/// Pause after a connection could not be taken.
pub const ACCEPT_PAUSE: Duration = Duration::from_millis(20);
