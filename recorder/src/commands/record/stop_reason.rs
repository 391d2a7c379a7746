//! The reasons why a recording or one of its files ends.

use super::accepted::RunEnd;

/// The reason why a recording or one of its files ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StopReason {
    Signal,
    Duration,
    OwnerGone,
    Run(RunEnd),
    /// The file has reached a limit, and the next one begins.
    Split,
    WriteError,
    /// The disk has less free space than its reserve.
    Reserve,
    /// The reader of the progress has gone.
    ReaderGone,
}

impl StopReason {
    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::Signal => "signal",
            Self::Duration => "duration reached",
            Self::OwnerGone => "owner gone",
            Self::Run(RunEnd::NewRun) => "new run",
            Self::Run(RunEnd::NewLoad) => "new scene loaded",
            Self::Run(RunEnd::EndStep) => "steps reached",
            Self::Split => "split",
            Self::WriteError => "write error",
            Self::Reserve => "disk reserve reached",
            Self::ReaderGone => "reader of the progress gone",
        }
    }

    /// Returns an explanation of an end that the user has not asked for, and that `--follow` prevents.
    pub(crate) fn hint(self) -> Option<&'static str> {
        match self {
            Self::OwnerGone => Some(
                "the recording ended with the node; with --follow, it goes on with the next run, in \
                 another file",
            ),
            Self::Run(RunEnd::NewRun) => Some(
                "the recording ended because another run began; with --follow, it goes on in another \
                 file",
            ),
            Self::Run(RunEnd::NewLoad) => Some(
                "the recording ended because another scene was loaded; with --follow, it goes on in \
                 another file",
            ),
            Self::Signal
            | Self::Duration
            | Self::Run(RunEnd::EndStep)
            | Self::Split
            | Self::WriteError
            | Self::Reserve
            | Self::ReaderGone => None,
        }
    }
}
