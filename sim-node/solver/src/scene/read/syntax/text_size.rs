//! The memory that parsing takes, bounded before it is taken.
//!
//! A parsed table needs about a kilobyte, whatever it holds, so a text of 16 MiB could ask for several
//! gigabytes.

use sim_types::SCENE_SIZE_BYTES_MAX;
use toml_parser::Source;
use toml_parser::lexer::{Token, TokenKind};

use crate::scene::error::{Place, SceneError};

/// Most tokens of a text. Complete texts of scenes have one in 1.8 bytes (short
/// numbers) to one in 2.7 bytes.
const TOKENS_MAX: usize = SCENE_SIZE_BYTES_MAX / 8 * 5;
/// Fewest bytes of an element, a generator or a nested table, with every default written out.
const TABLE_BYTES_MIN: usize = 48;
/// Fewest bytes of a number in a list: `0, `.
const ENTRY_BYTES_MIN: usize = 3;

/// Refuses a text that no scene of the allowed size has. Needs no memory for it.
pub(in crate::scene::read) fn check_size(place: &Place<'_>) -> Result<(), SceneError> {
    let contents = Contents::of(place.text);
    let problem = if contents.tokens > TOKENS_MAX {
        format!("has {} words, numbers and signs (allowed: {TOKENS_MAX})", contents.tokens)
    } else if contents.size_bytes_min() > SCENE_SIZE_BYTES_MAX {
        format!(
            "has {} tables and {} list entries, {} bytes or more with every default written out \
             (allowed: {SCENE_SIZE_BYTES_MAX})",
            contents.tables,
            contents.entries,
            contents.size_bytes_min()
        )
    } else {
        return Ok(());
    };
    Err(place.error(0..0, "scene", problem))
}

/// Numbers of what a text holds, counted without parsing it.
#[derive(Debug, Default, PartialEq, Eq)]
struct Contents {
    tokens: usize,
    /// Headers, inline tables, and the tables that dotted keys stand for.
    tables: usize,
    /// Commas: entries of lists, and of inline tables.
    entries: usize,
}

impl Contents {
    fn of(text: &str) -> Self {
        let (mut contents, mut position) = (Self::default(), Position::default());
        for token in Source::new(text).lex() {
            contents.tokens += 1;
            contents.entries += usize::from(token.kind() == TokenKind::Comma);
            contents.tables += usize::from(position.starts_table(&token));
            position.advance(&token);
        }
        contents
    }

    /// Fewest bytes of these contents, with every default written out.
    fn size_bytes_min(&self) -> usize {
        self.tables * TABLE_BYTES_MIN + self.entries * ENTRY_BYTES_MIN
    }
}

/// The place of a token in the text.
#[derive(Debug, Default)]
struct Position {
    /// The open brackets, innermost last.
    open: Vec<TokenKind>,
    /// Between an equals sign and the end of its value.
    is_value: bool,
}

impl Position {
    fn starts_table(&self, token: &Token) -> bool {
        match token.kind() {
            TokenKind::LeftSquareBracket => self.open.is_empty() && !self.is_value,
            TokenKind::LeftCurlyBracket => true,
            TokenKind::Dot => !self.is_value,
            _ => false,
        }
    }

    fn advance(&mut self, token: &Token) {
        match token.kind() {
            TokenKind::LeftSquareBracket => self.open.push(token.kind()),
            TokenKind::LeftCurlyBracket => {
                self.open.push(token.kind());
                self.is_value = false;
            }
            TokenKind::RightSquareBracket | TokenKind::RightCurlyBracket => {
                self.open.pop();
                self.is_value = !self.open.is_empty();
            }
            TokenKind::Equals => self.is_value = true,
            TokenKind::Comma => {
                self.is_value = self.open.last() != Some(&TokenKind::LeftCurlyBracket);
            }
            TokenKind::Newline if self.open.is_empty() => self.is_value = false,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Scene, builtin};

    fn contents(text: &str) -> (usize, usize) {
        let contents = Contents::of(text);
        (contents.tables, contents.entries)
    }

    #[test]
    fn tables_and_entries_are_counted_as_the_parser_makes_them() {
        for (text, expected) in [
            ("", (0, 0)),
            ("a = 1.5", (0, 0)),
            ("[a]\nb = 1.5\n[[c.d]]\n", (3, 0)),
            ("a.b.c = 1", (2, 0)),
            ("1.1 = 1.1", (1, 0)),
            ("a = [1.5, [2.5, 3.5]]\nb.c = 1", (1, 2)),
            ("a = { b.c = 1.5, d = [1.5], e.f = 2 }", (3, 2)),
            ("a = [{ b = 1 }, { c.d = 1 }]", (3, 1)),
            ("a = [\n1.5,\n]\n[b]", (1, 1)),
            ("a = \"[[b]], { }, c.d\" # [[e]], { }, f.g", (0, 0)),
            ("a = \"\"\"\n[b]\n\"\"\"", (0, 0)),
        ] {
            assert_eq!(contents(text), expected, "{text}");
        }
    }

    #[test]
    fn the_complete_text_of_a_scene_is_never_shorter_than_its_lower_bound() {
        let least = "version = 1\n[wind]\n[[particle]]\nposition = [0, 0, 0]\n[[particle]]\n\
            position = [1, 0, 0]\n[[constraint]]\nparticles = [0, 1]\n[[collider]]\n\
            shape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0\n[[anchor]]\nparticles = [0]\n\
            path = [{ time = 0 }]\n";
        for text in builtin::names().filter_map(builtin::text).chain([least]) {
            let complete = Scene::from_toml(text, "f").unwrap().to_toml();
            let contents = Contents::of(&complete);
            assert!(contents.size_bytes_min() <= complete.len(), "{contents:?}\n{complete}");
            assert!(contents.tokens * 8 <= complete.len() * 5, "{contents:?}\n{complete}");
        }
    }

    #[test]
    fn a_text_that_would_need_gigabytes_is_refused_before_it_is_parsed() {
        let tables = "[[generate]]\n".repeat(400_000);
        let keys = "a.b=1\n".repeat(400_000);
        let entries = format!("a = [{}]", "12,".repeat(5_600_000));
        let lines = "\n".repeat(11_000_000);
        for (text, expected) in [
            (tables, "has 400000 tables and 0 list entries, 19200000 bytes or more"),
            (keys, "has 400000 tables and 0 list entries, 19200000 bytes or more"),
            (entries, "has 11200007 words, numbers and signs (allowed: 10485760)"),
            (lines, "has 11000001 words, numbers and signs (allowed: 10485760)"),
        ] {
            let error = Scene::from_toml(&text, "f").unwrap_err();
            assert!(error.problem.starts_with(expected), "{error}");
        }
    }
}
