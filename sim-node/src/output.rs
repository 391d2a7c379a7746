//! Output of the program: results and tables on stdout, everything else on stderr, and the exit codes.

use std::io::{self, IsTerminal};
use std::process::{ExitCode, Termination};

use anyhow::Context;
use serde::Serialize;
use sim_contract::{printable, printable_line};
use sim_host::console;

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

/// Side on which the cells of a column are aligned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Align {
    /// Words.
    Left,
    /// Numbers.
    Right,
}

/// Rows of cells under a header. Each column is as wide as its widest cell.
#[derive(Debug)]
pub(crate) struct Table<const COLUMNS: usize> {
    aligns: [Align; COLUMNS],
    /// The header is the first row.
    rows: Vec<[String; COLUMNS]>,
}

impl<const COLUMNS: usize> Table<COLUMNS> {
    pub(crate) fn new(header: [(&str, Align); COLUMNS]) -> Self {
        let aligns = header.map(|(_, align)| align);
        Self { aligns, rows: vec![header.map(|(title, _)| title.to_owned())] }
    }

    pub(crate) fn add(&mut self, row: [String; COLUMNS]) {
        self.rows.push(row);
    }

    /// The table with a newline behind each row, and without trailing spaces.
    pub(crate) fn text(&self) -> String {
        let width = |column: usize| {
            self.rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0)
        };
        let widths: [usize; COLUMNS] = std::array::from_fn(width);
        let mut text = String::new();
        for row in &self.rows {
            let cells =
                row.iter().zip(widths).zip(self.aligns).map(|((cell, width), align)| match align {
                    Align::Left => format!("{cell:<width$}"),
                    Align::Right => format!("{cell:>width$}"),
                });
            let line = cells.collect::<Vec<_>>().join("  ");
            text.push_str(line.trim_end());
            text.push('\n');
        }
        text
    }
}

/// End of a subcommand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Exit {
    /// Exit code 0.
    Done,
    /// Exit code 1: failed, with the reason on stderr. (Code 2 is a usage error.)
    Failed,
    /// Exit code 4: the node rejected the command of `ctl`.
    Rejected,
}

impl Termination for Exit {
    fn report(self) -> ExitCode {
        match self {
            Self::Done => ExitCode::SUCCESS,
            Self::Failed => ExitCode::FAILURE,
            Self::Rejected => ExitCode::from(4),
        }
    }
}

/// Prints an error as one line on stderr, followed by its causes.
pub(crate) fn from_result(result: anyhow::Result<Exit>) -> Exit {
    result.unwrap_or_else(|error| {
        note(&format!("error: {error:#}"));
        Exit::Failed
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_widest_cell() {
        let mut table = Table::new([("name", Align::Left), ("count", Align::Right)]);
        table.add(["curtain".to_owned(), "7".to_owned()]);
        table.add(["é".to_owned(), "1234567".to_owned()]);
        assert_eq!(table.text(), "name       count\ncurtain        7\né        1234567\n");
    }
}
