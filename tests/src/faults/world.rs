//! The world of a run: one name in one domain, and the programs around it.

use sim_contract::Client;

use crate::faults::action::{CLIENTS, MEMBERS, RECORDERS};
use crate::faults::actor::{Actor, Ends};
use crate::faults::domain_files::DomainFiles;
use crate::faults::journal::Journal;
use crate::faults::kept_files::KeptFiles;
use crate::finished::Finished;
use crate::programs::Program;
use crate::sandbox::Sandbox;

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

/// A member of the lockstep.
#[derive(Debug)]
pub(super) struct Member {
    pub(super) actor: Actor,
    pub(super) client_id: u64,
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
    pub(super) followers: Vec<Actor>,
    pub(super) members: [Option<Member>; MEMBERS],
    /// Clients that were stopped while they gave states.
    pub(super) restorers: Vec<Actor>,
    pub(super) node: Option<Actor>,
    /// Number of nodes and loads so far. A recording ends with its load.
    pub(super) load_count: u64,
    /// Numbers of members and of restorers so far.
    pub(super) member_count: u64,
    pub(super) restorer_count: u64,
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
            followers: Vec::new(),
            members: Default::default(),
            restorers: Vec::new(),
            node: None,
            load_count: 0,
            member_count: 0,
            restorer_count: 0,
            kept: KeptFiles::default(),
            journal: Journal::new(seed),
            files: DomainFiles::new(&sandbox),
            sandbox,
        }
    }

    /// Asserts that no program has ended that runs until it gets a signal.
    pub(super) fn check_lasting_programs(&mut self) {
        for index in (0..self.followers.len()).rev() {
            if !self.followers[index].is_running() {
                self.followers.remove(index).wait(&mut self.journal);
            }
        }
        for slot in &mut self.members {
            if let Some(mut member) = slot.take() {
                if member.actor.is_running() {
                    *slot = Some(member);
                } else {
                    member.actor.wait(&mut self.journal);
                }
            }
        }
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
}
