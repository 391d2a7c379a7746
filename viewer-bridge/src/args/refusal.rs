//! Errors of the command line, in the words of the other programs.

use std::path::Path;

use clap::error::{ContextKind, ErrorKind};

/// Replaces the text of clap for an argument that it does not know. All other errors stay.
pub(super) fn explain(error: clap::Error, command: &clap::Command) -> clap::Error {
    let (ErrorKind::UnknownArgument, Some(argument)) =
        (error.kind(), error.get(ContextKind::InvalidArg))
    else {
        return error;
    };
    let argument = argument.to_string();
    let (problem, hint) = if argument.starts_with('-') {
        let suggestion = error.get(ContextKind::SuggestedArg);
        let hint = suggestion.map(|option| format!(" (did you mean '{option}'?)"));
        (format!("there is no option '{argument}' here"), hint)
    } else {
        let is_recording = Path::new(&argument).extension().is_some_and(|one| one == "mcap");
        let hint = is_recording.then(|| format!(" (to show a recording, use --replay {argument})"));
        (format!("there is one argument too many: '{argument}'"), hint)
    };
    let hint = hint.unwrap_or_default();
    let text = format!("{problem}{hint}\n\nFor more information, try '--help'.\n");
    clap::Error::raw(ErrorKind::UnknownArgument, text).with_cmd(command)
}
