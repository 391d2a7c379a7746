//! `PROTOCOL.md` gives the layout of every binary message: its tables alone lead from field to field through the bytes,
//! to their end.

use std::collections::BTreeMap;

use super::messages;

/// A row of a table: offset, type and meaning.
type Row = [String; 3];

/// The tables after the heading of each kind.
fn layouts() -> BTreeMap<u16, Vec<Vec<Row>>> {
    let page = include_str!("../../PROTOCOL.md");
    let section = page.split("## 2. Binary messages").nth(1).unwrap();
    let section = section.split("\n## ").next().unwrap();
    let mut layouts = BTreeMap::new();
    for part in section.split("\n### ").skip(1) {
        let (heading, content) = part.split_once('\n').unwrap();
        let tables: Vec<Vec<Row>> = content.split("\n\n").filter_map(table).collect();
        // "2 FRAME f32, 3 FRAME u16" describes two kinds.
        for kind in heading.split(", ") {
            let number = kind.split(' ').next().unwrap().parse().unwrap();
            layouts.insert(number, tables.clone());
        }
    }
    layouts
}

/// Reads a table of offsets.
fn table(text: &str) -> Option<Vec<Row>> {
    let text = text.trim();
    if !text.starts_with("| offset |") {
        return None;
    }
    let rows = text.lines().skip(2).map(|line| {
        let mut cells = line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned());
        std::array::from_fn(|_| cells.next().unwrap())
    });
    Some(rows.collect())
}

/// A place in a message, and the counts that its fields have given so far.
struct Walk<'a> {
    kind: u16,
    bytes: &'a [u8],
    at: usize,
    counts: BTreeMap<char, usize>,
}

impl Walk<'_> {
    fn u32(&self, at: usize) -> usize {
        u32::from_le_bytes(self.bytes[at..at + 4].try_into().unwrap()) as usize
    }

    /// Passes the fields of a row. `row_size` is that of the elements in the second table.
    fn pass(&mut self, [_, form, meaning]: &Row, row_size: usize) {
        let forms: Vec<_> = form.split(" or ").collect();
        // The positions of a frame have one of two types.
        let form = if forms.len() == 2 && self.kind == 3 { forms[1] } else { forms[0] };
        let is_padded = form.ends_with(" pad") || form.starts_with("u16[");
        let form = form.trim_end_matches(" pad");
        if let Some((size, count)) = form.split_once(" bytes × ") {
            assert_eq!(size.parse(), Ok(row_size), "{meaning}");
            self.at += row_size * self.counts[&count.chars().next().unwrap()];
            return;
        }
        let (element, count) = form.trim_end_matches(']').split_once('[').unwrap_or((form, "1"));
        if element == "u32" {
            self.note_counts(meaning);
        }
        self.at += size_of_number(element) * self.count(count);
        if is_padded {
            self.at = self.at.next_multiple_of(4);
        }
    }

    /// Notes the counts that a meaning names: "n, number of particles" or "its index, v vertices, t triangles".
    fn note_counts(&mut self, meaning: &str) {
        for (index, part) in meaning.split(", ").enumerate() {
            let name = part.split(' ').next().unwrap();
            let mut letters = name.chars();
            let (Some(letter), None) = (letters.next(), letters.next()) else { continue };
            if letter.is_ascii_lowercase() {
                self.counts.insert(letter, self.u32(self.at + 4 * index));
            }
        }
    }

    /// The number of elements: "3", "n" or "3n".
    fn count(&self, text: &str) -> usize {
        let letter = text.chars().last().filter(char::is_ascii_lowercase);
        let factor = text.trim_end_matches(|last: char| last.is_ascii_lowercase());
        let factor = if factor.is_empty() { 1 } else { factor.parse().unwrap() };
        factor * letter.map_or(1, |letter| self.counts[&letter])
    }
}

fn size_of_number(name: &str) -> usize {
    match name {
        "u8" => 1,
        "u16" => 2,
        "u32" | "f32" => 4,
        "u64" | "f64" => 8,
        other => panic!("{other} is not the name of a number"),
    }
}

/// The size of an element whose table has offsets such as "+4".
fn row_size(rows: &[Row]) -> usize {
    let mut walk = Walk { kind: 0, bytes: &[0; 256], at: 0, counts: BTreeMap::new() };
    for row in rows {
        assert_eq!(row[0], format!("+{}", walk.at), "{row:?}");
        walk.pass(row, 0);
    }
    walk.at
}

#[test]
fn the_tables_of_the_page_lead_through_every_message_to_its_end() {
    let layouts = layouts();
    for (name, bytes) in messages() {
        let kind = u16::from_le_bytes([bytes[0], bytes[1]]);
        let (fields, elements) = layouts[&kind].split_first().unwrap();
        let row_size = elements.first().map_or(0, |rows| row_size(rows));
        let mut walk = Walk { kind, bytes: &bytes, at: 16, counts: BTreeMap::new() };
        let mut rows = fields.iter();
        while let Some(row) = rows.next() {
            if !row[0].is_empty() {
                assert_eq!(row[0].parse(), Ok(walk.at), "{name}: {row:?}");
            }
            walk.pass(row, row_size);
            if row[2].ends_with("each as follows") {
                // The next three rows belong to each mesh of a collider.
                let mesh = [rows.next(), rows.next(), rows.next()].map(Option::unwrap);
                let triangle_count = walk.counts[&'t'];
                for row in (0..walk.counts[&'m']).flat_map(|_| mesh) {
                    walk.pass(row, 0);
                }
                walk.counts.insert('t', triangle_count);
            }
        }
        assert_eq!(walk.at, bytes.len(), "{name}");
    }
    // Every kind of message has an example.
    let kinds = messages().into_iter().map(|(_, bytes)| u16::from(bytes[0]));
    assert!(layouts.keys().all(|kind| kinds.clone().any(|known| known == *kind)));
}
