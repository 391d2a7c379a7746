//! Output of the program: results on stdout, everything else on stderr.

use std::io::{self, ErrorKind, IsTerminal, Write};

use anyhow::Context;
use serde::Serialize;
use sim_contract::{printable, printable_line};

/// Prints a result that ends with a newline.
pub(crate) fn text(text: &str) -> anyhow::Result<()> {
    write(io::stdout().lock(), &printable(text)).context("cannot write to stdout")
}

/// Prints a result as a line.
pub(crate) fn line(line: &str) -> anyhow::Result<()> {
    text(&format!("{}\n", printable_line(line)))
}

/// Prints the content of a file. It is unchanged, unless it goes to a terminal.
pub(crate) fn file(text: &str) -> anyhow::Result<()> {
    let out = io::stdout().lock();
    let text = if out.is_terminal() { printable(text) } else { text.into() };
    write(out, &text).context("cannot write to stdout")
}

/// Prints a result as one line of JSON.
pub(crate) fn json(value: &impl Serialize) -> anyhow::Result<()> {
    line(&serde_json::to_string(value).context("encoding the result")?)
}

/// Prints text on stderr. Ignores errors, because stderr may be closed.
pub(crate) fn note(text: &str) {
    let _ignored = writeln!(io::stderr().lock(), "{}", printable(text));
}

/// Writes a text to its end, past every buffer: the end of a program ignores errors. A pipe whose
/// reader has gone is none, because that reader wants no more.
fn write(mut out: impl Write, text: &str) -> io::Result<()> {
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An output that accepts text into its buffer and fails when it is flushed.
    struct Failing(ErrorKind);

    impl Write for Failing {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Err(self.0.into())
        }
    }

    #[test]
    fn a_full_output_is_an_error_and_a_closed_pipe_is_none() {
        let full = write(Failing(ErrorKind::StorageFull), "text").unwrap_err();
        assert_eq!(full.kind(), ErrorKind::StorageFull);
        write(Failing(ErrorKind::BrokenPipe), "text").unwrap();
    }
}
