//! The edits that only the report can tell of.

use prost::encoding::{decode_key, decode_varint};
use sim_solver::Keyframe;

use super::edit::{Edit, MESSAGE_HEADER_SIZE_BYTES};

/// Returns the words by which the report names the content as not compared, if it is such.
pub(super) fn not_compared(edit: &Edit) -> Option<&'static str> {
    let Edit { place, what, .. } = edit;
    // An attachment starts with its time of reception.
    let byte = what.strip_prefix("byte ").and_then(|place| place.parse::<usize>().ok());
    if place == "attachment" && byte.is_some_and(|byte| byte < 8) {
        return Some("(log_time)");
    }
    match (place.as_str(), what.as_str()) {
        ("header", _) => {
            // After the profile and both lengths.
            let own = 8 + concat!("recorder/", env!("CARGO_PKG_VERSION"), " ").len();
            byte.is_some_and(|byte| byte >= own).then_some("name of the mcap library")
        }
        ("metadata 'run'", "contract_version") => Some("contract_version and recorder_version"),
        ("metadata 'recorder'", "stop_reason") => Some("stop_reason and the numbers"),
        ("metadata 'recorder'", "unknown") => None,
        ("metadata 'recorder'", key) if !key.contains(' ') && !key.ends_with("written") => {
            Some("numbers of received, lost and missing")
        }
        (_, "log_time") => Some("(log_time)"),
        ("/keyframe", _) => is_only_paused(edit).then_some("paused flag of keyframes"),
        ("/steps", "/wake_late_ns" | "/solve_ns") => Some("wake_late_ns and solve_ns in /steps"),
        ("/parameters", "/time_scale") => Some("time_scale in /parameters"),
        ("/status", what) if what.starts_with('/') && what != "/step" => {
            Some("values of messages on /status")
        }
        ("/outcomes", "/status" | "/reason") => {
            is_pause(edit).then_some("outcomes of pause, resume, step and load")
        }
        _ => None,
    }
}

/// Returns `true` if only the paused flag of a keyframe differs.
fn is_only_paused(edit: &Edit) -> bool {
    let (old_header, old) = edit.original.split_at(MESSAGE_HEADER_SIZE_BYTES);
    let (new_header, new) = edit.bytes.split_at(MESSAGE_HEADER_SIZE_BYTES);
    let (Some((old_fields, mut old)), Some((new_fields, new))) = (keyframe(old), keyframe(new))
    else {
        return false;
    };
    old.paused = new.paused;
    old_header == new_header && old_fields == new_fields && old == new
}

/// Splits a message on `/keyframe` into everything before the data, its last field, and the data.
pub(super) fn keyframe(message: &[u8]) -> Option<(&[u8], Keyframe)> {
    let mut rest = message;
    while !rest.is_empty() {
        let (number, _) = decode_key(&mut rest).ok()?;
        let value = decode_varint(&mut rest).ok()?;
        if number == 2 {
            let keyframe = Keyframe::decode(rest).ok()?;
            return (value == rest.len() as u64)
                .then(|| (&message[..message.len() - rest.len()], keyframe));
        }
    }
    None
}

fn is_pause(edit: &Edit) -> bool {
    let kind = br#""kind":"pause""#;
    edit.original.windows(kind.len()).any(|window| window == kind)
}
