//! Output of the program: results on stdout, everything else on stderr, progress on a terminal, and the exit codes.

use std::io::{self, IsTerminal};
use std::path::Path;
use std::process::{ExitCode, Termination};
use std::sync::LazyLock;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use recording::LogEnd;
use serde::Serialize;
use sim_contract::{printable, printable_line};
use sim_host::{Stop, console, is_being_written};

use super::damaged_input::{DamagedInput, losses};

/// The option that selects the format of a result.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(crate) struct AsJson {
    /// Print the result as one line of JSON
    #[arg(long)]
    json: bool,
}

/// Prints a result: the value as one line of JSON, or the text.
pub(crate) fn result<T: Serialize>(as_json: AsJson, value: &T, text: &str) -> anyhow::Result<()> {
    let line = if as_json.json {
        printable_line(&serde_json::to_string(value)?).into_owned()
    } else {
        printable(text).into_owned()
    };
    bytes(format!("{line}\n").as_bytes())
}

/// Prints the bytes of a result.
pub(crate) fn bytes(bytes: &[u8]) -> anyhow::Result<()> {
    console::write_result(bytes).context("cannot write to stdout")
}

/// The last line of a terminal, which changes in place.
static LIVE_LINE: LazyLock<ProgressBar> = LazyLock::new(live_line);

/// Shows a line on stderr in the place of the last one, if that is a terminal.
pub(crate) fn show_live(text: String) {
    LIVE_LINE.set_message(text);
}

/// Removes the line.
pub(crate) fn end_live() {
    LIVE_LINE.finish_and_clear();
}

/// Prints a line on stderr, or drops it.
pub(crate) fn note(text: &str) {
    LIVE_LINE.suspend(|| console::note(text));
}

/// Warns about a file without its end, on stderr. `done` is the work that was done with it.
pub(crate) fn warn_incomplete(path: &Path, end: &LogEnd, done: &str) {
    let text = path.display();
    if is_being_written(path) {
        note(&format!("warning: {text} is being written by another program; {done}"));
    } else {
        note(&format!(
            "warning: {text} is {end}; {done}. `recorder repair {text} OUT.mcap` copies what is intact"
        ));
    }
}

/// Warns about a recording without its end: where the end of its readable part is, and what is lost. `done` is the work that
/// was done with the readable part.
pub(crate) fn warn_of_losses(path: &Path, end: &LogEnd, done: &str, stop: &Stop) {
    warn_incomplete(path, end, done);
    note_losses(path, end, stop);
}

/// Prints what a recording has lost, on stderr.
pub(crate) fn note_losses(path: &Path, end: &LogEnd, stop: &Stop) {
    note_lines(&losses(path, end, stop));
}

fn note_lines(lines: &[String]) {
    for line in lines {
        note(&format!("  {}", printable_line(line)));
    }
}

/// Warns about a file that has another extension than its format, because other programs, and
/// `viewer-bridge`, do not find it.
pub(crate) fn warn_of_extension(path: &Path, expected: &[&str]) {
    if let Some(warning) = extension_warning(path, expected) {
        note(&warning);
    }
}

fn extension_warning(path: &Path, expected: &[&str]) -> Option<String> {
    let first = expected.first()?;
    let extension = path.extension().unwrap_or_default();
    let is_known = expected.iter().any(|known| extension.eq_ignore_ascii_case(known));
    // Stdout, which may go to a file, a device and a folder need no extension, or are refused later.
    let is_file = path != Path::new("-")
        && !path.starts_with("/dev")
        && std::fs::metadata(path).map_or(true, |found| found.is_file());
    let path = path_text(path);
    (!is_known && is_file).then(|| {
        format!("warning: programs expect a file of this format to end in .{first}, unlike {path}")
    })
}

/// Describes what is left of a recording after an error of writing.
pub(crate) fn incomplete(recording: &str, part_path: &Path) -> String {
    let is_empty = std::fs::metadata(part_path).is_ok_and(|part| part.len() == 0);
    if is_empty {
        format!("{recording} is incomplete; nothing of it was written")
    } else {
        let part = path_text(part_path);
        format!(
            "{recording} is incomplete; what was written before is in {part} (see `recorder check {part}`)"
        )
    }
}

/// Returns a path as text for users.
pub(crate) fn path_text(path: &Path) -> String {
    path.display().to_string()
}

/// Returns a progress bar for a known number of steps.
pub(crate) fn progress_bar(steps: u64) -> ProgressBar {
    if !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} steps, {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(steps).with_style(style)
}

/// Returns a spinner with a message.
pub(crate) fn progress_spinner() -> ProgressBar {
    if io::stderr().is_terminal() { ProgressBar::new_spinner() } else { ProgressBar::hidden() }
}

/// Returns a line of text that changes in place.
pub(crate) fn live_line() -> ProgressBar {
    let style = ProgressStyle::with_template("{msg}");
    let style = style.unwrap_or_else(|_| ProgressStyle::default_spinner());
    progress_spinner().with_style(style)
}

/// Returns a progress bar for a known number of bytes.
pub(crate) fn progress_bytes(bytes: u64) -> ProgressBar {
    if !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let template = "{bar:40} {bytes}/{total_bytes}, {bytes_per_sec}, {eta} left";
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(bytes).with_style(style)
}

/// The exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Exit {
    /// 0: success.
    Done,
    /// 1: failure, with the reason on stderr. (2 is a usage error, with which clap exits.)
    Failed,
    /// 3: finished, but with loss, truncation or divergence; or the input is so damaged that nothing of it can be
    /// used.
    Loss,
}

impl Termination for Exit {
    fn report(self) -> ExitCode {
        match self {
            Self::Done => ExitCode::SUCCESS,
            Self::Failed => ExitCode::FAILURE,
            Self::Loss => ExitCode::from(3),
        }
    }
}

/// Returns the exit code of a subcommand. Prints an error and its causes as one line on stderr.
pub(crate) fn from_result(result: anyhow::Result<Exit>) -> Exit {
    result.unwrap_or_else(|error| {
        console::note(&format!("error: {error:#}"));
        let Some(damaged) = error.downcast_ref::<DamagedInput>() else { return Exit::Failed };
        note_lines(&damaged.losses());
        Exit::Loss
    })
}

/// Ends the program as clap does: with code 2 after an error of the command line, with 0 after a help
/// text, or with 1 if that cannot be written.
#[allow(clippy::exit, reason = "clap ends the program in the same way")]
pub(crate) fn with_usage(error: &clap::Error) -> ! {
    let (printed, code) = (error.print(), error.exit_code());
    std::process::exit(console::usage_exit_code(printed, error.use_stderr(), code))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_with_the_extension_of_another_format_causes_a_warning() {
        let warning = |path, expected: &[&str]| extension_warning(Path::new(path), expected);
        assert_eq!(
            warning("x.abc", &["pc2"]).unwrap(),
            "warning: programs expect a file of this format to end in .pc2, unlike x.abc"
        );
        assert!(warning("run", &["mcap"]).is_some());
        for (path, expected) in [
            ("cache.PC2", &["pc2"][..]),
            ("run.apng", &["png", "apng"]),
            ("/dev/stdout", &["csv"]),
            ("-", &["csv"]),
            ("folder.of.files", &[]),
        ] {
            assert_eq!(warning(path, expected), None, "{path}");
        }
    }
}
