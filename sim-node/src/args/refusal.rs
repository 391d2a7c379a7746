//! Errors of the command line, in the words of this program.

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// Error text for an argument that clap does not know; `None` for all other errors, whose texts
/// are printed as they are.
pub(super) fn text(error: &clap::Error) -> Option<String> {
    if error.kind() != ErrorKind::UnknownArgument {
        return None;
    }
    let context = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.clone()),
        Some(ContextValue::StyledStr(text)) => Some(text.to_string()),
        _ => None,
    };
    let argument = context(ContextKind::InvalidArg)?;
    let problem = if !argument.starts_with('-') {
        format!("there is one argument too many: '{argument}'")
    } else if argument.parse::<f64>().is_ok() {
        format!("the negative number '{argument}' is not allowed here")
    } else {
        format!("there is no option '{argument}' here")
    };
    let suggestion = context(ContextKind::SuggestedArg)
        .map(|option| format!(" (did you mean '{option}'?)"))
        .unwrap_or_default();
    let usage = context(ContextKind::Usage).unwrap_or_default();
    Some(format!(
        "error: {problem}{suggestion}\n\n{usage}\n\nFor more information, try '--help'.\n"
    ))
}
