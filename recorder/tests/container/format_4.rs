//! Recordings of format 4 are read, checked and repaired like those of today. They are rewritten from
//! today's: `/keyframe` has the solver's bytes alone, and nothing counts `/tf` or names the axis that
//! points up.

use std::borrow::Cow;
use std::io::Cursor;

use mcap::read::ChunkFlattener;
use mcap::records::{Metadata, Record};
use mcap::{Attachment, WriteOptions};
use recorder::{LogEnd, LogReader, Message, Topic, check_file, repair_file};

use super::recording::Recording;

/// Size of the start of a message on `/keyframe` before its data: the step and the size of the data.
fn start_size(message: &[u8]) -> usize {
    let varint_size =
        |from: usize| 1 + message[from..].iter().take_while(|one| **one > 127).count();
    let size = if message[0] == 1 << 3 { 1 + varint_size(1) } else { 0 };
    assert_eq!(message[size], 2 << 3 | 2, "the data follows");
    size + 1 + varint_size(size + 1)
}

fn as_format_4(metadata: &Metadata) -> Metadata {
    let mut metadata = metadata.clone();
    match metadata.name.as_str() {
        "run" => {
            metadata.metadata.insert("format_version".to_owned(), "4".to_owned());
            assert!(metadata.metadata.remove("up").is_some());
        }
        "recorder" => {
            let counted = metadata.metadata.insert("tf.written".to_owned(), "0".to_owned());
            assert_eq!(counted.as_deref(), Some("1"));
            metadata.metadata.insert("tf.received".to_owned(), "0".to_owned());
        }
        _ => {}
    }
    metadata
}

/// Rewrites a finished file as recorders of format 4 wrote it.
fn format_4_file(file: &[u8]) -> Vec<u8> {
    let mut keyframes = None;
    let mut old = WriteOptions::new()
        .profile("")
        .chunk_size(Some(8000))
        .compression(None)
        .create(Cursor::new(Vec::new()))
        .unwrap();
    for record in ChunkFlattener::new(file).unwrap() {
        match record.unwrap() {
            Record::Attachment { header, data, .. } => {
                let (name, media_type) = (header.name, header.media_type);
                let (log_time, create_time) = (header.log_time, header.create_time);
                let data = Cow::Owned(data.into_owned());
                old.attach(&Attachment { log_time, create_time, name, media_type, data }).unwrap();
            }
            Record::Metadata(metadata) => old.write_metadata(&as_format_4(&metadata)).unwrap(),
            Record::Schema { header, data } => {
                old.add_schema_with_id(header.id, &header.name, &header.encoding, &data).unwrap();
            }
            Record::Channel(mut channel) => {
                if channel.topic == "/keyframe" {
                    keyframes = Some(channel.id);
                    channel.schema_id = 0;
                    "application/octet-stream".clone_into(&mut channel.message_encoding);
                }
                let (id, schema, encoding) =
                    (channel.id, channel.schema_id, channel.message_encoding);
                old.add_channel_with_id(id, schema, &channel.topic, &encoding, &channel.metadata)
                    .unwrap();
            }
            Record::Message { header, data } => {
                let is_keyframe = Some(header.channel_id) == keyframes;
                let start = if is_keyframe { start_size(&data) } else { 0 };
                old.write_to_known_channel(&header, &data[start..]).unwrap();
            }
            _ => {}
        }
    }
    old.finish().unwrap();
    old.into_inner().into_inner()
}

fn messages(file: &[u8]) -> Vec<Message> {
    let mut log = LogReader::new(file).unwrap();
    let read = std::iter::from_fn(|| log.next_message().unwrap());
    let messages = read.map(|logged| logged.message).collect();
    assert_eq!(log.end(), Some(&LogEnd::Complete));
    messages
}

#[test]
fn a_recording_of_format_4_reads_and_checks_like_one_of_today() {
    let today = Recording::default().write();
    let old = format_4_file(&today);
    assert_eq!(LogReader::new(old.as_slice()).unwrap().format_version(), 4);
    let (read, expected) = (messages(&old), messages(&today));
    assert!(read.iter().filter(|one| one.topic() == Topic::Keyframe).count() > 4);
    assert_eq!(read, expected);
    let report = check_file(Cursor::new(&old), None, &mut |_, _| {}).unwrap();
    assert_eq!(report.findings.list(), []);
}

#[test]
fn a_repair_of_format_4_keeps_its_format() {
    let old = format_4_file(&Recording::default().write());
    let truncated = &old[..old.len() - 20];
    let mut repaired = Vec::new();
    let report =
        repair_file(Cursor::new(truncated), &mut repaired, None, None, &mut |_, _| {}).unwrap();
    assert!(report.losses.is_empty());
    assert_eq!(LogReader::new(repaired.as_slice()).unwrap().format_version(), 4);
    assert_eq!(messages(&repaired), messages(&old));
    let report = check_file(Cursor::new(&repaired), None, &mut |_, _| {}).unwrap();
    assert_eq!(report.findings.list(), []);
}
