//! Standard output and standard error of the programs.
//!
//! Results go to stdout. A result that cannot be written is an error, except that a pipe whose reader
//! has gone ends the output quietly, as `| head` expects. Messages go to stderr; those that cannot be
//! written are dropped, because no run must end for a message. A descriptor that is closed from the
//! start is `/dev/null`.

use std::borrow::Cow;
use std::io::{self, ErrorKind, Write};
use std::os::fd::AsFd;

use rustix::event::{PollFd, PollFlags, poll};
use rustix::time::Timespec;
use sim_types::{printable, printable_line};

/// Writes a result to stdout, past every buffer: the end of a program ignores errors.
///
/// # Errors
/// Stdout does not accept the bytes, for example because its disk is full.
pub fn write_result(bytes: &[u8]) -> io::Result<()> {
    write(io::stdout().lock(), bytes)
}

/// Writes a part of a result that goes on to stdout, past every buffer. Returns `false` if its reader
/// has gone and wants no more.
///
/// # Errors
/// Same as [`write_result`].
pub fn write_part(bytes: &[u8]) -> io::Result<bool> {
    write_or_closed(io::stdout().lock(), bytes)
}

/// Returns `true` if stdout is a pipe whose reader has gone. A program that writes seldom asks, to end
/// with its reader.
pub fn is_reader_gone() -> bool {
    has_lost_its_reader(&io::stdout())
}

fn has_lost_its_reader(out: &impl AsFd) -> bool {
    let mut streams = [PollFd::new(out, PollFlags::empty())];
    // Without an answer, the next write tells.
    let _ = poll(&mut streams, Some(&Timespec { tv_sec: 0, tv_nsec: 0 }));
    streams[0].revents().contains(PollFlags::ERR)
}

/// Longest line of a message, in bytes. A name in a file can have a million characters.
const NOTE_SIZE_BYTES_MAX: usize = 4000;

/// Writes a line to stderr, or drops it. Replaces line breaks and control characters in it, and leaves out the
/// middle of a very long one: its start names the place, and its end the cure.
pub fn note(text: &str) {
    let _dropped = writeln!(io::stderr().lock(), "{}", shorten(&printable_line(text)));
}

fn shorten(line: &str) -> Cow<'_, str> {
    if line.len() <= NOTE_SIZE_BYTES_MAX {
        return Cow::Borrowed(line);
    }
    let head = &line[..line.floor_char_boundary(NOTE_SIZE_BYTES_MAX / 2)];
    let tail = &line[line.ceil_char_boundary(line.len() - NOTE_SIZE_BYTES_MAX / 2)..];
    let count = line.len() - head.len() - tail.len();
    Cow::Owned(format!("{head}... ({count} bytes are left out) ...{tail}"))
}

/// Writes several lines to stderr, or drops them. Replaces control characters in them.
pub fn note_lines(text: &str) {
    let _dropped = writeln!(io::stderr().lock(), "{}", printable(text));
}

/// Accepts a write that failed because the reader of a pipe has gone: that reader wants no more.
///
/// # Errors
/// Every other error stays.
pub fn accept_closed_pipe(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}

/// Returns the exit code of a program that ends with the text of its command line, a help text or an
/// error: `code`, or 1 if the text is a result and could not be written. Reports that on stderr.
/// `printed` is the result of printing the text, and `is_error` tells that it went to stderr.
#[must_use]
pub fn usage_exit_code(printed: io::Result<()>, is_error: bool, code: i32) -> i32 {
    match accept_closed_pipe(printed) {
        Err(problem) if !is_error => {
            note(&format!("error: cannot write to stdout: {problem}"));
            1
        }
        _ => code,
    }
}

fn write(out: impl Write, bytes: &[u8]) -> io::Result<()> {
    write_or_closed(out, bytes).map(|_| ())
}

fn write_or_closed(mut out: impl Write, bytes: &[u8]) -> io::Result<bool> {
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
        result => result.map(|()| true),
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
        let full = write(Failing(ErrorKind::StorageFull), b"text").unwrap_err();
        assert_eq!(full.kind(), ErrorKind::StorageFull);
        write(Failing(ErrorKind::BrokenPipe), b"text").unwrap();
        assert!(!write_or_closed(Failing(ErrorKind::BrokenPipe), b"text").unwrap());
        assert!(write_or_closed(io::sink(), b"text").unwrap());
    }

    #[test]
    fn a_message_about_a_very_long_name_keeps_its_place_and_its_cure() {
        let message =
            |length| format!("error: a.toml:3: name: '{}': use a shorter one", "é".repeat(length));
        let short = message(900);
        assert_eq!(shorten(&short), short);
        let cut = shorten(&message(500_000)).into_owned();
        assert!(cut.len() < NOTE_SIZE_BYTES_MAX + 100, "{}", cut.len());
        assert!(cut.starts_with("error: a.toml:3: name: 'éé"), "{cut}");
        assert!(cut.ends_with("éé': use a shorter one"), "{cut}");
        assert!(cut.contains("... (9960"), "{cut}");
    }

    #[test]
    fn a_pipe_has_lost_its_reader_once_that_is_closed() {
        let (reader, writer) = io::pipe().unwrap();
        assert!(!has_lost_its_reader(&writer));
        drop(reader);
        assert!(has_lost_its_reader(&writer));
        assert!(!has_lost_its_reader(&std::fs::File::open("/dev/null").unwrap()));
    }

    #[test]
    fn a_help_text_that_cannot_be_written_is_a_failure_and_an_error_of_usage_stays_one() {
        let full = || Err(ErrorKind::StorageFull.into());
        let closed = || Err(ErrorKind::BrokenPipe.into());
        for (printed, code) in [(Ok(()), 0), (closed(), 0), (full(), 1)] {
            assert_eq!(usage_exit_code(printed, false, 0), code);
        }
        for printed in [Ok(()), closed(), full()] {
            assert_eq!(usage_exit_code(printed, true, 2), 2);
        }
    }
}
