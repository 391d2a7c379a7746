//! Command files: one JSON object per line. The rows of `/outcomes` are such lines.

use serde::Deserialize;
use serde_json::{Map, Value};
use sim_messages::{
    ACTIONS, Action, ActionInfo, FieldForm, FieldInfo, MOTION_POINTS_MAX, MovedObject, PathError,
    PathPart, PathPoint, PlainF32, RestoreContents, Text,
};

/// A command and the step in which it takes effect.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedCommand {
    /// The first step that shows the effect.
    pub step: u64,
    /// Number of the outcome in the log that the command comes from.
    pub index: Option<u64>,
    /// Sender of the command. 0 is the console.
    pub client_id: u64,
    /// Number of the command among the commands of its client; by default the number of the command in the file, from 1.
    pub sequence: u64,
    /// The command.
    pub action: Action,
}

/// An error in a command file, with its position.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("{label}:{line}: {}: {} (allowed: {})", .error.field, .error.problem, .error.allowed)]
pub struct CommandFileError {
    label: String,
    /// From 1.
    line: usize,
    error: FieldError,
}

/// An error in one field of a line.
#[derive(Debug, PartialEq, Eq)]
struct FieldError {
    field: String,
    problem: String,
    allowed: String,
}

/// The fields of every line. `status`, `reason`, `disconnected` and `new_run` come from logs and have no
/// effect.
const COMMON_FIELDS: [&str; 9] = [
    "step",
    "kind",
    "client_id",
    "sequence",
    "index",
    "status",
    "reason",
    "disconnected",
    "new_run",
];

/// Parses commands and sorts them in the order of application. `label` names the file in errors.
///
/// # Errors
/// A line is not a command. The error names the line, the field and what is allowed.
pub fn parse_commands(text: &str, label: &str) -> Result<Vec<TimedCommand>, CommandFileError> {
    let mut commands = Vec::new();
    // Some editors begin a file with this mark.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    for (line, text) in (1..).zip(text.lines()) {
        if text.trim().is_empty() {
            continue;
        }
        let number = commands.len() as u64 + 1;
        let of_line = parse_line(text, number).map_err(|error| {
            let label = label.to_owned();
            CommandFileError { label, line, error }
        })?;
        commands.extend(of_line);
    }
    sort_commands(&mut commands);
    Ok(commands)
}

/// Sorts by step, then by index, then by client and sequence. Commands without an index come last in
/// their step, and in the next one after a rewind, whose step shows a state without further changes.
pub fn sort_commands(commands: &mut [TimedCommand]) {
    commands.sort_by_key(|command| {
        let index = command.index.unwrap_or(u64::MAX);
        (command.step, index, command.client_id, command.sequence)
    });
    let mut first_step = 0;
    for command in commands {
        if command.index.is_none() {
            command.step = command.step.max(first_step);
        }
        // Only those of a recording have a state to restore.
        let is_restore = matches!(command.action, Action::Restore { .. });
        if matches!(command.action, Action::Rewind { .. }) || is_restore && command.index.is_some()
        {
            first_step = command.step.saturating_add(1);
        }
    }
}

/// Parses the command of a line, whose number in the file is `number`. A long path becomes several commands, with
/// ascending numbers.
fn parse_line(text: &str, number: u64) -> Result<Vec<TimedCommand>, FieldError> {
    let Ok(Value::Object(fields)) = serde_json::from_str(text) else {
        let example = r#"an object such as {"step":1,"kind":"pin","particle":0}"#;
        return Err(invalid("line", "is not a JSON object", example));
    };
    let step = integer(&fields, "step", 1)?;
    let step = step.ok_or_else(|| missing("step", "whole numbers from 1"))?;
    let index = integer(&fields, "index", 0)?;
    let client_id = integer(&fields, "client_id", 0)?.unwrap_or(0);
    let first = integer(&fields, "sequence", 0)?.unwrap_or(number);
    let command = |(part, action)| {
        let sequence = first.wrapping_add(part);
        TimedCommand { step, index, client_id, sequence, action }
    };
    Ok((0..).zip(actions(&fields)?).map(command).collect())
}

fn actions(fields: &Map<String, Value>) -> Result<Vec<Action>, FieldError> {
    let Some(name) = fields.get("kind") else {
        return Err(missing("kind", &kind_names()));
    };
    let row = name.as_str().and_then(ActionInfo::from_name);
    let row = row.ok_or_else(|| {
        let meant = ActionInfo::meant(name.as_str().unwrap_or_default(), []);
        invalid("kind", &format!("{name} is unknown{meant}"), &kind_names())
    })?;
    let own = || row.fields.iter().map(|field| field.name);
    let is_known = |name: &str| own().chain(COMMON_FIELDS).any(|known| known == name);
    if let Some(unknown) = fields.keys().find(|name| !is_known(name)) {
        let allowed: Vec<_> = own().chain(COMMON_FIELDS).collect();
        let meant = ActionInfo::meant(row.name, [unknown.as_str()]);
        let problem = format!("is not a field of {name}{meant}");
        return Err(invalid(unknown, &problem, &allowed.join(", ")));
    }
    for field in row.fields {
        match fields.get(field.name) {
            Some(value) if is_valid(field.form, value) => {}
            Some(value) => {
                return Err(invalid(field.name, &format!("{value} is invalid"), field.allowed));
            }
            None if !field.is_optional => return Err(missing(field.name, field.allowed)),
            None => {}
        }
    }
    // Either of two fields must be present.
    if row.name == "rewind" && !own().any(|name| fields.contains_key(name)) {
        return Err(missing("to_step", row.fields[0].allowed));
    }
    let own_fields =
        fields.iter().filter(|(name, _)| *name == "kind" || own().any(|own| own == *name));
    let mut object: Map<_, _> =
        own_fields.map(|(name, value)| (name.clone(), value.clone())).collect();
    let path = object.get_mut("path").map(|path| std::mem::replace(path, Value::Array(Vec::new())));
    // All fields are valid. The error of serde would name internal types.
    let action = serde_json::from_value(Value::Object(object))
        .map_err(|_| invalid("line", "is not a command", &kind_names()))?;
    match (action, path) {
        (Action::Follow { object, object_index, append, .. }, Some(Value::Array(points)))
            if !points.is_empty() =>
        {
            let points = path_points(points)?;
            // A single command may be one that the node has rejected.
            if let Some(path) = PathPart::new(&points) {
                return Ok(vec![Action::Follow { object, object_index, path, append }]);
            }
            Action::follow(object, object_index, &points, append).map_err(|error| match error {
                PathError::Length { count } => {
                    let allowed = format!("1 to {MOTION_POINTS_MAX} points");
                    invalid("path", &format!("has {count} points"), &allowed)
                }
                PathError::Point { .. } => {
                    invalid("path", &error.to_string(), FieldInfo::PATH.allowed)
                }
            })
        }
        (action, _) => Ok(vec![action]),
    }
}

fn path_points(points: Vec<Value>) -> Result<Vec<PathPoint>, FieldError> {
    let point = |value: Value| {
        PathPoint::deserialize(&value)
            .map_err(|_| invalid("path", &format!("{value} is invalid"), FieldInfo::PATH.allowed))
    };
    points.into_iter().map(point).collect()
}

fn integer(fields: &Map<String, Value>, name: &str, min: u64) -> Result<Option<u64>, FieldError> {
    let Some(value) = fields.get(name) else { return Ok(None) };
    match value.as_u64() {
        Some(number) if number >= min => Ok(Some(number)),
        _ => {
            let allowed = format!("whole numbers from {min}");
            Err(invalid(name, &format!("{value} is invalid"), &allowed))
        }
    }
}

fn is_valid(form: FieldForm, value: &Value) -> bool {
    let is_number = |value: &Value| serde_json::from_value::<PlainF32>(value.clone()).is_ok();
    let are_numbers =
        |count| value.as_array().is_some_and(|all| all.len() == count && all.iter().all(is_number));
    let is_text = |is_valid: fn(&str) -> bool| value.as_str().is_some_and(is_valid);
    match form {
        FieldForm::Whole => value.as_u64().is_some_and(|number| u32::try_from(number).is_ok()),
        FieldForm::Long => value.is_u64(),
        FieldForm::Number => is_number(value),
        FieldForm::Flag => value.is_boolean(),
        FieldForm::Vector => are_numbers(3),
        FieldForm::Rotation => are_numbers(4),
        FieldForm::Text => is_text(|text| Text::new(text).is_ok()),
        FieldForm::Value => value.is_null() || is_number(value) || are_numbers(3),
        FieldForm::Kind => value.is_string() || value.is_null(),
        FieldForm::Object => is_text(|text| MovedObject::from_name(text).is_some()),
        FieldForm::Contents => is_text(|text| RestoreContents::from_name(text).is_some()),
        FieldForm::Hash => is_text(|text| u64::from_str_radix(text, 16).is_ok()),
        FieldForm::Path => value.is_array(),
    }
}

fn kind_names() -> String {
    ACTIONS.iter().map(|info| info.name).collect::<Vec<_>>().join(", ")
}

fn missing(field: &str, allowed: &str) -> FieldError {
    invalid(field, "is missing", allowed)
}

fn invalid(field: &str, problem: &str, allowed: &str) -> FieldError {
    FieldError { field: field.to_owned(), problem: problem.to_owned(), allowed: allowed.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        parse_commands(text, "drag.jsonl").unwrap_err().to_string()
    }

    #[test]
    fn commands_are_sorted_in_the_order_of_application() {
        let text = r#"
            {"step":9,"kind":"reset"}
            {"step":3,"kind":"pin","particle":4,"client_id":7}
            {"step":3,"kind":"unpin","particle":4,"client_id":7}
            {"step":3,"kind":"pause","client_id":2,"sequence":99}
            {"step":5,"kind":"release","particle":1,"index":8,"status":"applied","reason":""}
            {"step":5,"kind":"step","count":2,"index":7,"status":"rejected","reason":"x"}"#;
        let commands = parse_commands(text, "x").unwrap();
        let order: Vec<_> = commands.iter().map(|c| (c.step, c.client_id, c.sequence)).collect();
        assert_eq!(order, [(3, 2, 99), (3, 7, 2), (3, 7, 3), (5, 0, 6), (5, 0, 5), (9, 0, 1)]);
        assert_eq!(commands[0].action, Action::Pause);
        assert_eq!(commands[3].action, Action::Step { count: 2 });
    }

    #[test]
    fn a_command_after_a_rewind_takes_effect_in_the_next_step() {
        let text = r#"
            {"step":3,"kind":"rewind","to_step":1}
            {"step":3,"kind":"rewind","to_step":2}
            {"step":3,"kind":"reset"}
            {"step":4,"kind":"pause"}
            {"step":9,"kind":"pause"}"#;
        let commands = parse_commands(text, "x").unwrap();
        let order: Vec<_> = commands.iter().map(|one| (one.step, one.sequence)).collect();
        assert_eq!(order, [(3, 1), (4, 2), (5, 3), (5, 4), (9, 5)]);
    }

    #[test]
    fn a_byte_order_mark_at_the_start_is_skipped() {
        let text = "\u{feff}{\"step\":1,\"kind\":\"pause\"}\n";
        assert_eq!(parse_commands(text, "x").unwrap()[0].action, Action::Pause);
    }

    #[test]
    fn a_line_of_a_log_is_a_command() {
        let line = r#"{"step":3,"client_id":7,"sequence":8,"index":0,"kind":"grab","particle":1,"target":["-inf",0.1,-0.0],"over_s":0.25,"status":"rejected","reason":"non_finite"}"#;
        let commands = parse_commands(line, "x").unwrap();
        let target = [f32::NEG_INFINITY, 0.1, -0.0];
        let action = Action::Grab { particle: 1, target, over_s: 0.25 };
        let expected = TimedCommand { step: 3, index: Some(0), client_id: 7, sequence: 8, action };
        assert_eq!(commands, [expected]);
    }

    #[test]
    fn every_command_can_be_read() {
        for action in Action::samples() {
            let mut line = serde_json::to_value(action).unwrap();
            line["step"] = 1.into();
            assert_eq!(parse_commands(&line.to_string(), "x").unwrap()[0].action, action);
        }
    }

    fn line_with_path(point_count: usize) -> String {
        let point = |time| format!(r#"{{"time":{time},"translation":[0,{time},0]}}"#);
        let points: Vec<_> = (1..=point_count).map(point).collect();
        let points = points.join(",");
        format!(
            r#"{{"step":5,"kind":"follow","object":"anchor","object_index":3,"path":[{points}]}}"#
        )
    }

    #[test]
    fn a_long_path_becomes_a_chain_of_commands_that_are_numbered_as_if_each_had_a_line() {
        let text = format!("{}\n{{\"step\":5,\"kind\":\"pause\"}}", line_with_path(9));
        let commands = parse_commands(&text, "x").unwrap();
        let sequences: Vec<_> = commands.iter().map(|command| command.sequence).collect();
        assert_eq!(sequences, [1, 2, 3, 4]);
        let parts: Vec<_> = commands[..3]
            .iter()
            .map(|command| match command.action {
                Action::Follow { path, append, .. } => (command.step, path.points().len(), append),
                other => panic!("{other:?}"),
            })
            .collect();
        assert_eq!(parts, [(5, 4, false), (5, 4, true), (5, 1, true)]);
        let wrong = line_with_path(9).replace(r#""time":9"#, r#""time":8"#);
        let error = parse_commands(&wrong, "x").unwrap_err().to_string();
        assert!(error.contains("point 8 of the path: the time 8 is not after 8"), "{error}");
    }

    #[test]
    fn a_path_of_more_points_than_a_motion_has_is_refused() {
        assert_eq!(parse_commands(&line_with_path(2048), "x").unwrap().len(), 512);
        let expected = "drag.jsonl:1: path: has 2049 points (allowed: 1 to 2048 points)";
        assert_eq!(error(&line_with_path(2049)), expected);
    }

    #[test]
    fn every_error_names_its_line_and_field() {
        let wrong = [
            "nonsense",
            "[1]",
            r#"{"kind":"pin","particle":1}"#,
            r#"{"step":0,"kind":"pin","particle":1}"#,
            r#"{"step":1.5,"kind":"pause"}"#,
            r#"{"step":1,"particle":1}"#,
            r#"{"step":1,"kind":"dance"}"#,
            r#"{"step":1,"kind":"gab"}"#,
            r#"{"step":1,"kind":"pin","partcle":1}"#,
            r#"{"step":1,"kind":"pin"}"#,
            r#"{"step":1,"kind":"pin","particle":-1}"#,
            r#"{"step":1,"kind":"pin","particle":1,"colour":"red"}"#,
            r#"{"step":1,"kind":"grab","particle":1,"target":[0,1]}"#,
            r#"{"step":1,"kind":"grab","particle":1,"target":[0,1,2],"over_s":"soon"}"#,
            r#"{"step":1,"kind":"cut_radius","center":[0,1,2]}"#,
            r#"{"step":1,"kind":"push","center":[0,1,2],"radius":1,"delta":[0,1,2],"limit":null}"#,
            r#"{"step":1,"kind":"move_anchor","anchor":0,"translation":[0,1,2],"rotation":[1]}"#,
            r#"{"step":1,"kind":"set","parameter":"gravity","value":[0,1]}"#,
            r#"{"step":1,"kind":"drive_body","collider":0,"translation":[0,1,2],"force":true}"#,
            r#"{"step":1,"kind":"drive_body","collider":0,"translation":[0,1,2],"velocity":1}"#,
            r#"{"step":1,"kind":"drive_body","collider":0,"translation":[0,1,2],"angular_velocity":0}"#,
            r#"{"step":1,"kind":"drive_body","collider":0,"translation":[0,1,2],"torque":[0,1]}"#,
            r#"{"step":1,"kind":"release","particle":0,"force":[0,1,2]}"#,
            r#"{"step":1,"kind":"set","parameter":"gravity"}"#,
            r#"{"step":1,"kind":"set","parameter":7,"value":null}"#,
            r#"{"step":1,"kind":"set","parameter":"x","value":1,"constraint_kind":0}"#,
            r#"{"step":1,"kind":"set","parameter":"bending","value":1,"block":-1}"#,
            r#"{"step":1,"kind":"rewind"}"#,
            r#"{"step":1,"kind":"load","scene":null}"#,
            r#"{"step":1,"kind":"follow","object":"rope","object_index":0,"path":[]}"#,
            r#"{"step":1,"kind":"follow","object":"anchor","object_index":0,"path":[{"time":1}]}"#,
        ];
        let errors: Vec<_> = wrong.map(|line| error(&format!("\n{line}"))).into();
        insta::assert_snapshot!(errors.join("\n"), @r#"
        drag.jsonl:2: line: is not a JSON object (allowed: an object such as {"step":1,"kind":"pin","particle":0})
        drag.jsonl:2: line: is not a JSON object (allowed: an object such as {"step":1,"kind":"pin","particle":0})
        drag.jsonl:2: step: is missing (allowed: whole numbers from 1)
        drag.jsonl:2: step: 0 is invalid (allowed: whole numbers from 1)
        drag.jsonl:2: step: 1.5 is invalid (allowed: whole numbers from 1)
        drag.jsonl:2: kind: is missing (allowed: pin, unpin, grab, move, release, pause, resume, step, reset, push, cut, cut_radius, cut_segment, move_anchor, move_collider, set, load, rewind, restore, mark, drive_body, follow)
        drag.jsonl:2: kind: "dance" is unknown (allowed: pin, unpin, grab, move, release, pause, resume, step, reset, push, cut, cut_radius, cut_segment, move_anchor, move_collider, set, load, rewind, restore, mark, drive_body, follow)
        drag.jsonl:2: kind: "gab" is unknown (did you mean 'grab'?) (allowed: pin, unpin, grab, move, release, pause, resume, step, reset, push, cut, cut_radius, cut_segment, move_anchor, move_collider, set, load, rewind, restore, mark, drive_body, follow)
        drag.jsonl:2: partcle: is not a field of "pin" (did you mean 'particle'?) (allowed: particle, step, kind, client_id, sequence, index, status, reason, disconnected, new_run)
        drag.jsonl:2: particle: is missing (allowed: whole numbers 0..=4294967295)
        drag.jsonl:2: particle: -1 is invalid (allowed: whole numbers 0..=4294967295)
        drag.jsonl:2: colour: is not a field of "pin" (allowed: particle, step, kind, client_id, sequence, index, status, reason, disconnected, new_run)
        drag.jsonl:2: target: [0,1] is invalid (allowed: three numbers in m)
        drag.jsonl:2: over_s: "soon" is invalid (allowed: a number of seconds)
        drag.jsonl:2: radius: is missing (allowed: a number in m)
        drag.jsonl:2: limit: null is invalid (allowed: a number in m)
        drag.jsonl:2: rotation: [1] is invalid (allowed: four numbers: a quaternion x, y, z, w)
        drag.jsonl:2: value: [0,1] is invalid (allowed: a number, three numbers, or null for off)
        drag.jsonl:2: force: true is invalid (allowed: three numbers in N)
        drag.jsonl:2: velocity: 1 is invalid (allowed: three numbers in m/s)
        drag.jsonl:2: angular_velocity: 0 is invalid (allowed: three numbers in rad/s)
        drag.jsonl:2: torque: [0,1] is invalid (allowed: three numbers in N m)
        drag.jsonl:2: force: [0,1,2] is invalid (allowed: true or false)
        drag.jsonl:2: value: is missing (allowed: a number, three numbers, or null for off)
        drag.jsonl:2: parameter: 7 is invalid (allowed: the name of a parameter, at most 160 bytes)
        drag.jsonl:2: constraint_kind: 0 is invalid (allowed: structural, shear, bend, tether or all)
        drag.jsonl:2: block: -1 is invalid (allowed: whole numbers 0..=4294967295)
        drag.jsonl:2: to_step: is missing (allowed: whole numbers from 0)
        drag.jsonl:2: scene: null is invalid (allowed: the name of a scene, at most 160 bytes)
        drag.jsonl:2: object: "rope" is invalid (allowed: particle, anchor or collider)
        drag.jsonl:2: path: {"time":1} is invalid (allowed: points such as {"time":0.5,"translation":[0,0.1,0],"rotation":[0,0,0,1]})
        "#);
    }
}
