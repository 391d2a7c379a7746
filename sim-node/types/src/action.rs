//! The actions that clients ask a node to perform.

mod allowed_values;
mod fields;
mod kind_filter;

use serde::{Deserialize, Serialize};

use crate::json::hash;
use crate::json::non_finite::{number, optional_number, rotation, vector};
use crate::parameter::ParameterValue;
use crate::path_part::{PathError, PathPart, PathPoint, check_path};
use crate::text::Text;

pub use fields::ActionFields;
pub use kind_filter::KindFilter;
use kind_filter::kind_or_all;

/// Default time in which a grabbed particle reaches its target, in seconds: one frame at 60 Hz.
pub const GRAB_OVER_S_DEFAULT: f32 = 1.0 / 60.0;

/// An action at the boundary before a step. Its JSON form is a flat object with "kind".
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Action {
    /// Holds a particle in place.
    Pin {
        /// Index of the particle.
        particle: u32,
    },
    /// Frees a pinned particle. Its velocity is 0.
    Unpin {
        /// Index of the particle.
        particle: u32,
    },
    /// Grabs a particle and moves it along a straight line to a target.
    Grab {
        /// Index of the particle.
        particle: u32,
        /// Target in m, relative to the scene's origin.
        #[serde(with = "vector")]
        target: [f32; 3],
        /// Time to the target in seconds, 0..=3600, rounded up to whole steps.
        #[serde(with = "number", default = "grab_over_s_default")]
        over_s: f32,
    },
    /// Sets a new target for a particle that this client has grabbed.
    Move {
        /// Index of the particle.
        particle: u32,
        /// Target in m, relative to the scene's origin.
        #[serde(with = "vector")]
        target: [f32; 3],
        /// Time to the target in seconds, 0..=3600, rounded up to whole steps.
        #[serde(with = "number", default = "grab_over_s_default")]
        over_s: f32,
    },
    /// Releases a grabbed particle with the velocity of its last motion.
    Release {
        /// Index of the particle.
        particle: u32,
        /// Releases the grab of any client, not only one of this client.
        #[serde(default, skip_serializing_if = "is_false")]
        force: bool,
    },
    /// Pauses the node at this boundary.
    Pause,
    /// Resumes a paused node.
    Resume,
    /// Makes a paused node perform `count` steps.
    Step {
        /// Number of steps, 1 or more.
        count: u32,
    },
    /// Restores the initial state as the state of the next step. The step number continues.
    Reset,
    /// Sets the velocity of each free particle inside a sphere to `delta` times the rate.
    Push {
        /// Center of the sphere in m, relative to the scene's origin.
        #[serde(with = "vector")]
        center: [f32; 3],
        /// Radius of the sphere in m. A particle at exactly this distance is outside.
        #[serde(with = "number")]
        radius: f32,
        /// Displacement of the particles in the next step, in m.
        #[serde(with = "vector")]
        delta: [f32; 3],
        /// Largest magnitude of each component of `delta` in m. `None` means no limit.
        #[serde(default, with = "optional_number", skip_serializing_if = "Option::is_none")]
        limit: Option<f32>,
    },
    /// Tears a constraint.
    Cut {
        /// Index of the constraint.
        constraint: u32,
    },
    /// Tears every constraint with an end inside a sphere.
    CutRadius {
        /// Center of the sphere in m, relative to the scene's origin.
        #[serde(with = "vector")]
        center: [f32; 3],
        /// Radius of the sphere in m. An end at exactly this distance is outside.
        #[serde(with = "number")]
        radius: f32,
    },
    /// Tears every constraint that crosses a strip: a segment extended to both sides.
    CutSegment {
        /// Start of the segment in m, relative to the scene's origin.
        #[serde(with = "vector")]
        from: [f32; 3],
        /// End of the segment in m, relative to the scene's origin.
        #[serde(with = "vector")]
        to: [f32; 3],
        /// Direction in which the segment extends to both sides without limit; [0, 0, 1] for a planar
        /// scene.
        #[serde(with = "vector")]
        direction: [f32; 3],
    },
    /// Replaces an anchor's path. The anchor reaches this pose within `over_s` and stays.
    MoveAnchor {
        /// Index of the anchor.
        anchor: u32,
        /// Translation in m, relative to the pose at load.
        #[serde(with = "vector")]
        translation: [f32; 3],
        /// Rotation relative to the pose at load, as the quaternion x, y, z, w.
        #[serde(default = "identity", with = "rotation")]
        rotation: [f32; 4],
        /// Time to the pose in seconds, 0..=3600, rounded up to whole steps, at least one.
        #[serde(default, with = "number", skip_serializing_if = "is_zero")]
        over_s: f32,
    },
    /// Moves a collider to a pose within `over_s`, with the velocity that the motion implies.
    MoveCollider {
        /// Index of the collider.
        collider: u32,
        /// Translation in m, relative to the pose at load.
        #[serde(with = "vector")]
        translation: [f32; 3],
        /// Rotation relative to the pose at load, as the quaternion x, y, z, w.
        #[serde(default = "identity", with = "rotation")]
        rotation: [f32; 4],
        /// Time to the pose in seconds, 0..=3600, rounded up to whole steps, at least one.
        #[serde(default, with = "number", skip_serializing_if = "is_zero")]
        over_s: f32,
    },
    /// Sets a parameter of the simulation.
    Set {
        /// Name of the parameter. An unknown name is rejected.
        parameter: Text,
        /// New value. null in JSON means off.
        value: ParameterValue,
        /// Kind of the affected constraints, for `compliance` and `stiffness`. `None` means all kinds.
        #[serde(
            default,
            deserialize_with = "kind_or_all",
            skip_serializing_if = "Option::is_none"
        )]
        constraint_kind: Option<KindFilter>,
        /// Index of the generated block of the affected bends, for `bending`. `None` means all bends.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        block: Option<u32>,
        /// Index of the affected collider, for `friction` and `restitution`. `None` means all colliders.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        collider: Option<u32>,
    },
    /// Replaces the scene.
    Load {
        /// Name of a built-in scene, or path of a file on the node's host.
        scene: Text,
    },
    /// Puts an earlier state of this run in place: the nearest kept one at or before the target. Exactly
    /// one of the fields is present; the outcome has `to_step`, the step of the state.
    Rewind {
        /// Step of the run.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        to_step: Option<u64>,
        /// Number of steps back on the way to the current state. Steps that a rewind has left behind do
        /// not count.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        back_steps: Option<u32>,
    },
    /// Puts a given state in place. The state comes through a service of its own, so that a command
    /// alone is rejected.
    Restore {
        /// Part of the state that was given.
        contents: RestoreContents,
        /// Hash of the state in place.
        #[serde(with = "hash")]
        state_hash: u64,
    },
    /// Marks the step in the log. Changes nothing else.
    Mark {
        /// Text for people and for programs that read the log. Empty text is rejected.
        text: Text,
    },
    /// Moves a body through the next step, by its mass and inertia, with impulses from the particles that it
    /// meets. After the step it stands where it came.
    DriveBody {
        /// Index of the collider that is the body.
        collider: u32,
        /// Translation at the start of the step in m, relative to the pose at load.
        #[serde(with = "vector")]
        translation: [f32; 3],
        /// Rotation at the start of the step relative to the pose at load, as the quaternion x, y, z, w.
        #[serde(default = "identity", with = "rotation")]
        rotation: [f32; 4],
        /// Velocity of its center at the start of the step in m/s.
        #[serde(default, with = "vector")]
        velocity: [f32; 3],
        /// Angular velocity at the start of the step in rad/s.
        #[serde(default, with = "vector")]
        angular_velocity: [f32; 3],
        /// Force on its center in N, beside gravity and the contacts.
        #[serde(default, with = "vector")]
        force: [f32; 3],
        /// Torque about its center in N m, beside that of the contacts.
        #[serde(default, with = "vector")]
        torque: [f32; 3],
    },
    /// Leads a particle that this client has grabbed, an anchor or a collider along points in time. It moves linearly
    /// between them, and stays at the last one.
    Follow {
        /// Kind of the object.
        object: MovedObject,
        /// Index of the particle, anchor or collider.
        object_index: u32,
        /// The points. Their times ascend.
        path: PathPart,
        /// Appends the points to the motion that an earlier command began, and whose times go on.
        #[serde(default, skip_serializing_if = "is_false")]
        append: bool,
    },
    /// A kind that this version does not know. Always rejected.
    Unknown {
        /// Number of the kind on the wire. The number of a known kind becomes `u32::MAX` there, which
        /// no version will assign, so that an unknown action never becomes a known one.
        number: u32,
    },
}

impl Action {
    /// Name of the kind, as in the JSON form.
    pub fn kind_name(&self) -> &'static str {
        match self {
            Self::Pin { .. } => "pin",
            Self::Unpin { .. } => "unpin",
            Self::Grab { .. } => "grab",
            Self::Move { .. } => "move",
            Self::Release { .. } => "release",
            Self::Pause => "pause",
            Self::Resume => "resume",
            Self::Step { .. } => "step",
            Self::Reset => "reset",
            Self::Push { .. } => "push",
            Self::Cut { .. } => "cut",
            Self::CutRadius { .. } => "cut_radius",
            Self::CutSegment { .. } => "cut_segment",
            Self::MoveAnchor { .. } => "move_anchor",
            Self::MoveCollider { .. } => "move_collider",
            Self::Set { .. } => "set",
            Self::Load { .. } => "load",
            Self::Rewind { .. } => "rewind",
            Self::Restore { .. } => "restore",
            Self::Mark { .. } => "mark",
            Self::DriveBody { .. } => "drive_body",
            Self::Follow { .. } => "follow",
            Self::Unknown { .. } => "unknown",
        }
    }
}

fn grab_over_s_default() -> f32 {
    GRAB_OVER_S_DEFAULT
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_false(value: &bool) -> bool {
    !value
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_zero(value: &f32) -> bool {
    value.to_bits() == 0
}

/// No rotation.
fn identity() -> [f32; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

/// Object that an [`Action::Follow`] moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MovedObject {
    /// A particle that the client has grabbed.
    Particle,
    /// An anchor.
    Anchor,
    /// A collider.
    Collider,
}

/// Part of a state that a restore puts in place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u32)]
pub enum RestoreContents {
    /// The complete state: particles and keyframe.
    State = 1,
    /// Positions and velocities. Everything else stays.
    Motion = 2,
}

impl RestoreContents {
    /// Returns the contents with this number on the wire.
    pub fn from_number(number: u32) -> Option<Self> {
        [Self::State, Self::Motion].into_iter().find(|contents| *contents as u32 == number)
    }
}

impl Action {
    /// The commands that lead an object along points: the first one begins the motion, unless it is to be appended, and
    /// the others append to it.
    ///
    /// # Errors
    /// There are no points or more than [`crate::MOTION_POINTS_MAX`], a number is not finite, or the times do not ascend
    /// from 0 to [`crate::OVER_S_MAX`].
    pub fn follow(
        object: MovedObject,
        object_index: u32,
        points: &[PathPoint],
        append: bool,
    ) -> Result<Vec<Self>, PathError> {
        check_path(points)?;
        let parts = points.chunks(PathPart::POINTS_MAX).filter_map(PathPart::new).enumerate();
        let part = |(index, path)| Self::Follow {
            object,
            object_index,
            path,
            append: append || index > 0,
        };
        Ok(parts.map(part).collect())
    }

    /// Samples for tests of formats: one action of each kind, or several if it has options.
    #[doc(hidden)]
    #[allow(clippy::too_many_lines, reason = "a sample of each action")]
    pub fn samples() -> Vec<Self> {
        use crate::constraint_kind::ConstraintKind;

        let target = [0.1, -2.0, 3.5];
        let delta = [0.0, -0.0, 1e-9];
        let rotation = [0.0, 0.6, 0.0, 0.8];
        let set = |name: &str, value, constraint_kind| Self::Set {
            parameter: Text::cut(name),
            value,
            constraint_kind,
            block: None,
            collider: None,
        };
        let structural = KindFilter::Known(ConstraintKind::Structural);
        vec![
            Self::Pin { particle: 3 },
            Self::Unpin { particle: 4 },
            Self::Grab { particle: 5, target, over_s: 0.1 },
            Self::Move { particle: 5, target, over_s: 0.0 },
            Self::Release { particle: 5, force: false },
            Self::Release { particle: 5, force: true },
            Self::Pause,
            Self::Resume,
            Self::Step { count: 7 },
            Self::Reset,
            Self::Push { center: target, radius: 0.5, delta, limit: None },
            Self::Push { center: target, radius: 0.5, delta, limit: Some(0.0) },
            Self::Cut { constraint: 6 },
            Self::CutRadius { center: target, radius: 0.25 },
            Self::CutSegment { from: target, to: delta, direction: [0.0, 0.0, 1.0] },
            Self::MoveAnchor { anchor: 1, translation: target, rotation, over_s: 0.0 },
            Self::MoveCollider {
                collider: 2,
                translation: target,
                rotation: identity(),
                over_s: 1.5,
            },
            set("damping", ParameterValue::Number(0.5), None),
            set("gravity", ParameterValue::Vector(target), None),
            set("tear_force", ParameterValue::Off, None),
            set("compliance", ParameterValue::Number(0.0), Some(structural)),
            set("stiffness", ParameterValue::Number(1.0), Some(KindFilter::Unknown)),
            Self::Set {
                parameter: Text::cut("bending"),
                value: ParameterValue::Number(1e-3),
                constraint_kind: None,
                block: Some(1),
                collider: None,
            },
            Self::Set {
                parameter: Text::cut("friction"),
                value: ParameterValue::Number(0.25),
                constraint_kind: None,
                block: None,
                collider: Some(2),
            },
            Self::Load { scene: Text::cut("./gemütlich.toml") },
            Self::Rewind { to_step: Some(0x0123_4567_89ab), back_steps: None },
            Self::Rewind { to_step: None, back_steps: Some(480) },
            Self::Restore { contents: RestoreContents::State, state_hash: 0x0123_4567_89ab_cdef },
            Self::Restore { contents: RestoreContents::Motion, state_hash: 0 },
            Self::Mark { text: Text::cut("the sleeve slips, größer") },
            Self::DriveBody {
                collider: 2,
                translation: target,
                rotation,
                velocity: [0.0, -1.5, 0.25],
                angular_velocity: delta,
                force: [0.5, 0.0, 0.0],
                torque: [0.0, 0.0, -0.125],
            },
            Self::Follow {
                object: MovedObject::Collider,
                object_index: 2,
                path: PathPart::new(&[
                    PathPoint { time: 0.1, translation: target, rotation },
                    PathPoint { time: 3600.0, ..PathPoint::AT_LOAD },
                ])
                .unwrap_or(PathPart::EMPTY),
                append: true,
            },
            Self::Unknown { number: 99 },
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_fields_has_those_of_every_action() {
        let samples: Vec<_> =
            Action::samples().iter().map(|one| serde_json::to_value(one).unwrap()).collect();
        for (action, sample) in Action::samples().iter().zip(&samples) {
            assert_eq!(sample["kind"], action.kind_name());
            let row = ActionFields::ALL.iter().find(|row| sample["kind"] == row.kind).unwrap();
            let fields = || row.required.iter().chain(row.optional).copied();
            let is_known = |name: &String| name == "kind" || fields().any(|field| field == name);
            assert!(sample.as_object().unwrap().keys().all(is_known), "{sample}");
            for absent in fields() {
                let mut without = sample.clone();
                without.as_object_mut().unwrap().remove(absent);
                let is_optional = row.optional.contains(&absent);
                let is_read = serde_json::from_value::<Action>(without).is_ok();
                assert_eq!(is_read, is_optional, "{absent} of {}", row.kind);
            }
        }
        for row in &ActionFields::ALL {
            assert!(samples.iter().any(|sample| sample["kind"] == row.kind), "{}", row.kind);
        }
    }

    fn set(name: &str, value: ParameterValue, constraint_kind: Option<KindFilter>) -> Action {
        Action::Set {
            parameter: Text::cut(name),
            value,
            constraint_kind,
            block: None,
            collider: None,
        }
    }

    fn read(text: &str) -> Action {
        serde_json::from_str(text).unwrap_or_else(|error| panic!("{text}: {error}"))
    }

    #[test]
    fn every_action_survives_json() {
        for action in Action::samples() {
            let text = serde_json::to_string(&action).unwrap();
            assert_eq!(read(&text), action, "{text}");
        }
    }

    #[test]
    fn the_json_of_each_kind_is_frozen() {
        let lines: Vec<_> =
            Action::samples().iter().map(|action| serde_json::to_string(action).unwrap()).collect();
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
        assert_eq!(read(text), set("tear_force", ParameterValue::Number(f32::INFINITY), None));
        assert_eq!(serde_json::to_string(&read(text)).unwrap(), text);
        let text = r#"{"kind":"set","parameter":"gravity","value":[0,"-inf","nan"]}"#;
        let Action::Set { value: ParameterValue::Vector(value), .. } = read(text) else {
            panic!("not a vector: {text}");
        };
        assert!(value[1] == f32::NEG_INFINITY && value[2].is_nan());
        let text = r#"{"kind":"push","center":[0,0,0],"radius":1,"delta":[0,0,0],"limit":"inf"}"#;
        assert!(matches!(read(text), Action::Push { limit: Some(f32::INFINITY), .. }));
    }

    #[test]
    fn optional_fields_have_defaults() {
        let grab = Action::Grab { particle: 1, target: [0., 1., 2.], over_s: GRAB_OVER_S_DEFAULT };
        assert_eq!(read(r#"{"kind":"grab","particle":1,"target":[0,1,2]}"#), grab);
        let push = r#"{"kind":"push","center":[0,0,0],"radius":1,"delta":[0,0,0]}"#;
        assert!(matches!(read(push), Action::Push { limit: None, .. }));
        let move_command = r#"{"kind":"move_anchor","anchor":1,"translation":[0,0,0]}"#;
        assert!(matches!(
            read(move_command),
            Action::MoveAnchor { rotation: [0., 0., 0., 1.], .. }
        ));
        let move_command = r#"{"kind":"move_collider","collider":1,"translation":[0,0,0]}"#;
        assert!(matches!(
            read(move_command),
            Action::MoveCollider { rotation: [0., 0., 0., 1.], .. }
        ));
    }

    #[test]
    fn null_is_off_but_a_missing_value_is_an_error() {
        let text = r#"{"kind":"set","parameter":"tear_force","value":null}"#;
        assert_eq!(read(text), set("tear_force", ParameterValue::Off, None));
        let missing = r#"{"kind":"set","parameter":"tear_force"}"#;
        let error = serde_json::from_str::<Action>(missing).unwrap_err().to_string();
        assert!(error.contains("missing field `value`"), "{error}");
    }

    #[test]
    fn an_unknown_kind_of_constraint_is_read_as_unknown() {
        let text = r#"{"kind":"set","parameter":"compliance","value":1,"constraint_kind":"knot"}"#;
        let action = read(text);
        assert_eq!(
            action,
            set("compliance", ParameterValue::Number(1.0), Some(KindFilter::Unknown))
        );
        let text = serde_json::to_string(&action).unwrap();
        assert!(text.ends_with(r#""constraint_kind":"unknown"}"#), "{text}");
        for all in [r#""all""#, "null"] {
            let text = format!(
                r#"{{"kind":"set","parameter":"compliance","value":1,"constraint_kind":{all}}}"#
            );
            assert_eq!(read(&text), set("compliance", ParameterValue::Number(1.0), None));
        }
    }

    #[test]
    fn an_unknown_kind_or_a_wrong_field_is_an_error() {
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
