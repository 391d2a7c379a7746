//! What can be set while a scene runs, for the controls of a page.

use serde::Serialize;

/// A parameter, as a control needs it. The node has the last word.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SettingEntry {
    /// Its word in commands.
    pub name: &'static str,
    /// Unit of its value, "" for a plain number.
    pub unit: &'static str,
    /// What it takes.
    pub value: ValueKind,
    /// Least value, of each component.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
    /// Whether the least value itself is not allowed.
    pub above_min: bool,
    /// Whether it can be switched off.
    pub off: bool,
    /// Whether it can be set for one kind of constraints.
    pub per_kind: bool,
}

/// What a parameter takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ValueKind {
    /// Three numbers.
    Vector,
    /// A number.
    Number,
    /// A whole number.
    Whole,
}

/// The greatest f32, for what has no upper limit.
const UNLIMITED: f64 = f32::MAX as f64;

const NUMBER: SettingEntry = SettingEntry {
    name: "",
    unit: "",
    value: ValueKind::Number,
    min: 0.0,
    max: UNLIMITED,
    above_min: false,
    off: false,
    per_kind: false,
};
const VECTOR: SettingEntry =
    SettingEntry { value: ValueKind::Vector, min: -1e7, max: 1e7, off: true, ..NUMBER };
const PASSES: SettingEntry =
    SettingEntry { value: ValueKind::Whole, min: 1.0, max: 1000.0, ..NUMBER };
const RATIO: SettingEntry = SettingEntry { min: 1.0, above_min: true, off: true, ..NUMBER };

/// All parameters, in the order of a panel.
pub const SETTINGS: [SettingEntry; 15] = [
    SettingEntry { name: "gravity", unit: "m/s²", ..VECTOR },
    SettingEntry { name: "wind_velocity", unit: "m/s", ..VECTOR },
    SettingEntry { name: "wind_drag", unit: "kg/m³", off: true, ..NUMBER },
    SettingEntry { name: "damping", unit: "1/s", off: true, ..NUMBER },
    SettingEntry { name: "substeps", ..PASSES },
    SettingEntry { name: "iterations", ..PASSES },
    SettingEntry { name: "relaxation", above_min: true, max: 2.0, ..NUMBER },
    SettingEntry { name: "compliance", unit: "m/N", max: 1e20, per_kind: true, ..NUMBER },
    SettingEntry { name: "stiffness", max: 1.0, per_kind: true, ..NUMBER },
    SettingEntry { name: "max_stretch", ..RATIO },
    SettingEntry { name: "tear_stretch", ..RATIO },
    SettingEntry { name: "tear_distance", unit: "m", off: true, ..NUMBER },
    SettingEntry { name: "tear_force", unit: "N", above_min: true, off: true, ..NUMBER },
    SettingEntry { name: "max_speed", unit: "m/s", above_min: true, ..NUMBER },
    SettingEntry { name: "time_scale", min: 1e-3, max: 1e3, ..NUMBER },
];
