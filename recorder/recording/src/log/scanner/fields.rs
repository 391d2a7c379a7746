//! The fields of a record, whose lengths are compared with the bytes that the record has.
//!
//! The mcap crate allocates as many bytes as a text claims before it reads them.

use mcap::records::op;

/// A field of a record.
#[derive(Debug, Clone, Copy)]
enum RecordField {
    /// A number of bytes.
    Bytes(usize),
    /// A text or data with a length of 32 bits before it.
    Text,
    /// A list of texts, with its length in bytes before it.
    Texts,
    /// A list of entries of one size, with its length in bytes before it.
    Entries(usize),
    /// Data with a length of 64 bits before it.
    Data,
    /// The rest of the record.
    Rest,
}

/// Returns the fields of the records of a kind.
fn fields(opcode: u8) -> &'static [RecordField] {
    use RecordField::{Bytes, Data, Entries, Rest, Text, Texts};
    match opcode {
        op::HEADER => &[Text, Text],
        op::SCHEMA => &[Bytes(2), Text, Text, Text],
        op::CHANNEL => &[Bytes(4), Text, Text, Texts],
        op::MESSAGE => &[Bytes(22), Rest],
        op::METADATA => &[Text, Texts],
        op::ATTACHMENT => &[Bytes(16), Text, Text, Data, Bytes(4)],
        op::CHUNK => &[Bytes(28), Text, Data],
        op::MESSAGE_INDEX => &[Bytes(2), Entries(16)],
        op::CHUNK_INDEX => &[Bytes(32), Entries(10), Bytes(8), Text, Bytes(16)],
        op::ATTACHMENT_INDEX => &[Bytes(40), Text, Text],
        op::STATISTICS => &[Bytes(42), Entries(10)],
        op::METADATA_INDEX => &[Bytes(16), Text],
        op::SUMMARY_OFFSET => &[Bytes(17)],
        op::DATA_END => &[Bytes(4)],
        op::FOOTER => &[Bytes(20)],
        _ => &[Rest],
    }
}

/// Returns the number of bytes after the fields of a record. `Err` describes a field that exceeds the record.
pub(in crate::log) fn check_fields(opcode: u8, body: &[u8]) -> Result<usize, String> {
    let mut rest = Unread(body);
    let read = fields(opcode).iter().try_for_each(|field| rest.skip(*field));
    read.ok_or("a text or list that is longer than its record")?;
    Ok(rest.0.len())
}

/// The bytes of a record that are not read yet. A read returns `None` beyond the end of the record.
pub(super) struct Unread<'a>(pub(super) &'a [u8]);

impl<'a> Unread<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn skip(&mut self, field: RecordField) -> Option<()> {
        match field {
            RecordField::Bytes(count) => self.take(count).map(drop),
            RecordField::Text => self.part().map(drop),
            RecordField::Texts => {
                let mut list = Unread(self.part()?);
                while !list.0.is_empty() {
                    list.part()?;
                }
                Some(())
            }
            RecordField::Entries(size_bytes) => {
                self.part().filter(|list| list.len() % size_bytes == 0).map(drop)
            }
            RecordField::Data => {
                let size_bytes = self.u64()?;
                self.take(usize::try_from(size_bytes).ok()?).map(drop)
            }
            RecordField::Rest => self.take(self.0.len()).map(drop),
        }
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.take(size_of::<u32>())?.try_into().ok().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        self.take(size_of::<u64>())?.try_into().ok().map(u64::from_le_bytes)
    }

    /// Reads a part with a length of 32 bits before it.
    fn part(&mut self) -> Option<&'a [u8]> {
        let size_bytes = self.u32()?;
        self.take(usize::try_from(size_bytes).ok()?)
    }

    pub(super) fn text(&mut self) -> Option<String> {
        String::from_utf8(self.part()?.to_vec()).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn size(bytes: &[u8]) -> [u8; 4] {
        u32::try_from(bytes.len()).unwrap().to_le_bytes()
    }

    /// Returns a valid record of each opcode that has lengths.
    fn records() -> Vec<(u8, Vec<u8>)> {
        let text = |text: &str| [&size(text.as_bytes()), text.as_bytes()].concat();
        let map = |entries: &[&str]| {
            let all: Vec<_> = entries.iter().flat_map(|entry| text(entry)).collect();
            [&size(&all), all.as_slice()].concat()
        };
        vec![
            (op::HEADER, [text(""), text("library")].concat()),
            (op::SCHEMA, [vec![1, 0], text("name"), text("json"), text("{}")].concat()),
            (op::CHANNEL, [vec![1, 0, 1, 0], text("/a"), text("json"), map(&["k", "v"])].concat()),
            (op::METADATA, [text("run"), map(&["key", "value", "k", ""])].concat()),
            (
                op::ATTACHMENT,
                [
                    vec![0; 16],
                    text("scene.toml"),
                    text("toml"),
                    vec![3, 0, 0, 0, 0, 0, 0, 0],
                    vec![7; 3],
                    vec![0; 4],
                ]
                .concat(),
            ),
        ]
    }

    #[test]
    fn every_length_that_exceeds_its_record_is_found() {
        for (opcode, body) in records() {
            assert_eq!(check_fields(opcode, &body), Ok(0));
            assert!(mcap::parse_record(opcode, &body).is_ok(), "opcode {opcode}");
            for length in 0..body.len() {
                assert!(check_fields(opcode, &body[..length]).is_err(), "{opcode}: {length}");
            }
        }
    }

    #[test]
    fn no_accepted_record_asks_for_more_than_it_has() {
        for (opcode, body) in records() {
            for place in 0..body.len().saturating_sub(3) {
                let mut changed = body.clone();
                changed[place..place + 4].fill(0xff);
                if check_fields(opcode, &changed).is_ok() {
                    // Must neither panic nor allocate 4 GiB.
                    let _parsed = mcap::parse_record(opcode, &changed);
                }
            }
        }
    }
}
