//! Command files: each command prints as a line that reads back the same.
#![no_main]

use libfuzzer_sys::fuzz_target;
use recording::{TimedCommand, parse_commands, sort_commands};

fuzz_target!(|text: &str| {
    let Ok(commands) = parse_commands(text, "commands.jsonl") else { return };
    let lines: String = commands.iter().map(line).collect();
    let again = parse_commands(&lines, "commands.jsonl").expect("a printed command is valid");
    fuzz::assert_same(&again, &commands);
    let mut sorted = commands.clone();
    sort_commands(&mut sorted);
    fuzz::assert_same(&sorted, &commands);
});

fn line(command: &TimedCommand) -> String {
    let mut object = serde_json::to_value(command.action).expect("an action has a JSON form");
    object["step"] = command.step.into();
    object["client_id"] = command.client_id.into();
    object["sequence"] = command.sequence.into();
    if let Some(index) = command.index {
        object["index"] = index.into();
    }
    format!("{object}\n")
}
