//! Output of the program: results on stdout, everything else on stderr.

use std::io::{self, IsTerminal};

use anyhow::Context;
use serde::Serialize;
use sim_contract::{console, printable, printable_line};

/// Prints a result that ends with a newline.
pub(crate) fn text(text: &str) -> anyhow::Result<()> {
    console::write_result(printable(text).as_bytes()).context("cannot write to stdout")
}

/// Prints a result as a line.
pub(crate) fn line(line: &str) -> anyhow::Result<()> {
    text(&format!("{}\n", printable_line(line)))
}

/// Prints a line of a result that goes on. Returns `false` if its reader has gone and wants no more.
pub(crate) fn part(line: &str) -> anyhow::Result<bool> {
    let line = format!("{}\n", printable_line(line));
    console::write_part(line.as_bytes()).context("cannot write to stdout")
}

/// Prints the content of a file. It is unchanged, unless it goes to a terminal.
pub(crate) fn file(text: &str) -> anyhow::Result<()> {
    let text = if io::stdout().is_terminal() { printable(text) } else { text.into() };
    console::write_result(text.as_bytes()).context("cannot write to stdout")
}

/// Prints a result as one line of JSON.
pub(crate) fn json(value: &impl Serialize) -> anyhow::Result<()> {
    line(&serde_json::to_string(value).context("encoding the result")?)
}

/// Prints a line on stderr, or drops it.
pub(crate) fn note(text: &str) {
    console::note(text);
}
