//! Values of a scene file before any check. Each carries its place in the text.

use std::fmt;
use std::marker::PhantomData;
use std::num::NonZeroU32;
use std::ops::{Deref, Range};

use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeOwned, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// A value with its place in the text, which is shorter than 4 GiB.
#[derive(Debug)]
pub(super) struct Spanned<T> {
    value: T,
    start: u32,
    /// No value ends at the start of the text. That makes an `Option` as small as the value.
    end: NonZeroU32,
}

impl<T> Spanned<T> {
    /// Returns the place in the text, in bytes.
    pub(super) fn span(&self) -> Range<usize> {
        self.start as usize..self.end.get() as usize
    }

    pub(super) fn get_ref(&self) -> &T {
        &self.value
    }

    pub(super) fn get_mut(&mut self) -> &mut T {
        &mut self.value
    }

    pub(super) fn into_inner(self) -> T {
        self.value
    }

    /// Returns another value at the same place.
    pub(super) fn with<U>(&self, value: U) -> Spanned<U> {
        Spanned { value, start: self.start, end: self.end }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Spanned<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let spanned = toml::Spanned::<T>::deserialize(deserializer)?;
        let place = |offset| u32::try_from(offset).unwrap_or(u32::MAX);
        let Range { start, end } = spanned.span();
        let end = NonZeroU32::new(place(end)).unwrap_or(NonZeroU32::MIN);
        Ok(Self { value: spanned.into_inner(), start: place(start), end })
    }
}

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

/// Appends a list without spare capacity, which would take up to as much memory as the elements.
pub(super) fn append<T>(list: &mut Vec<T>, mut more: Vec<T>) {
    list.reserve_exact(more.len());
    list.append(&mut more);
}

/// Appends the further elements of a list that the text gives in parts.
pub(super) fn append_elements<T>(
    list: Option<&mut Spanned<Vec<T>>>,
    more: Option<Spanned<Vec<T>>>,
) {
    if let (Some(list), Some(more)) = (list, more) {
        append(list.get_mut(), more.into_inner());
    }
}

/// Returns the number of elements of a list; 0 if the key is missing.
pub(super) fn element_count<T>(list: Option<&Spanned<Vec<T>>>) -> usize {
    list.map_or(0, |list| list.get_ref().len())
}

/// The keys of a table in a scene file.
pub(super) trait TableKeys: DeserializeOwned {
    /// The table in words, for errors.
    const FORM: &'static str = "a table";
}

/// A table. Serde also fills a struct from a list, by position; a table refuses lists.
#[derive(Debug, Default)]
pub(super) struct Table<T>(pub(super) T);

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

/// One number, or two.
#[derive(Debug)]
pub(super) enum NumberOrPair {
    Number(f64),
    Pair(Tuple<Number, 2>),
}

impl<'de> Deserialize<'de> for NumberOrPair {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NumberOrPairVisitor)
    }
}

struct NumberOrPairVisitor;

impl<'de> Visitor<'de> for NumberOrPairVisitor {
    type Value = NumberOrPair;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a number or 2 numbers")
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<NumberOrPair, E> {
        Ok(NumberOrPair::Number(number))
    }

    #[allow(clippy::cast_precision_loss, reason = "a whole number is read from its text")]
    fn visit_i64<E: Error>(self, number: i64) -> Result<NumberOrPair, E> {
        Ok(NumberOrPair::Number(number as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<NumberOrPair, A::Error> {
        TupleVisitor(PhantomData).visit_seq(list).map(NumberOrPair::Pair)
    }
}

/// A list of three or four values.
#[derive(Debug)]
pub(super) struct ThreeOrFour<T> {
    pub(super) three: [T; 3],
    pub(super) fourth: Option<T>,
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for ThreeOrFour<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(ThreeOrFourVisitor(PhantomData))
    }
}

struct ThreeOrFourVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for ThreeOrFourVisitor<T> {
    type Value = ThreeOrFour<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("3 or 4 numbers")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<ThreeOrFour<T>, A::Error> {
        let mut length = 0;
        let mut next = || -> Result<Option<T>, A::Error> {
            let value = list.next_element()?;
            length += usize::from(value.is_some());
            Ok(value)
        };
        let (values, fourth) = ([next()?, next()?, next()?], next()?);
        while list.next_element::<IgnoredAny>()?.is_some() {
            length += 1;
        }
        match values {
            [Some(a), Some(b), Some(c)] if length <= 4 => {
                Ok(ThreeOrFour { three: [a, b, c], fourth })
            }
            _ => Err(Error::invalid_length(length, &self)),
        }
    }
}
