//! Edits of a JSON message within its text, so that all other bytes stay as they are.

use std::ops::Range;

use serde_json::Value;

/// A changed message.
pub(super) struct Change {
    /// The JSON pointer of the changed value, or what was added or removed.
    pub(super) what: String,
    pub(super) bytes: Vec<u8>,
}

/// Values of which a text replaces a known one with another that is known.
const KNOWN_TEXTS: [(&str, &str); 4] =
    [("applied", "rejected"), ("rejected", "applied"), ("cut", "unknown"), ("pause", "resume")];

/// A value without parts, at its place in the text.
struct Leaf {
    /// Its JSON pointer.
    pointer: String,
    place: Range<usize>,
}

/// The parts of a JSON text without spaces.
struct Scanner<'a> {
    text: &'a str,
    at: usize,
    leaves: Vec<Leaf>,
    /// The members of the outermost object, from the quote of the key to the end of the value.
    members: Vec<(String, Range<usize>)>,
}

/// Returns the edits of a message: each value, and a missing key.
pub(super) fn json_edits(data: &[u8]) -> Vec<Change> {
    let text = std::str::from_utf8(data).unwrap();
    let Scanner { leaves, members, .. } = Scanner::scan(text);
    assert_scanned(text, &leaves);
    let mut edits = Vec::new();
    for Leaf { pointer, place } in leaves {
        for other in other_values(&text[place.clone()]) {
            let bytes = replaced(text, place.clone(), &other);
            edits.push(Change { what: pointer.clone(), bytes });
        }
    }
    for (key, place) in members {
        // The comma after the member, or before the last one.
        let is_last = text.as_bytes()[place.end] == b'}';
        let place = if is_last { place.start - 1..place.end } else { place.start..place.end + 1 };
        edits.push(Change { what: format!("no {key}"), bytes: replaced(text, place, "") });
    }
    edits
}

fn replaced(text: &str, place: Range<usize>, other: &str) -> Vec<u8> {
    [&text[..place.start], other, &text[place.end..]].concat().into_bytes()
}

/// Compares the places of the leaves with an independent reader.
fn assert_scanned(text: &str, leaves: &[Leaf]) {
    let value: Value = serde_json::from_str(text).unwrap();
    for Leaf { pointer, place } in leaves {
        let leaf = &text[place.clone()];
        let expected = value.pointer(pointer).unwrap();
        assert_eq!(serde_json::from_str::<Value>(leaf).unwrap(), *expected, "{pointer}: {leaf}");
        assert_eq!(replaced(text, place.clone(), leaf), text.as_bytes());
    }
    assert_eq!(leaves.len(), leaf_count(&value), "{text}");
}

fn leaf_count(value: &Value) -> usize {
    match value {
        Value::Object(fields) => fields.values().map(leaf_count).sum(),
        Value::Array(all) => all.iter().map(leaf_count).sum(),
        _ => 1,
    }
}

/// Returns other values in the form in which a recorder writes them.
fn other_values(text: &str) -> Vec<String> {
    let first = match serde_json::from_str(text).unwrap() {
        Value::Bool(is_set) => (!is_set).to_string(),
        Value::Null => "1.5".to_owned(),
        Value::Number(number) if number.is_u64() => (number.as_u64().unwrap() ^ 1).to_string(),
        Value::Number(_) => next_number(text),
        Value::String(one) if one.len() == 16 => format!("{:?}", other_hash(&one)),
        Value::String(one) => format!("{:?}", format!("{one}x")),
        other => panic!("{other} has parts"),
    };
    let known = KNOWN_TEXTS.iter().filter(|(one, _)| text == format!("{one:?}"));
    std::iter::once(first).chain(known.map(|(_, other)| format!("{other:?}"))).collect()
}

fn other_hash(digits: &str) -> String {
    u64::from_str_radix(digits, 16)
        .map_or_else(|_| format!("{digits}x"), |hash| format!("{:016x}", hash ^ 1))
}

/// Returns the number whose lowest bit differs, as f32 if the text is the shortest one of such.
fn next_number(text: &str) -> String {
    let single: f32 = text.parse().unwrap();
    if serde_json::to_string(&single).unwrap() == text {
        return serde_json::to_string(&f32::from_bits(single.to_bits() ^ 1)).unwrap();
    }
    let double: f64 = text.parse().unwrap();
    serde_json::to_string(&f64::from_bits(double.to_bits() ^ 1)).unwrap()
}

impl<'a> Scanner<'a> {
    fn scan(text: &'a str) -> Self {
        let mut scanner = Self { text, at: 0, leaves: Vec::new(), members: Vec::new() };
        scanner.value("");
        assert_eq!(scanner.at, text.len());
        scanner
    }

    fn value(&mut self, pointer: &str) {
        match self.text.as_bytes()[self.at] {
            b'{' => self.parts(pointer, b'}', |scanner, _| {
                let key: String = serde_json::from_str(&scanner.text[scanner.token()]).unwrap();
                scanner.at += 1;
                key
            }),
            b'[' => self.parts(pointer, b']', |_, place| place.to_string()),
            _ => {
                let place = self.token();
                self.leaves.push(Leaf { pointer: pointer.to_owned(), place });
            }
        }
    }

    /// Scans the parts of an object or a list up to its end. `name` scans the name of a part.
    fn parts(&mut self, pointer: &str, end: u8, name: impl Fn(&mut Self, usize) -> String) {
        self.at += 1;
        for place in 0.. {
            if self.text.as_bytes()[self.at] == end {
                break;
            }
            let start = self.at;
            let name = name(self, place);
            self.value(&format!("{pointer}/{name}"));
            if pointer.is_empty() {
                self.members.push((name, start..self.at));
            }
            self.at += usize::from(self.text.as_bytes()[self.at] == b',');
        }
        self.at += 1;
    }

    /// Scans a text, a number or a word.
    fn token(&mut self) -> Range<usize> {
        let start = self.at;
        let bytes = self.text.as_bytes();
        if bytes[start] == b'"' {
            // No text of a recording has an escaped quote.
            self.at += 2 + self.text[start + 1..].find('"').unwrap();
        } else {
            let rest = &self.text[start..];
            self.at += rest.find([',', ']', '}']).unwrap();
        }
        start..self.at
    }
}
