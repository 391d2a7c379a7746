//! Messages of pages and commands of Foxglove clients: their form does not change their meaning, and
//! the check of a page's command accepts only finite numbers.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sim_contract::Action;
use viewer_bridge::message::{FromPage, parse_published};

fuzz_target!(|data: &[u8]| {
    let message = FromPage::decode(data);
    if let Ok(value) = serde_json::from_slice::<serde_json::Value>(data) {
        let reformatted = FromPage::decode(value.to_string().as_bytes());
        assert_eq!(message.is_ok(), reformatted.is_ok());
        if let (Ok(message), Ok(reformatted)) = (&message, &reformatted) {
            fuzz::assert_same(reformatted, message);
        }
    }
    if let Ok(FromPage::Command(command)) = &message
        && command.kind.check().is_ok()
    {
        assert_finite(&format!("{command:?}"));
    }
    check_published(data);
});

fn check_published(data: &[u8]) {
    let Ok(accepted) = parse_published(data) else { return };
    if accepted.validate().is_ok() {
        assert_finite(&format!("{accepted:?}"));
    }
    let action: Action = serde_json::from_slice(data).expect("a published command is an action");
    let text = serde_json::to_vec(&action).expect("an action has a JSON form");
    let again = parse_published(&text).expect("a printed action is valid");
    fuzz::assert_same(&again, &accepted);
}

/// Asserts that the numbers of a command are finite, outside of its texts.
fn assert_finite(debug: &str) {
    let outside = debug.split('"').step_by(2);
    for text in outside {
        assert!(
            !text.contains("NaN") && !text.contains(": inf") && !text.contains("-inf"),
            "{debug}"
        );
    }
}
