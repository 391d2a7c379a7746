//! From the bytes of a record to a message of a recording.

use mcap::records::MessageHeader;
use serde::de::DeserializeOwned;
use sim_messages::ParticleState;

use crate::log::encoding::{decode_keyframe, decode_particles};
use crate::log::message::Message;
use crate::log::run::RunDescription;
use crate::log::scanner::limits::SizeLimits;
use crate::log::topic::Topic;

/// A message with its times in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct LoggedMessage {
    /// The content.
    pub message: Message,
    /// Low 32 bits of the step.
    pub sequence: u32,
    /// Wall clock of the reception, in nanoseconds since 1970.
    pub log_time_ns: u64,
    /// Wall clock of the step, in nanoseconds since 1970.
    pub publish_time_ns: u64,
}

impl LoggedMessage {
    /// Returns the approximate memory use, in bytes.
    pub(in crate::log) fn size_bytes(&self) -> usize {
        size_of::<Self>() - size_of::<Message>() + self.message.size_bytes()
    }
}

/// Decodes the messages of a recording.
#[derive(Debug)]
pub(in crate::log) struct MessageDecoder<'a> {
    pub(in crate::log) run: &'a RunDescription,
    pub(in crate::log) limits: &'a SizeLimits,
    /// Memory for the particles of the next messages.
    pub(in crate::log) spare: &'a mut Vec<Vec<ParticleState>>,
}

impl MessageDecoder<'_> {
    /// Decodes a message. Returns `None` for `/tf`, which no reader of ours needs. `Err` describes the
    /// error in the content.
    pub(in crate::log) fn decode(
        &mut self,
        topic: Topic,
        header: &MessageHeader,
        data: &[u8],
    ) -> Result<Option<LoggedMessage>, String> {
        let size_bytes_max = self.limits.message_size_bytes_max(topic);
        if data.len() as u64 > size_bytes_max {
            return Err(format!(
                "it has {} bytes (allowed: up to {size_bytes_max} for its scene)",
                data.len()
            ));
        }
        let message = match topic {
            Topic::Tf => return Ok(None),
            Topic::Topology => Message::Topology(row(data)?),
            Topic::Surface => Message::Surface(row(data)?),
            Topic::Colliders => Message::Colliders(row(data)?),
            Topic::Tears => Message::Tears(row(data)?),
            Topic::Parameters => Message::Parameters(row(data)?),
            Topic::Forces => Message::Forces(row(data)?),
            Topic::Outcomes => Message::Outcome(row(data)?),
            Topic::Status => Message::Status(row(data)?),
            Topic::Events => Message::Event(row(data)?),
            Topic::Steps => Message::Step(row(data)?),
            Topic::Keyframe => {
                let (step, bytes) = decode_keyframe(data)?;
                Message::Keyframe { step, bytes }
            }
            Topic::Particles => {
                let step = self.run.step_at(header.publish_time);
                let step = step.ok_or("its time is not the time of a step")?;
                let mut particles = self.spare.pop().unwrap_or_default();
                decode_particles(data, &mut particles)?;
                Message::Particles { step, particles }
            }
        };
        Ok(Some(LoggedMessage {
            message,
            sequence: header.sequence,
            log_time_ns: header.log_time,
            publish_time_ns: header.publish_time,
        }))
    }
}

fn row<T: DeserializeOwned>(data: &[u8]) -> Result<T, String> {
    serde_json::from_slice(data).map_err(|error| without_type_names(&error.to_string()))
}

/// Removes the names of internal types from an error of serde.
fn without_type_names(error: &str) -> String {
    if error.contains("variant") {
        return "a field is missing or has the wrong type".to_owned();
    }
    let mut text = String::new();
    let mut words = error.split(' ');
    while let Some(word) = words.next() {
        if !text.is_empty() {
            text.push(' ');
        }
        text.push_str(match word {
            "struct" => {
                // The next word is the name of the type.
                words.next();
                "an object"
            }
            "u32" | "u64" => "a whole number",
            "f32" | "f64" => "a number",
            _ => word,
        });
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::rows::{OutcomeRow, StepRow, TopologyRow};

    #[test]
    fn errors_do_not_name_internal_types() {
        let errors = [
            row::<StepRow>(b"7").unwrap_err(),
            row::<StepRow>(b"{\"step\":\"x\"}").unwrap_err(),
            row::<StepRow>(b"{").unwrap_err(),
            row::<TopologyRow>(b"[]").unwrap_err(),
            row::<TopologyRow>(
                br#"{"step":0,"revision":0,"a":[],"b":[],"rest_length":[],"kind":[],"torn":[]}"#,
            )
            .unwrap_err(),
            row::<OutcomeRow>(
                br#"{"step":1,"client_id":1,"sequence":1,"index":0,"kind":"set","parameter":"x","value":{},"status":"","reason":""}"#,
            )
            .unwrap_err(),
        ];
        insta::assert_snapshot!(errors.join("\n"), @r#"
        invalid type: integer `7`, expected an object at line 1 column 1
        invalid type: string "x", expected a whole number at line 1 column 11
        EOF while parsing an object at line 1 column 1
        invalid length 0, expected an object with 10 elements at line 1 column 2
        expected one column: compliance or stiffness
        expected a number, three numbers or null at line 1 column 111
        "#);
    }
}
