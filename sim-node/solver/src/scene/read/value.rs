//! Values of a scene file before any check. Each carries its place in the text.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;

use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeOwned, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use toml::Spanned;

/// A whole or decimal number.
pub(super) type Number = Spanned<f64>;
/// Three numbers.
pub(super) type Vector = Spanned<Tuple<Number, 3>>;
/// A quaternion x, y, z, w.
pub(super) type Quaternion = Spanned<Tuple<Number, 4>>;
/// A whole number. Its range is checked later.
pub(super) type Whole = Spanned<i64>;
/// A text in quotes.
pub(super) type Word = Spanned<String>;
/// A list of tables.
pub(super) type Tables<T> = Vec<Spanned<Table<T>>>;

/// The keys of a table in a scene file.
pub(super) trait TableKeys: DeserializeOwned {
    /// The table in words, for errors.
    const FORM: &'static str = "a table";
}

/// A table. Serde also fills a struct from a list, by position; a table refuses lists.
#[derive(Debug, Default)]
pub(super) struct Table<T>(T);

impl<T> Deref for Table<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<'de, T: TableKeys> Deserialize<'de> for Table<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(TableVisitor(PhantomData))
    }
}

struct TableVisitor<T>(PhantomData<T>);

impl<'de, T: TableKeys> Visitor<'de> for TableVisitor<T> {
    type Value = Table<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(T::FORM)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Table<T>, A::Error> {
        T::deserialize(MapAccessDeserializer::new(map)).map(Table)
    }
}

/// A list of exactly N values. Serde's arrays ignore further values.
#[derive(Debug)]
pub(super) struct Tuple<T, const N: usize>([T; N]);

impl<T, const N: usize> Deref for Tuple<T, N> {
    type Target = [T; N];

    fn deref(&self) -> &[T; N] {
        &self.0
    }
}

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for Tuple<T, N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(TupleVisitor(PhantomData))
    }
}

struct TupleVisitor<T, const N: usize>(PhantomData<T>);

impl<'de, T: Deserialize<'de>, const N: usize> Visitor<'de> for TupleVisitor<T, N> {
    type Value = Tuple<T, N>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{N} numbers")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Tuple<T, N>, A::Error> {
        let mut values = Vec::with_capacity(N);
        let mut length = 0;
        while length < N {
            let Some(value) = list.next_element()? else { break };
            values.push(value);
            length += 1;
        }
        while length >= N && list.next_element::<IgnoredAny>()?.is_some() {
            length += 1;
        }
        match <[T; N]>::try_from(values) {
            Ok(values) if length == N => Ok(Tuple(values)),
            _ => Err(Error::invalid_length(length, &self)),
        }
    }
}
