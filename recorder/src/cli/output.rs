//! Output of the program: results on stdout, everything else on stderr.

use std::io::{self, Write};
use std::path::Path;

use serde::Serialize;
use sim_contract::{printable, printable_line};

/// The option that selects the format of a result.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(crate) struct AsJson {
    /// Print the result as one line of JSON
    #[arg(long)]
    json: bool,
}

/// Prints a result: the value as one line of JSON, or the text.
pub(crate) fn result<T: Serialize>(as_json: AsJson, value: &T, text: &str) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    if as_json.json {
        writeln!(out, "{}", printable_line(&serde_json::to_string(value)?))?;
    } else {
        writeln!(out, "{}", printable(text))?;
    }
    Ok(())
}

/// Prints a line on stderr. Ignores errors, because stderr may be closed.
pub(crate) fn note(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{}", printable_line(text));
}

/// Returns a path as text for users.
pub(crate) fn path_text(path: &Path) -> String {
    path.display().to_string()
}
