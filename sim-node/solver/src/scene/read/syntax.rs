//! The TOML parser, with its errors in the words of this program.

mod parse_cost;

use std::ops::Range;

use serde::de::DeserializeOwned;

use crate::scene::error::{Place, SceneError};
use parse_cost::check_parse_cost;

/// Parses TOML into a file structure. An error names the line, the field and what is allowed.
pub(super) fn parse<T: DeserializeOwned>(place: &Place<'_>) -> Result<T, SceneError> {
    check_parse_cost(place)?;
    let deserializer = toml::Deserializer::parse(place.text)
        .map_err(|error| syntax_error(place, &error, String::new()))?;
    serde_path_to_error::deserialize(deserializer).map_err(|error| {
        let path = field_path(&error.path().to_string());
        syntax_error(place, error.inner(), path)
    })
}

/// Removes the segments of serde's wrappers, which begin with `$`, from a path.
fn field_path(path: &str) -> String {
    let segments = path.split('.').filter(|segment| !segment.starts_with('$') && *segment != "?");
    segments.collect::<Vec<_>>().join(".")
}

fn syntax_error(place: &Place<'_>, error: &toml::de::Error, path: String) -> SceneError {
    let span = error.span().unwrap_or(0..0);
    let message = error.message().trim().replace('\n', ", ");
    let (field, problem) = match () {
        () if message.starts_with("unknown field ") => (path, unknown_key(&message)),
        () if message == "duplicate key" => duplicate_key(place, span.clone()),
        () if path.is_empty() => ("syntax".to_owned(), syntax_problem(&message)),
        () if is_list_of_tables(&path) && message.ends_with("expected a sequence") => {
            let problem =
                format!("is not a list of tables (allowed: tables with the header [[{path}]])");
            (path, problem)
        }
        () => (path, with_allowed(&message)),
    };
    let field = if field.is_empty() { "scene" } else { &field };
    place.error(span, field, problem)
}

/// From ``unclosed array, expected `]` ``.
fn syntax_problem(message: &str) -> String {
    match message.split_once(", expected ") {
        Some((problem, allowed)) => format!("{problem} (allowed: {allowed})"),
        None => message.to_owned(),
    }
}

/// Returns `true` for the keys that are lists of tables.
fn is_list_of_tables(path: &str) -> bool {
    ["particle", "constraint", "collider", "anchor", "generate"].contains(&path)
}

/// From ``unknown field `x`, expected one of `a`, `b` ``. The path ends with the key.
fn unknown_key(message: &str) -> String {
    let allowed = message.split_once(", expected ").map_or("", |(_, allowed)| allowed);
    format!("unknown key (allowed: {})", plain_words(allowed))
}

/// The error's span is the key.
fn duplicate_key(place: &Place<'_>, span: Range<usize>) -> (String, String) {
    let key = place.text.get(span).unwrap_or_default().to_owned();
    (key, "occurs twice (allowed: once)".to_owned())
}

/// Splits a message such as `invalid type: string "x", expected a boolean` into what is wrong and
/// what is allowed.
fn with_allowed(message: &str) -> String {
    match message.split_once(", expected ") {
        Some((problem, allowed)) => {
            format!("{} (allowed: {})", plain_problem(problem), plain_words(allowed))
        }
        None => message.to_owned(),
    }
}

/// Serde's words for a wrong value, as a predicate of the field.
fn plain_problem(problem: &str) -> String {
    const KINDS: [(&str, &str); 8] = [
        ("string ", "the text "),
        ("integer ", "the number "),
        ("floating point ", "the number "),
        ("boolean ", ""),
        ("sequence", "a list"),
        ("map", "a table"),
        ("datetime", "a date"),
        ("unit", "empty"),
    ];
    if let Some(length) = problem.strip_prefix("invalid length ") {
        let noun = if length == "1" { "entry" } else { "entries" };
        return format!("has {length} {noun}");
    }
    let value = problem.strip_prefix("invalid type: ").or(problem.strip_prefix("invalid value: "));
    let Some(value) = value else { return problem.to_owned() };
    let value = value.replace('`', "").replace(" as i128", "");
    let kind = KINDS.iter().find_map(|(from, to)| Some((to, value.strip_prefix(from)?)));
    kind.map_or(format!("is {value}"), |(to, rest)| format!("is {to}{rest}"))
}

/// Names of types and lists of keys, in plain words.
fn plain_words(allowed: &str) -> String {
    let allowed = allowed.strip_prefix("one of ").unwrap_or(allowed).replace('`', "");
    match allowed.as_str() {
        "i64" | "u32" | "i128" => "a whole number".to_owned(),
        "f64" | "f32" => "a number".to_owned(),
        "a string" => "text in quotes".to_owned(),
        "a boolean" => "true or false".to_owned(),
        "a sequence" => "a list".to_owned(),
        _ => allowed,
    }
}
