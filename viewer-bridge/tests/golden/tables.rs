//! The tables of the page, `web/js/panel/tables.js`, which are those of the Rust types.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use sim_contract::{
    ACTIONS, ActionInfo, FieldForm, NumberRange, PARAMETERS, ParameterInfo, Parts, Slider,
    ValueForm,
};

const HEAD: &str = r#"// Generated from the tables of parameters and actions; do not edit. `UPDATE_GOLDEN=1 cargo test -p viewer-bridge golden` rewrites it.

/**
 * A row of the panel. A "log" slider is logarithmic, and starts with 0 if `hasZero`. `whenOn` is the value
 * of a parameter when it is switched on. A row with `parts` has a value for all constraints or bends, or for those of a part: a
 * kind of constraint, a generated block with bends, or a collider. Without a value, each has its own.
 * @typedef {{
 *   name: string, label: string, unit: string, kind: "vector" | "linear" | "log" | "whole",
 *   least: number, most: number, canBeOff?: boolean, hasZero?: boolean, whenOn?: number, method?: "xpbd" | "pbd", parts?: "kinds" | "blocks" | "colliders",
 * }} Row
 */

/** The sliders, in units of a scene in metres. The values of a scene can widen a range. @type {Row[]} */
export const ROWS = [
"#;

const ACTIONS_HEAD: &str = r#"
/** @typedef {{ name: string, form: "whole" | "long" | "number" | "vector" | "rotation" | "text" | "value" | "kind", isOptional?: boolean }} Field */

/** The fields of each action that a user can give by hand. @type {Record<string, Field[]>} */
export const ACTIONS = {
"#;

fn tables() -> String {
    let mut sliders: Vec<_> =
        PARAMETERS.iter().filter_map(|info| Some((info, info.slider?))).collect();
    sliders.sort_by_key(|(_, slider)| slider.place);
    let rows: String = sliders.into_iter().map(|(info, slider)| row(info, &slider)).collect();
    let actions: String = ACTIONS.iter().filter_map(action).collect();
    format!("{HEAD}{rows}];\n{ACTIONS_HEAD}{actions}}};\n")
}

/// The row of an action. `None` for one with fields that no form has.
fn action(info: &ActionInfo) -> Option<String> {
    let mut fields = Vec::new();
    for field in info.fields {
        let form = match field.form {
            FieldForm::Whole => "whole",
            FieldForm::Long => "long",
            FieldForm::Number => "number",
            FieldForm::Vector => "vector",
            FieldForm::Rotation => "rotation",
            FieldForm::Text => "text",
            FieldForm::Value => "value",
            FieldForm::Kind => "kind",
            // Pages cannot release the grabs of others.
            FieldForm::Flag => continue,
            FieldForm::Object | FieldForm::Contents | FieldForm::Hash | FieldForm::Path => {
                return None;
            }
        };
        let optional = if field.is_optional { ", isOptional: true" } else { "" };
        fields.push(format!("{{ name: {:?}, form: {form:?}{optional} }}", field.name));
    }
    Some(format!("  {}: [{}],\n", info.name, fields.join(", ")))
}

fn row(info: &ParameterInfo, slider: &Slider) -> String {
    let ParameterInfo { name, unit, form, parts, method, .. } = info;
    let Slider { label, is_logarithmic, least, most, when_on, .. } = slider;
    let kind = match form {
        ValueForm::Vector => "vector",
        ValueForm::Whole => "whole",
        ValueForm::Number if *is_logarithmic => "log",
        ValueForm::Number => "linear",
    };
    // Ratios are multiples of something.
    let is_multiple = [NumberRange::RATIO, NumberRange::TIME_SCALE].contains(&info.range);
    let unit = if is_multiple { "×" } else { unit };
    let mut row = format!(
        "  {{ name: {name:?}, label: {label:?}, unit: {unit:?}, kind: {kind:?}, least: {least}, most: {most}"
    );
    if let Some(value) = when_on {
        write!(row, ", canBeOff: true, whenOn: {value}").unwrap();
    } else if *is_logarithmic && info.range.contains(0.0) {
        row += ", hasZero: true";
    }
    if let Some(method) = method {
        write!(row, ", method: {:?}", method.name()).unwrap();
    }
    row += match parts {
        Parts::None => "",
        Parts::Kinds => ", parts: \"kinds\"",
        Parts::Blocks => ", parts: \"blocks\"",
        Parts::Colliders => ", parts: \"colliders\"",
    };
    row + " },\n"
}

#[test]
fn the_tables_of_the_page_are_those_of_the_types() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("web/js/panel/tables.js");
    let tables = tables();
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        fs::write(&file, &tables).unwrap();
    }
    assert_eq!(
        fs::read_to_string(&file).unwrap_or_default(),
        tables,
        "UPDATE_GOLDEN=1 rewrites it"
    );
}
