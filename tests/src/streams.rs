//! Output streams of a child that do not accept everything.

use std::fs::File;
use std::io::pipe;
use std::process::{Command, Stdio};

use crate::programs::Program;

/// The output streams of a child.
#[derive(Debug, Clone, Copy, Default)]
pub struct Streams {
    /// Standard output.
    pub stdout: Stream,
    /// Standard error.
    pub stderr: Stream,
}

/// An output stream of a child.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Stream {
    /// The test reads it.
    #[default]
    Captured,
    /// The descriptor is closed, as after `>&-`.
    Closed,
    /// A pipe whose reader has gone, as before `| head`.
    ClosedPipe,
    /// A full disk: `/dev/full`.
    Full,
}

impl Streams {
    /// The command of a program. Only a shell can close a descriptor of the program that it becomes.
    #[allow(clippy::disallowed_methods, reason = "the harness starts processes")]
    pub(crate) fn command(self, program: Program) -> Command {
        let close = |stream, text| if stream == Stream::Closed { text } else { "" };
        let closed = [close(self.stdout, " >&-"), close(self.stderr, " 2>&-")].concat();
        if closed.is_empty() {
            return Command::new(program.path());
        }
        let mut shell = Command::new("sh");
        shell.arg("-c").arg(format!("exec \"$0\" \"$@\"{closed}")).arg(program.path());
        shell
    }
}

impl Stream {
    pub(crate) fn stdio(self) -> Stdio {
        match self {
            Self::Captured => Stdio::piped(),
            Self::Closed => Stdio::null(),
            Self::ClosedPipe => pipe().expect("a pipe").1.into(),
            Self::Full => File::options().write(true).open("/dev/full").expect("/dev/full").into(),
        }
    }
}
