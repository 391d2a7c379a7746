//! The commands of clients: the actions of the node, and those of the bridge itself.

use serde::Deserialize;
use serde_json::{Map, Value};
use sim_contract::{ACTIONS, Action, GRAB_OVER_S_DEFAULT, NumberRange, Reason};
use thiserror::Error;

use super::refusal::Refusal;
use super::timeline::Toward;
use crate::limits::{CONSTRAINTS_PER_CUT_MAX, STEPS_AT_ONCE_MAX};

/// Time of a part of a brush stroke, in s.
const BRUSH_SECONDS: NumberRange = NumberRange::closed(1e-3, 0.25, "0.001 to 0.25");
/// Time between two poses of a carried object, in s.
const CARRY_SECONDS: NumberRange = NumberRange::closed(0.0, 0.25, "0 to 0.25");

/// A command of a client.
#[derive(Debug, Clone, PartialEq)]
pub struct Command {
    /// The client's number for the command. A command with a number is always answered.
    pub id: Option<u32>,
    /// Successive commands of one kind with the same number are undone together.
    pub stroke: Option<u32>,
    /// Kind of the command, with its fields.
    pub kind: CommandKind,
}

/// Kind of a command, with its fields.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
#[allow(missing_docs, reason = "PROTOCOL.md describes every field with its unit and range")]
pub enum CommandKind {
    /// An action of the node, in the form that it has everywhere.
    #[serde(skip)]
    Action(Action),
    Brush(Brush),
    CutConstraints {
        epoch: u32,
        constraints: Vec<u32>,
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
    Look {
        step: u64,
        #[serde(default)]
        toward: Toward,
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
    StepBack {
        count: u32,
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

/// A motion of the brush: a push of the particles near the pointer.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "PROTOCOL.md describes every field with its unit and range")]
pub struct Brush {
    pub eye: [f32; 3],
    pub ray: [f32; 3],
    pub radius: f32,
    pub delta: [f32; 3],
    pub over_s: f32,
    #[serde(default)]
    pub cap: Option<f32>,
}

/// Kind of object that a page can carry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ObjectKind {
    /// A collider of the scene.
    Collider,
    /// An anchor of the scene, with its particles.
    Anchor,
}

/// An object that a page can carry, by its index among its kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Object {
    /// A collider.
    Collider(u32),
    /// An anchor.
    Anchor(u32),
}

impl ObjectKind {
    /// Returns the object of this kind with an index.
    pub fn at(self, index: u32) -> Object {
        match self {
            Self::Collider => Object::Collider(index),
            Self::Anchor => Object::Anchor(index),
        }
    }
}

fn over_s_default() -> f32 {
    GRAB_OVER_S_DEFAULT
}

impl From<Action> for CommandKind {
    fn from(action: Action) -> Self {
        Self::Action(action)
    }
}

impl Command {
    /// A command without numbers.
    pub fn new(kind: impl Into<CommandKind>) -> Self {
        Self { id: None, stroke: None, kind: kind.into() }
    }

    /// Reads a message with a `kind`.
    pub(super) fn read(mut fields: Map<String, Value>) -> Result<Self, Malformed> {
        let mut number = |name| fields.remove(name).map(u32::deserialize).transpose();
        let (id, stroke) = (number("id")?, number("stroke")?);
        let info = ACTIONS.iter().find(|info| fields["kind"] == info.name);
        // The parser of actions ignores fields of an action that has none.
        if let Some(info) = info.filter(|info| info.fields.is_empty() && fields.len() > 1) {
            return Err(Malformed(format!("{} has no fields", info.name)));
        }
        let fields = Value::Object(fields);
        let kind = if info.is_some() {
            accept(Action::deserialize(fields)?)?.into()
        } else {
            CommandKind::deserialize(fields)?
        };
        Ok(Self { id, stroke, kind })
    }
}

/// The reason for which a text is not a message that the bridge accepts. It closes the connection of a page then: the
/// page is broken, or not ours.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct Malformed(pub(super) String);

impl From<serde_json::Error> for Malformed {
    fn from(error: serde_json::Error) -> Self {
        Self(error.to_string())
    }
}

impl Malformed {
    /// A command that clients of the bridge may not send.
    fn not_accepted(name: &str) -> Self {
        Self(format!("{name} is not accepted here"))
    }
}

/// Reads an action that a Foxglove client publishes: a JSON object. The error is for the user.
///
/// # Errors
/// The payload is not JSON, or not an action that clients may publish.
pub fn parse_published(payload: &[u8]) -> Result<Action, Malformed> {
    match accept(serde_json::from_slice(payload)?)? {
        action @ Action::Rewind { .. } => Err(Malformed::not_accepted(action.kind_name())),
        action => Ok(action),
    }
}

/// Refuses the actions that the bridge does not pass on for its clients.
fn accept(action: Action) -> Result<Action, Malformed> {
    match action {
        // A client of the bridge ends only its own grabs.
        Action::Release { force: true, .. } => Err(Malformed::not_accepted("release with force")),
        Action::Follow { .. } | Action::Restore { .. } | Action::Unknown { .. } => {
            Err(Malformed::not_accepted(action.kind_name()))
        }
        // No limit and an infinite one are the same.
        Action::Push { center, radius, delta, limit: Some(f32::INFINITY) } => {
            Ok(Action::Push { center, radius, delta, limit: None })
        }
        action => Ok(action),
    }
}

impl CommandKind {
    /// Name in messages.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Action(action) => action.kind_name(),
            Self::Brush(_) => "brush",
            Self::CutConstraints { .. } => "cut_constraints",
            Self::Lift { .. } => "lift",
            Self::Carry { .. } => "carry",
            Self::Throw { .. } => "throw",
            Self::Look { .. } => "look",
            Self::Undo { .. } => "undo",
            Self::Record {} => "record",
            Self::StopRecording {} => "stop_recording",
            Self::Seek { .. } => "seek",
            Self::StepBack { .. } => "step_back",
            Self::Ghost { .. } => "ghost",
            Self::Loop { .. } => "loop",
        }
    }

    /// Checks the numbers, before the command reaches the source.
    ///
    /// # Errors
    /// A number is not finite or out of its range, or a vector has no direction.
    pub fn check(&self) -> Result<(), Refusal> {
        self.check_numbers().map_err(|reason| match self {
            Self::Action(action) => Refusal::of_action(reason, action),
            _ => reason.into(),
        })
    }

    fn check_numbers(&self) -> Result<(), Reason> {
        match self {
            Self::Action(Action::Step { count }) | Self::StepBack { count } => {
                if (1..=STEPS_AT_ONCE_MAX).contains(count) {
                    Ok(())
                } else {
                    Err(Reason::OutOfRange)
                }
            }
            Self::Action(action) => action.validate(),
            Self::Brush(Brush { eye, ray, radius, delta, over_s, cap }) => {
                for vector in [eye, ray, delta] {
                    NumberRange::COORDINATE.check(vector)?;
                }
                NumberRange::LENGTH.check(&[*radius])?;
                BRUSH_SECONDS.check(&[*over_s])?;
                NumberRange::AT_LEAST_ZERO.check(cap.as_slice())?;
                if *ray == [0.0; 3] { Err(Reason::OutOfRange) } else { Ok(()) }
            }
            Self::CutConstraints { constraints, .. }
                if constraints.len() > CONSTRAINTS_PER_CUT_MAX =>
            {
                Err(Reason::OutOfRange)
            }
            Self::Carry { offset, over_s, .. } => {
                NumberRange::COORDINATE.check(offset)?;
                CARRY_SECONDS.check(&[*over_s])
            }
            Self::Throw { velocity, .. } => NumberRange::COORDINATE.check(velocity),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::FromPage;

    fn check_text(text: &str) -> Result<(), &'static str> {
        match FromPage::parse(text).unwrap() {
            FromPage::Command(command) => command.kind.check().map_err(Refusal::name),
            other => panic!("{other:?} is not a command"),
        }
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        for text in [
            r#"{"kind":"grab","particle":1,"target":[0,1e8,0]}"#,
            r#"{"kind":"brush","eye":[0,0,1],"ray":[0,0,0],"radius":1,"delta":[0,0,0],"over_s":0.1}"#,
            r#"{"kind":"brush","eye":[0,0,1],"ray":[0,0,1],"radius":-1,"delta":[0,0,0],"over_s":0.1}"#,
            r#"{"kind":"brush","eye":[0,0,1],"ray":[0,0,1],"radius":1,"delta":[0,0,0],"over_s":0}"#,
            r#"{"kind":"step","count":0}"#,
            r#"{"kind":"step","count":10001}"#,
            r#"{"kind":"step_back","count":10001}"#,
        ] {
            assert_eq!(check_text(text), Err("out_of_range"), "{text}");
        }
        let ids = vec!["1"; CONSTRAINTS_PER_CUT_MAX + 1].join(",");
        let cut = format!(r#"{{"kind":"cut_constraints","epoch":1,"constraints":[{ids}]}}"#);
        assert_eq!(check_text(&cut), Err("out_of_range"));
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused() {
        for text in [
            r#"{"kind":"grab","particle":1,"target":[0,1e39,0]}"#,
            r#"{"kind":"throw","object":"anchor","index":0,"velocity":[1e39,0,0]}"#,
        ] {
            assert_eq!(check_text(text), Err("non_finite"), "{text}");
        }
    }

    #[test]
    fn numbers_at_the_ends_of_their_ranges_are_allowed() {
        for text in [
            r#"{"kind":"brush","eye":[0,0,1],"ray":[0,0,-2],"radius":1,"delta":[0,0,0],"over_s":0.1,"cap":0}"#,
            r#"{"kind":"step","count":10000}"#,
            r#"{"kind":"step_back","count":10000}"#,
        ] {
            assert_eq!(check_text(text), Ok(()), "{text}");
        }
    }

    #[test]
    fn published_commands_are_actions() {
        let read = |text: &str| parse_published(text.as_bytes());
        assert_eq!(read(r#"{"kind":"pin","particle":3}"#), Ok(Action::Pin { particle: 3 }));
        let (center, delta) = ([0.0, 1.0, 2.0], [0.1, 0.0, 0.0]);
        let push = Action::Push { center, radius: 0.5, delta, limit: None };
        let text = r#"{"kind":"push","center":[0,1,2],"radius":0.5,"delta":[0.1,0,0]"#;
        assert_eq!(read(&format!("{text}}}")), Ok(push));
        assert_eq!(read(&format!(r#"{text},"limit":"inf"}}"#)), Ok(push));
        let refused = ["rewind", "follow", "restore", "unknown"];
        for action in Action::samples() {
            let text = serde_json::to_string(&action).unwrap();
            let (name, is_forced) = (action.kind_name(), text.contains("force\":true"));
            match read(&text) {
                Ok(accepted) => assert_eq!(accepted, action),
                Err(error) if is_forced => {
                    assert_eq!(error.to_string(), "release with force is not accepted here");
                }
                Err(error) => assert_eq!(error.to_string(), format!("{name} is not accepted here")),
            }
            assert_eq!(read(&text).is_err(), is_forced || refused.contains(&name), "{text}");
        }
    }

    #[test]
    fn other_published_messages_are_refused() {
        for text in ["", "[]", "{}", r#"{"kind":"dance"}"#, r#"{"kind":"pin"}"#] {
            assert!(parse_published(text.as_bytes()).is_err(), "{text}");
        }
    }

    #[test]
    fn a_page_may_rewind_but_not_release_the_grabs_of_others() {
        assert_eq!(check_text(r#"{"kind":"rewind","to_step":3}"#), Ok(()));
        for text in [
            r#"{"kind":"release","particle":3,"force":true}"#,
            r#"{"kind":"restore","contents":"state","state_hash":"0123456789abcdef"}"#,
        ] {
            assert!(FromPage::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_wrong_parameter_is_refused_with_its_range_or_its_new_name() {
        let refused = |name, value: f32| {
            CommandKind::Action(Action::set(name, value)).check().unwrap_err().text("set")
        };
        assert_eq!(refused("tear_force", -1.0), "tear_force accepts a number > 0");
        assert_eq!(refused("wind_drag", 1.0), "the parameter is now called wind.drag");
    }
}
