//! Messages from a page to the server.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::{Map, Value};

use super::command::{Command, Malformed};
use crate::limits::PARTICLES_INSPECTED_MAX;

/// A message from a page. A command has a `kind`, and every other message a `type`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum FromPage {
    /// The first message.
    Hello(Hello),
    /// The last frame that the page has drawn.
    Ack {
        /// Number of the frame.
        frame: u32,
    },
    /// Subscribes to the forces of each step, or no longer.
    Forces {
        /// `true` if the page wants them.
        is_on: bool,
    },
    /// Subscribes to the speeds of all particles, or no longer.
    Speeds {
        /// `true` if the page wants them.
        is_on: bool,
    },
    /// Subscribes to the exact states of these particles, and of no others.
    Inspect {
        /// Indices; at most [`PARTICLES_INSPECTED_MAX`].
        #[serde(deserialize_with = "inspected")]
        particles: Vec<u32>,
    },
    /// A command.
    #[serde(skip)]
    Command(Command),
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
    /// The text is not a JSON object, its type or kind is unknown, or a field is missing, unknown or of the
    /// wrong type.
    pub fn parse(text: &str) -> Result<Self, Malformed> {
        let fields: Map<String, Value> = serde_json::from_str(text)?;
        if fields.contains_key("kind") {
            return Command::read(fields).map(Self::Command);
        }
        Ok(Self::deserialize(Value::Object(fields))?)
    }
}

/// Reads the indices of inspected particles.
fn inspected<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<u32>, D::Error> {
    let particles = Vec::deserialize(deserializer)?;
    if particles.len() <= PARTICLES_INSPECTED_MAX {
        return Ok(particles);
    }
    let count = particles.len();
    Err(D::Error::custom(format!(
        "inspect names {count} particles; the limit is {PARTICLES_INSPECTED_MAX}"
    )))
}

#[cfg(test)]
mod tests {
    use sim_contract::{Action, ParameterValue};

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
            r#"{"type":"pause"}"#,
            r#"{"type":"command"}"#,
            r#"{"kind":"dance"}"#,
            r#"{"kind":"action"}"#,
            r#"{"kind":7}"#,
            r#"{"kind":"hello","protocol":1}"#,
            r#"{"type":"ack","kind":"pause","frame":1}"#,
            r#"{"kind":"pause","why":1}"#,
            r#"{"kind":"pin"}"#,
            r#"{"kind":"pin","particle":-1}"#,
            r#"{"kind":"pin","particle":1.5}"#,
            r#"{"kind":"pin","particle":4294967296}"#,
            r#"{"kind":"pin","particle":1,"id":-1}"#,
            r#"{"kind":"pin","particle":1,"id":"a"}"#,
            r#"{"kind":"pin","particle":1,"stroke":null}"#,
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
            r#"{"kind":"grab","particle":1,"target":[0,0]}"#,
            r#"{"kind":"grab","particle":1,"target":[0,0,"much"]}"#,
            r#"{"kind":"carry","object":"anchor","index":0,"offset":[0,0,"nan"]}"#,
            r#"{"kind":"brush","eye":[0,0,1],"ray":[0,0,1],"radius":1,"delta":[0,0,0],"over_s":0.1,"colour":2}"#,
            r#"{"kind":"set","parameter":"damping","value":true}"#,
        ] {
            assert!(FromPage::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn optional_fields_have_defaults() {
        let hello = Hello { protocol: 1, token: None, format: Choice::Auto, parts: false };
        let text = r#"{"type":"hello","protocol":1}"#;
        assert_eq!(FromPage::parse(text), Ok(FromPage::Hello(hello)));
        let action = Action::Move { particle: 3, target: [0.0; 3], over_s: 1.0 / 60.0 };
        let command = Command { id: Some(4), stroke: Some(5), kind: action.into() };
        let text = r#"{"id":4,"kind":"move","particle":3,"target":[0,0,0],"stroke":5}"#;
        assert_eq!(FromPage::parse(text), Ok(FromPage::Command(command)));
    }

    #[test]
    fn null_switches_a_parameter_off_but_a_missing_value_is_malformed() {
        let text = r#"{"kind":"set","parameter":"tear_force","value":null}"#;
        let command = Command::new(Action::set("tear_force", ParameterValue::Off));
        assert_eq!(FromPage::parse(text), Ok(FromPage::Command(command)));
        assert!(FromPage::parse(r#"{"kind":"set","parameter":"tear_force"}"#).is_err());
    }
}
