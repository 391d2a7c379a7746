//! The decoders of messages from clients, on any bytes: they never panic, and what passes them is in
//! range. An independent reader (JSON values) gives the ranges of what was sent.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use serde_json::{Map, Value};
use sim_contract::{Action, COORDINATE_MAX};
use viewer_bridge::message::{CommandKind, FromPage, parse_published};

/// Fields with coordinates, whose absolute values are limited.
const COORDINATES: [&str; 11] = [
    "target",
    "eye",
    "ray",
    "delta",
    "from",
    "to",
    "direction",
    "center",
    "translation",
    "offset",
    "velocity",
];
/// Fields whose vectors need a direction.
const DIRECTIONS: [&str; 3] = ["ray", "direction", "rotation"];
/// Text that is hard to decode, beside valid values.
const FRAGMENTS: [&str; 12] = [
    "null",
    "[]",
    "{}",
    "\"nan\"",
    "-1",
    "1e39",
    "1e400",
    "-0.0",
    "4294967296",
    "[1,2,3]",
    "[1e8,0,0]",
    "[0,0,0]",
];

/// Every message that a page can send.
fn messages() -> Vec<Value> {
    let texts: Value = serde_json::from_str(include_str!("golden/texts.json")).unwrap();
    texts["from_page"].as_array().unwrap().clone()
}

/// Checks the command of a message that was decoded.
fn examine(bytes: &[u8]) {
    let Ok(message) = FromPage::decode(bytes) else { return };
    // Only JSON objects with a type or a kind are messages.
    let sent: Map<String, Value> = serde_json::from_slice(bytes).unwrap();
    if let FromPage::Command(command) = message {
        assert_eq!(sent["kind"], command.kind.name());
        examine_command(&command.kind, &sent);
    } else {
        assert!(sent["type"].is_string());
    }
}

/// Checks that a command in range was sent with numbers in range.
fn examine_command(command: &CommandKind, sent: &Map<String, Value>) {
    if command.check().is_err() {
        return;
    }
    let vector = |field: &str| -> Option<Vec<f64>> {
        Some(sent.get(field)?.as_array()?.iter().map(|axis| axis.as_f64().unwrap()).collect())
    };
    // The limit of a push applies first.
    let is_limited = |field: &str| field == "delta" && sent.contains_key("limit");
    let coordinates = COORDINATES.iter().filter(|field| !is_limited(field));
    for axis in coordinates.filter_map(|field| vector(field)).flatten() {
        assert!(axis.abs() <= f64::from(COORDINATE_MAX), "{command:?}");
    }
    for vector in DIRECTIONS.iter().filter_map(|field| vector(field)) {
        assert!(vector.iter().any(|axis| *axis != 0.0), "{command:?}");
    }
    if !matches!(
        command,
        CommandKind::Action(Action::Load { .. } | Action::Set { .. } | Action::Mark { .. })
    ) {
        let text = format!("{command:?}");
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    }
}

#[test]
fn the_beginning_of_a_message_is_malformed() {
    for message in messages() {
        let text = message.to_string();
        assert!(FromPage::decode(text.as_bytes()).is_ok(), "{text}");
        for end in 0..text.len() {
            assert!(FromPage::decode(&text.as_bytes()[..end]).is_err(), "{}", &text[..end]);
        }
    }
}

#[test]
fn deep_nesting_is_malformed() {
    for opening in ["[", "{\"type\":", "{\"kind\":\"cut_constraints\",\"constraints\":["] {
        let text = opening.repeat((64 << 10) / opening.len());
        assert!(FromPage::decode(text.as_bytes()).is_err());
        assert!(parse_published(text.as_bytes()).is_err());
    }
}

/// The text of a value that a field may have.
fn value() -> impl Strategy<Value = String> {
    prop_oneof![
        select(&FRAGMENTS[..]).prop_map(ToOwned::to_owned),
        any::<f64>().prop_map(|number| format!("{number:e}")),
        any::<f32>().prop_map(|number| format!("[{number:e},0,1]")),
        any::<i64>().prop_map(|number| number.to_string()),
        any::<String>().prop_map(|text| Value::from(text).to_string()),
    ]
}

/// A message with some of its values replaced.
fn altered_message() -> impl Strategy<Value = String> {
    let changes = vec((any::<Index>(), value()), 1..3);
    (select(messages()), changes).prop_map(|(message, changes)| {
        let fields = message.as_object().unwrap().iter();
        let mut fields: Vec<_> =
            fields.map(|(name, value)| (name.clone(), value.to_string())).collect();
        for (index, value) in changes {
            index.get_mut(&mut fields).1 = value;
        }
        let fields = fields.iter().map(|(name, value)| format!("\"{name}\":{value}"));
        format!("{{{}}}", fields.collect::<Vec<_>>().join(","))
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn any_bytes_are_decoded_or_malformed(bytes in vec(any::<u8>(), 0..200)) {
        examine(&bytes);
        let _command = parse_published(&bytes);
    }

    #[test]
    fn a_message_with_other_bytes_is_decoded_or_malformed(
        message in select(messages()),
        changes in vec((any::<Index>(), any::<u8>()), 1..4),
    ) {
        let mut bytes = message.to_string().into_bytes();
        for (index, byte) in changes {
            *index.get_mut(&mut bytes) = byte;
        }
        examine(&bytes);
    }

    #[test]
    fn a_message_with_other_fields_is_in_range_or_refused(text in altered_message()) {
        examine(text.as_bytes());
        if let Ok(action) = parse_published(text.as_bytes()) {
            examine_command(&action.into(), &serde_json::from_str(&text).unwrap());
        }
    }
}
