//! Repairs keep exactly what is intact, and declare the rest: the result is sound for the check, and every
//! message in it is one of the original.

use std::io::{Cursor, Write};

use recording::{
    Closing, Compression, Finding, FrameReader, LogEnd, LogReader, Message, RepairError,
    RepairReport, Topic, check_file, repair_file,
};

use super::fixture::{Place, Random, Recording, records, selections};

const SEEDS: u64 = 60;
/// Opcode of a chunk.
const CHUNK: u8 = 6;
const MESSAGE_INDEX: u8 = 7;
const METADATA: u8 = 12;

fn repair(bytes: &[u8]) -> Result<(Vec<u8>, RepairReport), RepairError> {
    let mut out = Vec::new();
    let report = repair_file(Cursor::new(bytes), &mut out, None, None, &mut |_, _| {})?;
    Ok((out, report))
}

/// Returns all messages of a complete file.
fn messages(bytes: &[u8]) -> Vec<Message> {
    let mut log = LogReader::new(bytes).unwrap();
    let mut all = Vec::new();
    while let Some(logged) = log.next_message().unwrap() {
        all.push(logged.message);
    }
    assert_eq!(log.end(), Some(&LogEnd::Complete));
    all
}

/// Returns the steps of all snapshots. Fails if one lacks its row.
fn steps(bytes: &[u8]) -> Vec<u64> {
    let mut frames = FrameReader::new(LogReader::new(bytes).unwrap());
    std::iter::from_fn(|| frames.next_frame().unwrap()).map(|frame| frame.row.step).collect()
}

/// Asserts the promises of a repair, whatever the damage was.
fn assert_repaired(original: &[u8], repaired: &[u8], case: &str) {
    let report = check_file(Cursor::new(repaired), None, &mut |_, _| {}).unwrap();
    assert_eq!(report.findings.list(), [], "{case}");
    let (kept, all) = (messages(repaired), messages(original));
    let mut rest = all.iter();
    for message in &kept {
        assert!(rest.any(|one| one == message), "{case}: another message, or another order");
    }
    assert_eq!(steps(repaired).len(), count(&kept, Topic::Steps), "{case}");
}

fn count(messages: &[Message], topic: Topic) -> usize {
    messages.iter().filter(|one| one.topic() == topic).count()
}

fn closing(bytes: &[u8]) -> Closing {
    let mut log = LogReader::new(bytes).unwrap();
    while log.next_message().unwrap().is_some() {}
    log.closing().unwrap().clone()
}

/// Asserts that kept and declared messages are those of the original, whose end must be intact.
fn assert_declared(original: &[u8], repaired: &[u8], case: &str) {
    let (kept, all, closing) = (messages(repaired), messages(original), closing(repaired));
    for topic in Topic::ALL.into_iter().filter(|topic| *topic != Topic::Tf) {
        let counts = &closing.counts[topic];
        let sum = count(&kept, topic) as u64 + counts.lost;
        assert_eq!(sum, count(&all, topic) as u64, "{case}: {}", topic.name());
        assert_eq!(counts.written, count(&kept, topic) as u64, "{case}: {}", topic.name());
    }
}

#[test]
fn a_repair_keeps_what_a_selection_has() {
    for selection in selections() {
        let whole = Recording { selection, ..Recording::default() }.write();
        let broken = Recording { selection, is_finished: false, ..Recording::default() }.write();
        let (repaired, report) = repair(&broken).unwrap();
        assert!(report.losses.is_empty(), "{selection:?}: {:?}", report.losses);
        assert_eq!(messages(&repaired), messages(&whole), "{selection:?}");
        assert_eq!(LogReader::new(&*repaired).unwrap().selection(), selection);
        let report = check_file(Cursor::new(&repaired), None, &mut |_, _| {}).unwrap();
        assert_eq!(report.findings.list(), [], "{selection:?}");
    }
}

/// Returns the metadata records.
fn metadata(bytes: &[u8]) -> Vec<&[u8]> {
    let all = records(bytes).into_iter().filter(|one| one.opcode == METADATA);
    all.map(|one| &bytes[one.start..one.end]).collect()
}

fn chunks(bytes: &[u8]) -> Vec<Place> {
    records(bytes).into_iter().filter(|one| one.opcode == CHUNK).collect()
}

#[test]
fn a_sound_file_and_a_file_without_an_end_lose_nothing() {
    for is_finished in [true, false] {
        let bytes = Recording { is_finished, ..Recording::default() }.write();
        let whole = Recording::default().write();
        let (repaired, report) = repair(&bytes).unwrap();
        assert!(report.losses.is_empty() && !report.is_uncertain, "{:?}", report.losses);
        assert_eq!(report.has_end, is_finished);
        assert_repaired(&whole, &repaired, "whole");
        assert_eq!(messages(&repaired), messages(&whole));
        assert_eq!((report.steps, report.losses.ranges()), (Some([0, 40]), &[][..]));
    }
}

#[test]
fn a_damaged_chunk_is_skipped_and_its_steps_are_declared() {
    let bytes = Recording::default().write();
    let mut damaged = bytes.clone();
    let chunk = chunks(&bytes)[3];
    damaged[chunk.end - 100] ^= 4;
    let (repaired, report) = repair(&damaged).unwrap();
    assert_repaired(&bytes, &repaired, "one chunk");
    let kept = steps(&repaired);
    let missing: Vec<u64> = (0..=40).filter(|step| !kept.contains(step)).collect();
    assert!(!missing.is_empty() && kept.first() == Some(&0) && kept.last() == Some(&40));
    let range = format!("{}..={}", missing[0], missing[missing.len() - 1]);
    let ranges: Vec<_> = report.losses.ranges().iter().map(ToString::to_string).collect();
    assert_eq!(ranges, [range], "the steps that the file lacks");
    let closing = closing(&repaired);
    assert_eq!(closing.missing()["/particles"], missing.len() as u64);
    assert_eq!(closing.stop_reason, "test", "that of the original");
}

#[test]
fn a_lost_first_chunk_takes_only_its_own_messages_with_it() {
    for compression in [Compression::None, Compression::Zstd] {
        let bytes = Recording { compression, ..Recording::default() }.write();
        let mut damaged = bytes.clone();
        let chunk = chunks(&bytes)[0];
        damaged[chunk.end - 30] ^= 1;
        let (repaired, report) = repair(&damaged).unwrap();
        assert_repaired(&bytes, &repaired, "first chunk");
        assert_eq!(report.steps.map(|[_, last]| last), Some(40));
        assert!(!report.losses.is_empty());
    }
}

/// The first chunk also declares the channels.
#[test]
fn a_chunk_whose_header_is_damaged_takes_only_its_own_messages_with_it() {
    let bytes = Recording { compression: Compression::Zstd, ..Recording::default() }.write();
    let all = chunks(&bytes);
    for (number, chunk) in all.iter().enumerate().filter(|(n, _)| [0, 3, all.len() - 1].contains(n))
    {
        let (own, _) = repair(&{
            let mut damaged = bytes.clone();
            damaged[chunk.end - 30] ^= 1;
            damaged
        })
        .unwrap();
        // Its opcode, its length, and its size behind two times.
        for byte in (chunk.start..chunk.start + 9).chain([chunk.start + 25, chunk.start + 28]) {
            let case = format!("chunk {number}, byte {}", byte - chunk.start);
            let mut damaged = bytes.clone();
            for bit in [6, 7] {
                damaged[byte] = bytes[byte] ^ 1 << bit;
                let (repaired, report) = repair(&damaged).unwrap();
                assert_repaired(&bytes, &repaired, &case);
                assert_declared(&bytes, &repaired, &case);
                assert!(!report.losses.is_empty(), "{case}");
                assert_eq!(messages(&repaired), messages(&own), "{case}");
                let is_index = |finding: &Finding| finding.record == "message index";
                assert!(!report.findings.list().iter().any(is_index), "{case}");
            }
        }
    }
}

#[test]
fn a_damaged_message_index_takes_nothing_with_it() {
    let bytes = Recording::default().write();
    let indexes = records(&bytes).into_iter().filter(|one| one.opcode == MESSAGE_INDEX);
    for index in indexes.take(8) {
        for place in [index.start + 9, index.end - 1] {
            let mut damaged = bytes.clone();
            damaged[place] ^= 2;
            let (repaired, report) = repair(&damaged).unwrap();
            assert_eq!(messages(&repaired), messages(&bytes));
            assert!(report.losses.is_empty() && !report.is_uncertain);
            assert_eq!(report.findings.list()[0].record, "message index");
        }
        // The indexes behind it are those of an intact chunk, so they count no losses.
        let mut damaged = bytes.clone();
        damaged[index.start] ^= 0x40;
        let (repaired, report) = repair(&damaged).unwrap();
        assert_eq!(messages(&repaired), messages(&bytes));
        assert_declared(&bytes, &repaired, "a part that is no record");
        assert!(report.losses.messages().is_empty(), "{:?}", report.losses);
    }
}

#[test]
fn a_damaged_number_in_the_end_of_a_file_is_no_loss() {
    let bytes = Recording::default().write();
    let place = bytes.windows(17).rposition(|text| text == b"particles.written").unwrap();
    // The text of the number follows its length.
    let digit = place + 17 + 4;
    assert_eq!(&bytes[digit..digit + 2], b"41");
    let mut damaged = bytes.clone();
    damaged[digit] = b'9';
    let (repaired, report) = repair(&damaged).unwrap();
    assert_declared(&bytes, &repaired, "91 particles");
    assert!(report.losses.is_empty() && report.is_uncertain, "{:?}", report.losses);
}

#[test]
fn a_message_that_is_missing_in_a_sound_file_is_declared() {
    let whole = Recording::default().write();
    let closed = closing(&whole);
    for (topic, step) in [(Topic::Tears, 10), (Topic::Particles, 20), (Topic::Outcomes, 25)] {
        let is_removed = |one: &Message| one.topic() == topic && one.step() == step;
        let bytes = Recording::default()
            .write_closed(|messages| messages.retain(|one| !is_removed(one)), &closed);
        let (repaired, report) = repair(&bytes).unwrap();
        assert_repaired(&whole, &repaired, topic.name());
        assert_declared(&whole, &repaired, topic.name());
        assert_eq!(report.losses.messages()[topic.name()], 1);
    }
}

#[test]
fn any_damage_leaves_a_sound_file_with_messages_of_the_original() {
    for seed in 0..SEEDS {
        let mut random = Random::new(seed);
        let compression = [Compression::None, Compression::Lz4, Compression::Zstd][random.below(3)];
        let bytes = Recording { compression, ..Recording::default() }.write();
        // The scene and the metadata of the run precede the first chunk.
        let first = chunks(&bytes)[0].start;
        let at = first + random.below(bytes.len() - first);
        let mut damaged = bytes.clone();
        match random.below(4) {
            0 => damaged[at] ^= 1 << random.below(8),
            1 => damaged.truncate(at),
            2 => damaged[at..].iter_mut().take(3000).for_each(|byte| *byte = 0),
            _ => drop(damaged.drain(at..(at + 1 + random.below(5000)).min(bytes.len()))),
        }
        let (repaired, _) = repair(&damaged).unwrap();
        let case = format!("seed {seed}");
        assert_repaired(&bytes, &repaired, &case);
        let end = metadata(&bytes).pop().unwrap();
        if damaged.windows(end.len()).any(|part| part == end) {
            assert_declared(&bytes, &repaired, &case);
        }
    }
}

#[test]
fn a_message_that_no_node_publishes_is_left_out_with_its_snapshot() {
    let bytes = Recording::default().write_changed(|messages| {
        let particles = messages.iter_mut().find_map(|message| match message {
            Message::Particles { step: 9, particles } => Some(particles),
            _ => None,
        });
        particles.unwrap()[2].velocity[1] = f32::NAN;
    });
    let (repaired, report) = repair(&bytes).unwrap();
    assert_repaired(&Recording::default().write(), &repaired, "NaN");
    assert_eq!(report.losses.ranges().iter().map(ToString::to_string).collect::<Vec<_>>(), ["9"]);
    assert!(!steps(&repaired).contains(&9));
}

#[test]
fn damage_that_no_record_explains_is_reported_as_uncertain() {
    let mut bytes = Recording::default().write();
    let place = bytes.windows(5).position(|text| text == b"mcap-").unwrap();
    bytes[place] ^= 1;
    let (_, report) = repair(&bytes).unwrap();
    assert!(report.losses.is_empty() && report.is_uncertain);
}

#[test]
fn a_file_without_a_description_of_its_run_is_not_repairable() {
    let mut bytes = Recording::default().write();
    let place = bytes.windows(6).position(|text| text == b"run_id").unwrap();
    bytes[place - 2] ^= 0x40;
    let error = repair(&bytes).unwrap_err();
    assert!(matches!(error, RepairError::Read(_)), "{error}");
}

/// A disk without space.
#[derive(Debug)]
struct Full;

impl Write for Full {
    fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
        Err(std::io::ErrorKind::StorageFull.into())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn an_output_that_cannot_be_written_is_an_error() {
    let bytes = Recording::default().write();
    let result = repair_file(Cursor::new(&bytes), Full, None, None, &mut |_, _| {});
    assert!(matches!(result, Err(RepairError::Write(_))), "{result:?}");
}

/// Larger than what a check keeps in memory.
const LONG_SIZE_BYTES: u64 = 20 << 20;

#[test]
fn a_long_attachment_is_copied_and_one_with_a_wrong_byte_is_left_out_without_missing_steps() {
    let attachment_size_bytes = LONG_SIZE_BYTES;
    let mut bytes = Recording { attachment_size_bytes, ..Recording::default() }.write();
    let (repaired, report) = repair(&bytes).unwrap();
    assert!(report.losses.is_empty() && !report.is_uncertain, "{:?}", report.findings);
    let report = check_file(Cursor::new(&repaired), None, &mut |_, _| {}).unwrap();
    assert_eq!(report.findings.list(), []);
    let long = |bytes: &[u8]| {
        let place = records(bytes).into_iter().find(|one| one.end - one.start > 20 << 20);
        place.map(|one| bytes[one.start..one.end].to_vec())
    };
    assert!(long(&repaired).is_some() && long(&repaired) == long(&bytes), "another attachment");

    let place = records(&bytes).into_iter().find(|one| one.end - one.start > 20 << 20).unwrap();
    bytes[place.end - 1000] ^= 1;
    let (repaired, report) = repair(&bytes).unwrap();
    assert_eq!(report.losses.messages()["attachments"], 1);
    assert_eq!((report.losses.ranges(), long(&repaired)), (&[][..], None));
    assert_repaired(&Recording::default().write(), &repaired, "without its attachment");
}

#[test]
fn damage_before_the_description_of_the_run_is_a_loss_that_names_the_scene() {
    let mut bytes = Recording::default().write();
    let scene = records(&bytes).into_iter().find(|one| one.opcode == 9).unwrap();
    bytes[scene.end - 20] ^= 1;
    let (_, report) = repair(&bytes).unwrap();
    assert!(!report.losses.is_empty() && report.losses.ranges().is_empty());
    assert!(report.losses.head().unwrap().contains("the scene"), "{:?}", report.losses);
}

#[test]
fn a_file_that_declares_the_largest_number_of_losses_is_repaired() {
    let bytes = Recording { lost: u64::MAX, ..Recording::default() }.write();
    let mut damaged = bytes.clone();
    damaged[chunks(&bytes)[3].end - 100] ^= 4;
    let (_, report) = repair(&damaged).unwrap();
    assert!(!report.losses.is_empty());
}
