//! The fields of actions: their rows in the table, and their bytes on the wire.

use super::words::{KindFilter, MovedObject, RestoreContents};
use crate::limits::NumberRange;
use crate::parameter::ParameterValue;
use crate::path_part::{PathError, PathPart, PathPoint, PointFault, check_path};
use crate::reason::Reason;
use crate::text::Text;

/// A field of an action.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldInfo {
    /// Name in JSON.
    pub name: &'static str,
    /// Meaning, with unit and range.
    pub meaning: &'static str,
    /// Form of the value.
    pub form: FieldForm,
    /// Values of this form and unit, in words.
    pub allowed: &'static str,
    /// Allowed numbers, for each component of a vector.
    pub range: NumberRange,
    /// The number 0, a vector of zeros and the empty text are refused.
    pub is_nonzero: bool,
    /// The JSON form can lack the field.
    pub is_optional: bool,
    /// Value of an optional field that the JSON form lacks, in words. Empty if the words would say nothing.
    pub default: &'static str,
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
    let (range, is_nonzero) = (NumberRange::FINITE, false);
    let (is_optional, default) = (false, "");
    FieldInfo {
        name: "",
        meaning: "",
        form,
        allowed,
        range,
        is_nonzero,
        is_optional,
        default,
        size_bytes: 0,
    }
}

pub(super) const WHOLE: FieldInfo = field(FieldForm::Whole, "whole numbers 0..=4294967295");
pub(super) const LONG: FieldInfo = field(FieldForm::Long, "whole numbers from 0");
pub(super) const SECONDS: FieldInfo =
    field(FieldForm::Number, "a number of seconds").within(NumberRange::SECONDS);
pub(super) const LENGTH: FieldInfo =
    field(FieldForm::Number, "a number in m").within(NumberRange::LENGTH);
pub(super) const FLAG: FieldInfo = field(FieldForm::Flag, "true or false");
pub(super) const POINT: FieldInfo = three("three numbers in m").within(NumberRange::COORDINATE);
pub(super) const ROTATION: FieldInfo =
    field(FieldForm::Rotation, "four numbers: a quaternion x, y, z, w")
        .within(NumberRange::COORDINATE)
        .nonzero();
pub(super) const VALUE: FieldInfo =
    field(FieldForm::Value, "a number, three numbers, or null for off");
pub(super) const KIND: FieldInfo = field(FieldForm::Kind, "structural, shear, bend, tether or all");
pub(super) const OBJECT: FieldInfo = field(FieldForm::Object, "particle, anchor or collider");
pub(super) const CONTENTS: FieldInfo = field(FieldForm::Contents, "state or motion");
pub(super) const HASH: FieldInfo = field(FieldForm::Hash, "16 hex digits in a string");

pub(super) const fn three(allowed: &'static str) -> FieldInfo {
    field(FieldForm::Vector, allowed)
}

pub(super) const fn words(allowed: &'static str) -> FieldInfo {
    field(FieldForm::Text, allowed)
}

impl FieldInfo {
    /// A path.
    pub const PATH: Self = field(
        FieldForm::Path,
        "points such as {\"time\":0.5,\"translation\":[0,0.1,0],\"rotation\":[0,0,0,1]}",
    );

    pub(super) const fn within(self, range: NumberRange) -> Self {
        Self { range, ..self }
    }

    pub(super) const fn nonzero(self) -> Self {
        Self { is_nonzero: true, ..self }
    }

    pub(super) const fn optional(self, default: &'static str) -> Self {
        Self { is_optional: true, default, ..self }
    }

    /// Name of the argument on a command line and in Python: without the unit, which its values can have.
    pub fn argument(&self) -> &'static str {
        match self.form {
            FieldForm::Kind => "kind",
            _ => self.name.strip_suffix("_s").unwrap_or(self.name),
        }
    }

    fn check_numbers(&self, numbers: &[f32]) -> Result<(), Reason> {
        self.range.check(numbers)?;
        let is_zero = numbers.iter().all(|number| *number == 0.0);
        accept(!(is_zero && self.is_nonzero))
    }
}

/// Checks that numbers are finite.
pub(super) fn check_finite(numbers: &[f32]) -> Result<(), Reason> {
    let is_finite = numbers.iter().all(|number| number.is_finite());
    if is_finite { Ok(()) } else { Err(Reason::NonFinite) }
}

/// Refuses a value that is out of range.
pub(super) fn accept(is_allowed: bool) -> Result<(), Reason> {
    if is_allowed { Ok(()) } else { Err(Reason::OutOfRange) }
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

    /// Checks the value against the row of its field.
    fn check(&self, _field: &FieldInfo) -> Result<(), Reason> {
        Ok(())
    }
}

/// Numbers are little-endian.
macro_rules! numbers {
    ($($type:ty: $number:ident, $field:ident => $check:expr;)+) => {$(
        impl FieldType for $type {
            const SIZE_BYTES: usize = size_of::<Self>();

            fn write(&self, writer: &mut FieldWriter<'_>) {
                writer.put(&self.to_le_bytes());
            }

            fn read(reader: &mut FieldReader<'_>) -> Option<Self> {
                reader.take().map(Self::from_le_bytes)
            }

            fn check(&self, $field: &FieldInfo) -> Result<(), Reason> {
                let $number = *self;
                $check
            }
        }
    )+};
}

numbers! {
    u32: number, field => accept(number > 0 || !field.is_nonzero);
    u64: _number, _field => Ok(());
    f32: number, field => field.check_numbers(&[number]);
    f64: _number, _field => Ok(());
}

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

    fn check(&self, field: &FieldInfo) -> Result<(), Reason> {
        field.check_numbers(self)
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

    fn check(&self, field: &FieldInfo) -> Result<(), Reason> {
        self.iter().try_for_each(|value| value.check(field))
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

    fn check(&self, field: &FieldInfo) -> Result<(), Reason> {
        accept(!self.as_str().is_empty() || !field.is_nonzero)
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

    fn check(&self, _field: &FieldInfo) -> Result<(), Reason> {
        for point in self.points() {
            POINT.check_numbers(&point.translation)?;
            ROTATION.check_numbers(&point.rotation)?;
        }
        check_path(self.points()).map_err(|error| match error {
            PathError::Point { fault: PointFault::NotFinite, .. } => Reason::NonFinite,
            _ => Reason::OutOfRange,
        })
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
