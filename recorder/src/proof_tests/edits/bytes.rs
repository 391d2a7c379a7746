//! Edits of records by their bytes, and of metadata by its entries.

use std::collections::BTreeMap;

use mcap::records::op;

use super::edit::Change;

/// Channel, sequence, time of reception, time of the step.
const MESSAGE_HEADER: [(&str, usize); 4] =
    [("channel", 0), ("sequence", 2), ("log_time", 6), ("publish_time", 14)];

/// Returns the edits of the header of a message.
pub(super) fn message_header_edits(body: &[u8]) -> Vec<Change> {
    let edit = |(name, at): (&str, usize)| {
        let mut changed = body.to_vec();
        changed[at] ^= 0x20;
        Change::new(name, changed)
    };
    MESSAGE_HEADER.map(edit).into()
}

/// Returns the edits of a record by its bytes, at most about fifty.
pub(super) fn byte_edits(body: &[u8], from: usize) -> Vec<Change> {
    let stride = (body.len() / 40).max(1);
    let places = (from..body.len()).filter(|place| place % stride == 0 || body.len() - place < 8);
    places
        .map(|place| {
            let mut changed = body.to_vec();
            changed[place] ^= 1;
            Change::new(&format!("byte {place}"), changed)
        })
        .collect()
}

/// Returns the metadata of a record.
pub(super) fn metadata_of(body: &[u8]) -> mcap::records::Metadata {
    let Ok(mcap::records::Record::Metadata(metadata)) = mcap::parse_record(op::METADATA, body)
    else {
        panic!("metadata")
    };
    metadata
}

/// Returns the bytes of a metadata record.
pub(super) fn metadata_bytes(name: &str, map: &BTreeMap<String, String>) -> Vec<u8> {
    let text =
        |text: &str| [&u32::try_from(text.len()).unwrap().to_le_bytes(), text.as_bytes()].concat();
    let all: Vec<_> = map.iter().flat_map(|(key, one)| [text(key), text(one)].concat()).collect();
    let size = u32::try_from(all.len()).unwrap().to_le_bytes();
    [&text(name)[..], &size, &all].concat()
}

/// Returns the edits of a metadata record: each value, a missing entry, and an unknown one.
pub(super) fn metadata_edits(body: &[u8]) -> Vec<Change> {
    let metadata = metadata_of(body);
    let bytes = |map: &BTreeMap<String, String>| metadata_bytes(&metadata.name, map);
    assert_eq!(bytes(&metadata.metadata), body);
    let mut edits = Vec::new();
    for (key, value) in &metadata.metadata {
        let mut changed = metadata.metadata.clone();
        let other =
            value.parse::<u64>().map_or(format!("{value}x"), |number| (number ^ 1).to_string());
        changed.insert(key.clone(), other);
        edits.push(Change::new(key, bytes(&changed)));
        changed.remove(key);
        edits.push(Change::new(&format!("no {key}"), bytes(&changed)));
    }
    let mut changed = metadata.metadata.clone();
    changed.insert("unknown".to_owned(), "1".to_owned());
    edits.push(Change::new("unknown", bytes(&changed)));
    edits
}
