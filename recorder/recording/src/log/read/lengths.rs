//! The lengths within a record, compared with the bytes that the record has.
//!
//! The mcap crate allocates as many bytes as a text claims before it reads them.

use mcap::records::op;

/// Checks every length within a record. `Err` describes the first one that exceeds the record.
pub(in crate::log) fn check_lengths(opcode: u8, body: &[u8]) -> Result<(), String> {
    let fields = skip_fields(opcode, &mut Rest(body));
    fields.ok_or_else(|| "a text or list that is longer than its record".to_owned())
}

/// Returns `true` if a record has the length that its fields need, and not a byte more.
pub(in crate::log) fn is_exact(opcode: u8, body: &[u8]) -> bool {
    let mut rest = Rest(body);
    skip_fields(opcode, &mut rest).is_some() && (rest.0.is_empty() || opcode == op::MESSAGE)
}

/// Skips the fields of a record, or returns `None` if one exceeds it.
fn skip_fields(opcode: u8, rest: &mut Rest<'_>) -> Option<()> {
    match opcode {
        op::HEADER => rest.text().and_then(|()| rest.text()),
        op::SCHEMA => rest.skip(2).and_then(|()| rest.text()).and_then(|()| rest.text_and_text()),
        op::CHANNEL => rest.skip(4).and_then(|()| rest.text_and_text()).and_then(|()| rest.texts()),
        op::MESSAGE => rest.skip(22),
        op::METADATA => rest.text().and_then(|()| rest.texts()),
        op::ATTACHMENT => rest
            .skip(16)
            .and_then(|()| rest.text_and_text())
            .and_then(|()| rest.data())
            .and_then(|()| rest.skip(4)),
        op::CHUNK => rest.skip(28).and_then(|()| rest.text()).and_then(|()| rest.data()),
        op::MESSAGE_INDEX => rest.skip(2).and_then(|()| rest.entries(16)),
        op::CHUNK_INDEX => rest
            .skip(32)
            .and_then(|()| rest.entries(10))
            .and_then(|()| rest.skip(8))
            .and_then(|()| rest.text())
            .and_then(|()| rest.skip(16)),
        op::ATTACHMENT_INDEX => rest.skip(40).and_then(|()| rest.text_and_text()),
        op::STATISTICS => rest.skip(42).and_then(|()| rest.entries(10)),
        op::METADATA_INDEX => rest.skip(16).and_then(|()| rest.text()),
        op::SUMMARY_OFFSET => rest.skip(17),
        op::DATA_END => rest.skip(4),
        op::FOOTER => rest.skip(20),
        _ => Some(()),
    }
}

/// The bytes of a record that are not checked yet.
struct Rest<'a>(&'a [u8]);

impl<'a> Rest<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn skip(&mut self, count: usize) -> Option<()> {
        self.take(count).map(drop)
    }

    /// Takes a part with a length of 32 bits before it.
    fn part(&mut self) -> Option<&'a [u8]> {
        let size: [u8; 4] = self.take(4)?.try_into().ok()?;
        self.take(usize::try_from(u32::from_le_bytes(size)).ok()?)
    }

    fn text(&mut self) -> Option<()> {
        self.part().map(drop)
    }

    fn text_and_text(&mut self) -> Option<()> {
        self.text().and_then(|()| self.text())
    }

    /// Takes a list of entries of one size.
    fn entries(&mut self, size_bytes: usize) -> Option<()> {
        self.part().filter(|list| list.len() % size_bytes == 0).map(drop)
    }

    /// Takes a list of texts.
    fn texts(&mut self) -> Option<()> {
        let mut list = Rest(self.part()?);
        while !list.0.is_empty() {
            list.text()?;
        }
        Some(())
    }

    /// Takes data with a length of 64 bits before it.
    fn data(&mut self) -> Option<()> {
        let size: [u8; 8] = self.take(8)?.try_into().ok()?;
        self.skip(usize::try_from(u64::from_le_bytes(size)).ok()?)
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
            assert_eq!(check_lengths(opcode, &body), Ok(()));
            assert!(mcap::parse_record(opcode, &body).is_ok(), "opcode {opcode}");
            for length in 0..body.len() {
                assert!(check_lengths(opcode, &body[..length]).is_err(), "{opcode}: {length}");
            }
        }
    }

    #[test]
    fn no_accepted_record_asks_for_more_than_it_has() {
        for (opcode, body) in records() {
            for place in 0..body.len().saturating_sub(3) {
                let mut changed = body.clone();
                changed[place..place + 4].fill(0xff);
                if check_lengths(opcode, &changed).is_ok() {
                    // Must neither panic nor allocate 4 GiB.
                    let _parsed = mcap::parse_record(opcode, &changed);
                }
            }
        }
    }
}
