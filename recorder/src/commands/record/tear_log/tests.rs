//! What is new in each list, also where lists, causes or outcomes were missed.

use super::*;

const RUN_ID: u64 = 77;

fn snapshot(step: u64, torn_count: u32) -> SnapshotHeader {
    SnapshotHeader { run_id: RUN_ID, step, torn_count, ..SnapshotHeader::default() }
}

fn header(step: u64, new_count: u32) -> TearsHeader {
    TearsHeader { run_id: RUN_ID, step, new_count, ..TearsHeader::default() }
}

/// Causes alternate: an even constraint was cut, an odd one stretched.
fn causes(torn: &[u32]) -> Vec<u8> {
    torn.iter()
        .map(|one| if one % 2 == 0 { TearCause::Cut } else { TearCause::Stretch } as u8)
        .collect()
}

fn add(log: &mut TearLog, step: u64, torn: &[u32], new_count: u32) {
    let header = header(step, new_count);
    log.add(vec![(header, torn.to_vec())], vec![(header, causes(torn))]);
}

/// "5: 2 cut, 3 stretch"
fn rows(log: &mut TearLog, step: u64) -> Vec<String> {
    let text = |row: TearsRow| {
        let tears = row.constraints.iter().enumerate().map(|(place, constraint)| {
            format!("{constraint} {}", row.causes.get(place).map_or("?", String::as_str))
        });
        format!("{}: {}", row.step, tears.collect::<Vec<_>>().join(", "))
    };
    log.rows_until(&snapshot(step, 0)).into_iter().map(text).collect()
}

/// A log that has begun at step 4 with nothing torn.
fn begun() -> TearLog {
    let mut log = TearLog::default();
    add(&mut log, 0, &[], 0);
    assert!(log.is_known_at(&snapshot(4, 0)));
    assert!(log.begin(&snapshot(4, 0)).is_empty());
    log
}

#[test]
fn each_row_has_what_is_new_in_its_list() {
    let mut log = begun();
    add(&mut log, 5, &[2], 1);
    add(&mut log, 7, &[2, 3, 8], 2);
    assert_eq!(rows(&mut log, 7), ["5: 2 cut", "7: 3 stretch, 8 cut"]);
    assert!(rows(&mut log, 9).is_empty());
    assert_eq!(log.missing_count(&snapshot(9, 3)), 0);
}

#[test]
fn a_list_waits_for_the_snapshot_of_its_step() {
    let mut log = begun();
    add(&mut log, 6, &[2], 1);
    assert!(rows(&mut log, 5).is_empty());
    assert_eq!(rows(&mut log, 6), ["6: 2 cut"]);
}

#[test]
fn what_a_missed_list_said_comes_with_the_next_one() {
    let mut log = begun();
    add(&mut log, 9, &[2, 5, 8], 1);
    assert_eq!(rows(&mut log, 9), ["9: 2 cut, 5 stretch, 8 cut"]);
    let mut log = begun();
    assert_eq!(log.missing_count(&snapshot(9, 3)), 3, "or is counted");
    let torn: Vec<u32> = (0..200).collect();
    for count in 1..=torn.len() {
        add(&mut log, 9 + count as u64, &torn[..count], 1);
    }
    let all = log.rows_until(&snapshot(1000, 200));
    let named: Vec<u32> = all.into_iter().flat_map(|row| row.constraints).collect();
    assert_eq!(named, torn, "also with more lists than wait");
}

#[test]
fn a_reset_begins_anew_even_if_the_same_tears_again() {
    let mut log = begun();
    add(&mut log, 5, &[2, 3], 2);
    assert_eq!(rows(&mut log, 5).len(), 1);
    // The list that says that nothing is torn was missed.
    log.add_reset(8);
    add(&mut log, 11, &[2, 3, 4], 1);
    assert_eq!(rows(&mut log, 11), ["11: 2 cut, 3 stretch, 4 cut"]);
    log.add_reset(12);
    add(&mut log, 12, &[6], 1);
    assert_eq!(rows(&mut log, 12), ["12: 6 cut"], "cut at the boundary of the reset");
}

#[test]
fn a_shorter_list_is_a_reset_whose_outcome_was_missed() {
    let mut log = begun();
    add(&mut log, 5, &[2, 3], 2);
    add(&mut log, 8, &[], 0);
    add(&mut log, 9, &[3], 1);
    assert_eq!(rows(&mut log, 9), ["5: 2 cut, 3 stretch", "9: 3 stretch"]);
}

#[test]
fn a_recording_begins_with_what_was_torn_before_its_first_snapshot() {
    let latched = |log: &mut TearLog| add(log, 3, &[9, 1], 1);
    let mut log = TearLog::default();
    latched(&mut log);
    assert!(!log.is_known_at(&snapshot(6, 3)), "a newer list is yet to come");
    assert_eq!(log.begin(&snapshot(6, 2)), [9, 1]);
    assert!(rows(&mut log, 6).is_empty());

    let mut log = TearLog::default();
    latched(&mut log);
    add(&mut log, 6, &[9, 1, 4], 1);
    assert_eq!(log.begin(&snapshot(6, 3)), [9, 1]);
    assert_eq!(rows(&mut log, 6), ["6: 4 cut"], "what tore in its own step is a row");

    let mut log = TearLog::default();
    add(&mut log, 8, &[9, 1, 4, 5], 1);
    assert_eq!(log.begin(&snapshot(6, 3)), [9, 1, 4], "the list in force was missed");
    assert_eq!(rows(&mut log, 8), ["8: 5 stretch"]);
}

#[test]
fn causes_that_were_missed_are_those_of_a_later_list() {
    let mut log = begun();
    log.add(vec![(header(5, 1), vec![2]), (header(6, 1), vec![2, 3])], Vec::new());
    log.add(Vec::new(), vec![(header(6, 1), causes(&[2, 3]))]);
    assert_eq!(rows(&mut log, 6), ["5: 2 cut", "6: 3 stretch"]);
    log.add(vec![(header(7, 1), vec![2, 3, 4])], Vec::new());
    assert_eq!(rows(&mut log, 7), ["7: 4 ?"], "or not known");
    log.add(vec![(header(8, 2), vec![2, 3, 4, 5, 6])], vec![(header(8, 2), vec![3, 1, 3, 255, 3])]);
    assert_eq!(rows(&mut log, 8), ["8: 5 unknown, 6 cut"]);
}

#[test]
fn lists_of_another_run_are_left_out() {
    let mut log = begun();
    let other = TearsHeader { run_id: RUN_ID + 1, ..header(5, 1) };
    log.add(vec![(other, vec![3])], vec![(other, vec![0])]);
    add(&mut log, 6, &[2], 1);
    assert_eq!(rows(&mut log, 6), ["6: 2 cut"]);
}
