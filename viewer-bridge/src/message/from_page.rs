//! What a page says.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use sim_contract::{GRAB_OVER_S_DEFAULT, KindFilter, ParameterValue};
use thiserror::Error;

/// A message of a page.
#[derive(Debug, Clone, PartialEq)]
pub enum FromPage {
    /// Its first one.
    Hello(Hello),
    /// The last frame that it has drawn.
    Ack {
        /// Number of the frame.
        frame: u32,
    },
    /// Something to do.
    Command {
        /// The page's number for it; then it is always answered.
        id: Option<u32>,
        /// What to do.
        command: Command,
    },
}

/// The first message of a page.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hello {
    /// The protocol that it speaks.
    pub protocol: u32,
    /// What proves that it was given the address.
    #[serde(default)]
    pub token: Option<String>,
    /// How it wants positions.
    #[serde(default)]
    pub format: Choice,
}

/// How a page wants positions.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Choice {
    /// As they are while there are few, else in 65,536 steps.
    #[default]
    Auto,
    /// As they are.
    F32,
    /// In 65,536 steps of their box.
    U16,
}

/// Something to do.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
#[allow(missing_docs, reason = "PROTOCOL.md has every field with its unit and range")]
pub enum Command {
    DragBegin {
        particle: u32,
        target: [f32; 3],
        #[serde(default = "over_s_default")]
        over_s: f32,
    },
    DragMove {
        particle: u32,
        target: [f32; 3],
        #[serde(default = "over_s_default")]
        over_s: f32,
    },
    DragEnd {
        particle: u32,
    },
    Brush {
        eye: [f32; 3],
        ray: [f32; 3],
        radius: f32,
        delta: [f32; 3],
        over_s: f32,
        #[serde(default)]
        cap: Option<f32>,
    },
    Pin {
        particle: u32,
    },
    Unpin {
        particle: u32,
    },
    Cut {
        epoch: u32,
        constraints: Vec<u32>,
    },
    CutSegment {
        from: [f32; 3],
        to: [f32; 3],
        direction: [f32; 3],
    },
    CutRadius {
        center: [f32; 3],
        radius: f32,
    },
    MoveCollider {
        collider: u32,
        translation: [f32; 3],
        #[serde(default = "no_rotation")]
        rotation: [f32; 4],
    },
    MoveAnchor {
        anchor: u32,
        translation: [f32; 3],
        #[serde(default = "no_rotation")]
        rotation: [f32; 4],
    },
    Pause {},
    Resume {},
    Step {
        #[serde(default = "one")]
        count: i32,
    },
    Reset {},
    Load {
        scene: String,
    },
    Set {
        parameter: String,
        value: ParameterValue,
        #[serde(default)]
        constraint_kind: Option<KindFilter>,
    },
    Seek {
        step: u64,
    },
    Rate {
        value: f32,
    },
    Loop {
        is_on: bool,
    },
}

fn over_s_default() -> f32 {
    GRAB_OVER_S_DEFAULT
}

fn no_rotation() -> [f32; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

fn one() -> i32 {
    1
}

impl Command {
    /// Its word in messages.
    pub fn name(&self) -> &'static str {
        match self {
            Self::DragBegin { .. } => "drag_begin",
            Self::DragMove { .. } => "drag_move",
            Self::DragEnd { .. } => "drag_end",
            Self::Brush { .. } => "brush",
            Self::Pin { .. } => "pin",
            Self::Unpin { .. } => "unpin",
            Self::Cut { .. } => "cut",
            Self::CutSegment { .. } => "cut_segment",
            Self::CutRadius { .. } => "cut_radius",
            Self::MoveCollider { .. } => "move_collider",
            Self::MoveAnchor { .. } => "move_anchor",
            Self::Pause {} => "pause",
            Self::Resume {} => "resume",
            Self::Step { .. } => "step",
            Self::Reset {} => "reset",
            Self::Load { .. } => "load",
            Self::Set { .. } => "set",
            Self::Seek { .. } => "seek",
            Self::Rate { .. } => "rate",
            Self::Loop { .. } => "loop",
        }
    }
}

/// Why a text is no message. It ends the connection: the page is broken, or none of ours.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct Malformed(String);

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Ack {
    frame: u32,
}

impl FromPage {
    /// Reads a message.
    ///
    /// # Errors
    /// No JSON object, an unknown type, a field too many, too few or of another kind.
    pub fn parse(text: &str) -> Result<Self, Malformed> {
        let mut fields: Map<String, Value> = read(text)?;
        match fields.get("type").and_then(Value::as_str) {
            Some("hello") => untagged(fields).map(Self::Hello),
            Some("ack") => untagged(fields).map(|Ack { frame }| Self::Ack { frame }),
            _ => {
                let id = fields.remove("id").map(from_value).transpose()?;
                Ok(Self::Command { id, command: from_value(Value::Object(fields))? })
            }
        }
    }
}

fn untagged<T: DeserializeOwned>(mut fields: Map<String, Value>) -> Result<T, Malformed> {
    fields.remove("type");
    from_value(Value::Object(fields))
}

fn read<T: DeserializeOwned>(text: &str) -> Result<T, Malformed> {
    serde_json::from_str(text).map_err(|error| Malformed(error.to_string()))
}

fn from_value<T: DeserializeOwned>(value: Value) -> Result<T, Malformed> {
    serde_json::from_value(value).map_err(|error| Malformed(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_type_or_field_is_malformed() {
        for text in [
            "",
            "[]",
            "1",
            "null",
            "{}",
            r#"{"type":"dance"}"#,
            r#"{"type":"pause","why":1}"#,
            r#"{"type":"pin"}"#,
            r#"{"type":"pin","particle":-1}"#,
            r#"{"type":"pin","particle":1.5}"#,
            r#"{"type":"pin","particle":4294967296}"#,
            r#"{"type":"pin","particle":1,"id":-1}"#,
            r#"{"type":"pin","particle":1,"id":"a"}"#,
            r#"{"type":"ack","frame":1,"id":1}"#,
            r#"{"type":"hello"}"#,
            r#"{"type":"hello","protocol":1,"colour":2}"#,
            r#"{"type":"hello","protocol":1,"format":"f64"}"#,
            r#"{"type":"drag_begin","particle":1,"target":[0,0]}"#,
            r#"{"type":"drag_begin","particle":1,"target":[0,0,"nan"]}"#,
            r#"{"type":"set","parameter":"damping","value":true}"#,
        ] {
            assert!(FromPage::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn what_is_optional_has_a_default() {
        let hello = Hello { protocol: 1, token: None, format: Choice::Auto };
        let text = r#"{"type":"hello","protocol":1}"#;
        assert_eq!(FromPage::parse(text), Ok(FromPage::Hello(hello)));
        let command = Command::Step { count: 1 };
        let text = r#"{"type":"step"}"#;
        assert_eq!(FromPage::parse(text), Ok(FromPage::Command { id: None, command }));
        let command = Command::DragMove { particle: 3, target: [0.0; 3], over_s: 1.0 / 60.0 };
        let text = r#"{"id":4,"type":"drag_move","particle":3,"target":[0,0,0]}"#;
        assert_eq!(FromPage::parse(text), Ok(FromPage::Command { id: Some(4), command }));
    }

    #[test]
    fn null_switches_off_but_no_value_is_malformed() {
        let text = r#"{"type":"set","parameter":"tear_force","value":null}"#;
        let command = Command::Set {
            parameter: "tear_force".to_owned(),
            value: ParameterValue::Off,
            constraint_kind: None,
        };
        assert_eq!(FromPage::parse(text), Ok(FromPage::Command { id: None, command }));
        assert!(FromPage::parse(r#"{"type":"set","parameter":"tear_force"}"#).is_err());
    }
}
