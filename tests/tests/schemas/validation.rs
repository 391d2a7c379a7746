//! The validation of JSON by a JSON schema, for the keywords that our schemas use. It is stricter than
//! JSON Schema in one way: a key that the schema does not name is a violation.

use serde_json::{Map, Value};

/// Keywords that forbid nothing.
const NOTES: [&str; 5] = ["$schema", "title", "description", "format", "default"];
/// The pattern of numbers that are not finite.
const NOT_FINITE: &str = "^(nan|-?inf)$";

/// Returns the places where a value violates a schema.
///
/// # Panics
/// At a keyword that is not known here.
pub(crate) fn violations(schema: &Value, value: &Value) -> Vec<String> {
    let mut found = Vec::new();
    validate(schema.as_object().unwrap(), value, "", &mut found);
    found
}

fn validate(schema: &Map<String, Value>, value: &Value, place: &str, found: &mut Vec<String>) {
    for (keyword, rule) in schema {
        let is_valid = match keyword.as_str() {
            "type" => is_of_type(rule, value),
            "enum" => rule.as_array().unwrap().contains(value),
            "minimum" => value.as_f64().is_none_or(|number| number >= rule.as_f64().unwrap()),
            "maximum" => value.as_f64().is_none_or(|number| number <= rule.as_f64().unwrap()),
            "minItems" => value.as_array().is_none_or(|list| list.len() as u64 >= count(rule)),
            "maxItems" => value.as_array().is_none_or(|list| list.len() as u64 <= count(rule)),
            "pattern" => {
                assert_eq!(rule, NOT_FINITE);
                value.as_str().is_none_or(|text| ["nan", "inf", "-inf"].contains(&text))
            }
            "required" => {
                let names = rule.as_array().unwrap();
                names.iter().all(|name| value.get(name.as_str().unwrap()).is_some())
            }
            "anyOf" => rule.as_array().unwrap().iter().any(|one| violations(one, value).is_empty()),
            "items" => {
                for (index, item) in value.as_array().into_iter().flatten().enumerate() {
                    let schema = rule.as_object().unwrap();
                    validate(schema, item, &format!("{place}/{index}"), found);
                }
                true
            }
            // Below, together.
            "properties" | "patternProperties" => true,
            // Every key must be known anyway.
            "additionalProperties" => *rule == Value::Bool(false),
            note => {
                assert!(NOTES.contains(&note), "the keyword {note} at {place}");
                true
            }
        };
        if !is_valid {
            found.push(format!("{place}: {value} violates {keyword} {rule}"));
        }
    }
    validate_keys(schema, value, place, found);
}

fn validate_keys(schema: &Map<String, Value>, value: &Value, place: &str, found: &mut Vec<String>) {
    for (key, value) in value.as_object().into_iter().flatten() {
        let property = schema.get("properties").and_then(|all| all.get(key));
        let patterns = schema.get("patternProperties");
        let pattern = patterns.and_then(|all| all.get(format!("^{key}$")));
        let place = format!("{place}/{key}");
        match property.or(pattern) {
            Some(schema) => validate(schema.as_object().unwrap(), value, &place, found),
            None => found.push(format!("{place}: a key that the schema does not name")),
        }
    }
}

fn is_of_type(rule: &Value, value: &Value) -> bool {
    let is_one = |word: &Value| match word.as_str().unwrap() {
        "boolean" => value.is_boolean(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "integer" => value.is_u64() || value.is_i64(),
        "object" => value.is_object(),
        "array" => value.is_array(),
        "null" => value.is_null(),
        other => panic!("the type {other}"),
    };
    rule.as_array().map_or_else(|| is_one(rule), |words| words.iter().any(is_one))
}

fn count(rule: &Value) -> u64 {
    rule.as_u64().unwrap()
}
