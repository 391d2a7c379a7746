//! The world of a run: one name in one domain, and the programs around it.

use sim_contract::Client;

use crate::faults::action::{CLIENTS, Ending, RECORDERS};
use crate::faults::actor::{Actor, Ends};
use crate::faults::domain_files::DomainFiles;
use crate::faults::journal::Journal;
use crate::faults::kept_files::KeptFiles;
use crate::process::Finished;
use crate::programs::Program;
use crate::sandbox::Sandbox;

/// Most stubborn readers at the same time.
const READERS_MAX: usize = 2;

const READER_ENDS: Ends = Ends { codes: &[], errors: &["NoNode"], needs_no_signal: false };

/// A recorder and its file.
#[derive(Debug)]
pub(super) struct Recorder {
    pub(super) actor: Actor,
    pub(super) file: String,
    /// [`World::load_count`] at its start.
    pub(super) load_count: u64,
    /// True if a number of steps ends it.
    pub(super) has_steps: bool,
}

/// The programs, and what is known of them.
// Fields are dropped in this order: clients and programs leave the domain before it is removed, and the
// journal is printed after the output of the programs.
#[derive(Debug)]
pub(super) struct World {
    pub(super) clients: [Option<Client>; CLIENTS],
    pub(super) recorders: [Option<Recorder>; RECORDERS],
    pub(super) bridge: Option<Actor>,
    pub(super) readers: Vec<Actor>,
    pub(super) node: Option<Actor>,
    /// Number of nodes and loads so far. A recording ends with its load.
    pub(super) load_count: u64,
    pub(super) kept: KeptFiles,
    pub(super) journal: Journal,
    pub(super) files: DomainFiles,
    pub(super) sandbox: Sandbox,
}

impl World {
    pub(super) fn new(seed: u64) -> Self {
        let sandbox = Sandbox::new();
        Self {
            clients: Default::default(),
            recorders: Default::default(),
            bridge: None,
            readers: Vec::new(),
            node: None,
            load_count: 0,
            kept: KeptFiles::default(),
            journal: Journal::new(seed),
            files: DomainFiles::new(&sandbox),
            sandbox,
        }
    }

    /// Asserts that no program has ended that runs until it gets a signal.
    pub(super) fn check_lasting_programs(&mut self) {
        for lasting in [&mut self.node, &mut self.bridge] {
            if let Some(mut actor) = lasting.take() {
                if actor.is_running() {
                    *lasting = Some(actor);
                } else {
                    actor.wait(&mut self.journal);
                }
            }
        }
    }

    /// Runs a program to its end.
    pub(super) fn run(&mut self, program: Program, args: &[&str], ends: Ends) -> Finished {
        Actor::start(program, &self.sandbox, args, ends).wait(&mut self.journal)
    }

    /// Starts a reader that borrows samples and never returns them.
    pub(super) fn start_stubborn_reader(&mut self) {
        if self.node.is_some() && self.readers.len() < READERS_MAX {
            let reader = Actor::start(Program::StubbornReader, &self.sandbox, &[], READER_ENDS);
            self.readers.push(reader);
        }
    }

    /// Kills the oldest of them.
    pub(super) fn kill_stubborn_reader(&mut self) {
        if !self.readers.is_empty() {
            self.readers.remove(0).end(Ending::Kill, &self.files, &mut self.journal);
        }
    }
}
