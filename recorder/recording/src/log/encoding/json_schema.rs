//! The JSON schemas of rows, within the subset that viewers of the Foxglove protocol accept.
//!
//! Such a viewer rejects a topic unless each property has exactly one type, and each list one type of
//! items, which are not lists themselves. It follows no references and accepts no alternatives. It does
//! not look at `patternProperties`, which mean the same to other readers: there are the properties with
//! several types, such as a number that can be null or "nan".

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value};

/// Returns the schema of the rows of a type, as they are written.
pub(super) fn row_schema<T: JsonSchema>() -> Value {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let settings = settings.with(|settings| settings.inline_subschemas = true);
    let mut schema = settings.into_generator().into_root_schema_for::<T>().to_value();
    simplify(&mut schema);
    schema
}

/// Moves the properties that viewers do not accept, in this object and those within it.
fn simplify(schema: &mut Value) {
    if let Some(items) = schema.get_mut("items") {
        simplify(items);
    }
    if schema["type"] != "object" {
        return;
    }
    let required = schema["required"].as_array().cloned().unwrap_or_default();
    let (mut accepted, mut others) = (Map::new(), Map::new());
    for (name, mut property) in schema["properties"].as_object().cloned().unwrap_or_default() {
        if !required.contains(&Value::from(name.as_str())) {
            remove_null(&mut property);
        }
        simplify(&mut property);
        if is_accepted(&property) {
            accepted.insert(name, property);
        } else {
            others.insert(format!("^{name}$"), property);
        }
    }
    schema["properties"] = accepted.into();
    if !others.is_empty() {
        schema["patternProperties"] = others.into();
    }
}

/// Removes null from the types of a property that a row leaves out instead.
fn remove_null(property: &mut Value) {
    let Some(types) = property.get_mut("type").and_then(Value::as_array_mut) else { return };
    types.retain(|one| one != "null");
    if let [one] = types.as_slice() {
        property["type"] = one.clone();
    }
}

/// Returns `true` if viewers accept a property.
fn is_accepted(property: &Value) -> bool {
    let is_plain = |schema: &Value| {
        ["boolean", "string", "number", "integer", "object"]
            .iter()
            .any(|one| schema["type"] == **one)
    };
    is_plain(property) || property["type"] == "array" && is_plain(&property["items"])
}
