//! The actions of a schedule.

/// Number of recorders that can run at the same time.
pub(super) const RECORDERS: usize = 2;
/// Number of members of the lockstep that can run at the same time.
pub(super) const MEMBERS: usize = 3;
/// Number of clients that stay connected from action to action.
pub(super) const CLIENTS: usize = 3;
/// The end of a program.
#[derive(Debug, Clone, Copy)]
pub(super) enum Ending {
    Kill,
    Interrupt,
    Terminate,
    HangUp,
    InterruptTwice,
    /// Ctrl-C, then a kill after this many changes of the files of the domain.
    InterruptThenKill(u32),
}

/// A connection to the bridge, cut off at a random point.
#[derive(Debug, Clone, Copy)]
pub(super) enum Visit {
    /// Nothing is sent.
    Silent,
    /// Part of a request.
    HalfRequest,
    /// A request for the page, whose answer is read.
    Download,
    /// A page that connects and reads a few messages.
    Page,
    /// A page that grabs a particle.
    GrabbingPage,
    /// A page that sends no valid message.
    Nonsense,
}

/// An action. Those on a program that does not run do nothing.
#[derive(Debug, Clone)]
pub(super) enum Action {
    /// Starts a node, which is refused if one runs.
    StartNode {
        args: String,
    },
    /// Starts a node, and kills it after this many changes of the files of the domain.
    KillNodeAtStart {
        args: String,
        changes: u32,
    },
    EndNode(Ending),
    KillNodeInLoad {
        scene: &'static str,
        changes: u32,
    },
    StartRecorder {
        slot: usize,
        args: String,
    },
    KillRecorderAtStart {
        changes: u32,
    },
    EndRecorder {
        slot: usize,
        ending: Ending,
    },
    StopRecorder {
        slot: usize,
    },
    ContinueRecorder {
        slot: usize,
    },
    LimitFileSize {
        slot: usize,
        size_bytes: u64,
    },
    StartBridge,
    EndBridge(Ending),
    Visit(Visit),
    Ctl {
        line: String,
    },
    KillCtl {
        line: String,
        changes: u32,
    },
    Request {
        client: usize,
        command: String,
    },
    Flood {
        clients: usize,
        count: usize,
        command: String,
    },
    /// Lets a running node make steps, so that recordings grow.
    Wait {
        steps: u64,
    },
    KillGrabber {
        particle: u32,
        changes: u32,
    },
    StartStubbornReader,
    StopStubbornReader,
    ContinueStubbornReader,
    KillStubbornReader,
    /// Starts a reader of snapshots that goes on from node to node.
    StartFollower,
    StopFollower,
    ContinueFollower,
    EndFollower(Ending),
    /// Starts a member of the lockstep, which takes part every k-th step.
    StartMember {
        slot: usize,
        every: u32,
    },
    KillMemberAtStart {
        every: u32,
        changes: u32,
    },
    /// Stops a member. The node drops it.
    StopMember {
        slot: usize,
    },
    /// Continues a member, which joins again.
    ContinueMember {
        slot: usize,
    },
    EndMember {
        slot: usize,
        ending: Ending,
    },
    /// Starts a client that gives states to the node, and kills it.
    KillRestorer {
        contents: &'static str,
        changes: u32,
    },
    /// Starts a client that gives states to the node, and stops it.
    StopRestorer {
        contents: &'static str,
        changes: u32,
    },
    /// Continues the client that was stopped first, and ends it.
    EndRestorer(Ending),
    /// Gives a state of a kept recording to the node, with `recorder restore`.
    Restore {
        time_ms: u32,
        changes: Option<u32>,
    },
    /// Lets a process write random bytes into two services, without a pause, for some steps.
    WriteNoise {
        steps: u64,
        ending: Ending,
    },
    /// Removes the files in the root of the domain. Nothing can attach to the node until it has ended.
    Clean {
        args: String,
    },
    Play {
        ending: Ending,
        changes: u32,
    },
    Simulate {
        steps: u32,
        changes: Option<u32>,
    },
}
