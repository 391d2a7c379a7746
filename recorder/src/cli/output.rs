//! Output of the program: results on stdout, everything else on stderr.

use std::path::Path;
use std::sync::LazyLock;

use anyhow::Context;
use indicatif::ProgressBar;
use recording::LogEnd;
use serde::Serialize;
use sim_contract::{console, is_being_written, printable, printable_line};

use super::progress::live_line;

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
