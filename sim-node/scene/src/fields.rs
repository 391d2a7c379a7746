//! The keys of the tables of a scene, read and printed by one walk.
//!
//! Each table of a scene is a struct, whose [`SceneTable::fields`] names its keys with their values and ranges. To read a
//! text, the walk starts from the defaults and sets what the text gives. To print a scene, it writes the same keys.
//! A wrong value is reported and leaves the default, so that one walk finds all of them.

use std::cell::{Cell, RefCell};
use std::fmt;
use std::ops::RangeInclusive;

use sim_types::{ELEMENTS_MAX, NumberRange, did_you_mean, nearest};
use toml_writer::ToTomlValue;

use super::document::{Table, Value, ValueNode};
use super::error::Problems;
use super::lists;

/// A size: in f32, it still adds up with a coordinate of the same magnitude.
pub(crate) const SIZE: NumberRange = NumberRange {
    min: 0.0,
    excludes_min: true,
    text: "more than 0, at most 1e7",
    ..NumberRange::COORDINATE
};
/// A mass: its inverse is finite in f32, too. The excluded end is 2^-128.
pub(crate) const MASS: NumberRange = NumberRange {
    min: f32::from_bits(0x0020_0000),
    text: "1e-38 to 1e38 kg",
    ..NumberRange::POSITIVE
};
/// A bending rigidity; 0 bends freely.
pub(crate) const RIGIDITY: NumberRange = NumberRange::AT_LEAST_ZERO;
/// A coordinate, with the remedy for greater distances.
pub(crate) const POSITION: NumberRange = NumberRange {
    text: "-1e7 to 1e7; put a greater distance into `origin`",
    ..NumberRange::COORDINATE
};
/// Longest text that an error repeats, in bytes.
const SHOWN_TEXT_MAX: usize = 60;

/// A table of a scene.
pub(crate) trait SceneTable {
    /// The table in words, for errors.
    const FORM: &'static str = "a table";

    /// Walks the keys: values first, then tables.
    fn fields(&mut self, fields: &mut Fields<'_>);
}

/// The state of reading a text.
pub(crate) struct Reader<'a> {
    pub(crate) problems: &'a Problems<'a>,
    /// Reads a file that the scene names.
    pub(crate) read_file: &'a dyn Fn(&str) -> Result<String, String>,
    /// Warnings about such files and other values, one sentence each.
    pub(crate) warnings: RefCell<Vec<String>>,
    pub(crate) is_planar: Cell<bool>,
    /// The method is not wrong, so a softness of the other one is.
    pub(crate) is_method_known: Cell<bool>,
    /// The number of particles, once it is known.
    pub(crate) particle_count: Cell<Option<u32>>,
    /// By particle: it has an anchor.
    pub(crate) is_anchored: RefCell<Vec<bool>>,
    /// Returns the advice for a key that its table does not have.
    pub(crate) advice: fn(&str) -> String,
}

/// The keys from the top of the text to a value.
#[derive(Clone, Copy)]
pub(crate) struct FieldPath<'a> {
    parent: Option<&'a FieldPath<'a>>,
    key: &'a str,
    /// The element of a list.
    index: Option<usize>,
}

impl fmt::Display for FieldPath<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(parent) = self.parent {
            write!(formatter, "{parent}.")?;
        }
        formatter.write_str(self.key)?;
        self.index.map_or(Ok(()), |index| write!(formatter, "[{index}]"))
    }
}

impl FieldPath<'_> {
    /// Returns the keys alone, as in a header.
    fn header(&self) -> String {
        let parent = self.parent.map_or(String::new(), |parent| parent.header() + ".");
        parent + self.key
    }
}

/// A value of the text. Its methods return `None` after they have reported what is wrong.
#[derive(Clone, Copy)]
pub(crate) struct At<'a> {
    pub(crate) reader: &'a Reader<'a>,
    node: &'a ValueNode<'a>,
    path: FieldPath<'a>,
}

impl<'a> At<'a> {
    /// Reports what is wrong with the value.
    pub(crate) fn error<T>(&self, problem: impl Into<String>) -> Option<T> {
        self.reader.problems.add(self.node.start as usize, &self.path.to_string(), problem);
        None
    }

    /// Returns the path of the value.
    pub(crate) fn field(&self) -> String {
        self.path.to_string()
    }

    /// The value as written.
    pub(crate) fn text(&self) -> &'a str {
        &self.reader.problems.text[self.node.start as usize..self.node.end as usize]
    }

    /// Reports a value of another type.
    pub(crate) fn unexpected<T>(&self, allowed: &str) -> Option<T> {
        let description = match &self.node.value {
            Value::Boolean(value) => value.to_string(),
            Value::Integer | Value::Float => format!("the number {}", self.text()),
            Value::Date => "a date".to_owned(),
            Value::Text(text) if text.len() > SHOWN_TEXT_MAX => "a long text".to_owned(),
            Value::Text(text) => format!("the text {text:?}"),
            Value::List(_) => "a list".to_owned(),
            Value::Table(_) => "a table".to_owned(),
        };
        self.error(format!("is {description} (allowed: {allowed})"))
    }

    /// Returns the text, if the value is one.
    pub(crate) fn as_text(&self) -> Option<&'a str> {
        match &self.node.value {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }

    /// Returns the elements, if the value is a list.
    pub(crate) fn as_list(&self) -> Option<impl ExactSizeIterator<Item = Self> + use<'a>> {
        let Self { reader, path, .. } = *self;
        match &self.node.value {
            Value::List(list) => Some(list.iter().map(move |node| Self { reader, node, path })),
            _ => None,
        }
    }

    pub(crate) fn quoted_text(&self) -> Option<&'a str> {
        self.as_text().or_else(|| self.unexpected("text in quotes"))
    }

    /// Returns a text without control characters.
    pub(crate) fn line(&self) -> Option<&'a str> {
        let text = self.quoted_text()?;
        if !text.chars().any(char::is_control) {
            return Some(text);
        }
        self.error("has control characters (allowed: a line of text)")
    }

    pub(crate) fn list(&self) -> Option<impl ExactSizeIterator<Item = Self> + use<'a>> {
        if self.as_list().is_none() {
            return self.unexpected("a list");
        }
        self.as_list()
    }

    /// Returns the elements of a list of N numbers.
    pub(crate) fn numbers<const N: usize>(&self) -> Option<[Self; N]> {
        let Self { reader, path, .. } = *self;
        match &self.node.value {
            Value::List(list) => match <&[ValueNode<'a>; N]>::try_from(list.as_slice()) {
                Ok(list) => Some(list.each_ref().map(|node| Self { reader, node, path })),
                Err(_) => self.wrong_length(list.len(), &format!("{N} numbers")),
            },
            _ => self.unexpected(&format!("{N} numbers")),
        }
    }

    pub(crate) fn wrong_length<T>(&self, count: usize, allowed: &str) -> Option<T> {
        let noun = if count == 1 { "entry" } else { "entries" };
        self.error(format!("has {count} {noun} (allowed: {allowed})"))
    }

    pub(crate) fn flag(&self) -> Option<bool> {
        match self.node.value {
            Value::Boolean(value) => Some(value),
            _ => self.unexpected("true or false"),
        }
    }

    /// Returns a whole number of any size.
    pub(crate) fn integer(&self) -> Option<i64> {
        let is_integer = matches!(self.node.value, Value::Integer);
        let number = Some(self.text()).filter(|_| is_integer).and_then(whole);
        number.or_else(|| self.unexpected("a whole number"))
    }

    pub(crate) fn whole(&self, range: RangeInclusive<u32>) -> Option<u32> {
        let number = self.integer()?;
        let (low, high) = (*range.start(), *range.end());
        if let Some(number) = u32::try_from(number).ok().filter(|number| range.contains(number)) {
            return Some(number);
        }
        let allowed = if low == high { low.to_string() } else { format!("{low} to {high}") };
        self.error(format!("{number} is out of range (allowed: {allowed})"))
    }

    /// Returns `true` for a whole or decimal number.
    pub(crate) fn is_number(&self) -> bool {
        matches!(self.node.value, Value::Integer | Value::Float)
    }

    /// Returns a number in 64 bits.
    pub(crate) fn double(&self) -> Option<f64> {
        if !self.is_number() {
            return self.unexpected("a number");
        }
        let text = self.text().replace('_', "");
        #[allow(clippy::cast_precision_loss, reason = "hexadecimal integers have no decimals")]
        let number = text.parse().ok().or_else(|| whole(&text).map(|number| number as f64));
        number.or_else(|| self.unexpected("a number"))
    }

    /// Returns the number, rounded once from its text to f32.
    pub(crate) fn finite(&self) -> Option<f32> {
        if !self.is_number() {
            return self.unexpected("a number");
        }
        // Only rare forms need a copy: digits with `_`, and hexadecimal numbers, which have no f32 text.
        #[allow(clippy::cast_possible_truncation, reason = "hexadecimal integers have no f32 text")]
        let rare = || self.text().replace('_', "").parse().ok().or(self.double().map(|n| n as f32));
        let number: f32 = self.text().parse().ok().or_else(rare)?;
        if number.is_finite() {
            return Some(number);
        }
        let text = self.text();
        self.error(format!("{text} is not finite in 32 bits (allowed: a finite number)"))
    }

    pub(crate) fn number(&self, range: NumberRange) -> Option<f32> {
        let number = self.finite()?;
        if range.contains(number) {
            return Some(number);
        }
        self.error(format!("{} is out of range (allowed: {})", self.text(), range.text))
    }

    /// Returns a limit, or infinity for none.
    fn limit(&self, range: NumberRange) -> Option<f32> {
        if matches!(self.node.value, Value::Float) && self.text().trim_start_matches('+') == "inf" {
            return Some(f32::INFINITY);
        }
        let number = self.finite()?;
        if range.contains(number) {
            return Some(number);
        }
        let text = self.text();
        self.error(format!("{text} is out of range (allowed: {}, or inf for off)", range.text))
    }

    /// Returns the numbers of a vector, also of one out of the plane of a scene of 2 dimensions.
    fn axes(&self) -> Option<[f32; 3]> {
        let [x, y, z] = self.numbers()?;
        Some([x.number(POSITION)?, y.number(POSITION)?, z.number(POSITION)?])
    }

    pub(crate) fn vector(&self) -> Option<[f32; 3]> {
        let axes = self.axes()?;
        if self.reader.is_planar.get() && axes[2] != 0.0 {
            let z = axes[2];
            return self.error(format!("z is {z} in a scene of 2 dimensions (allowed: 0)"));
        }
        Some(axes)
    }

    /// Returns the normal of a plane. The normal of the plane of a scene of 2 dimensions is out of it.
    pub(crate) fn normal(&self) -> Option<[f32; 3]> {
        let axes = self.axes()?;
        if axes != [0.0; 3] {
            return Some(axes);
        }
        self.error("has no direction (allowed: a vector other than 0)")
    }

    /// Returns a quaternion x, y, z, w. In 2-D it rotates about z only.
    pub(crate) fn rotation(&self) -> Option<[f32; 4]> {
        let mut quaternion = [0.0; 4];
        for (part, number) in quaternion.iter_mut().zip(self.numbers::<4>()?) {
            *part = number.number(NumberRange::COORDINATE)?;
        }
        if quaternion == [0.0; 4] {
            return self.error("has no direction (allowed: x, y, z, w that are not all 0)");
        }
        if self.reader.is_planar.get() && quaternion[..2] != [0.0; 2] {
            return self.error("rotates out of the plane (allowed: [0, 0, z, w] in 2 dimensions)");
        }
        Some(quaternion)
    }

    /// Returns points: of a list, or of a text in base64.
    pub(crate) fn points<const N: usize>(&self, range: NumberRange) -> Option<Vec<[f32; N]>> {
        let points = if let Some(text) = self.as_text() {
            lists::parse_points(text).or_else(|| self.wrong_base64())?
        } else {
            let point = |at: At<'_>| {
                let mut point = [0.0; N];
                for (axis, number) in point.iter_mut().zip(at.numbers::<N>()?) {
                    *axis = number.number(range)?;
                }
                Some(point)
            };
            self.list()?.map(point).collect::<Option<Vec<_>>>()?
        };
        let wrong = points.as_flattened().iter().find(|number| !range.contains(**number));
        if let Some(number) = wrong {
            return self.error(format!("{number} is out of range (allowed: {})", range.text));
        }
        let z = points.iter().filter_map(|point| point.get(2)).find(|z| **z != 0.0);
        if let Some(z) = z.filter(|_| self.reader.is_planar.get()) {
            return self.error(format!("z is {z} in a scene of 2 dimensions (allowed: 0)"));
        }
        Some(points)
    }

    /// Returns lists of indices: of a list, or of a text in base64. Numbers that no index can be become the greatest one.
    pub(crate) fn index_lists(&self) -> Option<Vec<Vec<u32>>> {
        if let Some(text) = self.as_text() {
            return lists::parse_lists(text).or_else(|| self.wrong_base64());
        }
        let index = |at: At<'_>| at.integer().map(|one| u32::try_from(one).unwrap_or(u32::MAX));
        self.list()?.map(|list| list.list()?.map(index).collect()).collect()
    }

    fn wrong_base64<T>(&self) -> Option<T> {
        self.error(
            "is not base64 of whole elements (allowed: a list, or the text of a printed scene)",
        )
    }

    /// Returns the text of an element of a list, or of its value if the list is in base64.
    pub(crate) fn element_text(&self, index: usize, value: &[u32]) -> String {
        let element = self.as_list().and_then(|mut list| list.nth(index));
        element.map_or_else(|| format!("{value:?}"), |element| element.text().to_owned())
    }

    /// Returns the choice that a word names.
    pub(crate) fn word<T: Clone>(&self, choices: &[(&'static str, T)]) -> Option<T> {
        let name = self.quoted_text()?;
        if let Some((_, choice)) = choices.iter().find(|(known, _)| *known == name) {
            return Some(choice.clone());
        }
        let allowed = choices.iter().map(|(known, _)| *known).collect::<Vec<_>>().join(", ");
        let meant = did_you_mean(name, choices.iter().map(|(known, _)| *known));
        self.error(format!("{name:?} is unknown{meant} (allowed: {allowed})"))
    }

    /// Returns the index of an existing particle. All are accepted as long as the shapes have errors.
    pub(crate) fn particle(&self) -> Option<u32> {
        match self.reader.particle_count.get() {
            Some(0) => {
                let index = self.integer()?;
                self.error(format!(
                    "{index} is out of range: the scene has no particles (allowed: none)"
                ))
            }
            Some(count) => self.whole(0..=count - 1),
            None => self.whole(0..=ELEMENTS_MAX),
        }
    }

    /// Reads the keys of a table over the given values.
    fn table<T: SceneTable>(&self, mut value: T) -> Option<T> {
        let Value::Table(table) = &self.node.value else { return self.unexpected(T::FORM) };
        let Self { reader, node, path } = *self;
        let place = TablePlace { reader, table, start: node.start as usize, path: Some(path) };
        Fields::read(place, &mut value);
        Some(value)
    }
}

/// Parses a whole number with any radix.
fn whole(text: &str) -> Option<i64> {
    let text = text.replace('_', "");
    let radix = |radix: u32| i64::from_str_radix(&text[2..], radix).ok();
    match text.get(..2) {
        Some("0x") => radix(16),
        Some("0o") => radix(8),
        Some("0b") => radix(2),
        _ => text.parse().ok(),
    }
}

/// A table of the text.
struct TablePlace<'a> {
    reader: &'a Reader<'a>,
    table: &'a Table<'a>,
    start: usize,
    /// `None` for the top of the text.
    path: Option<FieldPath<'a>>,
}

enum Mode<'a> {
    Read(TablePlace<'a>),
    Print(&'a mut Printer),
    /// Only the names of the keys are wanted.
    Keys,
}

/// The text of a scene, as far as it is printed.
#[derive(Default)]
pub(crate) struct Printer {
    text: String,
    /// The header of the current table.
    header: String,
    /// Only the size of the text is wanted.
    measures: bool,
    /// Size of the text that is not kept.
    size_bytes: usize,
}

/// A value that decides what other keys its table has.
pub(crate) trait TableShape: Clone {
    /// The word of the key `shape`.
    fn word(&self) -> &'static str;

    /// Returns each shape with its defaults.
    fn blanks() -> Vec<Self>;

    /// Returns the keys of the table with each shape.
    fn keys() -> Vec<NamedKeys>;
}

/// The keys of a table, or of a table with one of its shapes.
pub(crate) struct NamedKeys {
    /// The header of the table, or the shape.
    pub(crate) name: &'static str,
    pub(crate) keys: Vec<&'static str>,
}

impl NamedKeys {
    pub(crate) fn new(name: &'static str, table: &mut impl SceneTable) -> Self {
        let mut fields = Fields::new(Mode::Keys);
        table.fields(&mut fields);
        Self { name, keys: fields.keys }
    }

    /// Returns the names of the tables that have a key.
    pub(crate) fn owners(all: &[Self], key: &str) -> Vec<&'static str> {
        all.iter().filter(|one| one.keys.contains(&key)).map(|one| one.name).collect()
    }
}

/// The shape of a table, and the way to the keys of all of them.
#[derive(Clone, Copy)]
struct ShapeName {
    name: &'static str,
    keys: fn() -> Vec<NamedKeys>,
}

/// A walk over the keys of a table.
pub(crate) struct Fields<'a> {
    mode: Mode<'a>,
    keys: Vec<&'static str>,
    /// Required keys that the text lacks, with what is allowed.
    missing: Vec<(&'static str, String)>,
    /// A key that belongs to another scene.
    refused: Option<&'static str>,
    /// Of a table whose keys depend on its shape: the shape, and the keys of all of them.
    shape: Option<ShapeName>,
}

/// Prints a whole scene.
pub(crate) fn print(scene: &mut impl SceneTable) -> String {
    let mut printer = Printer::default();
    scene.fields(&mut Fields::new(Mode::Print(&mut printer)));
    printer.text
}

/// Returns the size of a whole scene in print, in bytes. Keeps at most a table of it at once.
pub(crate) fn printed_size(scene: &mut impl SceneTable) -> usize {
    let mut printer = Printer { measures: true, ..Printer::default() };
    scene.fields(&mut Fields::new(Mode::Print(&mut printer)));
    printer.size_bytes + printer.text.len()
}

/// Reads the top of a text over the given values.
pub(crate) fn read<'a>(reader: &'a Reader<'a>, table: &'a Table<'a>, scene: &mut impl SceneTable) {
    Fields::read(TablePlace { reader, table, start: 0, path: None }, scene);
}

impl<'a> Fields<'a> {
    fn new(mode: Mode<'a>) -> Self {
        Self { mode, keys: Vec::new(), missing: Vec::new(), refused: None, shape: None }
    }

    /// Returns the reader, if a text is read.
    pub(crate) fn reader(&self) -> Option<&Reader<'a>> {
        match &self.mode {
            Mode::Read(place) => Some(place.reader),
            _ => None,
        }
    }

    /// Returns `true` while a scene of 2 dimensions is read.
    pub(crate) fn is_planar(&self) -> bool {
        self.reader().is_some_and(|reader| reader.is_planar.get())
    }

    /// Returns the number of problems so far. A check of several values makes sense only without problems in them.
    pub(crate) fn problem_count(&self) -> usize {
        self.reader().map_or(0, |reader| reader.problems.count()) + self.missing.len()
    }

    /// Names a key, and returns its value in the text.
    pub(crate) fn get(&mut self, key: &'static str) -> Option<At<'_>> {
        if !self.keys.contains(&key) {
            self.keys.push(key);
        }
        self.find(key)
    }

    /// Returns the value of a key in the text.
    pub(crate) fn find(&self, key: &'static str) -> Option<At<'_>> {
        let Mode::Read(TablePlace { reader, table, path, .. }) = &self.mode else { return None };
        let path = FieldPath { parent: path.as_ref(), key, index: None };
        table.get(key).map(|node| At { reader, node, path })
    }

    /// Reports what is wrong with a key: at its value, or at the table if it is missing.
    pub(crate) fn error(&self, key: &'static str, problem: impl Into<String>) {
        if let Some(at) = self.find(key) {
            at.error::<()>(problem);
        } else if let Mode::Read(TablePlace { reader, start, path, .. }) = &self.mode {
            let path = FieldPath { parent: path.as_ref(), key, index: None };
            reader.problems.add(*start, &path.to_string(), problem);
        }
    }

    /// Reports what is wrong with a key of a table in a list.
    pub(crate) fn error_in(&self, list: &'static str, index: usize, key: &str, problem: &str) {
        let Some(at) = self.find(list) else { return };
        let Some(mut table) = at.as_list().and_then(|mut list| list.nth(index)) else { return };
        table.path.index = Some(index);
        let value = table.node.get(key);
        let path = FieldPath { parent: Some(&table.path), key, index: None };
        At { node: value.unwrap_or(table.node), path, ..table }.error::<()>(problem);
    }

    /// Requires a key. `allowed` describes its value.
    pub(crate) fn require(&mut self, key: &'static str, allowed: &str) {
        if self.reader().is_some() && self.find(key).is_none() {
            self.missing.push((key, allowed.to_owned()));
        }
    }

    /// Refuses a key that other scenes have.
    pub(crate) fn refuse(&mut self, key: &'static str, problem: &str) {
        if let Mode::Keys = self.mode {
            self.keys.push(key);
        } else if self.find(key).is_some() {
            self.error(key, problem);
        }
        self.refused = Some(key);
    }

    /// Walks a key with its own ways to read its value, and to print it unless it has none.
    pub(crate) fn value<T>(
        &mut self,
        key: &'static str,
        value: &mut T,
        read: impl FnOnce(At<'_>) -> Option<T>,
        print: impl FnOnce(&T) -> Option<String>,
    ) {
        if let Mode::Print(printer) = &mut self.mode {
            if let Some(text) = print(value) {
                printer.text.extend([key, " = ", &text, "\n"]);
            }
        } else if let Some(new) = self.get(key).and_then(read) {
            *value = new;
        }
    }

    pub(crate) fn number(&mut self, key: &'static str, value: &mut f32, range: NumberRange) {
        self.value(key, value, |at| at.number(range), printed);
    }

    pub(crate) fn optional_number(
        &mut self,
        key: &'static str,
        value: &mut Option<f32>,
        range: NumberRange,
    ) {
        self.value(key, value, |at| at.number(range).map(Some), |value| printed(value.as_ref()?));
    }

    /// Walks a limit, which is `None` without the key, and infinity for off.
    pub(crate) fn limit(&mut self, key: &'static str, value: &mut Option<f32>, range: NumberRange) {
        self.value(key, value, |at| at.limit(range).map(Some), |value| printed(value.as_ref()?));
    }

    /// Walks a size, which is required.
    pub(crate) fn size(&mut self, key: &'static str, value: &mut f32) {
        self.require(key, SIZE.text);
        self.number(key, value, SIZE);
    }

    pub(crate) fn whole(&mut self, key: &'static str, value: &mut u32, range: RangeInclusive<u32>) {
        self.value(key, value, |at| at.whole(range), printed);
    }

    /// Walks a number of elements, which is required.
    pub(crate) fn count(&mut self, key: &'static str, value: &mut u32, min: u32) {
        self.require(key, &format!("a whole number >= {min}"));
        self.whole(key, value, min..=ELEMENTS_MAX);
    }

    pub(crate) fn vector(&mut self, key: &'static str, value: &mut [f32; 3]) {
        self.value(key, value, |at| at.vector(), printed);
    }

    /// Walks a vector that is required.
    pub(crate) fn point(&mut self, key: &'static str, value: &mut [f32; 3]) {
        self.require(key, "three numbers");
        self.vector(key, value);
    }

    pub(crate) fn rotation(&mut self, key: &'static str, value: &mut [f32; 4]) {
        self.value(key, value, |at| at.rotation(), printed);
    }

    /// Walks a flag, which is printed unless it has its default.
    pub(crate) fn flag(&mut self, key: &'static str, value: &mut bool, default: bool) {
        let print = |value: &bool| (*value != default).then(|| value.to_string());
        self.value(key, value, |at| at.flag(), print);
    }

    pub(crate) fn word<T: Copy + PartialEq>(
        &mut self,
        key: &'static str,
        value: &mut T,
        choices: &[(&'static str, T)],
    ) {
        let print = |value: &T| {
            let choice = choices.iter().find(|(_, choice)| choice == value);
            choice.and_then(|(name, _)| printed(*name))
        };
        self.value(key, value, |at| at.word(choices), print);
    }

    /// Walks the key `shape`. Returns `false` if the text has no known one: then all other keys go unchecked.
    pub(crate) fn shape<S: TableShape>(&mut self, value: &mut S) -> bool {
        let choices: Vec<_> = S::blanks().into_iter().map(|blank| (blank.word(), blank)).collect();
        let allowed: Vec<_> = choices.iter().map(|(name, _)| *name).collect();
        if self.find("shape").is_none() {
            self.error("shape", missing(&allowed.join(", ")));
        }
        let mut is_known = self.reader().is_none();
        let read = |at: At<'_>| {
            let shape = at.word(&choices)?;
            is_known = true;
            Some(shape)
        };
        self.value("shape", value, read, |value| printed(value.word()));
        if is_known {
            self.shape = Some(ShapeName { name: value.word(), keys: S::keys });
        } else {
            self.stop();
        }
        is_known
    }

    /// Leaves all other keys of the text unchecked.
    pub(crate) fn stop(&mut self) {
        self.mode = Mode::Keys;
    }

    /// Walks a table.
    pub(crate) fn table<T: SceneTable + Clone>(&mut self, key: &'static str, value: &mut T) {
        if let Mode::Print(printer) = &mut self.mode {
            printer.table(key, ["\n[", "]\n"], value);
        } else if let Some(new) = self.get(key).and_then(|at| at.table(value.clone())) {
            *value = new;
        }
    }

    /// Walks a table that a scene need not have.
    pub(crate) fn optional_table<T: SceneTable + Clone + Default>(
        &mut self,
        key: &'static str,
        value: &mut Option<T>,
    ) {
        if matches!(self.mode, Mode::Print(_)) {
            if let Some(value) = value {
                self.table(key, value);
            }
        } else if let Some(new) = self.get(key).and_then(|at| at.table(T::default())) {
            *value = Some(new);
        }
    }

    /// Walks a list of tables. `blank` has the defaults of each.
    pub(crate) fn tables<T: SceneTable + Clone>(
        &mut self,
        key: &'static str,
        list: &mut Vec<T>,
        blank: &T,
    ) {
        if let Mode::Print(printer) = &mut self.mode {
            for value in list {
                printer.table(key, ["\n[[", "]]\n"], value);
            }
        } else if let Some(at) = self.get(key) {
            let Some(nodes) = at.as_list() else {
                let header = format!("tables with the header [[{}]]", at.path.header());
                at.unexpected::<()>(&header);
                return;
            };
            list.reserve_exact(nodes.len());
            for (index, mut element) in nodes.enumerate() {
                element.path.index = Some(index);
                list.extend(element.table(blank.clone()));
            }
        }
    }

    /// Reads a table. Reports the keys of the text that it does not have, and those that it lacks, unless one is misspelt.
    fn read(place: TablePlace<'a>, value: &mut impl SceneTable) {
        let mut fields = Self::new(Mode::Read(place));
        value.fields(&mut fields);
        let Mode::Read(TablePlace { reader, table, path, .. }) = &fields.mode else { return };
        let is_known = |key: &str| fields.keys.contains(&key) || fields.refused == Some(key);
        let mut meant = Vec::new();
        for entry in table.entries.iter().filter(|entry| !is_known(&entry.key)) {
            let path = FieldPath { parent: path.as_ref(), key: &entry.key, index: None };
            let problem = fields.unknown_key(reader, &entry.key);
            reader.problems.add(entry.start as usize, &path.to_string(), problem);
            meant.extend(nearest(&entry.key, fields.keys.iter().copied()));
        }
        for (key, allowed) in fields.missing.iter().filter(|(key, _)| !meant.contains(key)) {
            fields.error(key, missing(allowed));
        }
    }

    /// Returns the problem of a key that the table does not have.
    fn unknown_key(&self, reader: &Reader<'_>, key: &str) -> String {
        let allowed = self.keys.join(", ");
        let meant = did_you_mean(key, self.keys.iter().copied());
        if let Some(shape) = self.shape.filter(|_| meant.is_empty()) {
            let owners = NamedKeys::owners(&(shape.keys)(), key).join(", ");
            if !owners.is_empty() {
                let name = shape.name;
                return format!(
                    "unknown key of the shape {name}, a key of {owners} (allowed: {allowed})"
                );
            }
        }
        let advice = if meant.is_empty() { (reader.advice)(key) } else { meant };
        format!("unknown key{advice} (allowed: {allowed})")
    }
}

impl Printer {
    fn table(&mut self, key: &str, [before, behind]: [&str; 2], table: &mut impl SceneTable) {
        let outer = self.header.len();
        if outer > 0 {
            self.header.push('.');
        }
        self.header.push_str(key);
        if self.measures {
            self.size_bytes += self.text.len();
            self.text.clear();
        }
        self.text.extend([before, &self.header, behind]);
        table.fields(&mut Fields::new(Mode::Print(self)));
        self.header.truncate(outer);
    }
}

/// Returns the problem of a key that is missing.
fn missing(allowed: &str) -> String {
    format!("is missing (allowed: {allowed})")
}

/// Returns the TOML of a value.
#[allow(clippy::unnecessary_wraps, reason = "values that are not printed have none")]
pub(crate) fn printed<T: ToTomlValue + ?Sized>(value: &T) -> Option<String> {
    Some(value.to_toml_value())
}
