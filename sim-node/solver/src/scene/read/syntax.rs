//! The TOML parser, with its errors in the words of this program.

mod document;
mod keys;
mod parse_cost;
mod pieces;

use std::collections::BTreeMap;
use std::ops::Range;

use serde::Deserialize;
use sim_types::SCENE_SIZE_BYTES_MAX;
use toml::de::{DeTable, Deserializer};

use super::file_scene::FileScene;
use crate::scene::error::{Place, SceneError};
use crate::scene::memory::reading_bytes;
use document::Document;
use parse_cost::check_parse_cost;
use pieces::pieces;

/// Parses the text of a scene, a long one piece by piece. An error names the line, the field and what
/// is allowed.
pub(super) fn parse(place: &Place<'_>) -> Result<FileScene, SceneError> {
    let size_bytes = place.text.len();
    if size_bytes > SCENE_SIZE_BYTES_MAX {
        let problem = format!("has {size_bytes} bytes of text (allowed: {SCENE_SIZE_BYTES_MAX})");
        return Err(place.error(0..0, "scene", problem));
    }
    place.check_memory(reading_bytes(size_bytes))?;
    let mut file = FileScene::default();
    let mut names = Names::default();
    let mut kept_size_bytes = 0;
    for (index, piece) in pieces(place.text).iter().enumerate() {
        let document = Document::new(place.text, piece);
        check_parse_cost(place, &document, kept_size_bytes)?;
        let table = document.parse().map_err(|error| {
            let span = error.span().map(|span| document.place(span));
            syntax_error(place, span, error.message(), String::new())
        })?;
        names.add(place, table.get_ref(), index == 0)?;
        let mut part = FileScene::deserialize(Deserializer::from(table)).map_err(|error| {
            let path = error.span().and_then(|span| document.path_to(&span)).unwrap_or_default();
            let path = with_earlier_pieces(&path, &file, piece.continued);
            syntax_error(place, error.span(), error.message(), path)
        })?;
        kept_size_bytes += part.size_bytes();
        match piece.continued {
            Some("anchor") => file.continue_anchor(&mut part),
            Some("collider") => file.continue_collider(&mut part),
            Some(_) => file.continue_generator(&mut part),
            None => {}
        }
        file.append(part);
    }
    Ok(file)
}

/// The keys of the scene in the pieces so far. `true` for a list of tables, to which later pieces can add.
#[derive(Default)]
struct Names(BTreeMap<String, bool>);

impl Names {
    /// Adds the keys of a piece. One that occurs twice is an error.
    fn add(
        &mut self,
        place: &Place<'_>,
        table: &DeTable<'_>,
        is_first: bool,
    ) -> Result<(), SceneError> {
        for (key, value) in table {
            // Before the first header, a list is complete.
            let can_grow = value.get_ref().is_array() && !is_first;
            let could_grow = self.0.insert(key.get_ref().to_string(), can_grow);
            if could_grow.is_some_and(|could_grow| !(could_grow && can_grow)) {
                return Err(syntax_error(place, Some(key.span()), "duplicate key", String::new()));
            }
        }
        Ok(())
    }
}

/// Adds the elements of earlier pieces to the indices of a path such as `particle[3].mass` or
/// `anchor[0].path[3].time`.
fn with_earlier_pieces(path: &str, file: &FileScene, continued: Option<&str>) -> String {
    let Some((list, table, rest)) = split_index(path) else { return path.to_owned() };
    let is_continued = continued == Some(list);
    let first = file.table_count(list) - usize::from(is_continued);
    let rest = match split_index(rest) {
        Some((".path", point, rest)) if is_continued && table == 0 => {
            format!(".path[{}]{rest}", point + file.last_point_count())
        }
        _ => rest.to_owned(),
    };
    format!("{list}[{}]{rest}", first + table)
}

/// Splits a path at its first index.
fn split_index(path: &str) -> Option<(&str, usize, &str)> {
    let (list, rest) = path.split_once('[')?;
    let (index, rest) = rest.split_once(']')?;
    Some((list, index.parse().ok()?, rest))
}

fn syntax_error(
    place: &Place<'_>,
    span: Option<Range<usize>>,
    message: &str,
    path: String,
) -> SceneError {
    let span = span.unwrap_or(0..0);
    let message = message.trim().replace('\n', ", ");
    let (field, problem) = match () {
        () if message.starts_with("unknown field ") => {
            let problem = unknown_key(path.rsplit('.').next().unwrap_or_default(), &message);
            (path, problem)
        }
        () if message == "duplicate key" => duplicate_key(place, span.clone()),
        () if path.is_empty() => ("syntax".to_owned(), syntax_problem(&message)),
        () if keys::is_list_of_tables(&path) && message.ends_with("expected a sequence") => {
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

/// From ``unknown field `x`, expected one of `a`, `b` ``.
fn unknown_key(key: &str, message: &str) -> String {
    let allowed = message.split_once(", expected ").map_or("", |(_, allowed)| allowed);
    // Two keys are joined by "or".
    let allowed = plain_words(&allowed.replace("` or `", "`, `"));
    format!("unknown key{} (allowed: {allowed})", keys::advice(key, allowed.split(", ")))
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
