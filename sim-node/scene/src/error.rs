//! Errors in scenes, with their places in the text.

use std::cell::{Cell, RefCell};
use std::fmt;

use thiserror::Error;
use toml_parser::{Expected, ParseError};

/// Most problems that an error lists.
const PROBLEMS_MAX: usize = 1000;

/// The problems of a scene in the order of its lines; at least one. Its text is the first one with its place,
/// `FILE:LINE: FIELD: what is wrong (allowed: ...)`, and the number of the others.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub struct SceneError {
    label: String,
    problems: Vec<SceneProblem>,
    /// Number of the problems behind those listed.
    omitted_count: usize,
}

/// A wrong value in a scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneProblem {
    /// Line in the text, from 1.
    pub line: usize,
    /// Path of the field, such as `solver.rate_hz` or `particle[3].mass`.
    pub field: String,
    /// Description of the problem, with the allowed values.
    pub problem: String,
}

impl SceneError {
    /// The first problem.
    pub fn first(&self) -> &SceneProblem {
        &self.problems[0]
    }

    /// Returns each problem with its place, line by line. Of more than 1,000, the last line has the number of the rest.
    pub fn list(&self) -> String {
        let lines = self.problems.iter().map(|problem| self.line(problem));
        let omitted = (self.omitted_count > 0).then(|| {
            let Self { label, omitted_count, .. } = self;
            format!("{label}: and {omitted_count} more errors")
        });
        lines.chain(omitted).collect::<Vec<_>>().join("\n")
    }

    fn line(&self, SceneProblem { line, field, problem }: &SceneProblem) -> String {
        // A key or a text in quotes can have line breaks.
        format!("{}:{line}: {field}: {problem}", self.label).replace('\n', "\\n")
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.line(self.first()))?;
        let others = match self.problems.len() - 1 + self.omitted_count {
            0 => return Ok(()),
            1 => "1 more error".to_owned(),
            count => format!("{count} more errors"),
        };
        write!(formatter, " (and {others}; `sim-node check` lists all)")
    }
}

/// The problems that are found while a text is read.
#[derive(Debug)]
pub(crate) struct Problems<'a> {
    pub(crate) text: &'a str,
    /// Path of the file, or name of the scene.
    pub(crate) label: &'a str,
    /// With their places, in bytes. The line is set at the end.
    found: RefCell<Vec<(usize, SceneProblem)>>,
    count: Cell<usize>,
    /// End of the line of the last error of the syntax.
    line_end: Cell<usize>,
}

impl<'a> Problems<'a> {
    pub(crate) fn new(text: &'a str, label: &'a str) -> Self {
        Self { text, label, found: RefCell::default(), count: Cell::new(0), line_end: Cell::new(0) }
    }

    /// Returns the number of problems so far.
    pub(crate) fn count(&self) -> usize {
        self.count.get()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.count() == 0
    }

    /// Adds a problem at a place of the text, in bytes.
    pub(crate) fn add(&self, start: usize, field: &str, problem: impl Into<String>) {
        let mut found = self.found.borrow_mut();
        let (field, problem) = (field.to_owned(), problem.into());
        found.push((start, SceneProblem { line: 0, field, problem }));
        self.count.set(self.count() + 1);
        if found.len() >= 2 * PROBLEMS_MAX {
            found.sort_by_key(|(start, _)| *start);
            found.truncate(PROBLEMS_MAX);
        }
    }

    /// Adds a key that occurs twice.
    pub(crate) fn add_duplicate(&self, start: u32, key: &str) {
        self.add(start as usize, key, "occurs twice (allowed: once)");
    }

    /// Adds an error of the syntax. What follows on the same line is only its consequence.
    pub(crate) fn add_syntax(&self, error: &ParseError) {
        let start = error.unexpected().map_or(0, |span| span.start());
        if start < self.line_end.get() {
            return;
        }
        let rest = &self.text[self.text.floor_char_boundary(start)..];
        self.line_end.set(start + rest.find('\n').unwrap_or(rest.len()) + 1);
        let allowed = match error.expected() {
            None => String::new(),
            Some([]) => " (allowed: nothing)".to_owned(),
            Some(expected) => {
                let expected: Vec<_> = expected.iter().map(expectation).collect();
                format!(" (allowed: {})", expected.join(", "))
            }
        };
        self.add(start, "syntax", format!("{}{allowed}", error.description()));
    }

    /// Returns the problems so far as an error, if there are any.
    pub(crate) fn check(&self) -> Result<(), SceneError> {
        let mut found = self.found.take();
        if found.is_empty() {
            return Ok(());
        }
        found.sort_by_key(|(start, _)| *start);
        found.truncate(PROBLEMS_MAX);
        let (mut line, mut place) = (1, 0);
        let problems = found.into_iter().map(|(start, mut problem)| {
            let start = self.text.floor_char_boundary(start);
            line += self.text[place..start].matches('\n').count();
            place = start;
            problem.line = line;
            problem
        });
        let problems: Vec<_> = problems.collect();
        let omitted_count = self.count() - problems.len();
        Err(SceneError { label: self.label.to_owned(), problems, omitted_count })
    }
}

/// A token that the parser expected.
fn expectation(expected: &Expected) -> String {
    match expected {
        Expected::Literal("\n") => "newline".to_owned(),
        Expected::Literal("`") => "'`'".to_owned(),
        Expected::Literal(text) => format!("`{text}`"),
        Expected::Description(text) => (*text).to_owned(),
        _ => "another token".to_owned(),
    }
}
