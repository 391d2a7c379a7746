//! The document of a piece: its text, with the way from its places to those in the scene's text.

use std::borrow::Cow;
use std::mem::replace;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue, Error};

use super::keys::is_list_of_tables;
use super::pieces::Piece;

/// The text of a piece.
pub(super) struct Document<'t> {
    pub(super) text: Cow<'t, str>,
    ranges: &'t [Range<usize>],
}

impl<'t> Document<'t> {
    pub(super) fn new(text: &'t str, piece: &'t Piece<'t>) -> Self {
        let part = |range: &Range<usize>| &text[range.clone()];
        let text = match piece.ranges.as_slice() {
            [range] => Cow::Borrowed(part(range)),
            ranges => Cow::Owned(ranges.iter().map(part).collect()),
        };
        Self { text, ranges: &piece.ranges }
    }

    /// Parses the document. The places in the table are those in the scene's text.
    pub(super) fn parse(&self) -> Result<Spanned<DeTable<'_>>, Error> {
        let table = DeTable::parse(&self.text)?;
        Ok(Spanned::new(self.place(table.span()), self.place_table(table.into_inner())))
    }

    /// Returns the path, such as `particle[3].mass`, to the key or value at a place in the scene's text. For
    /// errors only, because it parses the document again.
    pub(super) fn path_to(&self, place: &Range<usize>) -> Option<String> {
        path_in_table(self.parse().ok()?.get_ref(), place)
    }

    /// Returns a place in the scene's text. Only its start counts for a value with parts in other
    /// pieces.
    pub(super) fn place(&self, place: Range<usize>) -> Range<usize> {
        let mut offset = 0;
        for range in self.ranges {
            if place.start < offset + range.len() {
                let start = range.start + place.start - offset;
                return start..start + place.len();
            }
            offset += range.len();
        }
        let end = self.ranges.last().map_or(0, |range| range.end);
        end..end
    }

    fn place_table<'d>(&self, table: DeTable<'d>) -> DeTable<'d> {
        let place = |(key, mut value): (Spanned<_>, _)| {
            self.place_value(&mut value);
            (Spanned::new(self.place(key.span()), key.into_inner()), value)
        };
        table.into_iter().map(place).collect()
    }

    fn place_value(&self, value: &mut Spanned<DeValue<'_>>) {
        let place = self.place(value.span());
        let value_at_place = match replace(value.get_mut(), DeValue::Boolean(false)) {
            DeValue::Table(table) => DeValue::Table(self.place_table(table)),
            DeValue::Array(mut list) => {
                list.iter_mut().for_each(|element| self.place_value(element));
                DeValue::Array(list)
            }
            scalar => scalar,
        };
        *value = Spanned::new(place, value_at_place);
    }
}

fn path_in_table(table: &DeTable<'_>, place: &Range<usize>) -> Option<String> {
    table.iter().find_map(|(key, value)| {
        let name = key.get_ref();
        if [key.span(), value.span()].contains(place) {
            return Some(name.to_string());
        }
        let (index, path) = match value.get_ref() {
            DeValue::Table(table) => (None, path_in_table(table, place)?),
            DeValue::Array(list) => {
                let (index, path) = path_in_list(list, place)?;
                (Some(index), path)
            }
            _ => return None,
        };
        // Other lists can begin in an earlier document.
        let index = index.filter(|_| name == "path" || is_list_of_tables(name));
        let index = index.map(|index| format!("[{index}]")).unwrap_or_default();
        let dot = if path.is_empty() { "" } else { "." };
        Some(format!("{name}{index}{dot}{path}"))
    })
}

/// Returns the index of the element at a place, and the path within the element.
fn path_in_list(list: &DeArray<'_>, place: &Range<usize>) -> Option<(usize, String)> {
    list.iter().enumerate().find_map(|(index, element)| {
        let path = match element.get_ref() {
            _ if element.span() == *place => String::new(),
            DeValue::Table(table) => path_in_table(table, place)?,
            DeValue::Array(list) => path_in_list(list, place)?.1,
            _ => return None,
        };
        Some((index, path))
    })
}
