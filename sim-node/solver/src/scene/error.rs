//! What is wrong with a scene, and where.

use std::ops::Range;

use thiserror::Error;

/// A scene that cannot be used. Its text is `FILE:LINE: FIELD: what is wrong (allowed: ...)`.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{label}:{line}: {field}: {problem}")]
pub struct SceneError {
    /// The file's path or the scene's name.
    pub label: String,
    /// Line of the text, from 1.
    pub line: usize,
    /// The field, as a path: `solver.rate_hz`, `particle[3].mass`.
    pub field: String,
    /// What is wrong, and what is allowed.
    pub problem: String,
}

/// Where in the text a value stands.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place<'a> {
    pub(crate) text: &'a str,
    pub(crate) label: &'a str,
}

impl Place<'_> {
    /// An error at a byte range of the text.
    pub(crate) fn error(&self, span: Range<usize>, field: &str, problem: String) -> SceneError {
        let start = self.text.floor_char_boundary(span.start);
        let line = 1 + self.text[..start].matches('\n').count();
        SceneError { label: self.label.to_owned(), line, field: field.to_owned(), problem }
    }

    /// The parser's error, in our words: what is wrong (allowed: what is).
    pub(crate) fn syntax_error(&self, error: &toml::de::Error, path: &str) -> SceneError {
        let message = error.message().trim().replace('\n', ", ");
        let problem = match message.split_once(", expected ") {
            Some((what, allowed)) => format!("{what} (allowed: {})", plain_types(allowed)),
            None => message,
        };
        let field = if path.is_empty() { "scene" } else { path };
        self.error(error.span().unwrap_or(0..0), field, problem)
    }
}

/// Names of Rust types as a person would say them.
fn plain_types(allowed: &str) -> String {
    let allowed = allowed.strip_prefix("one of ").unwrap_or(allowed).replace('`', "");
    match allowed.as_str() {
        "i64" | "u32" | "i128" => "a whole number".to_owned(),
        "f64" | "f32" => "a number".to_owned(),
        "a string" => "a text in quotes".to_owned(),
        "a boolean" => "true or false".to_owned(),
        _ => allowed,
    }
}
