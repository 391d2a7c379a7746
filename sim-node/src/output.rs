//! Output of the program: results on stdout, everything else on stderr.

use anyhow::Context;
use serde::Serialize;
use sim_contract::console;

/// Prints a result that ends with a newline.
pub(crate) fn text(text: &str) -> anyhow::Result<()> {
    console::write_result(text.as_bytes()).context("cannot write to stdout")
}

/// Prints a result as a line.
pub(crate) fn line(line: &str) -> anyhow::Result<()> {
    text(&format!("{line}\n"))
}

/// Prints a result as one line of JSON.
pub(crate) fn json(value: &impl Serialize) -> anyhow::Result<()> {
    line(&serde_json::to_string(value).context("encoding the result")?)
}

/// Prints a line on stderr, or drops it.
pub(crate) fn note(text: &str) {
    console::note(text);
}
