//! The pinned particles of a shape.

use sim_types::did_you_mean;

use crate::fields::{At, Fields, printed};

/// The pinned particles of a shape.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Pinned {
    /// One of the shape's words, such as "top".
    Word(&'static str),
    /// Indices within the shape, ascending.
    List(Vec<u32>),
}

impl Pinned {
    /// Walks the key of a shape that has these words, the default first. `count` is its number of particles, if that is known.
    pub(super) fn key(
        &mut self,
        fields: &mut Fields<'_>,
        words: &[&'static str],
        count: Option<u64>,
    ) {
        if fields.reader().is_some() {
            *self = Self::Word(words[0]);
        }
        let read = |at: At<'_>| match at.as_text() {
            Some(text) => {
                let known = words.iter().find(|word| **word == text);
                known.map(|word| Self::Word(word)).or_else(|| {
                    let meant = did_you_mean(text, words.iter().copied());
                    let words = words.join(", ");
                    at.error(format!(
                        "{text:?} is unknown{meant} (allowed: {words} or a list of indices)"
                    ))
                })
            }
            None => Self::read_list(at, count),
        };
        fields.value("pinned", self, read, Self::print);
    }

    pub(super) fn print(&self) -> Option<String> {
        match self {
            Self::Word(word) => printed(*word),
            Self::List(list) => printed(list),
        }
    }

    /// Reads a list of indices, ascending and without duplicates.
    pub(super) fn read_list(at: At<'_>, count: Option<u64>) -> Option<Self> {
        let allowed = "a word in quotes or a list of indices";
        let Some(elements) = at.as_list() else { return at.unexpected(allowed) };
        let mut list = Vec::with_capacity(elements.len());
        for element in elements {
            let index = element.integer()?;
            match u32::try_from(index) {
                Ok(small) if count.is_none_or(|count| u64::from(small) < count) => list.push(small),
                _ => {
                    let last = count.unwrap_or(1) - 1;
                    let problem = format!("{index} is out of range (allowed: 0 to {last})");
                    return element.error(problem);
                }
            }
        }
        list.sort_unstable();
        list.dedup();
        Some(Self::List(list))
    }

    /// Returns `true` if a particle of the shape is pinned. `by_word` decides for the shape's words.
    pub(super) fn contains(&self, index: u32, by_word: impl FnOnce(&str) -> bool) -> bool {
        match self {
            Self::Word(word) => by_word(word),
            Self::List(list) => list.binary_search(&index).is_ok(),
        }
    }
}

/// Words for the pinned ends of a line, the default first.
pub(crate) const END_WORDS: [&str; 4] = ["first", "last", "both", "none"];

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
