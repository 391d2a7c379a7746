//! The inputs of a simulation: scenes, commands and text files of bounded size.

use std::io::{self, ErrorKind, Read};
use std::path::Path;

use anyhow::{Context, anyhow, bail};
use recording::simulation::Start;
use recording::{
    LogEnd, LogReader, Message, OutcomeRow, StepRow, TimedCommand, open_regular_file,
    parse_commands, recorded_scene, sort_commands,
};
use sim_host::{Stop, read_scene_file, to_text};
use sim_solver::Scene;
use sim_solver::scene::LoadError;

/// Largest command file, in bytes: several hours of commands at 60 Hz.
const COMMAND_FILE_SIZE_BYTES_MAX: u64 = 1 << 30;

/// Most commands of a recording to repeat: hours of a drag at 60 Hz. They take about 250 MB of memory.
pub(crate) const COMMANDS_MAX: usize = 1 << 20;

/// Commands of a file, in the order of application.
#[derive(Debug)]
pub(crate) struct CommandSource {
    name: String,
    commands: Vec<TimedCommand>,
    /// The first state of a recording: its commands are those after it.
    start: Option<Start>,
}

impl CommandSource {
    /// Reads commands and sorts them. They are the outcomes of a recording if `source` ends in `.mcap`,
    /// else the lines of a command file.
    pub(crate) fn load(source: &str, stop: &Stop) -> anyhow::Result<Self> {
        if is_recording(source) {
            return Self::from_recording(source, stop).with_context(|| source.to_owned());
        }
        let text = read_text_file(Path::new(source), COMMAND_FILE_SIZE_BYTES_MAX)
            .with_context(|| format!("{source}: cannot read the commands"))?;
        Ok(Self { name: source.to_owned(), commands: parse_commands(&text, source)?, start: None })
    }

    fn from_recording(source: &str, stop: &Stop) -> anyhow::Result<Self> {
        let mut log = LogReader::open_until(Path::new(source), stop)?;
        let mut start = None;
        let mut commands = Vec::new();
        while let Some(logged) = log.next_message()? {
            match logged.message {
                Message::Step(StepRow { step, outcome_count, .. }) => {
                    _ = start.get_or_insert(Start { step, outcome_count });
                }
                Message::Outcome(_) if commands.len() == COMMANDS_MAX => {
                    bail!(
                        "it has more than {COMMANDS_MAX} commands; prove it with `recorder verify`"
                    );
                }
                Message::Outcome(row) => commands.push(timed_command(&row)),
                _ => {}
            }
        }
        match log.end() {
            Some(LogEnd::Complete) | None => {}
            Some(end) => bail!("the file is {end}, so its commands are incomplete"),
        }
        sort_commands(&mut commands);
        Ok(Self { name: source.to_owned(), commands, start })
    }

    /// Returns the commands for a simulation from a state of a run.
    ///
    /// # Errors
    /// They are those of a recording that starts after this state, so it can lack commands.
    pub(crate) fn after(mut self, state: Start) -> anyhow::Result<Vec<TimedCommand>> {
        let Some(start) = self.start else { return Ok(self.commands) };
        let lacks_none = start.outcome_count == 0 || start.outcome_count == state.outcome_count;
        if start.step > state.step && !lacks_none {
            let or_before = if state.step > 0 { " or before" } else { "" };
            bail!(
                "{}: the recording starts at step {}, so it lacks the {} earlier commands of its run. Use a \
                 recording that starts at step {}{or_before}, or prove this one with `recorder verify`",
                self.name,
                start.step,
                start.outcome_count,
                state.step
            );
        }
        // A state has the effect of the commands up to its own step.
        let first = start.step.max(state.step);
        self.commands.retain(|command| command.step > first);
        Ok(self.commands)
    }
}

pub(crate) fn timed_command(row: &OutcomeRow) -> TimedCommand {
    TimedCommand {
        step: row.step,
        index: Some(row.index),
        client_id: row.client_id,
        sequence: row.sequence,
        action: row.action,
    }
}

/// Reads and validates a scene. `source` is a recording if it ends in `.mcap`, else a scene file if
/// it contains `/` or ends in `.toml`, else the name of a built-in scene.
pub(crate) fn load_scene(source: &str, stop: &Stop) -> anyhow::Result<Scene> {
    if is_recording(source) {
        let log =
            LogReader::open_until(Path::new(source), stop).with_context(|| source.to_owned())?;
        return recorded_scene(&log).with_context(|| source.to_owned());
    }
    let read = |path: &Path| read_scene_file(path).map_err(|error| error.to_string());
    Scene::load(source, &read).map_err(|error| match error {
        LoadError::UnknownName(_) => anyhow!("{error}; or give a recording ending in .mcap"),
        other => other.into(),
    })
}

/// Extension of recordings.
const EXTENSION: &str = ".mcap";

/// Returns `true` for the path of a recording, finished or not. The documented rule is case-sensitive.
pub(crate) fn is_recording(source: &str) -> bool {
    source.strip_suffix(".part").unwrap_or(source).ends_with(EXTENSION)
}

/// Reads a regular file of at most `size_bytes_max` bytes.
pub(crate) fn read_text_file(path: &Path, size_bytes_max: u64) -> io::Result<String> {
    let file = open_regular_file(path)?;
    let mut bytes = Vec::new();
    let size_bytes = file.take(size_bytes_max + 1).read_to_end(&mut bytes)? as u64;
    if size_bytes > size_bytes_max {
        let problem = format!("it is longer than {size_bytes_max} bytes");
        return Err(io::Error::new(ErrorKind::FileTooLarge, problem));
    }
    to_text(bytes).map_err(io::Error::other)
}

#[cfg(test)]
mod command_source_tests {
    use std::fs;

    use recording::{Closing, LogOptions, LogWriter, RunDescription};
    use sim_contract::Action;

    use super::*;

    fn recording(path: &Path, outcome_count: u64, command_steps: &[u64]) -> CommandSource {
        let description = RunDescription { rate_hz: 240, ..RunDescription::default() };
        let mut log =
            LogWriter::create(Vec::new(), LogOptions::default(), &description, b"", 0).unwrap();
        let row = StepRow { step: 120, outcome_count, ..StepRow::default() };
        log.write(&Message::Step(row), 0).unwrap();
        for (index, step) in (0..).zip(command_steps) {
            let row = OutcomeRow {
                step: *step,
                client_id: 1,
                sequence: index,
                index,
                action: Action::Pause,
                status: "applied".to_owned(),
                reason: String::new(),
                disconnected: false,
                new_run: false,
            };
            log.write(&Message::Outcome(row), 0).unwrap();
        }
        fs::write(path, log.finish(&Closing::default()).unwrap()).unwrap();
        CommandSource::load(&path.display().to_string(), &Stop::default()).unwrap()
    }

    #[test]
    fn commands_up_to_the_first_state_of_a_simulation_are_left_out() {
        let path = std::env::temp_dir().join(format!("between-{}.mcap", std::process::id()));
        let after = |step| {
            let state = Start { step, outcome_count: 5 };
            let commands = recording(&path, 0, &[120, 130, 200, 210]).after(state).unwrap();
            commands.iter().map(|command| command.step).collect::<Vec<_>>()
        };
        let found = [0, 130, 200, 210].map(after);
        fs::remove_file(&path).unwrap();
        assert_eq!(found, [vec![130, 200, 210], vec![200, 210], vec![210], vec![]]);
    }

    #[test]
    fn a_recording_that_starts_after_some_commands_of_the_simulation_is_refused() {
        let path = std::env::temp_dir().join(format!("late-{}.mcap", std::process::id()));
        let after = |outcome_count, step, known_count| {
            recording(&path, outcome_count, &[]).after(Start { step, outcome_count: known_count })
        };
        for (outcome_count, step, known_count) in [(0, 0, 0), (3, 120, 3), (3, 200, 5), (3, 60, 3)]
        {
            assert_eq!(after(outcome_count, step, known_count).unwrap(), []);
        }
        let errors = [(0, 0), (60, 2)].map(|(step, known)| after(3, step, known).unwrap_err());
        fs::remove_file(&path).unwrap();
        for (error, place) in errors.iter().zip(["step 0", "step 60 or before"]) {
            let expected = format!(
                ".mcap: the recording starts at step 120, so it lacks the 3 earlier commands of its run. \
                 Use a recording that starts at {place}, or prove this one with `recorder verify`"
            );
            assert!(error.to_string().ends_with(&expected), "{error}");
        }
    }
}

#[cfg(test)]
mod scene_source_tests {
    use rustix::fs::{CWD, FileType, Mode, mknodat};

    use super::*;

    #[test]
    fn a_fifo_in_place_of_a_scene_is_refused_without_waiting() {
        let name = format!("{}-recorder-fifo.toml", std::process::id());
        let path = std::env::temp_dir().join(name);
        mknodat(CWD, &path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
        let path = path.to_str().unwrap();
        let error = load_scene(path, &Stop::default()).unwrap_err().to_string();
        std::fs::remove_file(path).unwrap();
        assert_eq!(
            error,
            format!("{path}: cannot read the scene: it is a named pipe (FIFO), not a regular file")
        );
    }

    #[test]
    fn an_unknown_scene_is_refused_with_the_known_ones_and_the_recordings() {
        let error = load_scene("knot", &Stop::default()).unwrap_err().to_string();
        assert!(error.starts_with("there is no built-in scene 'knot' (allowed: drape,"), "{error}");
        assert!(error.ends_with("or give a recording ending in .mcap"), "{error}");
    }
}
