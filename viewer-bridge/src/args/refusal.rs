//! Errors of the command line, in the words of the other programs.

use std::path::Path;

use clap::error::{ContextKind, ErrorKind};

/// Replaces the text of clap for an argument that it does not know. All other errors stay.
pub(super) fn explain(error: clap::Error, command: &clap::Command) -> clap::Error {
    let (invalid, suggested) = match error.kind() {
        ErrorKind::UnknownArgument => (ContextKind::InvalidArg, ContextKind::SuggestedArg),
        // A word that is not an option could only be a subcommand.
        ErrorKind::InvalidSubcommand => {
            (ContextKind::InvalidSubcommand, ContextKind::SuggestedSubcommand)
        }
        _ => return error,
    };
    let Some(argument) = error.get(invalid) else { return error };
    let argument = argument.to_string();
    let suggestion = error.get(suggested).map(|name| format!(" (did you mean '{name}'?)"));
    let (problem, hint) = if argument.starts_with('-') {
        (format!("there is no option '{argument}' here"), suggestion)
    } else {
        let is_recording = Path::new(&argument).extension().is_some_and(|one| one == "mcap");
        let replay =
            is_recording.then(|| format!(" (to show a recording, use --replay {argument})"));
        (format!("there is one argument too many: '{argument}'"), replay.or(suggestion))
    };
    let hint = hint.unwrap_or_default();
    let text = format!("{problem}{hint}\n\nFor more information, try '--help'.\n");
    clap::Error::raw(ErrorKind::UnknownArgument, text).with_cmd(command)
}
