//! Loads commands from command files and recordings.

use std::path::Path;

use anyhow::{Context, bail};
use recorder::{
    LogEnd, LogReader, Message, OutcomeRow, TimedCommand, Topic, parse_commands, sort_commands,
};
use sim_contract::Stop;

use super::scene_source::is_recording;
use super::text_file::read_text_file;

/// Largest command file, in bytes: several hours of commands at 60 Hz.
const COMMAND_FILE_SIZE_BYTES_MAX: u64 = 1 << 30;

/// Most commands of a recording to repeat: hours of a drag at 60 Hz. They take about 250 MB of memory.
pub(crate) const COMMANDS_MAX: usize = 1 << 20;

/// Reads commands and sorts them in the order of application. They are the outcomes of a recording
/// if `source` ends in `.mcap`, else the lines of a command file.
pub(crate) fn load_commands(source: &str, stop: &Stop) -> anyhow::Result<Vec<TimedCommand>> {
    if is_recording(source) {
        return commands_in_recording(Path::new(source), stop).with_context(|| source.to_owned());
    }
    let text = read_text_file(Path::new(source), COMMAND_FILE_SIZE_BYTES_MAX)
        .with_context(|| format!("{source}: cannot read the commands"))?;
    Ok(parse_commands(&text, source)?)
}

fn commands_in_recording(path: &Path, stop: &Stop) -> anyhow::Result<Vec<TimedCommand>> {
    let mut log = LogReader::open_until(path, stop)?;
    log.selection().require(&[Topic::Outcomes], "`recorder simulate --commands`")?;
    let mut first_row = None;
    let mut commands = Vec::new();
    while let Some(logged) = log.next_message()? {
        match logged.message {
            Message::Step(row) => _ = first_row.get_or_insert(row),
            Message::Outcome(_) if commands.len() == COMMANDS_MAX => {
                bail!("it has more than {COMMANDS_MAX} commands; prove it with `recorder verify`");
            }
            Message::Outcome(row) => commands.push(timed_command(&row)),
            _ => {}
        }
    }
    match log.end() {
        Some(LogEnd::Complete) | None => {}
        Some(end) => bail!("the file is {end}, so its commands are incomplete"),
    }
    if let Some(row) = first_row
        && row.outcome_count > 0
    {
        bail!(
            "the recording starts at step {}, so it lacks the {} earlier commands of its run. Use a \
             recording that starts at step 0, or prove this one with `recorder verify`",
            row.step,
            row.outcome_count
        );
    }
    sort_commands(&mut commands);
    Ok(commands)
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

#[cfg(test)]
mod tests {
    use std::fs;

    use recorder::{Closing, LogOptions, LogWriter, RunDescription, StepRow, Up};

    use super::*;

    #[test]
    fn a_recording_that_starts_after_some_commands_is_refused() {
        let description = RunDescription {
            run_id: 1,
            epoch_ns: 0,
            scene_name: "point".to_owned(),
            origin: [0.0; 3],
            up: Up::Y,
            rate_hz: 240,
            method: 0,
            particle_count: 0,
            constraint_count: 0,
            bend_count: 0,
            solver_version: 1,
            contract_version: 1,
            recorder_version: "0.1.0".to_owned(),
        };
        let path = std::env::temp_dir().join(format!("late-{}.mcap", std::process::id()));
        let load = |outcome_count| {
            let options = LogOptions::default();
            let mut log = LogWriter::create(Vec::new(), options, &description, b"", 0).unwrap();
            let row = StepRow { step: 120, outcome_count, ..StepRow::default() };
            log.write(&Message::Step(row), 0).unwrap();
            fs::write(&path, log.finish(&Closing::default()).unwrap()).unwrap();
            load_commands(&path.display().to_string(), &Stop::default())
        };
        assert_eq!(load(0).unwrap(), []);
        let error = format!("{:#}", load(3).unwrap_err());
        fs::remove_file(&path).unwrap();
        let expected = ".mcap: the recording starts at step 120, so it lacks the 3 earlier commands \
            of its run. Use a recording that starts at step 0, or prove this one with `recorder \
            verify`";
        assert!(error.ends_with(expected), "{error}");
    }
}
