//! Errors in scenes, with their place in the text.

use std::ops::Range;

use thiserror::Error;

use super::memory::check_memory;

/// An error in a scene. Its text is `FILE:LINE: FIELD: what is wrong (allowed: ...)`.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{label}:{line}: {field}: {problem}")]
pub struct SceneError {
    /// Path of the file, or name of the scene.
    pub label: String,
    /// Line in the text, from 1.
    pub line: usize,
    /// Path of the field, such as `solver.rate_hz` or `particle[3].mass`.
    pub field: String,
    /// Description of the error, with the allowed values.
    pub problem: String,
}

/// The text of a scene, as the place of errors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place<'a> {
    pub(crate) text: &'a str,
    /// Path of the file, or name of the scene.
    pub(crate) label: &'a str,
}

impl Place<'_> {
    /// Refuses a text, or a part of it, if the process cannot get the memory to read it.
    pub(crate) fn check_memory(&self, needed_bytes: u64) -> Result<(), SceneError> {
        check_memory(needed_bytes).map_err(|error| self.error(0..0, "scene", error.to_string()))
    }

    /// Creates an error at a byte range of the text.
    pub(crate) fn error(&self, span: Range<usize>, field: &str, problem: String) -> SceneError {
        let start = self.text.floor_char_boundary(span.start);
        let line = 1 + self.text[..start].matches('\n').count();
        SceneError { label: self.label.to_owned(), line, field: field.to_owned(), problem }
    }
}
