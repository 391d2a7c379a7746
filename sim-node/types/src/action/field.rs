//! The fields of actions: their rows in the table, and their bytes on the wire.

use super::words::{KindFilter, MovedObject, RestoreContents};
use crate::parameter::ParameterValue;
use crate::path_part::{PathPart, PathPoint};
use crate::text::Text;

/// A field of an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FieldInfo {
    /// Name in JSON.
    pub name: &'static str,
    /// Meaning, with unit and range.
    pub meaning: &'static str,
    /// Form of the value.
    pub form: FieldForm,
    /// Values of this form and unit, in words.
    pub allowed: &'static str,
    /// The JSON form can lack the field.
    pub is_optional: bool,
    /// Size on the wire, in bytes.
    pub size_bytes: usize,
}

/// Form of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldForm {
    /// A whole number of 32 bits, such as an index.
    Whole,
    /// A whole number of 64 bits.
    Long,
    /// A number.
    Number,
    /// True or false.
    Flag,
    /// Three numbers.
    Vector,
    /// A quaternion x, y, z, w.
    Rotation,
    /// A [`Text`].
    Text,
    /// A [`ParameterValue`].
    Value,
    /// A [`KindFilter`], or nothing for all kinds.
    Kind,
    /// A [`MovedObject`].
    Object,
    /// [`RestoreContents`].
    Contents,
    /// A hash.
    Hash,
    /// A [`PathPart`].
    Path,
}

const fn field(form: FieldForm, allowed: &'static str) -> FieldInfo {
    FieldInfo { name: "", meaning: "", form, allowed, is_optional: false, size_bytes: 0 }
}

pub(super) const WHOLE: FieldInfo = field(FieldForm::Whole, "whole numbers 0..=4294967295");
pub(super) const LONG: FieldInfo = field(FieldForm::Long, "whole numbers from 0");
pub(super) const SECONDS: FieldInfo = field(FieldForm::Number, "a number of seconds");
pub(super) const LENGTH: FieldInfo = field(FieldForm::Number, "a number in m");
pub(super) const FLAG: FieldInfo = field(FieldForm::Flag, "true or false");
pub(super) const POINT: FieldInfo = three("three numbers in m");
pub(super) const ROTATION: FieldInfo =
    field(FieldForm::Rotation, "four numbers: a quaternion x, y, z, w");
pub(super) const VALUE: FieldInfo =
    field(FieldForm::Value, "a number, three numbers, or null for off");
pub(super) const KIND: FieldInfo = field(FieldForm::Kind, "structural, shear, bend, tether or all");
pub(super) const OBJECT: FieldInfo = field(FieldForm::Object, "particle, anchor or collider");
pub(super) const CONTENTS: FieldInfo = field(FieldForm::Contents, "state or motion");
pub(super) const HASH: FieldInfo = field(FieldForm::Hash, "16 hex digits in a string");

pub(super) const fn three(allowed: &'static str) -> FieldInfo {
    field(FieldForm::Vector, allowed)
}

pub(super) const fn text(allowed: &'static str) -> FieldInfo {
    field(FieldForm::Text, allowed)
}

impl FieldInfo {
    /// A path.
    pub const PATH: Self = field(
        FieldForm::Path,
        "points such as {\"time\":0.5,\"translation\":[0,0.1,0],\"rotation\":[0,0,0,1]}",
    );

    pub(super) const fn optional(self) -> Self {
        Self { is_optional: true, ..self }
    }
}

/// Writes fields one after the other.
pub(super) struct FieldWriter<'a>(&'a mut [u8]);

impl<'a> FieldWriter<'a> {
    /// The bytes are 0.
    pub(super) fn new(bytes: &'a mut [u8]) -> Self {
        Self(bytes)
    }

    fn put(&mut self, bytes: &[u8]) {
        let (place, rest) = std::mem::take(&mut self.0).split_at_mut(bytes.len());
        place.copy_from_slice(bytes);
        self.0 = rest;
    }

    /// Leaves zeros.
    fn skip(&mut self, size_bytes: usize) {
        self.0 = std::mem::take(&mut self.0).split_at_mut(size_bytes).1;
    }
}

/// Reads fields one after the other.
pub(super) struct FieldReader<'a>(&'a [u8]);

impl<'a> FieldReader<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    fn take<const SIZE_BYTES: usize>(&mut self) -> Option<[u8; SIZE_BYTES]> {
        let (bytes, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*bytes)
    }
}

/// The type of a field.
pub(super) trait FieldType: Sized {
    /// Size on the wire.
    const SIZE_BYTES: usize;

    fn write(&self, writer: &mut FieldWriter<'_>);

    /// Returns `None` if the bytes are no value of this type.
    fn read(reader: &mut FieldReader<'_>) -> Option<Self>;
}

/// Numbers are little-endian.
macro_rules! numbers {
    ($($type:ty),+) => {$(
        impl FieldType for $type {
            const SIZE_BYTES: usize = size_of::<Self>();

            fn write(&self, writer: &mut FieldWriter<'_>) {
                writer.put(&self.to_le_bytes());
            }

            fn read(reader: &mut FieldReader<'_>) -> Option<Self> {
                reader.take().map(Self::from_le_bytes)
            }
        }
    )+};
}

numbers!(u32, u64, f32, f64);

/// Types with a number of 32 bits.
macro_rules! numbered {
    ($($type:ty: $value:ident => $number:expr, $read:ident => $result:expr;)+) => {$(
        impl FieldType for $type {
            const SIZE_BYTES: usize = size_of::<u32>();

            fn write(&self, writer: &mut FieldWriter<'_>) {
                let $value = *self;
                u32::write(&$number, writer);
            }

            fn read(reader: &mut FieldReader<'_>) -> Option<Self> {
                let $read = u32::read(reader)?;
                $result
            }
        }
    )+};
}

numbered! {
    bool: value => u32::from(value), number => [false, true].get(number as usize).copied();
    KindFilter: kind => kind.number(), number => Some(Self::from_number(number));
    MovedObject: object => object as u32, number => Self::from_number(number);
    RestoreContents: contents => contents as u32, number => Self::from_number(number);
}

/// The numbers, one after the other.
impl<const COUNT: usize> FieldType for [f32; COUNT] {
    const SIZE_BYTES: usize = size_of::<Self>();

    fn write(&self, writer: &mut FieldWriter<'_>) {
        for number in self {
            number.write(writer);
        }
    }

    fn read(reader: &mut FieldReader<'_>) -> Option<Self> {
        let mut numbers = [0.0; COUNT];
        for number in &mut numbers {
            *number = f32::read(reader)?;
        }
        Some(numbers)
    }
}

/// 1 and the value, or 0 and zeros.
impl<T: FieldType> FieldType for Option<T> {
    const SIZE_BYTES: usize = size_of::<u32>() + T::SIZE_BYTES;

    fn write(&self, writer: &mut FieldWriter<'_>) {
        self.is_some().write(writer);
        match self {
            Some(value) => value.write(writer),
            None => writer.skip(T::SIZE_BYTES),
        }
    }

    fn read(reader: &mut FieldReader<'_>) -> Option<Self> {
        if bool::read(reader)? {
            return Some(Some(T::read(reader)?));
        }
        reader.0 = reader.0.get(T::SIZE_BYTES..)?;
        Some(None)
    }
}

/// UTF-8, padded with zeros.
impl FieldType for Text {
    const SIZE_BYTES: usize = Self::SIZE_BYTES_MAX;

    fn write(&self, writer: &mut FieldWriter<'_>) {
        writer.put(&self.to_wire());
    }

    fn read(reader: &mut FieldReader<'_>) -> Option<Self> {
        reader.take().map(|bytes| Self::from_wire(&bytes))
    }
}

/// The count of numbers, and three numbers. Unused ones are 0.
impl FieldType for ParameterValue {
    const SIZE_BYTES: usize = size_of::<u32>() + size_of::<[f32; 3]>();

    fn write(&self, writer: &mut FieldWriter<'_>) {
        let numbers = self.numbers();
        let mut all = [0.0; 3];
        all[..numbers.len()].copy_from_slice(numbers);
        let count = [0_u32, 1, 2, 3][numbers.len()];
        count.write(writer);
        all.write(writer);
    }

    fn read(reader: &mut FieldReader<'_>) -> Option<Self> {
        let count = u32::read(reader)?;
        let numbers = <[f32; 3]>::read(reader)?;
        Self::from_numbers(numbers.get(..count as usize)?)
    }
}

/// The count of points, and four points: time, translation and rotation. Unused ones are 0.
impl FieldType for PathPart {
    const SIZE_BYTES: usize = size_of::<u32>() + Self::POINTS_MAX * PathPoint::SIZE_BYTES;

    fn write(&self, writer: &mut FieldWriter<'_>) {
        let points = self.points();
        let count = [0_u32, 1, 2, 3, 4][points.len()];
        count.write(writer);
        for point in points {
            point.write(writer);
        }
        writer.skip((Self::POINTS_MAX - points.len()) * PathPoint::SIZE_BYTES);
    }

    fn read(reader: &mut FieldReader<'_>) -> Option<Self> {
        let count = u32::read(reader)? as usize;
        let mut points = [PathPoint::AT_LOAD; Self::POINTS_MAX];
        for point in &mut points {
            *point = PathPoint::read(reader)?;
        }
        Self::new(points.get(..count)?)
    }
}

impl FieldType for PathPoint {
    const SIZE_BYTES: usize = size_of::<f64>() + size_of::<[f32; 7]>();

    fn write(&self, writer: &mut FieldWriter<'_>) {
        self.time.write(writer);
        self.translation.write(writer);
        self.rotation.write(writer);
    }

    fn read(reader: &mut FieldReader<'_>) -> Option<Self> {
        let (time, translation) = (f64::read(reader)?, FieldType::read(reader)?);
        Some(Self { time, translation, rotation: FieldType::read(reader)? })
    }
}
