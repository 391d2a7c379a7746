//! The checks of a recording, snapshot by snapshot.

use std::io::Read;
use std::sync::atomic::AtomicBool;

use recorder::{EventRow, Frame, FrameReader, LogReader, Message, ReadError};
use sim_contract::ParticleFlags;
use sim_solver::{Scene, Solver};

use super::coverage::Coverage;
use super::load::{compare_counts, compare_load, compare_run};
use super::resimulation::{Finding, Resimulation, StartError};
use crate::simulation::frozen::FrozenTracker;
use crate::simulation::run_id::RunId;

/// The reason why a recording cannot be verified.
#[derive(Debug, thiserror::Error)]
pub(crate) enum VerifyError {
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error(transparent)]
    Start(#[from] StartError),
}

/// A recording that is being verified.
#[derive(Debug)]
pub(super) struct Verification<R> {
    pub(super) frames: FrameReader<R>,
    scene: Scene,
    threads: usize,
    pub(super) simulation: Option<Resimulation>,
    pub(super) coverage: Coverage,
    /// Number of scene loads, from `/topology`.
    revision: Option<u32>,
    frozen: FrozenTracker,
    run_id: RunId,
    /// The file has every command of its run.
    has_all_commands: bool,
}

impl<R: Read> Verification<R> {
    pub(super) fn new(log: LogReader<R>, scene: Scene, threads: usize) -> Self {
        let coverage =
            Coverage { is_older_format: !log.is_current_format(), ..Coverage::default() };
        Self {
            run_id: RunId::new(log.scene()),
            frames: FrameReader::new(log.with_audit()),
            scene,
            threads,
            simulation: None,
            coverage,
            revision: None,
            frozen: FrozenTracker::default(),
            has_all_commands: false,
        }
    }

    /// Compares the header of the file with the scene.
    pub(super) fn check_header(&self) -> Finding {
        let log = self.frames.log();
        let what = match self.audit_finding() {
            Finding::Identical => compare_run(log.run(), log.scene(), &self.scene),
            finding => return finding,
        };
        what.map_or(Finding::Identical, Finding::in_file)
    }

    /// Checks the next snapshot. Returns its step and the finding, or `None` at the end of the readable
    /// part.
    pub(super) fn next(
        &mut self,
        stop: &AtomicBool,
    ) -> Result<Option<(u64, Finding)>, VerifyError> {
        loop {
            let frame = match self.frames.next_frame() {
                Ok(Some(frame)) => frame,
                Ok(None) => return Ok(None),
                Err(ReadError::Interrupted) => return Ok(Some((0, Finding::Interrupted))),
                Err(error) => return Err(error.into()),
            };
            let step = frame.row.step;
            let finding = self.check_content(&frame);
            if finding != Finding::Identical {
                return Ok(Some((step, finding)));
            }
            if let Some(finding) = self.check_state(&frame, stop)? {
                return Ok(Some((step, finding)));
            }
            self.coverage.skipped_count += 1;
        }
    }

    /// Compares the form of the messages, the load and the events.
    fn check_content(&mut self, frame: &Frame) -> Finding {
        let finding = self.audit_finding();
        if finding != Finding::Identical {
            return finding;
        }
        let has_parameters = frame.updates.iter().any(|one| matches!(one, Message::Parameters(_)));
        if self.coverage.is_older_format && has_parameters {
            return Finding::in_file(
                "the metadata 'run': its format_version is older than /parameters".to_owned(),
            );
        }
        let diverged = |what| Finding::Diverged { step: frame.row.step, what, difference: None };
        self.add_commands(frame);
        if let Some(what) = self.check_load(frame) {
            return diverged(what);
        }
        let revision = *self.revision.get_or_insert(frame.row.topology_revision);
        if frame.row.topology_revision != revision {
            return diverged("its topology_revision in /steps is not that of /topology".to_owned());
        }
        self.check_events(frame).map_or(Finding::Identical, diverged)
    }

    fn check_load(&mut self, frame: &Frame) -> Option<String> {
        let is_load = |one: &&Message| matches!(one, Message::Topology(_) | Message::Surface(_));
        let mut rows = frame.updates.iter().filter(is_load).peekable();
        rows.peek()?;
        let run = self.frames.log().run();
        let solver = Solver::new(&self.scene);
        for row in rows {
            if let Message::Topology(row) = row {
                self.revision = Some(row.revision);
            }
            if let Some(what) = compare_load(row, run, &solver) {
                return Some(what);
            }
        }
        compare_counts(run, &solver)
    }

    /// Compares the events with the particles that froze since the last snapshot.
    fn check_events(&mut self, frame: &Frame) -> Option<String> {
        let (step, particles) = (frame.row.step, &frame.particles);
        let expected = self.frozen.new_events(step, particles);
        let events = frame.updates.iter().filter_map(|update| match update {
            Message::Event(row) => Some(row),
            _ => None,
        });
        let (own, earlier): (Vec<_>, Vec<_>) = events.partition(|row| row.step == step);
        // Events of snapshots that are missing tell of particles that froze in those.
        let is_frozen = |row: &&EventRow| {
            let particle = row.particle.and_then(|index| particles.get(index as usize));
            particle.is_none_or(|state| state.flags & ParticleFlags::FROZEN != 0)
        };
        let is_same = match earlier.as_slice() {
            [] => own.iter().copied().eq(&expected),
            _ => own.iter().all(is_frozen),
        };
        (!is_same).then(|| "its events in /events are not those of its particles".to_owned())
    }

    /// Adds the commands of a snapshot to the id of the run.
    fn add_commands(&mut self, frame: &Frame) {
        if self.frozen.is_new() {
            self.has_all_commands = frame.row.step == 0 && frame.row.outcome_count == 0;
        }
        let mut rows: Vec<_> = frame
            .updates
            .iter()
            .filter_map(|update| match update {
                Message::Outcome(row) => Some(row),
                _ => None,
            })
            .collect();
        rows.sort_by_key(|row| row.index);
        for row in rows {
            self.run_id.add(row.step, row.client_id, row.sequence, row.action);
        }
    }

    /// Compares the state with the simulation. Returns `None` before the first keyframe.
    fn check_state(
        &mut self,
        frame: &Frame,
        stop: &AtomicBool,
    ) -> Result<Option<Finding>, StartError> {
        if let Some(simulation) = &mut self.simulation {
            return Ok(Some(simulation.advance(frame, stop)));
        }
        let Some(mut start) = Resimulation::start(&self.scene, frame)? else { return Ok(None) };
        start.set_threads(self.threads);
        self.coverage.is_restored = frame.row.step > 0;
        Ok(Some(self.simulation.insert(start).compare_start(frame)))
    }

    /// Checks the end of the file, once [`Self::next`] has returned `None`.
    pub(super) fn check_end(&mut self) -> Finding {
        self.coverage.trailing_count = self.frames.trailing_updates().len();
        let log = self.frames.log();
        let foreign = log.audit().into_iter().flat_map(recorder::Audit::foreign);
        self.coverage.foreign = foreign.map(ToOwned::to_owned).collect();
        let finding = self.audit_finding();
        if finding != Finding::Identical {
            return finding;
        }
        // A recording of a node has a random id. An interrupted simulation has fewer commands.
        let is_simulated = log.run().epoch_ns == 0 && self.has_all_commands;
        let is_whole = log.closing().is_some_and(|one| one.stop_reason == "steps reached");
        self.coverage.has_run_hash = is_simulated && is_whole;
        if self.coverage.has_run_hash && log.run().run_id != self.run_id.value() {
            return Finding::in_file(
                "the metadata 'run': its run_id is not the hash of the scene and the commands in \
                 /outcomes"
                    .to_owned(),
            );
        }
        Finding::Identical
    }

    fn audit_finding(&self) -> Finding {
        let difference = self.frames.log().audit().and_then(|audit| audit.difference());
        difference.map_or(Finding::Identical, |difference| match difference.step {
            None => Finding::in_file(difference.what.clone()),
            Some(step) => {
                Finding::Diverged { step, what: difference.what.clone(), difference: None }
            }
        })
    }
}
