//! Another recording of the scene, whose states are shown as a ghost in the picture of this one.
//!
//! A thread opens it and finds the first step at which the two differ; the player reads the states on show.

mod job;

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

use recording::verification::distance;
use recording::{ReadError, RecordedState, Tape, TapeError};
use sim_contract::{ConstraintState, ParticleState};
use sim_host::Stop;

use super::open::Recording;
use crate::message::{GhostState, GhostText, Refusal};
use crate::source::recording_files::{name_of, path_of};
use crate::wire::{Ghost, Stamp};
use job::{Job, Report, Shown};

/// The recordings that can be the ghost of another one.
#[derive(Debug, Clone, Default)]
pub struct GhostChoice {
    /// Folder of the recordings that pages can choose, if there is one.
    pub folder: Option<PathBuf>,
    /// The recording that is the ghost from the start, which may lie elsewhere.
    pub given: Option<PathBuf>,
}

impl GhostChoice {
    fn given_name(&self) -> Option<String> {
        self.given.as_deref().and_then(name_of)
    }

    /// Returns the path of a recording that exists.
    fn path_of(&self, name: &str) -> Option<PathBuf> {
        if self.given_name().as_deref() == Some(name) {
            return self.given.clone();
        }
        let path = self.folder.as_deref().and_then(|folder| path_of(folder, name));
        path.filter(|path| path.is_file())
    }
}

/// The chosen ghost, if there is one.
#[derive(Debug)]
pub(super) struct Ghosts {
    choice: GhostChoice,
    stop: Stop,
    text: GhostText,
    chosen: Option<Chosen>,
    /// The thread of the last ghost. The next one begins when it has ended.
    thread: Option<JoinHandle<()>>,
    waiting: Option<(Job, Sender<Report>)>,
}

/// A ghost that has been chosen. Dropping it ends its thread.
#[derive(Debug)]
struct Chosen {
    reports: Receiver<Report>,
    is_cancelled: Arc<AtomicBool>,
    /// Once it is open.
    tape: Option<Box<Tape>>,
    /// The step on show for which the state was read, and the state, if the ghost has one there.
    read: Option<(u64, Option<Ghost>)>,
}

impl Drop for Chosen {
    fn drop(&mut self) {
        self.is_cancelled.store(true, Ordering::Relaxed);
    }
}

impl Ghosts {
    pub(super) fn new(choice: GhostChoice, stop: Stop) -> Self {
        let text = GhostText { given: choice.given_name(), ..GhostText::default() };
        Self { choice, stop, text, chosen: None, thread: None, waiting: None }
    }

    /// Chooses the recording of the command line, if there is one.
    pub(super) fn choose_given(&mut self, recording: &Recording) {
        if let Some(path) = self.choice.given.clone() {
            self.begin(path, recording);
        }
    }

    /// Chooses a recording by its name, or none.
    pub(super) fn choose(
        &mut self,
        name: Option<&str>,
        recording: &Recording,
    ) -> Result<(), Refusal> {
        let Some(name) = name else {
            (self.chosen, self.waiting) = (None, None);
            self.text = GhostText { given: self.text.given.take(), ..GhostText::default() };
            return Ok(());
        };
        let path = self.choice.path_of(name).ok_or(Refusal::UnknownRecording)?;
        self.begin(path, recording);
        Ok(())
    }

    fn begin(&mut self, path: PathBuf, recording: &Recording) {
        let (sender, reports) = channel();
        let is_cancelled = Arc::new(AtomicBool::new(false));
        let job = Job {
            shown: Shown::from_recording(recording),
            name: name_of(&path).unwrap_or_default(),
            path,
            stop: self.stop.clone(),
            is_cancelled: Arc::clone(&is_cancelled),
        };
        self.text = GhostText {
            state: GhostState::Opening,
            name: Some(job.name.clone()),
            given: self.text.given.take(),
            text: format!("opening {}", job.name),
            first_different_step: None,
        };
        // Dropping the last ghost ends its thread.
        self.chosen = Some(Chosen { reports, is_cancelled, tape: None, read: None });
        self.waiting = Some((job, sender));
        self.start_waiting();
    }

    /// Starts the thread of the chosen ghost once that of the last one has ended: there is one at a time, however
    /// fast pages choose. Returns whether it failed.
    fn start_waiting(&mut self) -> bool {
        if self.thread.as_ref().is_some_and(|thread| !thread.is_finished()) {
            return false;
        }
        let Some((job, sender)) = self.waiting.take() else { return false };
        let builder = thread::Builder::new().name("ghost".to_owned());
        match builder.spawn(move || job.run(&sender)) {
            Ok(thread) => {
                self.thread = Some(thread);
                false
            }
            Err(error) => {
                self.text.state = GhostState::Failed;
                self.text.text = format!("cannot start the thread that opens it: {error}");
                true
            }
        }
    }

    pub(super) fn text(&self) -> &GhostText {
        &self.text
    }

    /// Takes the reports of the thread. Returns whether there were any.
    pub(super) fn update(&mut self) -> bool {
        let mut has_changed = self.start_waiting();
        let Some(chosen) = &mut self.chosen else { return false };
        for report in chosen.reports.try_iter() {
            has_changed = true;
            match report {
                Report::Opened(tape) => chosen.tape = Some(tape),
                Report::Progress { state, text, first_different_step } => {
                    self.text.state = state;
                    self.text.text = text;
                    self.text.first_different_step = first_different_step;
                }
            }
        }
        has_changed
    }

    /// Returns the read errors of the ghost since the last call, as text for users.
    pub(super) fn drain_faults(&mut self) -> Vec<String> {
        let tape = self.chosen.as_mut().and_then(|chosen| chosen.tape.as_mut());
        tape.map(|tape| tape.drain_faults()).unwrap_or_default()
    }

    /// Reads the ghost of a state, if one is chosen. Returns whether the ghost has changed.
    ///
    /// # Errors
    /// A signal has arrived.
    pub(super) fn read(
        &mut self,
        epoch: u32,
        state: &RecordedState,
        constraints: &[ConstraintState],
    ) -> Result<bool, ReadError> {
        let step = state.row.step;
        let Some(Chosen { tape: Some(tape), read, .. }) = &mut self.chosen else {
            return Ok(false);
        };
        if read.as_ref().is_some_and(|(read_step, _)| *read_step == step) {
            return Ok(false);
        }
        let has_state = (tape.first_step()..=tape.last_step()).contains(&step);
        let ghost = match has_state.then(|| tape.state_at(step)).transpose() {
            Ok(ghost) => ghost.map(|ghost| {
                let stamp = Stamp { epoch, step: ghost.row.step };
                Ghost { stamp, ..to_ghost(&ghost, state, constraints) }
            }),
            Err(TapeError::Read(ReadError::Interrupted)) => return Err(ReadError::Interrupted),
            // An unreadable state of the ghost hides it, and leaves the recording on show.
            Err(_) => None,
        };
        *read = Some((step, ghost));
        Ok(true)
    }

    /// The ghost of the state that was read last.
    pub(super) fn state(&self) -> Option<&Ghost> {
        self.chosen.as_ref()?.read.as_ref()?.1.as_ref()
    }
}

/// Builds the message with a state of the ghost, without its stamp. It has the particles and constraints of the state on show.
fn to_ghost(
    ghost: &RecordedState,
    shown: &RecordedState,
    constraints: &[ConstraintState],
) -> Ghost {
    let particles = &ghost.particles;
    let (farthest, distance) = if ghost.row.step == shown.row.step {
        farthest(particles, &shown.particles)
    } else {
        (0, f32::NAN)
    };
    Ghost {
        stamp: Stamp::default(),
        farthest,
        distance,
        positions: particles.iter().map(|one| finite(one).unwrap_or([f32::NAN; 3])).collect(),
        hidden: hidden(ghost, constraints),
    }
}

fn finite(particle: &ParticleState) -> Option<[f32; 3]> {
    let position = particle.position;
    position.iter().all(|axis| axis.is_finite()).then_some(position)
}

/// Returns the particle whose two positions are farthest apart, and their distance in m.
#[allow(clippy::cast_possible_truncation, reason = "pages show three digits of a distance")]
fn farthest(a: &[ParticleState], b: &[ParticleState]) -> (u32, f32) {
    let distances = a.iter().zip(b).map(|(a, b)| distance(a, b));
    let distances = (0..).zip(distances).filter(|(_, distance)| distance.is_finite());
    let (particle, distance) =
        distances.fold((0, 0.0), |most, one| if one.1 > most.1 { one } else { most });
    (particle, distance as f32)
}

/// Returns the constraints that are torn or have an end without a finite position.
fn hidden(ghost: &RecordedState, constraints: &[ConstraintState]) -> Vec<u32> {
    let is_known = |index: &u32| (*index as usize) < constraints.len();
    let mut hidden: Vec<u32> = ghost.torn.indices().filter(is_known).collect();
    let particles = &ghost.particles;
    if particles.iter().any(|one| finite(one).is_none()) {
        let is_lost = |end: u32| particles.get(end as usize).and_then(finite).is_none();
        let torn: BTreeSet<u32> = hidden.iter().copied().collect();
        let lost = (0..)
            .zip(constraints)
            .filter(|(index, one)| (is_lost(one.a) || is_lost(one.b)) && !torn.contains(index));
        hidden.extend(lost.map(|(index, _)| index));
    }
    hidden
}

#[cfg(test)]
mod tests {
    use recording::StepRow;

    use super::*;

    fn state(step: u64, positions: &[[f32; 3]]) -> RecordedState {
        let particles = positions.iter();
        let particles = particles
            .map(|position| ParticleState { position: *position, ..ParticleState::default() });
        RecordedState {
            row: StepRow { step, ..StepRow::default() },
            has_readable_row: true,
            particles: Arc::new(particles.collect()),
            ..RecordedState::default()
        }
    }

    #[test]
    fn a_ghost_names_the_farthest_particle_at_the_same_step() {
        let shown = state(7, &[[0.0; 3], [1.0, 2.0, 3.0], [5.0; 3]]);
        let ghost = state(7, &[[0.0, 0.5, 0.0], [1.0, 2.0, 5.0], [5.0; 3]]);
        let found = to_ghost(&ghost, &shown, &[]);
        assert_eq!((found.farthest, found.distance), (1, 2.0));
        assert!(to_ghost(&state(6, &[[0.0; 3]; 3]), &shown, &[]).distance.is_nan());
    }

    #[test]
    fn constraints_without_a_place_are_hidden() {
        let constraint = |a, b| ConstraintState { a, b, ..ConstraintState::default() };
        let constraints = [constraint(0, 1), constraint(1, 2), constraint(0, 2)];
        let mut ghost = state(7, &[[0.0; 3], [0.0, f32::NAN, 0.0], [1.0; 3]]);
        ghost.torn.extend(5, [(2, 0), (1, 0), (9, 0)].map(|(index, cause)| torn(index, cause)));
        let found = to_ghost(&ghost, &ghost, &constraints);
        assert_eq!(found.hidden, [2, 1, 0]);
        assert!(found.positions[1].iter().all(|axis| axis.is_nan()));
    }

    fn torn(constraint: u32, cause: u32) -> sim_contract::TornConstraint {
        sim_contract::TornConstraint { constraint, cause }
    }
}
