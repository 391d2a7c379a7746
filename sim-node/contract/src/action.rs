//! What a client asks of a node.

use serde::{Deserialize, Serialize};

use crate::plain_number::{number, optional_number, rotation, vector};
use crate::{SettingKind, SettingValue, Text};

/// Seconds that a grabbed particle takes to its target unless told: one frame of a 60 Hz display.
pub const GRAB_OVER_S_DEFAULT: f32 = 1.0 / 60.0;

/// The client that every `sim-node ctl` speaks for: what one call grabs, a later call releases.
pub const CONSOLE_CLIENT_ID: u64 = 0;

/// Something to do at the boundary before a step. Its JSON form is a flat object with "kind".
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Action {
    /// Holds a particle where it stands.
    Pin {
        /// Index of the particle.
        particle: u32,
    },
    /// Frees a pinned particle, from rest.
    Unpin {
        /// Index of the particle.
        particle: u32,
    },
    /// Drives a particle to a target, linearly.
    Grab {
        /// Index of the particle.
        particle: u32,
        /// Where to, in m, relative to the scene's origin.
        #[serde(with = "vector")]
        target: [f32; 3],
        /// Seconds to get there, 0..=0.25, rounded up to whole steps.
        #[serde(with = "number", default = "grab_over_s_default")]
        over_s: f32,
    },
    /// Gives a particle that this client grabbed a new target.
    Move {
        /// Index of the particle.
        particle: u32,
        /// Where to, in m, relative to the scene's origin.
        #[serde(with = "vector")]
        target: [f32; 3],
        /// Seconds to get there, 0..=0.25, rounded up to whole steps.
        #[serde(with = "number", default = "grab_over_s_default")]
        over_s: f32,
    },
    /// Lets a grabbed particle go, with the velocity of its last motion.
    Release {
        /// Index of the particle.
        particle: u32,
    },
    /// Stops the node at this boundary.
    Pause,
    /// Lets a paused node go on.
    Resume,
    /// Lets a paused node make that many steps.
    Step {
        /// Steps to make, at least 1.
        count: u32,
    },
    /// Makes the next step's state the initial one; the step number goes on.
    Reset,
    /// Gives every free particle within a ball a new velocity: `delta` times the rate.
    Push {
        /// Centre of the ball, in m, relative to the scene's origin.
        #[serde(with = "vector")]
        center: [f32; 3],
        /// Radius of the ball in m; a particle at this distance is outside.
        #[serde(with = "number")]
        radius: f32,
        /// How far the particles go in the next step, in m.
        #[serde(with = "vector")]
        delta: [f32; 3],
        /// Most of each component of `delta`, in m; without it none is too much.
        #[serde(default, with = "optional_number", skip_serializing_if = "Option::is_none")]
        limit: Option<f32>,
    },
    /// Tears a constraint.
    Cut {
        /// Index of the constraint.
        constraint: u32,
    },
    /// Tears every constraint that has an end within a ball.
    CutRadius {
        /// Centre of the ball, in m, relative to the scene's origin.
        #[serde(with = "vector")]
        center: [f32; 3],
        /// Radius of the ball in m; an end at this distance is outside.
        #[serde(with = "number")]
        radius: f32,
    },
    /// Tears every constraint that crosses a strip: the segment, extended both ways.
    CutSegment {
        /// Begin of the segment, in m, relative to the scene's origin.
        #[serde(with = "vector")]
        from: [f32; 3],
        /// End of the segment, in m, relative to the scene's origin.
        #[serde(with = "vector")]
        to: [f32; 3],
        /// Direction in which the segment is extended without end; [0, 0, 1] in the plane.
        #[serde(with = "vector")]
        direction: [f32; 3],
    },
    /// Replaces an anchor's path: it stands in this pose from the end of the next step on.
    MoveAnchor {
        /// Index of the anchor.
        anchor: u32,
        /// In m, from its pose at load.
        #[serde(with = "vector")]
        translation: [f32; 3],
        /// Quaternion x, y, z, w.
        #[serde(default = "identity", with = "rotation")]
        rotation: [f32; 4],
    },
    /// Moves a collider within the next step, with the velocity that this implies.
    MoveCollider {
        /// Index of the collider.
        collider: u32,
        /// In m, from its pose at load.
        #[serde(with = "vector")]
        translation: [f32; 3],
        /// Quaternion x, y, z, w.
        #[serde(default = "identity", with = "rotation")]
        rotation: [f32; 4],
    },
    /// Gives a parameter of the simulation a new value.
    Set {
        /// Name of the parameter; one that the solver does not know is rejected.
        parameter: Text,
        /// Its value, which must be given: null in JSON is off.
        value: SettingValue,
        /// Which constraints it is for, where it is a parameter of constraints; without it all.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        constraint_kind: Option<SettingKind>,
    },
    /// Replaces the scene by another one.
    Load {
        /// Name of a built-in scene, or a file of the node's host.
        scene: Text,
    },
    /// What this version does not know, by its number on the wire. Always rejected.
    Unknown {
        /// [`crate::Command::kind`] as it came.
        number: u32,
    },
}

fn grab_over_s_default() -> f32 {
    GRAB_OVER_S_DEFAULT
}

/// No rotation.
fn identity() -> [f32; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::ConstraintKind;

    /// One of each kind, and those with options more than once.
    pub(crate) fn all_actions() -> Vec<Action> {
        let target = [0.1, -2.0, 3.5];
        let other = [0.0, -0.0, 1e-9];
        let rotation = [0.0, 0.6, 0.0, 0.8];
        vec![
            Action::Pin { particle: 3 },
            Action::Unpin { particle: 4 },
            Action::Grab { particle: 5, target, over_s: 0.1 },
            Action::Move { particle: 5, target, over_s: 0.0 },
            Action::Release { particle: 5 },
            Action::Pause,
            Action::Resume,
            Action::Step { count: 7 },
            Action::Reset,
            Action::Push { center: target, radius: 0.5, delta: other, limit: None },
            Action::Push { center: target, radius: 0.5, delta: other, limit: Some(0.0) },
            Action::Cut { constraint: 6 },
            Action::CutRadius { center: target, radius: 0.25 },
            Action::CutSegment { from: target, to: other, direction: [0.0, 0.0, 1.0] },
            Action::MoveAnchor { anchor: 1, translation: target, rotation },
            Action::MoveCollider { collider: 2, translation: target, rotation: identity() },
            set("damping", SettingValue::Number(0.5), None),
            set("gravity", SettingValue::Vector(target), None),
            set("tear_force", SettingValue::Off, None),
            set(
                "compliance",
                SettingValue::Number(0.0),
                Some(SettingKind::Known(ConstraintKind::Structural)),
            ),
            set("stiffness", SettingValue::Number(1.0), Some(SettingKind::Unknown)),
            Action::Load { scene: Text::new("./gemütlich.toml") },
            Action::Unknown { number: 99 },
        ]
    }

    fn set(name: &str, value: SettingValue, constraint_kind: Option<SettingKind>) -> Action {
        Action::Set { parameter: Text::new(name), value, constraint_kind }
    }

    fn read(text: &str) -> Action {
        serde_json::from_str(text).unwrap_or_else(|error| panic!("{text}: {error}"))
    }

    #[test]
    fn every_action_survives_json() {
        for action in all_actions() {
            let text = serde_json::to_string(&action).unwrap();
            assert_eq!(read(&text), action, "{text}");
        }
    }

    #[test]
    fn the_json_of_each_kind_is_frozen() {
        let lines: Vec<_> =
            all_actions().iter().map(|action| serde_json::to_string(action).unwrap()).collect();
        insta::assert_snapshot!(lines.join("\n"));
    }

    #[test]
    fn non_finite_numbers_are_strings_in_json() {
        let target = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
        let action = Action::Grab { particle: 1, target, over_s: 0.1 };
        let text = serde_json::to_string(&action).unwrap();
        assert_eq!(
            text,
            r#"{"kind":"grab","particle":1,"target":["nan","inf","-inf"],"over_s":0.1}"#
        );
        let Action::Grab { target, .. } = read(&text) else {
            panic!("not a grab: {text}");
        };
        assert!(target[0].is_nan());
        assert_eq!(target[1..], [f32::INFINITY, f32::NEG_INFINITY]);
    }

    #[test]
    fn non_finite_settings_and_limits_are_strings_in_json() {
        let text = r#"{"kind":"set","parameter":"tear_force","value":"inf"}"#;
        assert_eq!(read(text), set("tear_force", SettingValue::Number(f32::INFINITY), None));
        assert_eq!(serde_json::to_string(&read(text)).unwrap(), text);
        let text = r#"{"kind":"set","parameter":"gravity","value":[0,"-inf","nan"]}"#;
        let Action::Set { value: SettingValue::Vector(value), .. } = read(text) else {
            panic!("no vector: {text}");
        };
        assert!(value[1] == f32::NEG_INFINITY && value[2].is_nan());
        let text = r#"{"kind":"push","center":[0,0,0],"radius":1,"delta":[0,0,0],"limit":"inf"}"#;
        assert!(matches!(read(text), Action::Push { limit: Some(f32::INFINITY), .. }));
    }

    #[test]
    fn what_is_optional_has_a_default() {
        let grab = Action::Grab { particle: 1, target: [0., 1., 2.], over_s: GRAB_OVER_S_DEFAULT };
        assert_eq!(read(r#"{"kind":"grab","particle":1,"target":[0,1,2]}"#), grab);
        let push = r#"{"kind":"push","center":[0,0,0],"radius":1,"delta":[0,0,0]}"#;
        assert!(matches!(read(push), Action::Push { limit: None, .. }));
        let moved = r#"{"kind":"move_anchor","anchor":1,"translation":[0,0,0]}"#;
        assert!(matches!(read(moved), Action::MoveAnchor { rotation: [0., 0., 0., 1.], .. }));
        let moved = r#"{"kind":"move_collider","collider":1,"translation":[0,0,0]}"#;
        assert!(matches!(read(moved), Action::MoveCollider { rotation: [0., 0., 0., 1.], .. }));
    }

    #[test]
    fn null_switches_a_parameter_off_but_no_value_is_an_error() {
        let text = r#"{"kind":"set","parameter":"tear_force","value":null}"#;
        assert_eq!(read(text), set("tear_force", SettingValue::Off, None));
        let missing = r#"{"kind":"set","parameter":"tear_force"}"#;
        let error = serde_json::from_str::<Action>(missing).unwrap_err().to_string();
        assert!(error.contains("missing field `value`"), "{error}");
    }

    #[test]
    fn an_unknown_kind_of_constraints_is_kept_as_unknown() {
        let text = r#"{"kind":"set","parameter":"compliance","value":1,"constraint_kind":"knot"}"#;
        let action = read(text);
        assert_eq!(
            action,
            set("compliance", SettingValue::Number(1.0), Some(SettingKind::Unknown))
        );
        let text = serde_json::to_string(&action).unwrap();
        assert!(text.ends_with(r#""constraint_kind":"unknown"}"#), "{text}");
    }

    #[test]
    fn a_wrong_field_or_kind_is_an_error() {
        for text in [
            r#"{"kind":"pin","particle":1,"colour":2}"#,
            r#"{"kind":"dance"}"#,
            r#"{"kind":"pin"}"#,
            r#"{"kind":"pin","particle":-1}"#,
            r#"{"kind":"cut","particle":1}"#,
            r#"{"kind":"cut_radius","center":[0,0,0]}"#,
            r#"{"kind":"cut_segment","from":[0,0,0],"to":[0,0,1]}"#,
            r#"{"kind":"push","center":[0,0,0],"radius":1,"delta":[0,0,0],"limit":"much"}"#,
            r#"{"kind":"move_anchor","anchor":1,"translation":[0,0,0],"rotation":[0,0,1]}"#,
            r#"{"kind":"set","parameter":"gravity","value":[0,1]}"#,
            r#"{"kind":"set","parameter":"gravity","value":"much"}"#,
            r#"{"kind":"set","parameter":"gravity","value":true}"#,
            r#"{"kind":"set","value":1}"#,
            r#"{"kind":"load"}"#,
        ] {
            assert!(serde_json::from_str::<Action>(text).is_err(), "{text}");
        }
    }
}
