//! The check of recordings: it finds every flipped bit, names its place, goes on behind damage, and
//! finds content that no recorder writes.

use std::collections::BTreeMap;
use std::io::Cursor;

use super::fixture::{Place, Random, Recording, every, records, selections};
use recording::{CheckReport, Compression, Message, ReadError, StepRow, Topic, check_file};

/// Bits to flip in the body of each record.
const FLIPS_PER_RECORD: usize = 8;

fn check(bytes: &[u8]) -> Result<CheckReport, ReadError> {
    check_file(Cursor::new(bytes), None, &mut |_, _| {})
}

/// Returns the findings as text. The file must be a readable recording.
fn findings(bytes: &[u8]) -> Vec<String> {
    let report = check(bytes).unwrap();
    report.findings.list().iter().map(ToString::to_string).collect()
}

fn flipped(bytes: &[u8], bit: usize) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bytes[bit / 8] ^= 1 << (bit % 8);
    bytes
}

/// Returns `true` if the check finds something, or cannot read the file.
fn is_found(bytes: &[u8]) -> bool {
    check(bytes).map_or(true, |report| report.findings.count() > 0)
}

#[test]
fn a_sound_recording_has_no_findings() {
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let bytes = Recording { compression, ..Recording::default() }.write();
        assert_eq!(findings(&bytes), [""; 0], "{compression:?}");
        let extent = check(&bytes).unwrap().extent;
        assert_eq!((extent.snapshot_count, extent.steps), (41, Some([0, 40])));
        assert_eq!(extent.unhashed_count, 0, "tears and a reset are followed");
        assert_eq!(extent.not_checked, [""; 0]);
    }
}

#[test]
fn a_recording_without_a_part_of_its_run_has_no_findings() {
    for selection in selections() {
        let bytes = Recording { selection, ..Recording::default() }.write();
        assert_eq!(findings(&bytes), [""; 0], "{selection:?}");
        // The selection is what makes it complete.
        let selection = every(1);
        let is_whole = Recording { selection, ..Recording::default() }.write().len() == bytes.len();
        assert!(!is_whole);
    }
    let thinned = Recording { selection: every(3), ..Recording::default() };
    let bytes = thinned.write_changed(|messages| messages.retain(|one| one.step() != 12));
    let expected = "messages on /steps are missing, but the file declares 0";
    assert!(findings(&bytes)[0].contains(expected), "{:?}", findings(&bytes));
}

/// Returns the bits to flip: both ends, and in two records of each kind the bits that say where the next
/// record begins, and some within.
fn chosen_bits(bytes: &[u8], random: &mut Random) -> (Vec<usize>, Vec<u8>) {
    let mut bits: Vec<usize> = (0..8 * 8).chain(8 * (bytes.len() - 8)..8 * bytes.len()).collect();
    let mut kinds = BTreeMap::<u8, Vec<Place>>::new();
    for record in records(bytes) {
        kinds.entry(record.opcode).or_default().push(record);
    }
    for records in kinds.values() {
        let middle = records[random.below(records.len())];
        for record in [middle, records[records.len() - 1]] {
            bits.extend(8 * record.start..8 * (record.start + 2));
            let bit_count = 8 * (record.end - record.start);
            bits.extend((0..FLIPS_PER_RECORD).map(|_| 8 * record.start + random.below(bit_count)));
        }
    }
    (bits, kinds.into_keys().collect())
}

/// The checksums of the data and of the index cover every bit of a file except the magic at both ends,
/// which is compared. No bit has no effect.
#[test]
fn every_flipped_bit_is_found_in_every_kind_of_record_and_at_both_ends() {
    let compressions = [Compression::None, Compression::Lz4, Compression::Zstd];
    for (seed, compression) in compressions.into_iter().enumerate() {
        let bytes = Recording { compression, ..Recording::default() }.write();
        let (bits, kinds) = chosen_bits(&bytes, &mut Random::new(seed as u64));
        assert_eq!(kinds, [1, 2, 3, 4, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15], "every kind");
        for bit in bits {
            let place = (bit / 8, bit % 8);
            assert!(is_found(&flipped(&bytes, bit)), "{compression:?}: byte and bit {place:?}");
        }
    }
}

#[test]
fn a_flipped_bit_in_a_chunk_is_found_at_its_chunk_and_the_check_goes_on_behind_it() {
    let bytes = Recording::default().write();
    let chunks: Vec<_> = records(&bytes).into_iter().filter(|one| one.opcode == 6).collect();
    assert!(chunks.len() > 4, "{}", chunks.len());
    let (second, fourth) = (&chunks[1], &chunks[3]);
    // One within the content, one in the header.
    let damaged = flipped(&flipped(&bytes, 8 * (second.end - 7)), 8 * (fourth.start + 9 + 16));
    let found = check(&damaged).unwrap();
    let places: Vec<_> =
        found.findings.list().iter().map(|one| usize::try_from(one.byte).unwrap()).collect();
    assert!(places.contains(&second.start) && places.contains(&fourth.start), "{places:?}");
    let [_, last] = found.extent.steps.unwrap();
    assert_eq!(last, 40, "it reads the rest");
}

#[test]
fn a_file_that_is_cut_anywhere_is_truncated_and_not_sound() {
    let bytes = Recording::default().write();
    for length in (8..bytes.len()).step_by(97).chain(bytes.len() - 40..bytes.len()) {
        assert!(is_found(&bytes[..length]), "{length} of {}", bytes.len());
    }
    let long = [&bytes[..], &bytes].concat();
    let found = findings(&long);
    assert!(found.iter().any(|one| one.contains("other bytes follow")), "{found:?}");
}

#[test]
fn files_that_are_no_recordings_are_refused() {
    assert!(matches!(check(b""), Err(ReadError::Empty)));
    assert!(matches!(check(b"no recording at all"), Err(ReadError::NotMcap)));
    let head = &records(&Recording::default().write())[0];
    let bytes = &Recording::default().write()[..head.end];
    let damaged = check(bytes).unwrap_err();
    assert!(matches!(damaged, ReadError::NoHeader(_)), "{damaged}");
}

/// Returns the first finding in a recording whose messages were changed before they were written.
fn first_finding(change: impl Fn(&mut Vec<Message>)) -> String {
    let bytes = Recording::default().write_changed(change);
    let found = findings(&bytes);
    found.first().cloned().unwrap_or_else(|| "nothing".to_owned())
}

fn row(messages: &mut [Message], wanted: u64) -> &mut StepRow {
    let mut rows = messages.iter_mut().filter_map(|message| match message {
        Message::Step(row) => Some(row),
        _ => None,
    });
    rows.find(|row| row.step == wanted).unwrap()
}

fn remove_step(messages: &mut Vec<Message>, step: u64) {
    let is_removed = |one: &Message| {
        matches!(one.topic(), Topic::Steps | Topic::Particles) && one.step() == step
    };
    messages.retain(|one| !is_removed(one));
}

#[test]
fn content_that_no_node_publishes_is_found_with_its_step() {
    let hash = first_finding(|messages| row(messages, 7).state_hash ^= 1);
    assert!(hash.contains("/particles: step 7: its particles have the hash"), "{hash}");
    let nan = first_finding(|messages| {
        let particles = messages.iter_mut().find_map(|message| match message {
            Message::Particles { step: 9, particles } => Some(particles),
            _ => None,
        });
        particles.unwrap()[2].velocity[1] = f32::NAN;
    });
    assert!(nan.contains("step 9: particle 2 has a value that is not finite"), "{nan}");
    let gap = first_finding(|messages| remove_step(messages, 20));
    assert!(gap.contains("1 messages on /steps are missing, but the file declares 0"), "{gap}");
    let alone = first_finding(|messages| {
        let place =
            messages.iter().position(|one| matches!(one, Message::Particles { step: 5, .. }));
        messages.remove(place.unwrap());
    });
    assert!(alone.contains("step 6: the snapshot of step 5 is missing"), "{alone}");
    let back = first_finding(|messages| {
        let place =
            messages.iter().position(|one| matches!(one, Message::Step(row) if row.step == 37));
        messages.swap(place.unwrap(), place.unwrap() + 2);
        messages.swap(place.unwrap() + 1, place.unwrap() + 3);
    });
    assert!(back.contains("step 37 follows step 38"), "{back}");
}

#[test]
fn declared_gaps_and_foreign_messages_are_no_findings() {
    let recording = Recording { lost: 1, ..Recording::default() };
    let bytes = recording.write_changed(|messages| remove_step(messages, 20));
    assert_eq!(findings(&bytes), [""; 0]);
    assert_eq!(check(&bytes).unwrap().extent.declared_missing, 2, "a row and a snapshot");
}

#[test]
fn a_long_attachment_is_checked_like_a_short_one() {
    let attachment_size_bytes = 20 << 20;
    let mut bytes = Recording { attachment_size_bytes, ..Recording::default() }.write();
    assert_eq!(findings(&bytes), [""; 0]);
    assert_eq!(check(&bytes).unwrap().extent.not_checked, [""; 0]);
    let place = records(&bytes).into_iter().find(|one| one.end - one.start > 20 << 20).unwrap();
    bytes[place.end - 1000] ^= 1;
    let expected = format!("byte {}: attachment: its checksum is wrong", place.start);
    assert!(findings(&bytes)[0].starts_with(&expected), "{:?}", findings(&bytes));
}

#[test]
fn a_tear_of_a_constraint_that_the_scene_lacks_is_found() {
    for torn in [vec![u32::MAX], vec![0; 1000]] {
        let bytes = Recording::default().write_changed(|messages| {
            for message in messages {
                if let Message::Tears(row) = message {
                    row.causes = vec!["cut".to_owned(); torn.len()];
                    row.constraints.clone_from(&torn);
                }
            }
        });
        let all = findings(&bytes);
        assert!(all[0].contains("but the scene has"), "{all:?}");
    }
}
