//! Reasons for which a command is not applied.

use std::borrow::Cow;

use serde::{Serialize, Serializer};
use sim_contract::{Action, Parameter, Parts, Reason};

use crate::limits::GRABS_PER_CLIENT_MAX;

/// The reason for which a command was not applied: the node's, or the bridge's own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// The node gave a reason.
    Node(Reason),
    /// The node refused a value of this parameter.
    OutsideRange(Parameter),
    /// The node refused a value or the block of this parameter.
    OutsideBlocks(Parameter),
    /// The node refused a collider for this parameter, which belongs to no collider.
    WithoutColliders(Parameter),
    /// This parameter has another name now.
    Renamed(Parameter),
    /// The node gave a reason that this version does not know.
    Unknown,
    /// No node runs.
    NoNode,
    /// The node did not answer in time.
    NoAnswer,
    /// Too many commands wait.
    Busy,
    /// No built-in scene has the name.
    UnknownScene,
    /// The page showed another load.
    StaleEpoch,
    /// The client grabs too many particles.
    TooManyGrabs,
    /// Only a live node accepts the command.
    OnlyLive,
    /// Only a recording accepts the command.
    OnlyReplay,
    /// The page has changed nothing that can be undone.
    NothingToUndo,
    /// Other clients have made this many changes since.
    ChangedByOthers(u32),
    /// Neither the node nor the bridge has kept the state.
    StateNotKept,
    /// The bridge does not know how to load the scene of the state.
    SceneNotKnown,
    /// The scene of the state has another content now.
    SceneChanged,
    /// The bridge has no folder for recordings.
    RecordingNotAllowed,
    /// A recording is being made.
    AlreadyRecording,
    /// No recording is being made.
    NotRecording,
    /// The folder has no recording of this name.
    UnknownRecording,
}

impl From<Reason> for Refusal {
    fn from(reason: Reason) -> Self {
        Self::Node(reason)
    }
}

impl Refusal {
    /// The reason for which the node refused an action.
    pub(crate) fn of_action(reason: Reason, action: &Action) -> Self {
        let Action::Set { parameter, block, collider, .. } = action else {
            return Self::Node(reason);
        };
        let renamed = Parameter::from_old_name(parameter.as_str());
        match (reason, Parameter::from_name(parameter.as_str()).or(renamed)) {
            (Reason::UnknownParameter, Some(parameter)) => Self::Renamed(parameter),
            (Reason::OutOfRange, Some(parameter))
                if collider.is_some() && parameter.info().parts != Parts::Colliders =>
            {
                Self::WithoutColliders(parameter)
            }
            (Reason::OutOfRange, Some(parameter)) if block.is_some() => {
                Self::OutsideBlocks(parameter)
            }
            (Reason::OutOfRange, Some(parameter)) => Self::OutsideRange(parameter),
            _ => Self::Node(reason),
        }
    }

    /// Name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Node(reason) => reason.name(),
            Self::OutsideRange(_) | Self::OutsideBlocks(_) | Self::WithoutColliders(_) => {
                Reason::OutOfRange.name()
            }
            Self::Renamed(_) => Reason::UnknownParameter.name(),
            Self::Unknown => "unknown",
            Self::NoNode => "no_node",
            Self::NoAnswer => "no_answer",
            Self::Busy => "busy",
            Self::UnknownScene => "unknown_scene",
            Self::StaleEpoch => "stale_epoch",
            Self::TooManyGrabs => "too_many_grabs",
            Self::OnlyLive => "only_live",
            Self::OnlyReplay => "only_replay",
            Self::NothingToUndo => "nothing_to_undo",
            Self::ChangedByOthers(_) => "changed_by_others",
            Self::StateNotKept => "state_not_kept",
            Self::SceneNotKnown => "scene_not_known",
            Self::SceneChanged => "scene_changed",
            Self::RecordingNotAllowed => "recording_not_allowed",
            Self::AlreadyRecording => "already_recording",
            Self::NotRecording => "not_recording",
            Self::UnknownRecording => "unknown_recording",
        }
    }

    /// Sentence for the user about a command of the type `kind`: the reason, and the remedy where one is
    /// known.
    pub fn text(self, kind: &str) -> Cow<'static, str> {
        let text = match self {
            Self::Node(reason) => return reason_text(reason, kind),
            Self::OutsideRange(parameter) => {
                let info = parameter.info();
                return format!("{} accepts {}", info.name, info.range.text).into();
            }
            Self::OutsideBlocks(Parameter::Bending) => {
                let info = Parameter::Bending.info();
                let name = info.name;
                let range = info.range.text;
                return format!("{name} of a block accepts {range}, for a shape with bends").into();
            }
            Self::OutsideBlocks(parameter) => {
                return format!("{} has no values for blocks", parameter.name()).into();
            }
            Self::WithoutColliders(parameter) => {
                return format!("{} has no values for colliders", parameter.name()).into();
            }
            Self::Renamed(parameter) => {
                return format!("the parameter is now called {}", parameter.name()).into();
            }
            Self::Unknown => "the node gave an unknown reason",
            Self::NoNode => "no node is running; start one with `sim-node run`",
            Self::NoAnswer => "the node did not answer; the command may still take effect",
            Self::Busy => "too many commands are waiting; try again",
            Self::UnknownScene => {
                "there is no built-in scene of this name; `sim-node scenes` lists them"
            }
            Self::StaleEpoch => "another scene was loaded in the meantime",
            Self::TooManyGrabs => {
                return format!("you have already grabbed {GRABS_PER_CLIENT_MAX} particles").into();
            }
            Self::OnlyLive => "a recording cannot be changed",
            Self::OnlyReplay => "only a recording can do this",
            Self::NothingToUndo => {
                "this page has not cut, reset, loaded or gone back anything that it could undo"
            }
            Self::ChangedByOthers(count) => {
                let s = if count == 1 { "" } else { "s" };
                return format!(
                    "others have made {count} change{s} since, and this would undo them as well"
                )
                .into();
            }
            Self::StateNotKept => {
                "the state before it is no longer kept; `sim-node run --history` keeps more"
            }
            Self::SceneNotKnown => {
                "the scene before it came from a file that this viewer does not know; start the \
                 viewer with `--scene FILE`"
            }
            Self::SceneChanged => {
                "the file of the scene has changed since, so the state before it does not fit"
            }
            Self::RecordingNotAllowed => {
                "other machines can reach this viewer, so it records only into a folder that it was \
                 given: start it with `viewer-bridge --recordings DIR`"
            }
            Self::AlreadyRecording => "a recording is being made already; stop it first",
            Self::NotRecording => "no recording is being made",
            Self::UnknownRecording => {
                "there is no such recording; load the page again to see those of the folder"
            }
        };
        text.into()
    }
}

/// Explains a reason of the node. The node gives the same reason for different commands.
fn reason_text(reason: Reason, kind: &str) -> Cow<'static, str> {
    let text = match (reason, kind) {
        (Reason::NoEffectHere, "load") => {
            "the scene needs more shared memory than is free; end other programs that use it, or \
             load a smaller scene (the messages of the node have the figures)"
        }
        (Reason::OutOfRange, "load") => {
            "the node cannot run the scene with its options --rate and --substeps; start it \
             without them (the messages of the node have the details)"
        }
        (Reason::NoEffectHere, "step") => "the simulation is running; pause it first",
        (Reason::NoEffectHere, "set") => {
            "the scene has nothing that it applies to: stiffness belongs to the method pbd, \
             compliance to xpbd, and bending to scenes with bends"
        }
        (Reason::NoEffectHere, "grab" | "move" | "release" | "pin" | "unpin" | "brush") => {
            "the particle is frozen, because its state was no longer finite; reset restores it"
        }
        (Reason::NoEffectHere, "rewind") => {
            "the node keeps no past states; start it without --history 0"
        }
        (Reason::UnknownStep, "rewind") => {
            "the node no longer keeps a state this old, or another scene was loaded since; \
             `sim-node run --history` keeps more"
        }
        (Reason::UnknownStep, "look") => {
            "no past state is kept yet; the viewer keeps those that a page has shown"
        }
        (Reason::GrabbedByOther, "lift") => {
            "another page carries it, or clients hold all particles of the anchor; it is free once they \
             release it"
        }
        (Reason::GrabbedByOther, _) => {
            "another client has grabbed the particle; it is free once that client releases it"
        }
        _ => return reason.to_string().into(),
    };
    text.into()
}

impl Serialize for Refusal {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use sim_contract::{ParameterValue, Text};

    use super::*;

    #[test]
    fn the_text_belongs_to_the_command_and_names_a_remedy() {
        let reason = Refusal::Node(Reason::NoEffectHere);
        for (kind, remedy) in
            [("load", "end other programs"), ("step", "pause it first"), ("pin", "reset restores")]
        {
            let text = reason.text(kind);
            assert!(text.contains(remedy), "{kind}: {text}");
        }
        let load = Refusal::Node(Reason::OutOfRange).text("load");
        assert!(load.contains("--rate") && load.contains("without them"), "{load}");
        assert_eq!(
            Refusal::OutsideRange(Parameter::TearForce).text("set"),
            "tear_force accepts a number > 0"
        );
        let refused = |name: &str, block, collider| {
            let (parameter, value) = (Text::cut(name), ParameterValue::Number(1.0));
            let set = Action::Set { parameter, value, constraint_kind: None, block, collider };
            Refusal::of_action(Reason::OutOfRange, &set).text("set")
        };
        assert_eq!(
            refused("bending", Some(7), None),
            "bending of a block accepts a number >= 0, for a shape with bends"
        );
        assert_eq!(refused("damping", Some(7), None), "damping has no values for blocks");
        assert_eq!(refused("bending", None, Some(7)), "bending has no values for colliders");
        assert_eq!(refused("restitution", None, Some(0)), "restitution accepts 0 to 1");
        let set = Action::set("contact", ParameterValue::Off);
        let renamed = Refusal::of_action(Reason::UnknownParameter, &set);
        assert_eq!(renamed.text("set"), "the parameter is now called contact.thickness");
        assert!(Refusal::UnknownScene.text("load").contains("sim-node scenes"));
    }
}
