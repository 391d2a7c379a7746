//! Errors of a command line, with the nearest known word.

use std::ffi::OsString;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, Error};
use sim_types::nearest;

/// Adds the nearest known option, subcommand or value to the error of an unknown one, and removes the
/// advice to escape it.
///
/// `words` is the command line of `program`, the program's name included.
pub fn explain(mut error: Error, program: &Command, words: &[OsString]) -> Error {
    error.remove(ContextKind::Suggested);
    let command = selected(program, words);
    let (unknown, suggestion) = match error.kind() {
        ErrorKind::UnknownArgument => (ContextKind::InvalidArg, ContextKind::SuggestedArg),
        ErrorKind::InvalidSubcommand => {
            (ContextKind::InvalidSubcommand, ContextKind::SuggestedSubcommand)
        }
        ErrorKind::InvalidValue => (ContextKind::InvalidValue, ContextKind::SuggestedValue),
        _ => return error,
    };
    let Some(ContextValue::String(word)) = error.get(unknown).cloned() else { return error };
    let known = match error.get(ContextKind::ValidValue) {
        Some(ContextValue::Strings(values)) => values.clone(),
        _ if word.starts_with('-') => options(command),
        _ => subcommands(command),
    };
    if let Some(nearest) = nearest(&word, known.iter().map(String::as_str)) {
        error.insert(suggestion, ContextValue::String(nearest.to_owned()));
    }
    error
}

/// Returns the innermost subcommand that a command line names.
fn selected<'c>(program: &'c Command, words: &[OsString]) -> &'c Command {
    words
        .iter()
        .skip(1)
        .filter_map(|word| word.to_str())
        .fold(program, |command, word| command.find_subcommand(word).unwrap_or(command))
}

/// Returns the names of the options of a command, with their hyphens.
fn options(command: &Command) -> Vec<String> {
    let options = command.get_arguments().filter(|one| !one.is_hide_set());
    options.filter_map(|one| Some(format!("--{}", one.get_long()?))).collect()
}

/// Returns the names of the subcommands of a command.
pub fn subcommands(command: &Command) -> Vec<String> {
    let subcommands = command.get_subcommands().filter(|one| !one.is_hide_set());
    subcommands.map(|one| one.get_name().to_owned()).collect()
}
