//! Files of other programs: files without a scene are read, and files without a run are named. They are written here record
//! by record.

use std::io::Cursor;

use recording::LogReader;

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
        ("format_version", "7"),
        ("run_id", "000000000000002a"),
        ("epoch_ns", "0"),
        ("scene", "lost"),
        ("origin", "0 0 0"),
        ("rate_hz", "240"),
        ("method", "xpbd"),
        ("particle_count", "0"),
        ("constraint_count", "0"),
        ("bend_count", "0"),
        ("up", "y"),
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
