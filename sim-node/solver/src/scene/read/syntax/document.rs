//! The document of a piece: its text, with the way from its places to those in the scene's text.

use std::borrow::Cow;
use std::mem::replace;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue, Error};

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
