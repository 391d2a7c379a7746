//! The checks of a recording, snapshot by snapshot.

use std::io::Read;
use std::sync::atomic::AtomicBool;
use std::thread::Scope;

use crate::log::{
    AuditDifference, ColliderDetails, CollidersRow, Frame, LogEnd, LogReader, Message, OutcomeRow,
    ReadError, RunDescription, SceneColliders, TearsRow, Topic,
};
use sim_contract::Action;
use sim_solver::{Scene, Solver};

use super::coverage::Coverage;
use super::events::EventCheck;
use super::finding::{SnapshotFinding, StepGap};
use super::load::{compare_counts, compare_load, compare_run};
use super::read_ahead::{ReadAhead, ReadFrame};
use super::resimulation::{Resimulation, ResimulationError};
use super::snapshot_numbers::SnapshotNumbers;
use crate::recorded_scene::RecordedSceneError;
use crate::simulation::frozen::FrozenParticles;
use crate::simulation::run_id::RunId;

/// The format version from which on snapshots are numbered and tears have their causes.
const NUMBERED_VERSION: u32 = 4;

/// The reason why a recording cannot be verified.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The recording has no scene that can be simulated again.
    #[error(transparent)]
    Scene(#[from] RecordedSceneError),
    /// The operating system refused a thread.
    #[error("cannot start the thread that reads the file: {0}")]
    Thread(std::io::Error),
    /// The state to start from is invalid.
    #[error(transparent)]
    Start(#[from] ResimulationError),
    /// The recording has no complete state among the steps to compare.
    #[error("has no complete state up to step {step} to start from")]
    NoStateUpTo {
        /// The last step to compare.
        step: u64,
    },
    /// The recording has no complete state.
    #[error("has no snapshot with a keyframe to start from")]
    NoKeyframe {
        /// The end of a file that is not complete.
        end: Option<LogEnd>,
    },
}

/// The steps of a verification.
#[derive(Debug, Clone, Copy)]
pub struct StepRange {
    /// The step to start from, if it has a complete state, or the next one that has.
    pub start: u64,
    /// The last step to compare.
    pub last: u64,
}

/// Options of a verification.
#[derive(Debug, Clone, Copy)]
pub struct VerifyOptions {
    /// Threads of the solver.
    pub threads: usize,
    /// The steps to compare.
    pub range: StepRange,
}

/// A recording that is being verified.
#[derive(Debug)]
pub(super) struct Verification {
    pub(super) frames: ReadAhead,
    run: RunDescription,
    format_version: u32,
    /// The scene at load.
    loaded: Solver,
    colliders: SceneColliders,
    threads: usize,
    range: StepRange,
    pub(super) simulation: Option<Resimulation>,
    pub(super) coverage: Coverage,
    /// Number of scene loads, from `/topology`.
    revision: Option<u32>,
    /// The topics of the load that the file has.
    load_topics: Vec<Topic>,
    /// The file was simulated, not recorded from a node.
    is_simulated: bool,
    pub(super) numbers: SnapshotNumbers,
    events: EventCheck,
    /// The rows in /steps have the energy of their states.
    has_energy: bool,
    run_id: RunId,
    /// The file has every command of its run.
    has_all_commands: bool,
}

impl Verification {
    /// Starts to read `log`, which compares its form, on another thread.
    pub(super) fn start<'scope, R: Read + Send + 'scope>(
        threads: &'scope Scope<'scope, '_>,
        log: LogReader<R>,
        scene: &Scene,
        options: VerifyOptions,
    ) -> Result<Self, VerifyError> {
        let is_simulated = log.run().epoch_ns == 0;
        let is_older_format = !log.is_current_format();
        let has_numbers = log.format_version() >= NUMBERED_VERSION;
        let selection = log.selection();
        let left_out = selection.left_out().collect();
        let coverage = Coverage { is_older_format, left_out, ..Coverage::default() };
        Ok(Self {
            run_id: RunId::new(log.scene()),
            run: log.run().clone(),
            format_version: log.format_version(),
            frames: ReadAhead::start(threads, log).map_err(VerifyError::Thread)?,
            colliders: SceneColliders::new(scene),
            loaded: Solver::new(scene),
            threads: options.threads,
            range: options.range,
            simulation: None,
            coverage,
            revision: None,
            load_topics: Vec::new(),
            is_simulated,
            numbers: SnapshotNumbers::new(is_simulated, has_numbers, selection),
            events: EventCheck::default(),
            has_energy: selection.has_energy(),
            has_all_commands: false,
        })
    }

    /// Checks the next snapshot. Returns its step and the finding, or `None` at the end of the readable
    /// part.
    pub(super) fn next(
        &mut self,
        stop: &AtomicBool,
    ) -> Result<Option<(u64, SnapshotFinding)>, VerifyError> {
        loop {
            let ReadFrame { frame, frozen } = match self.frames.next_frame() {
                Ok(Some(frame)) => frame,
                Ok(None) => return Ok(None),
                Err(ReadError::Interrupted) => return Ok(Some((0, SnapshotFinding::Interrupted))),
                Err(error) => return Err(error.into()),
            };
            let step = frame.row.step;
            if step > self.range.last {
                self.coverage.last_step = Some(self.range.last);
                return Ok(None);
            }
            let finding = self.check(&frame, frozen, stop)?;
            self.frames.give_back(frame);
            if let Some(finding) = finding {
                return Ok(Some((step, finding)));
            }
            self.coverage.skipped_count += 1;
            self.coverage.skipped.get_or_insert(StepGap { from: step, to: step }).to = step;
        }
    }

    /// Returns the finding for a snapshot, or `None` before the first keyframe.
    fn check(
        &mut self,
        frame: &Frame,
        frozen: Option<FrozenParticles>,
        stop: &AtomicBool,
    ) -> Result<Option<SnapshotFinding>, ResimulationError> {
        match self.check_content(frame, frozen) {
            SnapshotFinding::Identical => {
                let finding = self.check_state(frame, stop)?;
                Ok(finding.map(|finding| self.check_energy(finding, frame)))
            }
            finding => Ok(Some(finding)),
        }
    }

    /// Refuses an identical snapshot without the energy that the file declares.
    fn check_energy(&self, finding: SnapshotFinding, frame: &Frame) -> SnapshotFinding {
        let lacks_energy = self.has_energy && frame.row.energy.is_none();
        if lacks_energy && finding == SnapshotFinding::Identical {
            let what =
                "its row in /steps lacks the energy, which the metadata 'selection' declares";
            return SnapshotFinding::at_step(frame.row.step, what.to_owned());
        }
        finding
    }

    /// Compares the form of the messages, the load and the events.
    fn check_content(&mut self, frame: &Frame, frozen: Option<FrozenParticles>) -> SnapshotFinding {
        let finding = self.form_finding();
        if finding != SnapshotFinding::Identical {
            return finding;
        }
        if let Some(topic) = self.frames.seen.newer_topic {
            let what = format!("its format_version is older than {}", topic.name());
            return SnapshotFinding::in_file(format!("the metadata 'run': {what}"));
        }
        let diverged =
            |what| SnapshotFinding::Diverged { step: frame.row.step, what, difference: None };
        self.add_commands(frame);
        if let Some(what) = self.check_load(frame) {
            return diverged(what);
        }
        let revision = *self.revision.get_or_insert(frame.row.topology_revision);
        if frame.row.topology_revision != revision {
            return diverged("its topology_revision in /steps is not that of /topology".to_owned());
        }
        if let Some(finding) = self.check_rows(frame) {
            return finding;
        }
        if frame.row.energy.is_some() && !self.has_energy {
            let what =
                "its row in /steps has an energy, which the metadata 'selection' does not declare";
            return diverged(what.to_owned());
        }
        let what = self.numbers.check(&frame.row);
        let events = frozen.and_then(|frozen| self.check_events(frame, frozen));
        what.or(events).map_or(SnapshotFinding::Identical, diverged)
    }

    /// Compares the events with particles.
    fn check_events(&mut self, frame: &Frame, frozen: FrozenParticles) -> Option<String> {
        if self.range.start > 0 && self.simulation.is_none() && frame.particles.is_some() {
            self.events.skip(frame.row.step, frozen);
            return None;
        }
        let what = self.events.check(frame, frozen, self.numbers.is_after_gap());
        what.filter(|_| !self.coverage.left_out.contains(&Topic::Events))
    }

    /// Compares the events of a snapshot that has no particles with those of the simulation.
    fn check_events_of_simulation(&mut self, frame: &Frame) -> SnapshotFinding {
        if frame.particles.is_some() {
            return SnapshotFinding::Identical;
        }
        let Some(simulation) = &self.simulation else { return SnapshotFinding::Identical };
        let frozen = FrozenParticles::find(simulation.particles());
        let what = self.check_events(frame, frozen);
        what.map_or(SnapshotFinding::Identical, |what| SnapshotFinding::Diverged {
            step: frame.row.step,
            what,
            difference: None,
        })
    }

    fn check_load(&mut self, frame: &Frame) -> Option<String> {
        let is_load = |one: &&Message| matches!(one, Message::Topology(_) | Message::Surface(_));
        let mut rows = frame.updates.iter().filter(is_load).peekable();
        rows.peek()?;
        let run = &self.run;
        let solver = &self.loaded;
        for row in rows {
            let topic = row.topic();
            if self.load_topics.contains(&topic) {
                return Some(format!("the message on {} is in the file twice", topic.name()));
            }
            self.load_topics.push(topic);
            if let Message::Topology(row) = row {
                self.revision = Some(row.revision);
            }
            if let Some(what) = compare_load(row, run, self.format_version, solver) {
                return Some(what);
            }
        }
        compare_counts(run, self.format_version, solver)
    }

    /// Checks the fields of tears and outcomes on which no state depends.
    fn check_rows(&mut self, frame: &Frame) -> Option<SnapshotFinding> {
        frame.updates.iter().find_map(|update| {
            let what = match update {
                Message::Outcome(row) => self.check_disconnected(row),
                Message::Tears(row) => self.check_causes(row),
                Message::Colliders(row) => self.check_details(row),
                Message::Event(row) if self.is_simulated && row.is_of_member() => {
                    Some("/events: a simulation has no lockstep".to_owned())
                }
                _ => None,
            }?;
            Some(SnapshotFinding::Diverged { step: update.step(), what, difference: None })
        })
    }

    /// Only a node ends the grab of a client whose connection has ended, and it always can.
    fn check_disconnected(&self, row: &OutcomeRow) -> Option<String> {
        let is_release = matches!(row.action, Action::Release { .. }) && row.is_applied();
        let is_wrong = row.disconnected && (self.is_simulated || !is_release);
        is_wrong.then(|| {
            let index = row.index;
            format!("/outcomes: outcome {index}: it is no release of a node, but \"disconnected\"")
        })
    }

    /// Older formats have no causes, and a node may have causes that its recorder did not know.
    fn check_causes(&mut self, row: &TearsRow) -> Option<String> {
        let is_complete = row.causes.len() == row.constraints.len();
        let unknown_count = row.causes.iter().filter(|cause| *cause == "unknown").count();
        self.coverage.unknown_cause_count += unknown_count;
        let has_causes = self.format_version >= NUMBERED_VERSION;
        let is_wrong = has_causes && !is_complete || self.is_simulated && unknown_count > 0;
        is_wrong.then(|| "/tears: it has no cause for one of its constraints".to_owned())
    }

    /// Compares the details of colliders with the scene. Recordings of earlier builds have none.
    fn check_details(&self, row: &CollidersRow) -> Option<String> {
        let none = ColliderDetails::default();
        let mut pairs = row.colliders.iter().zip(&self.colliders.details);
        let place = pairs.position(|(one, own)| one.details != none && one.details != *own)?;
        let [recorded, own] = [&row.colliders[place].details, &self.colliders.details[place]];
        Some(format!("/colliders: collider {place}: recorded {recorded:?}, in the scene {own:?}"))
    }

    /// Adds the commands of a snapshot to the id of the run.
    fn add_commands(&mut self, frame: &Frame) {
        if self.events.is_new() {
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
    ) -> Result<Option<SnapshotFinding>, ResimulationError> {
        if let Some(simulation) = &mut self.simulation {
            return Ok(Some(match simulation.advance(frame, stop) {
                SnapshotFinding::Identical => self.check_events_of_simulation(frame),
                finding => finding,
            }));
        }
        if frame.row.step < self.range.start {
            return Ok(None);
        }
        let start = Resimulation::start_from(frame, || self.loaded.clone())?;
        let Some(mut start) = start else { return Ok(None) };
        start.set_threads(self.threads);
        self.coverage.is_restored = frame.row.step > 0;
        Ok(Some(self.simulation.insert(start).compare_start(frame)))
    }

    /// Completes the description of what was compared, once [`Self::next`] has returned `None`.
    pub(super) fn finish_coverage(&mut self) {
        let waiting_count = self.simulation.as_ref().map_or(0, Resimulation::waiting_count);
        self.coverage.trailing_count = self.frames.seen.trailing_count + waiting_count;
        self.coverage.earlier_count =
            self.simulation.as_ref().map_or(0, Resimulation::earlier_count);
        self.coverage.given_count = self.simulation.as_ref().map_or(0, Resimulation::given_count);
        self.coverage.foreign.clone_from(&self.frames.seen.foreign);
        let own = &self.colliders.files;
        let is_other = |name: &&String| own.iter().all(|file| file.name != **name);
        let others = self.frames.seen.mesh_files.iter().filter(is_other);
        self.coverage.foreign.extend(others.map(|name| format!("attachment '{name}'")));
    }

    /// Returns the steps whose states could not be simulated.
    pub(super) fn gaps(&self) -> Vec<StepGap> {
        self.simulation.as_ref().map_or_else(Vec::new, |simulation| simulation.gaps().to_vec())
    }

    /// Checks the end of the file, once [`Self::next`] has returned `None`.
    pub(super) fn check_end(&mut self) -> SnapshotFinding {
        let closing = self.frames.seen.closing.as_deref();
        let finding = self.form_finding();
        if finding != SnapshotFinding::Identical {
            return finding;
        }
        if let Some(what) = closing.and_then(|one| self.numbers.check_declared(one)) {
            return SnapshotFinding::in_file(what);
        }
        // A recording of a node has a random id. An interrupted simulation has fewer commands, and so has a
        // repaired file that lacks some.
        let has_inputs = self.is_simulated && self.has_all_commands;
        let is_whole = closing.is_some_and(|one| {
            one.stop_reason == "steps reached"
                && !one.missing().contains_key(Topic::Outcomes.name())
        });
        self.coverage.has_run_hash = has_inputs && is_whole && self.gaps().is_empty();
        if self.coverage.has_run_hash && self.run.run_id != self.run_id.value() {
            return SnapshotFinding::in_file(
                "the metadata 'run': its run_id is not the hash of the scene and the commands in \
                 /outcomes"
                    .to_owned(),
            );
        }
        SnapshotFinding::Identical
    }

    fn form_finding(&self) -> SnapshotFinding {
        form_finding(self.frames.seen.difference.as_ref())
    }
}

/// Compares the header of a file with the scene. `log` compares its form.
pub(super) fn check_header<R: Read>(log: &LogReader<R>, scene: &Scene) -> SnapshotFinding {
    let what = match form_finding(log.audit().and_then(|audit| audit.difference())) {
        SnapshotFinding::Identical => compare_run(log, scene),
        finding => return finding,
    };
    what.map_or(SnapshotFinding::Identical, SnapshotFinding::in_file)
}

/// Returns the finding for a part of the file that a recorder would write differently.
fn form_finding(difference: Option<&AuditDifference>) -> SnapshotFinding {
    difference.map_or(SnapshotFinding::Identical, |AuditDifference { step, what }| match step {
        None => SnapshotFinding::in_file(what.clone()),
        Some(step) => SnapshotFinding::at_step(*step, what.clone()),
    })
}
