//! Files of older recorders and of other programs: those of format 2 are read, and files without a
//! run are named. They are written here record by record.

use std::io::Cursor;

use recorder::{LogEnd, LogReader, Message, TearTracker};
use sim_contract::{TearCause, TornConstraint};

#[test]
fn a_recording_without_a_scene_is_readable() {
    let metadata = |entries: &[(&str, &str)]| {
        let entries = entries.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned()));
        mcap::records::Metadata { name: "run".to_owned(), metadata: entries.collect() }
    };
    let file = |metadata: &mcap::records::Metadata| {
        let mut other = mcap::WriteOptions::new().create(Cursor::new(Vec::new())).unwrap();
        other.write_metadata(metadata).unwrap();
        other.finish().unwrap();
        other.into_inner().into_inner()
    };
    let ours = file(&metadata(&[
        ("format_version", "2"),
        ("run_id", "000000000000002a"),
        ("epoch_ns", "0"),
        ("scene", "lost"),
        ("origin", "0 0 0"),
        ("rate_hz", "240"),
        ("method", "xpbd"),
        ("particle_count", "0"),
        ("constraint_count", "0"),
        ("solver_version", "1"),
        ("contract_version", "1"),
        ("recorder_version", "0.1.0"),
    ]));
    let log = LogReader::new(ours.as_slice()).unwrap();
    assert_eq!((log.run().scene_name.as_str(), log.scene()), ("lost", &b""[..]));
    let foreign = file(&metadata(&[("distance", "10 km")]));
    let error = LogReader::new(foreign.as_slice()).unwrap_err();
    assert!(error.to_string().contains("not a recording of a simulation"), "{error}");
}

/// A file as recorders of format 2 wrote it: without `/parameters`, and with unknown causes.
fn format_2_file() -> Vec<u8> {
    let mut file = mcap::WriteOptions::new().create(Cursor::new(Vec::new())).unwrap();
    let entries = [
        ("format_version", "2"),
        ("run_id", "000000000000002a"),
        ("epoch_ns", "0"),
        ("scene", "two points"),
        ("origin", "0 0 0"),
        ("rate_hz", "240"),
        ("method", "xpbd"),
        ("particle_count", "0"),
        ("constraint_count", "2"),
        ("solver_version", "3"),
        ("contract_version", "2"),
        ("recorder_version", "0.1.0"),
    ];
    let metadata = entries.map(|(key, value)| (key.to_owned(), value.to_owned())).into();
    let run = mcap::records::Metadata { name: "run".to_owned(), metadata };
    file.write_metadata(&run).unwrap();
    let rows = [
        (
            "/topology",
            r#"{"step":7,"revision":0,"a":[0,1],"b":[1,2],"rest_length":[1,1],"compliance":[0,0],"kind":[0,0],"torn":[1]}"#,
        ),
        ("/tears", r#"{"step":8,"constraints":[0]}"#),
        ("/tears", r#"{"step":9,"constraints":[0,1],"causes":["unknown","cut"]}"#),
        (
            "/status",
            r#"{"step":9,"paused":false,"replay":false,"real_time_factor":1,"wake_late_ns_p50":0,"wake_late_ns_p99":0,"solve_ns_p50":0,"solve_ns_p99":0,"late_steps":0,"skipped_periods":0,"outcome_count":0,"rejected_count":0,"rate_hz":240,"particle_count":0,"constraint_count":2,"reader_count":1,"process_id":1,"scene_name":"two points"}"#,
        ),
    ];
    for (sequence, (topic, row)) in (0..).zip(rows) {
        let channel_id =
            file.add_channel(0, topic, "json", &std::collections::BTreeMap::new()).unwrap();
        let header =
            mcap::records::MessageHeader { channel_id, sequence, log_time: 0, publish_time: 0 };
        file.write_to_known_channel(&header, row.as_bytes()).unwrap();
    }
    file.finish().unwrap();
    file.into_inner().into_inner()
}

#[test]
fn a_file_of_format_2_is_readable() {
    let file = format_2_file();
    let mut log = LogReader::new(file.as_slice()).unwrap();
    let mut messages = Vec::new();
    while let Some(logged) = log.next_message().unwrap() {
        messages.push(logged.message);
    }
    let [Message::Topology(topology), before, after, Message::Status(status)] = &messages[..]
    else {
        panic!("{messages:?}")
    };
    assert_eq!((topology.constraints().unwrap().len(), status.time_scale), (2, 1.0));
    let mut tracker = TearTracker::new(topology.torn_before());
    tracker.process(before);
    tracker.process(after);
    let torn = tracker.at(9).unwrap();
    let causes: Vec<_> = torn.constraints.iter().map(TornConstraint::cause).collect();
    assert_eq!(torn.indices().collect::<Vec<_>>(), [1, 0, 0, 1]);
    assert_eq!(causes, [None, None, None, Some(TearCause::Cut)]);
    assert_eq!(log.end(), Some(&LogEnd::Complete));
}
