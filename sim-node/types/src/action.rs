//! The actions that clients ask a node to perform: one table.

mod allowed_values;
mod field;
mod words;

use serde::{Deserialize, Serialize};

use crate::json::hash;
use crate::json::{number, optional_number, rotation, vector};
use crate::limits::NumberRange;
use crate::parameter::{Parameter, ParameterValue, Part};
use crate::path_part::{PathError, PathPart, PathPoint, check_path};
use crate::reason::Reason;
use crate::suggestion::did_you_mean;
use crate::text::Text;

use field::{
    CONTENTS, FLAG, FieldReader, FieldType, FieldWriter, HASH, KIND, LENGTH, LONG, OBJECT, POINT,
    ROTATION, SECONDS, VALUE, WHOLE, accept, check_finite, three, words,
};
pub use field::{FieldForm, FieldInfo};
use words::kind_or_all;
pub use words::{KindFilter, MovedObject, RestoreContents};

/// Default time in which a grabbed particle reaches its target, in seconds: one frame at 60 Hz.
pub const GRAB_OVER_S_DEFAULT: f32 = 1.0 / 60.0;

/// Default of a vector, in words.
const ZERO: &str = "0 0 0";

/// A row of the table of actions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActionInfo {
    /// Number on the wire.
    pub number: u32,
    /// Name of the kind in JSON.
    pub name: &'static str,
    /// Effect.
    pub meaning: &'static str,
    /// Allowed values of the fields that have limits, in words.
    pub allowed: Option<&'static str>,
    /// The fields, in the order of the wire.
    pub fields: &'static [FieldInfo],
}

/// Declares [`Action`] and [`ACTIONS`]. A row has the effect, the variant, its number, its name in JSON and, if fields have
/// limits, the limits in words. A field has its meaning, its form in JSON if its type has another one, its name, its type
/// and its row in the table.
///
/// ```text
/// /// Makes a paused node perform `count` steps.
/// Step = 8 "step", "1 or more" {
///     /// Number of steps.
///     count: u32 = WHOLE,
/// }
/// ```
macro_rules! actions {
    ($(
        $(#[doc = $doc:literal])+
        $variant:ident = $number:literal $name:literal $(, $allowed:literal)? $({ $(
            $(#[doc = $field_doc:literal])+
            $(#[serde($($serde:tt)+)])?
            $field:ident: $type:ty = $info:expr
        ),+ $(,)? })?
    )+) => {
        /// An action at the boundary before a step. Its JSON form is a flat object with "kind".
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
        #[serde(tag = "kind", deny_unknown_fields)]
        pub enum Action {
            $(
                $(#[doc = $doc])+
                #[serde(rename = $name)]
                $variant $({ $(
                    $(#[doc = $field_doc])+
                    $(#[serde($($serde)+)])?
                    $field: $type
                ),+ })?,
            )+
            /// A kind that this version does not know. Always rejected.
            #[serde(rename = "unknown")]
            Unknown {
                /// Number of the kind on the wire. The number of a known kind becomes `u32::MAX` there, which no version
                /// will assign, so that an unknown action never becomes a known one.
                number: u32,
            },
        }

        /// The table of actions, by ascending number.
        pub const ACTIONS: &[ActionInfo] = &[$(ActionInfo {
            number: $number,
            name: $name,
            meaning: concat!($($doc),+).trim_ascii(),
            allowed: first(&[$($allowed)?]),
            fields: &[$($(FieldInfo {
                name: stringify!($field),
                meaning: concat!($($field_doc),+).trim_ascii(),
                size_bytes: <$type as FieldType>::SIZE_BYTES,
                ..$info
            }),+)?],
        }),+];

        impl Action {
            /// Name of the kind, as in the JSON form.
            pub fn kind_name(&self) -> &'static str {
                match self {
                    $(Self::$variant { .. } => $name,)+
                    Self::Unknown { .. } => UNKNOWN,
                }
            }

            /// Number on the wire.
            pub fn number(&self) -> u32 {
                match *self {
                    $(Self::$variant { .. } => $number,)+
                    Self::Unknown { number } => match number {
                        known if ACTIONS.iter().any(|info| info.number == known) => u32::MAX,
                        unknown => unknown,
                    },
                }
            }

            fn check_fields(&self) -> Result<(), Reason> {
                match self {
                    $(Self::$variant $({ $($field),+ })? => { $($($field.check(&$info)?;)+)? })+
                    Self::Unknown { .. } => return Err(Reason::NoEffectHere),
                }
                Ok(())
            }

            fn write(&self, writer: &mut FieldWriter<'_>) {
                match self {
                    $(Self::$variant $({ $($field),+ })? => { $($($field.write(writer);)+)? })+
                    Self::Unknown { .. } => {}
                }
            }

            /// Returns `None` for fields that no action of this kind has.
            fn read(number: u32, reader: &mut FieldReader<'_>) -> Option<Self> {
                Some(match number {
                    $($number => Self::$variant $({ $($field: FieldType::read(reader)?),+ })?,)+
                    _ => return None,
                })
            }
        }
    };
}

actions! {
    /// Holds a particle in place.
    Pin = 1 "pin" {
        /// Index of the particle.
        particle: u32 = WHOLE,
    }
    /// Frees a pinned particle. Its velocity is 0.
    Unpin = 2 "unpin" {
        /// Index of the particle.
        particle: u32 = WHOLE,
    }
    /// Grabs a particle, which moves along a straight line to a target.
    Grab = 3 "grab", "coordinates within 1e7, z 0 in 2-D, over 0 to 3600 s" {
        /// Index of the particle.
        particle: u32 = WHOLE,
        /// Target in m, relative to the scene's origin.
        #[serde(with = "vector")]
        target: [f32; 3] = POINT,
        /// Time to the target in seconds, 0..=3600, rounded up to whole steps.
        #[serde(with = "number", default = "grab_over_s_default")]
        over_s: f32 = SECONDS.optional("1/60"),
    }
    /// Sets a new target for a particle that this client has grabbed.
    Move = 4 "move", "coordinates within 1e7, z 0 in 2-D, over 0 to 3600 s" {
        /// Index of the particle.
        particle: u32 = WHOLE,
        /// Target in m, relative to the scene's origin.
        #[serde(with = "vector")]
        target: [f32; 3] = POINT,
        /// Time to the target in seconds, 0..=3600, rounded up to whole steps.
        #[serde(with = "number", default = "grab_over_s_default")]
        over_s: f32 = SECONDS.optional("1/60"),
    }
    /// Releases a grabbed particle with the velocity of its last motion.
    Release = 5 "release" {
        /// Index of the particle.
        particle: u32 = WHOLE,
        /// Releases the grab of any client, not only one of this client.
        #[serde(default, skip_serializing_if = "is_false")]
        force: bool = FLAG.optional(""),
    }
    /// Pauses the node at this boundary.
    Pause = 6 "pause"
    /// Resumes a paused node.
    Resume = 7 "resume"
    /// Makes a paused node perform `count` steps.
    Step = 8 "step", "1 or more" {
        /// Number of steps, 1 or more.
        count: u32 = WHOLE.nonzero(),
    }
    /// Restores the initial state as the state of the next step. The step number continues.
    Reset = 9 "reset"
    /// Sets the velocity of each free particle inside a sphere to `delta` times the rate.
    Push = 10 "push", "coordinates and delta within 1e7, z 0 in 2-D, radius 0 to 1e7, limit 0 or more" {
        /// Center of the sphere in m, relative to the scene's origin.
        #[serde(with = "vector")]
        center: [f32; 3] = POINT,
        /// Radius of the sphere in m. A particle at exactly this distance is outside.
        #[serde(with = "number")]
        radius: f32 = LENGTH,
        /// Displacement of the particles in the next step, in m.
        #[serde(with = "vector")]
        delta: [f32; 3] = POINT.within(NumberRange::FINITE),
        /// Largest magnitude of each component of `delta` in m. `None` means no limit.
        #[serde(default, with = "optional_number", skip_serializing_if = "Option::is_none")]
        limit: Option<f32> = LENGTH.within(NumberRange::AT_LEAST_ZERO).optional("no limit"),
    }
    /// Tears a constraint.
    Cut = 11 "cut" {
        /// Index of the constraint.
        constraint: u32 = WHOLE,
    }
    /// Tears every constraint with an end inside a sphere.
    CutRadius = 12 "cut_radius", "coordinates within 1e7, z 0 in 2-D, radius 0 to 1e7" {
        /// Center of the sphere in m, relative to the scene's origin.
        #[serde(with = "vector")]
        center: [f32; 3] = POINT,
        /// Radius of the sphere in m. An end at exactly this distance is outside.
        #[serde(with = "number")]
        radius: f32 = LENGTH,
    }
    /// Tears every constraint that crosses a strip: a segment extended to both sides.
    CutSegment = 13 "cut_segment", "coordinates within 1e7, direction not 0; in 2-D, z of both ends 0" {
        /// Start of the segment in m, relative to the scene's origin.
        #[serde(with = "vector")]
        from: [f32; 3] = POINT,
        /// End of the segment in m, relative to the scene's origin.
        #[serde(with = "vector")]
        to: [f32; 3] = POINT,
        /// Direction in which the segment extends to both sides without limit; [0, 0, 1] for a planar scene.
        #[serde(with = "vector")]
        direction: [f32; 3] = three("three numbers").within(NumberRange::COORDINATE).nonzero(),
    }
    /// Moves an anchor to a pose within `over_s`, where it stays. Its path ends.
    MoveAnchor = 14 "move_anchor",
        "coordinates within 1e7, rotation not 0, over 0 to 3600 s; in 2-D, z 0 and a rotation about z" {
        /// Index of the anchor.
        anchor: u32 = WHOLE,
        /// Translation in m, relative to the pose at load.
        #[serde(with = "vector")]
        translation: [f32; 3] = POINT,
        /// Rotation relative to the pose at load, as the quaternion x, y, z, w.
        #[serde(default = "identity", with = "rotation")]
        rotation: [f32; 4] = ROTATION.optional("0 0 0 1"),
        /// Time to the pose in seconds, 0..=3600, rounded up to whole steps, at least one.
        #[serde(default, with = "number", skip_serializing_if = "is_zero")]
        over_s: f32 = SECONDS.optional("one step"),
    }
    /// Moves a collider to a pose within `over_s`, with the velocity that the motion implies.
    MoveCollider = 15 "move_collider",
        "coordinates within 1e7, rotation not 0, over 0 to 3600 s; in 2-D, z 0 and a rotation about z; for bounds, no rotation" {
        /// Index of the collider.
        collider: u32 = WHOLE,
        /// Translation in m, relative to the pose at load.
        #[serde(with = "vector")]
        translation: [f32; 3] = POINT,
        /// Rotation relative to the pose at load, as the quaternion x, y, z, w.
        #[serde(default = "identity", with = "rotation")]
        rotation: [f32; 4] = ROTATION.optional("0 0 0 1"),
        /// Time to the pose in seconds, 0..=3600, rounded up to whole steps, at least one.
        #[serde(default, with = "number", skip_serializing_if = "is_zero")]
        over_s: f32 = SECONDS.optional("one step"),
    }
    /// Sets a parameter of the simulation. [`Action::set`] makes one for the whole scene.
    Set = 16 "set" {
        /// Name of the parameter. An unknown name is rejected.
        parameter: Text = words("the name of a parameter, at most 160 bytes"),
        /// New value. null in JSON means off.
        value: ParameterValue = VALUE,
        /// Kind of the affected constraints, for `compliance` and `stiffness`. `None` means all kinds.
        #[serde(default, deserialize_with = "kind_or_all", skip_serializing_if = "Option::is_none")]
        constraint_kind: Option<KindFilter> = KIND.optional("all kinds"),
        /// Index of the generated block of the affected bends, for `bending`. `None` means all bends.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        block: Option<u32> = WHOLE.optional("all bends"),
        /// Index of the affected collider, for `friction` and `restitution`. `None` means all colliders.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        collider: Option<u32> = WHOLE.optional("all colliders"),
    }
    /// Replaces the scene.
    Load = 17 "load", "a scene that the node can read; see its messages" {
        /// Name of a built-in scene, or path of a file on the node's host.
        scene: Text = words("the name of a scene, at most 160 bytes"),
    }
    /// Puts an earlier state of this run in place: the nearest kept one at or before the target. Exactly one of the fields is
    /// present; the outcome has `to_step`, the step of the state.
    Rewind = 18 "rewind", "a step of this run that the node has made" {
        /// Step of the run.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        to_step: Option<u64> = LONG.optional(""),
        /// Number of steps back on the way to the current state. Steps that a rewind has left behind do not count.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        back_steps: Option<u32> = WHOLE.optional(""),
    }
    /// Puts a given state in place. The state comes through a service of its own, so that a command alone is rejected.
    Restore = 19 "restore" {
        /// Part of the state that was given.
        contents: RestoreContents = CONTENTS,
        /// Hash of the state in place.
        #[serde(with = "hash")]
        state_hash: u64 = HASH,
    }
    /// Marks the step in the log. Changes nothing else.
    Mark = 20 "mark", "a text that is not empty" {
        /// Text for people and for programs that read the log. Empty text is rejected.
        text: Text = words("a text of at most 160 bytes").nonzero(),
    }
    /// Moves a body through the next step, by its mass and inertia, with impulses from the particles that it meets. After
    /// the step it stands where it came.
    DriveBody = 21 "drive_body",
        "coordinates within 1e7, rotation not 0, velocity within 1e7 m/s and angular velocity within 1e4 rad/s, also after a step of the force and torque; in 2-D, z 0 and rotations about z" {
        /// Index of the collider that is the body.
        collider: u32 = WHOLE,
        /// Translation at the start of the step in m, relative to the pose at load.
        #[serde(with = "vector")]
        translation: [f32; 3] = POINT,
        /// Rotation at the start of the step relative to the pose at load, as the quaternion x, y, z, w.
        #[serde(default = "identity", with = "rotation")]
        rotation: [f32; 4] = ROTATION.optional("0 0 0 1"),
        /// Velocity of its center at the start of the step in m/s.
        #[serde(default, with = "vector")]
        velocity: [f32; 3] = three("three numbers in m/s").within(NumberRange::COORDINATE).optional(ZERO),
        /// Angular velocity at the start of the step in rad/s.
        #[serde(default, with = "vector")]
        angular_velocity: [f32; 3] = three("three numbers in rad/s").within(NumberRange::SPIN).optional(ZERO),
        /// Force on its center in N, beside gravity and the contacts.
        #[serde(default, with = "vector")]
        force: [f32; 3] = three("three numbers in N").optional(ZERO),
        /// Torque about its center in N m, beside the torque of the contacts.
        #[serde(default, with = "vector")]
        torque: [f32; 3] = three("three numbers in N m").optional(ZERO),
    }
    /// Leads a particle that this client has grabbed, an anchor or a collider along points in time. It moves linearly between
    /// them, and stays at the last one.
    Follow = 22 "follow",
        "points at ascending times from 0 to 3600 s, after those that they are appended to; coordinates within 1e7, rotation not 0; in 2-D, z 0 and rotations about z; for bounds, no rotation; at most 2048 points of all motions of the scene on their way" {
        /// Kind of the object.
        object: MovedObject = OBJECT,
        /// Index of the particle, anchor or collider.
        object_index: u32 = WHOLE,
        /// The points. Their times ascend.
        path: PathPart = FieldInfo::PATH,
        /// Appends the points to the motion that an earlier command began, and whose times go on.
        #[serde(default, skip_serializing_if = "is_false")]
        append: bool = FLAG.optional(""),
    }
}

/// Name of a kind that this version does not know.
const UNKNOWN: &str = "unknown";

const fn first(words: &[&'static str]) -> Option<&'static str> {
    match words {
        [first, ..] => Some(first),
        [] => None,
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

impl ActionInfo {
    /// The row of [`Action::Unknown`], which is not in the table: recordings have it for a command of another version.
    const UNKNOWN: Self = Self {
        number: u32::MAX,
        name: UNKNOWN,
        meaning: "a kind that this version does not know",
        allowed: None,
        fields: &[FieldInfo {
            name: "number",
            meaning: "number of the kind",
            size_bytes: 0,
            ..WHOLE
        }],
    };

    /// Returns the row of a kind, also of an unknown one.
    pub fn from_name(name: &str) -> Option<&'static Self> {
        ACTIONS.iter().chain([&Self::UNKNOWN]).find(|info| info.name == name)
    }

    /// Returns ` (did you mean 'x'?)` for the first unknown name in the JSON form of an action, its kind or one of its fields,
    /// or an empty text.
    pub fn meant<'a>(kind: &str, fields: impl IntoIterator<Item = &'a str>) -> String {
        let Some(info) = Self::from_name(kind) else {
            return did_you_mean(kind, ACTIONS.iter().map(|info| info.name));
        };
        let known = || ["kind"].into_iter().chain(info.fields.iter().map(|field| field.name));
        let unknown = fields.into_iter().find(|name| known().all(|known| known != *name));
        unknown.map_or_else(String::new, |name| did_you_mean(name, known()))
    }
}

impl Action {
    /// Size of the fields of any action on the wire, in bytes.
    pub const FIELDS_SIZE_BYTES: usize = 232;

    /// Returns the fields on the wire: one after the other, little-endian, without gaps, then zeros.
    pub fn encode(&self) -> [u8; Self::FIELDS_SIZE_BYTES] {
        let mut bytes = [0; Self::FIELDS_SIZE_BYTES];
        self.write(&mut FieldWriter::new(&mut bytes));
        bytes
    }

    /// Decodes the fields of a kind. A number that this version does not know, and fields that no action of the kind has,
    /// become [`Self::Unknown`]. Nothing else is checked here: the solver rejects wrong values with a reason.
    pub fn decode(number: u32, fields: &[u8; Self::FIELDS_SIZE_BYTES]) -> Self {
        let action = Self::read(number, &mut FieldReader::new(fields));
        action.unwrap_or(Self::Unknown { number })
    }

    /// Checks everything that does not depend on a scene or its state. A solver makes this check before it looks at
    /// either.
    ///
    /// # Errors
    /// [`Reason::NonFinite`], [`Reason::OutOfRange`] or [`Reason::UnknownParameter`], for the first field with a wrong
    /// value; [`Reason::NoEffectHere`] for an unknown action.
    pub fn validate(&self) -> Result<(), Reason> {
        self.check_fields()?;
        match *self {
            Self::Push { delta, limit, .. } => {
                let limit = limit.unwrap_or(f32::MAX);
                let is_near =
                    |axis: f32| NumberRange::COORDINATE.contains(axis.clamp(-limit, limit));
                accept(delta.into_iter().all(is_near))
            }
            Self::Set { parameter, value, .. } => {
                let parameter = Parameter::from_name(parameter.as_str());
                let parameter = parameter.ok_or(Reason::UnknownParameter)?;
                check_finite(value.numbers())?;
                accept(parameter.info().accepts(value))
            }
            Self::Rewind { to_step, back_steps } => {
                accept(to_step.is_some() != back_steps.is_some())
            }
            _ => Ok(()),
        }
    }

    /// Sets a parameter for the whole scene.
    pub fn set(parameter: &str, value: impl Into<ParameterValue>) -> Self {
        let (parameter, value) = (Text::cut(parameter), value.into());
        Self::Set { parameter, value, constraint_kind: None, block: None, collider: None }
    }

    /// Makes a set one for a part of the scene. Any other action stays as it is.
    #[must_use]
    pub fn for_part(self, part: Part) -> Self {
        let Self::Set { parameter, value, .. } = self else { return self };
        let (mut constraint_kind, mut block, mut collider) = (None, None, None);
        match part {
            Part::All => {}
            Part::Kind(kind) => constraint_kind = Some(KindFilter::Known(kind)),
            Part::Block(index) => block = Some(index),
            Part::Collider(index) => collider = Some(index),
        }
        Self::Set { parameter, value, constraint_kind, block, collider }
    }

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
        use crate::kinds::ConstraintKind;

        let target = [0.1, -2.0, 3.5];
        let delta = [0.0, -0.0, 1e-9];
        let rotation = [0.0, 0.6, 0.0, 0.8];
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
            Self::set("damping", 0.5),
            Self::set("gravity", target),
            Self::set("tear_force", ParameterValue::Off),
            Self::set("compliance", 0.0).for_part(Part::Kind(ConstraintKind::Structural)),
            Self::Set {
                parameter: Text::cut("stiffness"),
                value: ParameterValue::Number(1.0),
                constraint_kind: Some(KindFilter::Unknown),
                block: None,
                collider: None,
            },
            Self::set("bending", 1e-3).for_part(Part::Block(1)),
            Self::set("friction", 0.25).for_part(Part::Collider(2)),
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
    use crate::kinds::ConstraintKind;

    use super::*;

    #[test]
    fn the_table_of_fields_has_those_of_every_action() {
        let samples: Vec<_> =
            Action::samples().iter().map(|one| serde_json::to_value(one).unwrap()).collect();
        for (action, sample) in Action::samples().iter().zip(&samples) {
            assert_eq!(sample["kind"], action.kind_name());
            let info = ActionInfo::from_name(action.kind_name()).unwrap();
            let is_known = |name: &String| {
                name == "kind" || info.fields.iter().any(|field| field.name == name)
            };
            assert!(sample.as_object().unwrap().keys().all(is_known), "{sample}");
            for field in info.fields {
                let mut without = sample.clone();
                without.as_object_mut().unwrap().remove(field.name);
                let is_read = serde_json::from_value::<Action>(without).is_ok();
                assert_eq!(is_read, field.is_optional, "{} of {}", field.name, info.name);
            }
        }
        for (number, info) in (1..).zip(ACTIONS) {
            assert_eq!(info.number, number, "{}", info.name);
            assert!(samples.iter().any(|sample| sample["kind"] == info.name), "{}", info.name);
        }
    }

    #[test]
    fn a_wrong_value_is_refused_with_its_reason() {
        for action in Action::samples() {
            let is_valid = action.validate() == Ok(());
            assert_eq!(is_valid, !matches!(action, Action::Unknown { .. }), "{action:?}");
        }
        let (out, non_finite) = (Reason::OutOfRange, Reason::NonFinite);
        for (text, reason) in [
            (r#""grab","particle":1,"target":["nan",0,0]"#, non_finite),
            (r#""grab","particle":1,"target":[0,0,1.1e7]"#, out),
            (r#""move","particle":1,"target":[0,0,0],"over_s":3600.1"#, out),
            (r#""move","particle":1,"target":[0,0,0],"over_s":"nan""#, non_finite),
            (r#""step","count":0"#, out),
            (r#""push","center":[0,0,0],"radius":-1,"delta":[0,0,0]"#, out),
            (r#""push","center":[0,0,0],"radius":1,"delta":[0,1e8,0]"#, out),
            (r#""push","center":[0,0,0],"radius":1,"delta":[0,0,0],"limit":-0.1"#, out),
            (r#""cut_segment","from":[0,0,0],"to":[1,0,0],"direction":[0,0,0]"#, out),
            (r#""move_anchor","anchor":0,"translation":[0,0,0],"rotation":[0,0,0,0]"#, out),
            (r#""move_collider","collider":0,"translation":[0,0,0],"over_s":-1"#, out),
            (
                r#""drive_body","collider":0,"translation":[0,0,0],"angular_velocity":[0,2e4,0]"#,
                out,
            ),
            (r#""drive_body","collider":0,"translation":[0,0,0],"torque":["inf",0,0]"#, non_finite),
            (r#""set","parameter":"colour","value":1"#, Reason::UnknownParameter),
            (r#""set","parameter":"gravity","value":[0,"nan",0]"#, non_finite),
            (r#""rewind""#, out),
            (r#""mark","text":"""#, out),
            (r#""follow","object":"anchor","object_index":0,"path":[]"#, out),
        ] {
            assert_eq!(read(&format!("{{\"kind\":{text}}}")).validate(), Err(reason), "{text}");
        }
        let limited = r#"{"kind":"push","center":[0,0,0],"radius":1,"delta":[0,1e8,0],"limit":1}"#;
        assert_eq!(read(limited).validate(), Ok(()));
    }

    #[test]
    fn every_action_survives_the_wire() {
        for action in Action::samples() {
            assert_eq!(Action::decode(action.number(), &action.encode()), action);
        }
    }

    #[test]
    fn an_unknown_action_never_becomes_a_known_one() {
        for number in (0..=100).chain([u32::MAX - 1, u32::MAX]) {
            let action = Action::Unknown { number };
            let decoded = Action::decode(action.number(), &action.encode());
            let is_known = ACTIONS.iter().any(|info| info.number == number);
            let expected = if is_known { u32::MAX } else { number };
            assert_eq!(decoded, Action::Unknown { number: expected });
        }
    }

    #[test]
    fn bytes_that_no_action_has_are_unknown() {
        let damaged = |action: Action, place: usize| {
            let mut fields = action.encode();
            fields[place] = 9;
            Action::decode(action.number(), &fields)
        };
        // A flag that is neither 0 nor 1, nine numbers, and a path of nine points.
        for (action, place) in [
            (Action::Release { particle: 0, force: false }, 4),
            (Action::set("damping", 1.0), Text::SIZE_BYTES_MAX),
            (Action::samples().into_iter().rfind(|one| one.number() == 22).unwrap(), 8),
        ] {
            assert_eq!(damaged(action, place), Action::Unknown { number: action.number() });
        }
        let known = Action::set("compliance", 1.0).for_part(Part::Kind(ConstraintKind::Bend));
        let Action::Set { constraint_kind, .. } = damaged(known, Text::SIZE_BYTES_MAX + 20) else {
            panic!("no set")
        };
        assert_eq!(constraint_kind, Some(KindFilter::Unknown), "a kind of another version");
    }

    #[test]
    fn a_misspelt_kind_or_field_is_answered_with_the_nearest_one() {
        assert_eq!(ActionInfo::meant("gab", ["kind"]), " (did you mean 'grab'?)");
        let partcle = ActionInfo::meant("pin", ["kind", "partcle"]);
        assert_eq!(partcle, " (did you mean 'particle'?)");
        assert_eq!(ActionInfo::meant("pin", ["kind", "particle"]), "");
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
