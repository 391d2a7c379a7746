//! The files of a replay, played one after another on one timeline.

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::Context;
use recording::{ContentSelection, Frame, LogEnd, RecordedState, RunDescription, StepRow, counted};
use sim_host::Stop;
use sim_host::clock::SECOND_NS;

use super::recording::{Recording, Start};
use super::replay::Recorded;
use crate::cli::output;

/// A recorded step of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    /// Number of the file, from 0.
    pub(super) file: usize,
    pub(super) step: u64,
}

/// The files of a replay. Files that continue a run, as those of a split recording, play as one run.
#[derive(Debug)]
pub(super) struct Playlist {
    files: Vec<Listed>,
    /// The file that is being read.
    current: usize,
    recording: Recording,
    /// The files that have ended without being complete, by number.
    incomplete: BTreeMap<usize, LogEnd>,
    stop: Stop,
}

/// A file on the timeline.
#[derive(Debug)]
struct Listed {
    path: PathBuf,
    rate_hz: u32,
    first_step: u64,
    last_step: u64,
    /// Time of its first snapshot, from the start of the replay.
    begin_ns: u64,
    /// It continues the run of the file before, without a gap.
    is_continuation: bool,
}

/// The end of a file, for the comparison with the start of the next one.
#[derive(Debug)]
struct Junction {
    run_id: u64,
    scene: Vec<u8>,
    topology_revision: u32,
    selection: ContentSelection,
    last_step: u64,
    /// `None` if it is unreadable.
    last: Option<StepRow>,
}

impl Playlist {
    /// Opens the first file, and reads the range of every other one.
    pub(super) fn open(paths: &[PathBuf], stop: &Stop) -> anyhow::Result<Self> {
        let mut files: Vec<Listed> = Vec::new();
        let mut junction: Option<Junction> = None;
        let mut first = None;
        for path in paths {
            let name = || output::path_text(path);
            let mut recording = Recording::open(path, stop).with_context(name)?;
            let listed =
                Listed::new(&mut recording, files.last(), junction.as_ref()).with_context(name)?;
            files.push(listed);
            junction = Some(Junction::of(&mut recording).with_context(name)?);
            first.get_or_insert(recording);
        }
        let recording = first.context("there is no file to play")?;
        Ok(Self { files, current: 0, recording, incomplete: BTreeMap::new(), stop: stop.clone() })
    }

    /// Returns the time from the first to the last snapshot.
    pub(super) fn duration_ns(&self) -> u64 {
        self.files.last().map_or(0, Listed::end_ns)
    }

    /// Returns the time of a step of the run that is being played, from the start of the replay. The file that
    /// is being read may be the one after that of the step.
    pub(super) fn time_ns(&self, step: u64) -> u64 {
        let file = self.place_of(step).map_or(self.current, |place| place.file);
        self.files[file].time_ns(step)
    }

    /// Returns the time of a place, from the start of the replay.
    pub(super) fn time_of(&self, place: Place) -> u64 {
        self.files[place.file].time_ns(place.step)
    }

    /// Returns the last place up to a time.
    pub(super) fn place_at(&self, time_ns: u64) -> Place {
        let file = self.files.partition_point(|file| file.begin_ns <= time_ns).saturating_sub(1);
        Place { file, step: self.files[file].step_at(time_ns) }
    }

    /// Returns the place of a step of the run that is being played, or `None` if it is not in the files.
    pub(super) fn place_of(&self, step: u64) -> Option<Place> {
        let (mut begin, mut end) = (self.current, self.current + 1);
        while self.files[begin].is_continuation {
            begin -= 1;
        }
        while self.files.get(end).is_some_and(|file| file.is_continuation) {
            end += 1;
        }
        let run = &self.files[begin..end];
        let last = run.last()?.last_step;
        let file = begin + run.iter().rposition(|file| file.first_step <= step)?;
        (step <= last).then_some(Place { file, step: step.min(self.files[file].last_step) })
    }

    /// Returns the place of the recorded snapshot before a step of the run that is being played; at the first
    /// one, that one.
    pub(super) fn place_before(&mut self, step: u64) -> anyhow::Result<Place> {
        let file = self.place_of(step).map_or(self.current, |place| place.file);
        let first = self.files[file].first_step;
        if step > first {
            return Ok(Place { file, step: self.recorded_step(file, step - 1)? });
        }
        Ok(match file.checked_sub(1) {
            Some(before) => Place { file: before, step: self.files[before].last_step },
            None => Place { file, step: first },
        })
    }

    /// Returns the place after the run that has ended.
    pub(super) fn place_after_run(&self) -> Option<Place> {
        let file = self.current + 1;
        self.files.get(file).map(|listed| Place { file, step: listed.first_step })
    }

    /// Continues at the last recorded step up to a place.
    pub(super) fn start_at(&mut self, place: Place) -> anyhow::Result<Start> {
        self.read(place.file)?;
        self.recording.start_at(place.step).with_context(|| self.name())
    }

    /// Returns the data of the load of the file that is being read.
    pub(super) fn recorded(&mut self) -> anyhow::Result<Recorded<'_>> {
        let name = self.name();
        self.recording.recorded().context(name)
    }

    /// Returns the next snapshot of the run, or `None` at its end. `reached` is the state after the last one.
    pub(super) fn next_frame(&mut self, reached: &RecordedState) -> anyhow::Result<Option<Frame>> {
        if let Some(frame) = self.recording.next_frame().with_context(|| self.name())? {
            return Ok(Some(frame));
        }
        let is_complete = self.report_end();
        let next = self.current + 1;
        if !is_complete || !self.files.get(next).is_some_and(|file| file.is_continuation) {
            return Ok(None);
        }
        let mut recording = self.open_file(next)?;
        let start = recording.start().with_context(|| output::path_text(recording.path()))?;
        let Some(frame) = start.continue_from(reached, self.recording.trailing_updates()) else {
            self.warn_of_loss(next);
            return Ok(None);
        };
        (self.recording, self.current) = (recording, next);
        Ok(Some(frame))
    }

    /// Prints what the files that have ended have lost. Returns `true` if every one was complete.
    pub(super) fn note_losses(&self) -> bool {
        for (file, end) in &self.incomplete {
            output::note_losses(&self.files[*file].path, end, &self.stop);
        }
        self.incomplete.is_empty()
    }

    fn name(&self) -> String {
        output::path_text(self.recording.path())
    }

    fn read(&mut self, file: usize) -> anyhow::Result<()> {
        if file != self.current {
            self.recording = self.open_file(file)?;
            self.current = file;
        }
        Ok(())
    }

    fn open_file(&self, file: usize) -> anyhow::Result<Recording> {
        let path = &self.files[file].path;
        Recording::open(path, &self.stop).with_context(|| output::path_text(path))
    }

    /// Returns the keyframe of a published step of the run that is being played, as
    /// [`Recording::keyframe_of`].
    pub(super) fn keyframe_of(&mut self, step: u64) -> anyhow::Result<Option<Vec<u8>>> {
        let Some(Place { file, .. }) = self.place_of(step) else { return Ok(None) };
        self.read_beside(file, |recording| recording.keyframe_of(step))
    }

    /// Returns the last recorded step of a file up to a step.
    fn recorded_step(&mut self, file: usize, step: u64) -> anyhow::Result<u64> {
        self.read_beside(file, |recording| Ok(recording.tape().step_at(step)?))
    }

    /// Reads from a file. The file that is being played stays the same.
    fn read_beside<T>(
        &mut self,
        file: usize,
        read: impl FnOnce(&mut Recording) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        let mut other = None;
        let recording = if file == self.current {
            &mut self.recording
        } else {
            other.insert(self.open_file(file)?)
        };
        let name = output::path_text(recording.path());
        read(recording).context(name)
    }

    /// Returns `true` if the file that has ended was complete.
    fn report_end(&mut self) -> bool {
        let Some(end) = self.recording.end() else { return true };
        let is_complete = *end == LogEnd::Complete;
        if !is_complete {
            output::warn_incomplete(self.recording.path(), end, "played as far as it goes");
            self.incomplete.insert(self.current, end.clone());
        }
        is_complete
    }

    fn warn_of_loss(&self, next: usize) {
        let (one, two) = (self.name(), output::path_text(&self.files[next].path));
        output::note(&format!(
            "warning: {one} lacks changes of torn constraints, colliders or parameters before {two}, so {two} \
             plays as a run of its own"
        ));
    }
}

impl Listed {
    fn new(
        recording: &mut Recording,
        before: Option<&Self>,
        junction: Option<&Junction>,
    ) -> anyhow::Result<Self> {
        let is_continuation = match (before, junction) {
            (Some(before), Some(junction)) => junction.is_continued_by(before, recording)?,
            _ => false,
        };
        let run = recording.run();
        let rate_hz = run.rate_hz;
        let first_step = recording.tape().first_step();
        let begin_ns = match before {
            None => 0,
            Some(before) if is_continuation => before.time_ns(first_step),
            // The last snapshot of a run is shown for one step.
            Some(before) => before.end_ns() + SECOND_NS / u64::from(before.rate_hz.max(1)),
        };
        let last_step = recording.tape().last_step();
        let path = recording.path().to_owned();
        Ok(Self { path, rate_hz, first_step, last_step, begin_ns, is_continuation })
    }

    fn time_ns(&self, step: u64) -> u64 {
        let steps = step.saturating_sub(self.first_step);
        self.begin_ns.saturating_add(RunDescription::duration_ns(steps, self.rate_hz))
    }

    fn end_ns(&self) -> u64 {
        self.time_ns(self.last_step)
    }

    /// Returns the last step up to a time.
    fn step_at(&self, time_ns: u64) -> u64 {
        let passed_ns = u128::from(time_ns.saturating_sub(self.begin_ns));
        // A time of a step is rounded down, so the next step may begin within the same nanosecond.
        let steps = (passed_ns + 1) * u128::from(self.rate_hz) / u128::from(SECOND_NS);
        let steps = u64::try_from(steps).unwrap_or(u64::MAX);
        self.first_step.saturating_add(steps).min(self.last_step)
    }
}

impl Junction {
    fn of(recording: &mut Recording) -> anyhow::Result<Self> {
        let last_step = recording.tape().last_step();
        let last = readable_row(recording, last_step)?;
        Ok(Self {
            run_id: recording.run().run_id,
            scene: recording.scene().to_vec(),
            topology_revision: recording.tape().topology().revision,
            selection: recording.selection(),
            last_step,
            last,
        })
    }

    /// Returns `true` if no snapshot is missing between this file and the next one. Warns about missing ones
    /// within a run.
    fn is_continued_by(&self, before: &Listed, next: &mut Recording) -> anyhow::Result<bool> {
        let is_same_load = self.run_id == next.run().run_id
            && self.topology_revision == next.tape().topology().revision
            && self.scene == next.scene();
        let first_step = next.tape().first_step();
        if !is_same_load || first_step <= self.last_step {
            return Ok(false);
        }
        let (Some(last), Some(first)) = (self.last, readable_row(next, first_step)?) else {
            return Ok(false);
        };
        let missing = self.selection.missing_between(last.snapshot_index, first.snapshot_index);
        if missing > 0 {
            let (one, two) = (before.path.display(), next.path().display());
            let snapshots = counted(missing, "snapshot");
            output::note(&format!(
                "warning: {snapshots} missing between {one} and {two}, so {two} plays as a run of its \
                 own. If another file of this recording has them, name it between the two"
            ));
        }
        Ok(missing == 0)
    }
}

fn readable_row(recording: &mut Recording, step: u64) -> anyhow::Result<Option<StepRow>> {
    let state = recording.tape().state_at(step)?;
    Ok(state.has_readable_row.then_some(state.row))
}
