//! The seam between a source and the protocols that show it.
//!
//! A source publishes [`Update`]s; each [`Sink`] translates them into its protocol. There are two
//! sinks: the pages and the Foxglove clients.

use std::fmt::Debug;
use std::sync::Arc;

use recording::{OutcomeRow, StatusRow, StepRow};
use sim_contract::{
    BendState, ConstraintState, Forces, LoadHeader, ParticleState, TornConstraint, Triangle,
};

use crate::message::{
    GhostText, Level, Node, OutcomeText, ParametersText, Playback, Timeline, Undoable,
};
use crate::request::ClientId;
use crate::shutdown::Shutdown;
use crate::wire::{Colliders, Ghost, Pins, Scene, Stamp, Statistics};

/// Something that a source shows or reports.
#[derive(Debug, Clone, Copy)]
pub enum Update<'a> {
    /// A new load. Nothing of it is torn, held or moved yet.
    Load(&'a Scene),
    /// The constraints and triangles of the load, as the node publishes them. It follows [`Update::Load`].
    Topology(Topology<'a>),
    /// The newest load cannot be shown. The previous one stays on show until the next [`Update::Load`].
    LoadRefused {
        /// The reason, for the user.
        text: &'a str,
    },
    /// The list of torn constraints has changed.
    Torn(Torn<'a>),
    /// The set of particles that are not free has changed.
    Pins(&'a Pins),
    /// The colliders have changed. Sinks show them with the next state.
    Colliders(&'a Colliders),
    /// The newest state. Everything that belongs to it has been published before.
    State(State<'a>),
    /// A client asked for the newest state again, and no other state will come soon.
    SameState,
    /// Statistics of the node and the scene. The sink adds those of its own clients.
    Statistics(&'a Statistics),
    /// The state of the node has changed.
    Node(&'a Node),
    /// The parameters have changed.
    Parameters(&'a ParametersText),
    /// The contents of the recording are known better.
    Timeline(&'a Timeline),
    /// The playback of the recording has changed.
    Playback(&'a Playback),
    /// Another recording is chosen as the ghost, or more is known about it.
    Ghost(&'a GhostText),
    /// The scene is back at its beginning.
    Reset {
        /// First step that shows it.
        step: u64,
    },
    /// A message for the user.
    Notice {
        /// Its severity.
        level: Level,
        /// The message.
        text: &'a str,
    },
    /// The newest change that a client can undo is another one. Only the sink of that client tells it.
    Undoable {
        /// The client.
        client: ClientId,
        /// Kind of change; `None` if there is none.
        what: Option<Undoable>,
    },
    /// A status message of the node.
    Status(&'a StatusRow),
    /// An outcome that the node published, for a command of any client.
    Outcome(&'a OutcomeRow),
    /// The answer to a command. Only the sink of that client sends it.
    Answer {
        /// The client that sent the command.
        client: ClientId,
        /// The answer.
        outcome: &'a OutcomeText,
    },
}

/// The constraints and triangles of a load.
#[derive(Debug, Clone, Copy)]
pub struct Topology<'a> {
    /// Header of the load.
    pub header: &'a LoadHeader,
    /// Constraints in the order of their indices.
    pub constraints: &'a [ConstraintState],
    /// Bends in the order of their indices.
    pub bends: &'a [BendState],
    /// Triangles of the surface.
    pub triangles: &'a [Triangle],
}

/// The list of torn constraints after a step, in the order of tearing.
#[derive(Debug, Clone, Copy)]
pub struct Torn<'a> {
    /// Load and step.
    pub stamp: Stamp,
    /// All torn constraints.
    pub all: &'a [TornConstraint],
    /// Number of entries at the front that were published before.
    pub known_count: usize,
}

/// The state after a step.
#[derive(Debug, Clone, Copy)]
pub struct State<'a> {
    /// Number of the load. [`crate::source::shown_state::ShownState`] fills it in.
    pub epoch: u32,
    /// The step and its timing.
    pub row: StepRow,
    /// Simulated time in s.
    pub sim_time_s: f64,
    /// [`crate::wire::frame_flag`] bits.
    pub flags: u32,
    /// `CLOCK_MONOTONIC` at publication, in ns.
    pub publish_monotonic_ns: u64,
    /// The particles.
    pub particles: &'a [ParticleState],
    /// The forces of the step, if they were read.
    pub forces: Option<&'a Forces>,
    /// The state of another recording at the same time.
    pub ghost: Option<&'a Ghost>,
}

/// Something that a source computes only if a client wants it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Demand {
    /// The next state.
    State,
    /// Statistics.
    Statistics,
    /// The forces of each step.
    Forces,
}

/// A protocol that shows a simulation to its clients.
pub trait Sink: Debug + Send + Sync {
    /// Returns whether a client waits for this.
    fn has_demand(&self, demand: Demand) -> bool;

    /// Sends an update to the clients. Never blocks: a slow client misses states, or is disconnected.
    fn publish(&self, update: &Update<'_>);
}

/// All sinks of the program.
#[derive(Debug, Default)]
pub struct Sinks {
    sinks: Vec<Arc<dyn Sink>>,
    shutdown: Shutdown,
}

impl Sinks {
    /// No sinks yet.
    pub fn new(shutdown: Shutdown) -> Self {
        Self { sinks: Vec::new(), shutdown }
    }

    /// Adds a sink.
    pub fn add(&mut self, sink: Arc<dyn Sink>) {
        self.sinks.push(sink);
    }

    /// Returns whether a client of any sink waits for this.
    pub fn has_demand(&self, demand: Demand) -> bool {
        self.sinks.iter().any(|sink| sink.has_demand(demand))
    }

    /// Publishes an update to every sink.
    pub fn publish(&self, update: &Update<'_>) {
        for sink in &self.sinks {
            sink.publish(update);
        }
    }

    /// Returns whether the program is ending.
    pub fn is_shutting_down(&self) -> bool {
        self.shutdown.has_begun()
    }
}
