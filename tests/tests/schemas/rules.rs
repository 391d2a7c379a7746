//! The rules of viewers of the Foxglove protocol for JSON schemas, as their parser applies them. One
//! property that breaks a rule costs the viewer the whole topic or service.

use serde_json::Value;

/// The types of properties and items beside lists.
const TYPES: [&str; 5] = ["boolean", "string", "number", "integer", "object"];

/// Returns the places that break a rule.
pub(crate) fn broken_rules(schema: &Value) -> Vec<String> {
    let mut broken = Vec::new();
    check_object(schema, "", &mut broken);
    if contains_key(schema, "$ref") {
        broken.push("a reference".to_owned());
    }
    broken
}

fn check_object(schema: &Value, place: &str, broken: &mut Vec<String>) {
    if schema["type"] != "object" {
        broken.push(format!("{place}/: its type is {}, not object", schema["type"]));
        return;
    }
    // The parser reads the properties of every object, also if there are none.
    let Some(properties) = schema["properties"].as_object() else {
        broken.push(format!("{place}/: an object without properties"));
        return;
    };
    for (name, property) in properties {
        check_property(property, &format!("{place}/{name}"), broken);
    }
}

fn check_property(property: &Value, place: &str, broken: &mut Vec<String>) {
    if let Some(alternatives) = property["oneOf"].as_array() {
        if !alternatives.iter().all(|one| one["const"].is_number()) {
            broken.push(format!("{place}: alternatives that are not numbers"));
        }
        return;
    }
    match property["type"].as_str() {
        Some("array") => check_type(&property["items"], &format!("{place}[]"), broken),
        _ => check_type(property, place, broken),
    }
}

fn check_type(schema: &Value, place: &str, broken: &mut Vec<String>) {
    match schema["type"].as_str() {
        Some("object") => check_object(schema, place, broken),
        Some(word) if TYPES.contains(&word) => {
            if !schema["contentEncoding"].is_null() {
                broken.push(format!("{place}: a content encoding"));
            }
        }
        _ => broken.push(format!("{place}: unsupported type {}", schema["type"])),
    }
}

fn contains_key(schema: &Value, key: &str) -> bool {
    match schema {
        Value::Object(map) => {
            map.contains_key(key) || map.values().any(|value| contains_key(value, key))
        }
        Value::Array(list) => list.iter().any(|value| contains_key(value, key)),
        _ => false,
    }
}

#[test]
fn the_rules_find_the_faults_that_viewers_report() {
    let property = |text: &str| {
        let schema = format!(r#"{{"type":"object","properties":{{"a":{text}}}}}"#);
        broken_rules(&serde_json::from_str(&schema).unwrap())
    };
    for accepted in [
        r#"{"type":"number"}"#,
        r#"{"type":"array","items":{"type":"integer"}}"#,
        r#"{"type":"object","properties":{},"patternProperties":{"^b$":{"anyOf":[]}}}"#,
        r#"{"oneOf":[{"const":1},{"const":2}]}"#,
    ] {
        assert_eq!(property(accepted), [""; 0], "{accepted}");
    }
    for refused in [
        "{}",
        "true",
        r#"{"type":["integer","null"]}"#,
        r#"{"anyOf":[{"type":"number"}]}"#,
        r##"{"$ref":"#/$defs/Number"}"##,
        r#"{"type":"object"}"#,
        r#"{"type":"array"}"#,
        r#"{"type":"array","items":{"type":["array","null"]}}"#,
        r#"{"type":"array","items":{"type":"array","items":{"type":"number"}}}"#,
        r#"{"type":"array","items":{"type":"object","properties":{"b":{"type":"null"}}}}"#,
        r#"{"oneOf":[{"const":"x"}]}"#,
    ] {
        assert_ne!(property(refused), [""; 0], "{refused}");
    }
}
