//! The pinned particles of a shape.

use serde::Serialize;

/// The pinned particles of a shape.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum Pinned {
    /// One of the shape's words, such as "top".
    Word(&'static str),
    /// Indices within the shape, ascending.
    List(Vec<u32>),
}

impl Pinned {
    /// Returns `true` if a particle of the shape is pinned. `by_word` decides for the shape's words.
    pub(super) fn contains(&self, index: u32, by_word: impl FnOnce(&str) -> bool) -> bool {
        match self {
            Self::Word(word) => by_word(word),
            Self::List(list) => list.binary_search(&index).is_ok(),
        }
    }
}

/// Words for the pinned ends of a line, the default first.
pub(in crate::scene) const END_WORDS: [&str; 4] = ["first", "last", "both", "none"];

/// Returns `true` if a word pins the place `place` in a line of `count` places.
pub(super) fn is_pinned_end(word: &str, place: u32, count: u32) -> bool {
    let (is_first, is_last) = (place == 0, place == count - 1);
    match word {
        "first" => is_first,
        "last" => is_last,
        "both" => is_first || is_last,
        _ => false,
    }
}
