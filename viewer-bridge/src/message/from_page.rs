//! Messages from a page to the server.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use sim_contract::{GRAB_OVER_S_DEFAULT, KindFilter, ParameterValue};
use thiserror::Error;

use super::body_drive::{BodyDrive, no_rotation};
use super::object::ObjectKind;
use super::timeline::Toward;
use crate::limits::PARTICLES_INSPECTED_MAX;

/// A message from a page.
#[derive(Debug, Clone, PartialEq)]
pub enum FromPage {
    /// The first message.
    Hello(Hello),
    /// The last frame that the page has drawn.
    Ack {
        /// Number of the frame.
        frame: u32,
    },
    /// The page wants to know more, or less, of each frame.
    Wish(Wish),
    /// A command.
    Command {
        /// The page's number for the command. A command with a number is always answered.
        id: Option<u32>,
        /// The command.
        command: Command,
    },
}

/// The first message of a page.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hello {
    /// Protocol number of the page.
    pub protocol: u32,
    /// Token from the printed address.
    #[serde(default)]
    pub token: Option<String>,
    /// Format in which the page wants positions.
    #[serde(default)]
    pub format: Choice,
    /// The page puts long messages together from their pieces.
    #[serde(default)]
    pub parts: bool,
}

/// A wish of a page: values of each frame besides the positions, from now on.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum Wish {
    /// The forces of the step, or no longer.
    Forces {
        /// `true` if it wants them.
        is_on: bool,
    },
    /// The speeds of all particles, or no longer.
    Speeds {
        /// `true` if it wants them.
        is_on: bool,
    },
    /// The exact states of these particles, and of no others.
    Inspect {
        /// Indices; at most [`PARTICLES_INSPECTED_MAX`].
        particles: Vec<u32>,
    },
}

/// Format of positions.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Choice {
    /// f32 for a small scene, u16 for a large one.
    #[default]
    Auto,
    /// The values of the node.
    F32,
    /// 65,536 steps across the bounding box.
    U16,
}

/// A command of a client.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
#[allow(missing_docs, reason = "PROTOCOL.md describes every field with its unit and range")]
pub enum Command {
    Grab {
        particle: u32,
        target: [f32; 3],
        #[serde(default = "over_s_default")]
        over_s: f32,
    },
    Move {
        particle: u32,
        target: [f32; 3],
        #[serde(default = "over_s_default")]
        over_s: f32,
    },
    Release {
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
        #[serde(default)]
        stroke: Option<u32>,
    },
    Push {
        center: [f32; 3],
        radius: f32,
        delta: [f32; 3],
        #[serde(default)]
        limit: Option<f32>,
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
        #[serde(default)]
        stroke: Option<u32>,
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
        #[serde(default)]
        over_s: f32,
    },
    DriveBody(BodyDrive),
    MoveAnchor {
        anchor: u32,
        translation: [f32; 3],
        #[serde(default = "no_rotation")]
        rotation: [f32; 4],
        #[serde(default)]
        over_s: f32,
    },
    Lift {
        epoch: u32,
        object: ObjectKind,
        index: u32,
    },
    Carry {
        object: ObjectKind,
        index: u32,
        offset: [f32; 3],
        #[serde(default = "over_s_default")]
        over_s: f32,
    },
    Throw {
        object: ObjectKind,
        index: u32,
        velocity: [f32; 3],
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
        #[serde(default)]
        block: Option<u32>,
        #[serde(default)]
        collider: Option<u32>,
        /// Changes with the same number are undone together.
        #[serde(default)]
        stroke: Option<u32>,
    },
    Mark {
        text: String,
    },
    Look {
        step: u64,
        #[serde(default)]
        toward: Toward,
    },
    Rewind {
        to_step: u64,
    },
    Undo {
        #[serde(default)]
        takes_others: bool,
    },
    Record {},
    StopRecording {},
    Seek {
        step: u64,
    },
    Rate {
        value: f32,
    },
    Ghost {
        /// Name of a recording; `None` for no ghost.
        #[serde(default)]
        name: Option<String>,
    },
    Loop {
        is_on: bool,
        /// First step of the loop; without it, that of the recording.
        #[serde(default)]
        first_step: Option<u64>,
        /// Last step of the loop; without it, that of the recording.
        #[serde(default)]
        last_step: Option<u64>,
    },
}

fn over_s_default() -> f32 {
    GRAB_OVER_S_DEFAULT
}

fn one() -> i32 {
    1
}

impl Command {
    /// Type in messages.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Grab { .. } => "grab",
            Self::Move { .. } => "move",
            Self::Release { .. } => "release",
            Self::Brush { .. } => "brush",
            Self::Push { .. } => "push",
            Self::Pin { .. } => "pin",
            Self::Unpin { .. } => "unpin",
            Self::Cut { .. } => "cut",
            Self::CutSegment { .. } => "cut_segment",
            Self::CutRadius { .. } => "cut_radius",
            Self::MoveCollider { .. } => "move_collider",
            Self::DriveBody(_) => "drive_body",
            Self::MoveAnchor { .. } => "move_anchor",
            Self::Lift { .. } => "lift",
            Self::Carry { .. } => "carry",
            Self::Throw { .. } => "throw",
            Self::Pause {} => "pause",
            Self::Resume {} => "resume",
            Self::Step { .. } => "step",
            Self::Reset {} => "reset",
            Self::Load { .. } => "load",
            Self::Mark { .. } => "mark",
            Self::Look { .. } => "look",
            Self::Rewind { .. } => "rewind",
            Self::Undo { .. } => "undo",
            Self::Set { .. } => "set",
            Self::Record {} => "record",
            Self::StopRecording {} => "stop_recording",
            Self::Seek { .. } => "seek",
            Self::Rate { .. } => "rate",
            Self::Ghost { .. } => "ghost",
            Self::Loop { .. } => "loop",
        }
    }
}

/// The reason for which a text is not a message. The server closes the connection then: the page
/// is broken, or not ours.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct Malformed(String);

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Ack {
    frame: u32,
}

impl FromPage {
    /// Decodes a message from the bytes of a text.
    ///
    /// # Errors
    /// The bytes are not UTF-8, or the text is not a message.
    pub fn decode(bytes: &[u8]) -> Result<Self, Malformed> {
        let text = str::from_utf8(bytes).map_err(|error| Malformed(error.to_string()))?;
        Self::parse(text)
    }

    /// Parses a message.
    ///
    /// # Errors
    /// The text is not a JSON object, its type is unknown, or a field is missing, unknown or of the
    /// wrong type.
    pub fn parse(text: &str) -> Result<Self, Malformed> {
        let mut fields: Map<String, Value> = read(text)?;
        match fields.get("type").and_then(Value::as_str) {
            Some("hello") => untagged(fields).map(Self::Hello),
            Some("ack") => untagged(fields).map(|Ack { frame }| Self::Ack { frame }),
            Some("forces" | "speeds" | "inspect") => read_wish(fields).map(Self::Wish),
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

fn read_wish(fields: Map<String, Value>) -> Result<Wish, Malformed> {
    let wish = from_value(Value::Object(fields))?;
    match &wish {
        Wish::Inspect { particles } if particles.len() > PARTICLES_INSPECTED_MAX => {
            let count = particles.len();
            Err(Malformed(format!(
                "inspect names {count} particles; the limit is {PARTICLES_INSPECTED_MAX}"
            )))
        }
        _ => Ok(wish),
    }
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
    fn an_unknown_type_or_a_wrong_field_is_malformed() {
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
            r#"{"type":"forces"}"#,
            r#"{"type":"forces","is_on":1}"#,
            r#"{"type":"speeds"}"#,
            r#"{"type":"inspect"}"#,
            r#"{"type":"inspect","particles":[-1]}"#,
            r#"{"type":"inspect","particles":[0,1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20,21,22,23,24,25,26,27,28,29,30,31,32]}"#,
            r#"{"type":"hello"}"#,
            r#"{"type":"hello","protocol":1,"colour":2}"#,
            r#"{"type":"hello","protocol":1,"format":"f64"}"#,
            r#"{"type":"grab","particle":1,"target":[0,0]}"#,
            r#"{"type":"grab","particle":1,"target":[0,0,"nan"]}"#,
            r#"{"type":"set","parameter":"damping","value":true}"#,
        ] {
            assert!(FromPage::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn optional_fields_have_defaults() {
        let hello = Hello { protocol: 1, token: None, format: Choice::Auto, parts: false };
        let text = r#"{"type":"hello","protocol":1}"#;
        assert_eq!(FromPage::parse(text), Ok(FromPage::Hello(hello)));
        let command = Command::Step { count: 1 };
        let text = r#"{"type":"step"}"#;
        assert_eq!(FromPage::parse(text), Ok(FromPage::Command { id: None, command }));
        let command = Command::Move { particle: 3, target: [0.0; 3], over_s: 1.0 / 60.0 };
        let text = r#"{"id":4,"type":"move","particle":3,"target":[0,0,0]}"#;
        assert_eq!(FromPage::parse(text), Ok(FromPage::Command { id: Some(4), command }));
    }

    #[test]
    fn null_switches_a_parameter_off_but_a_missing_value_is_malformed() {
        let text = r#"{"type":"set","parameter":"tear_force","value":null}"#;
        let command = Command::Set {
            parameter: "tear_force".to_owned(),
            value: ParameterValue::Off,
            constraint_kind: None,
            block: None,
            collider: None,
            stroke: None,
        };
        assert_eq!(FromPage::parse(text), Ok(FromPage::Command { id: None, command }));
        assert!(FromPage::parse(r#"{"type":"set","parameter":"tear_force"}"#).is_err());
    }
}
