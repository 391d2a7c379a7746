//! The messages of the service `commands`: [`Action`]s in a fixed layout.

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use sim_types::{
    Action, KindFilter, MovedObject, ParameterValue, PathPart, PathPoint, RestoreContents, Text,
};

/// Client id of every `sim-node ctl`, so that one call can release a particle that
/// another call grabbed.
pub const CONSOLE_CLIENT_ID: u64 = 0;

/// A command: 256 bytes, alignment 8. Written by clients, read by the owner of the name; also part
/// of an [`crate::Outcome`].
///
/// Fields that a kind does not use are 0. Lengths are in m, relative to the scene's origin; times
/// are in s.
///
/// | kind | `index` | `vectors` | other fields |
/// |---|---|---|---|
/// | 1 pin, 2 unpin | particle | | |
/// | 5 release | particle | | [`CommandOptions::FORCE`] |
/// | 3 grab, 4 move | particle | target | `number` over_s |
/// | 6 pause, 7 resume, 9 reset | | | |
/// | 8 step | | | `count` steps |
/// | 10 push | | center, delta | `number` radius, `limit` |
/// | 11 cut | constraint | | |
/// | 12 cut_radius | | center | `number` radius |
/// | 13 cut_segment | | from, to, direction | |
/// | 14 move_anchor | anchor | translation | `rotation`, `number` over_s |
/// | 15 move_collider | collider | translation | `rotation`, `number` over_s |
/// | 16 set | block or collider | value, if a vector | `text` parameter, `number` value, `count` constraint kind |
/// | 17 load | | | `text` scene |
/// | 18 rewind | step, low 32 bits | | `count` step, high 32 bits; or [`CommandOptions::BACK`] and `count` steps |
/// | 19 restore | hash, low 32 bits | | `count` hash, high 32 bits; [`CommandOptions::STATE`] or [`CommandOptions::MOTION`] |
/// | 20 mark | | | `text` |
/// | 21 drive_body | collider | translation, velocity, angular velocity | `rotation`, [`Command::wrench`] |
/// | 22 follow | particle, anchor or collider | | [`CommandOptions::ANCHOR`] or [`CommandOptions::COLLIDER`], else a particle; [`CommandOptions::APPEND`]; `count` [`Command::points`] |
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.Command")]
pub struct Command {
    /// Number of the action in the table above.
    pub kind: u32,
    /// Index of the particle, constraint, anchor, collider or, if [`CommandOptions::BLOCK`] is set, generated
    /// block. A set has a collider only with [`CommandOptions::COLLIDER`].
    pub index: u32,
    /// Random number of the sender, below 2^53 (exact in JSON); [`CONSOLE_CLIENT_ID`] is the console.
    pub client_id: u64,
    /// Number of the command among those of its client, ascending, below 2^53.
    pub sequence: u64,
    /// Points, offsets and directions, in the order of the table.
    pub vectors: [[f32; 3]; 3],
    /// Quaternion x, y, z, w.
    pub rotation: [f32; 4],
    /// Time of grab, move, `move_anchor` and `move_collider` in seconds, radius of push and `cut_radius`, value of set.
    pub number: f32,
    /// Limit of push, if [`CommandOptions::LIMIT`] is set.
    pub limit: f32,
    /// Number of steps of step; number of points of follow; [`crate::ConstraintKind`] of set, if
    /// [`CommandOptions::CONSTRAINT_KIND`] is set.
    pub count: u32,
    /// [`CommandOptions`] bits.
    pub options: u32,
    /// UTF-8 text, padded with zeros; force and torque of `drive_body`, see [`Command::wrench`]; points of `follow`, see
    /// [`Command::points`].
    pub text: [u8; Text::SIZE_BYTES_MAX],
    /// Always 0.
    pub spare: u32,
}

const _: () = assert!(size_of::<Command>() == 256 && align_of::<Command>() == 8);

impl Default for Command {
    fn default() -> Self {
        Self::zeroed()
    }
}

/// The bits of [`Command::options`]; all others are 0. A set has exactly one of the value bits.
#[derive(Debug)]
pub struct CommandOptions;

impl CommandOptions {
    /// A push has a limit.
    pub const LIMIT: u32 = 1;
    /// The value of a set is `number`.
    pub const VALUE_NUMBER: u32 = 1 << 1;
    /// The value of a set is the first of `vectors`.
    pub const VALUE_VECTOR: u32 = 1 << 2;
    /// A set switches its parameter off.
    pub const VALUE_OFF: u32 = 1 << 3;
    /// A set addresses the constraints of one kind.
    pub const CONSTRAINT_KIND: u32 = 1 << 4;
    /// A release ends the grab of any client.
    pub const FORCE: u32 = 1 << 5;
    /// A rewind has a step of the run.
    pub const TO: u32 = 1 << 6;
    /// A rewind has a number of steps.
    pub const BACK: u32 = 1 << 7;
    /// A restore puts a complete state in place.
    pub const STATE: u32 = 1 << 8;
    /// A restore puts positions and velocities in place.
    pub const MOTION: u32 = 1 << 9;
    /// A set addresses the bends of one generated block.
    pub const BLOCK: u32 = 1 << 10;
    /// A set addresses one collider; a follow moves a collider.
    pub const COLLIDER: u32 = 1 << 11;
    /// A follow moves an anchor.
    pub const ANCHOR: u32 = 1 << 12;
    /// A follow appends its points.
    pub const APPEND: u32 = 1 << 13;

    const VALUE_ANY: u32 = Self::VALUE_NUMBER | Self::VALUE_VECTOR | Self::VALUE_OFF;
}

mod kind {
    pub(super) const PIN: u32 = 1;
    pub(super) const UNPIN: u32 = 2;
    pub(super) const GRAB: u32 = 3;
    pub(super) const MOVE: u32 = 4;
    pub(super) const RELEASE: u32 = 5;
    pub(super) const PAUSE: u32 = 6;
    pub(super) const RESUME: u32 = 7;
    pub(super) const STEP: u32 = 8;
    pub(super) const RESET: u32 = 9;
    pub(super) const PUSH: u32 = 10;
    pub(super) const CUT: u32 = 11;
    pub(super) const CUT_RADIUS: u32 = 12;
    pub(super) const CUT_SEGMENT: u32 = 13;
    pub(super) const MOVE_ANCHOR: u32 = 14;
    pub(super) const MOVE_COLLIDER: u32 = 15;
    pub(super) const SET: u32 = 16;
    pub(super) const LOAD: u32 = 17;
    pub(super) const REWIND: u32 = 18;
    pub(super) const RESTORE: u32 = 19;
    pub(super) const MARK: u32 = 20;
    pub(super) const DRIVE_BODY: u32 = 21;
    pub(super) const FOLLOW: u32 = 22;
    /// No version will assign it.
    pub(super) const UNKNOWN: u32 = u32::MAX;
}

const ZERO: [f32; 3] = [0.0; 3];

const WRENCH_SIZE_BYTES: usize = size_of::<[[f32; 3]; 2]>();

/// A time and a pose.
const POINT_SIZE_BYTES: usize = size_of::<f64>() + size_of::<[f32; 7]>();
const _: () = assert!(Text::SIZE_BYTES_MAX / POINT_SIZE_BYTES == PathPart::POINTS_MAX);

impl Command {
    /// Encodes an action as the command `sequence` of the client `client_id`.
    pub fn new(client_id: u64, sequence: u64, action: Action) -> Self {
        Self { client_id, sequence, ..Self::from_action(action) }
    }

    /// Encodes an action; the sender is 0.
    #[allow(clippy::too_many_lines, reason = "an arm for each action")]
    fn from_action(action: Action) -> Self {
        match action {
            Action::Pin { particle } => Self::with_kind(kind::PIN, particle),
            Action::Unpin { particle } => Self::with_kind(kind::UNPIN, particle),
            Action::Grab { particle, target, over_s } => {
                Self::with_kind(kind::GRAB, particle).with_vector(target, over_s)
            }
            Action::Move { particle, target, over_s } => {
                Self::with_kind(kind::MOVE, particle).with_vector(target, over_s)
            }
            Action::Release { particle, force } => {
                let options = if force { CommandOptions::FORCE } else { 0 };
                Self { options, ..Self::with_kind(kind::RELEASE, particle) }
            }
            Action::Pause => Self::with_kind(kind::PAUSE, 0),
            Action::Resume => Self::with_kind(kind::RESUME, 0),
            Action::Step { count } => Self { count, ..Self::with_kind(kind::STEP, 0) },
            Action::Reset => Self::with_kind(kind::RESET, 0),
            Action::Push { center, radius, delta, limit } => Self {
                vectors: [center, delta, ZERO],
                limit: limit.unwrap_or_default(),
                options: if limit.is_some() { CommandOptions::LIMIT } else { 0 },
                ..Self::with_kind(kind::PUSH, 0).with_vector(center, radius)
            },
            Action::Cut { constraint } => Self::with_kind(kind::CUT, constraint),
            Action::CutRadius { center, radius } => {
                Self::with_kind(kind::CUT_RADIUS, 0).with_vector(center, radius)
            }
            Action::CutSegment { from, to, direction } => {
                Self { vectors: [from, to, direction], ..Self::with_kind(kind::CUT_SEGMENT, 0) }
            }
            Action::MoveAnchor { anchor, translation, rotation, over_s } => Self {
                rotation,
                ..Self::with_kind(kind::MOVE_ANCHOR, anchor).with_vector(translation, over_s)
            },
            Action::MoveCollider { collider, translation, rotation, over_s } => Self {
                rotation,
                ..Self::with_kind(kind::MOVE_COLLIDER, collider).with_vector(translation, over_s)
            },
            Action::Follow { object, object_index, path, append } => {
                let object = match object {
                    MovedObject::Particle => 0,
                    MovedObject::Anchor => CommandOptions::ANCHOR,
                    MovedObject::Collider => CommandOptions::COLLIDER,
                };
                let append = if append { CommandOptions::APPEND } else { 0 };
                let follow = Self::with_kind(kind::FOLLOW, object_index);
                Self { options: object | append, ..follow.with_points(path.points()) }
            }
            Action::Set { parameter, value, constraint_kind, block, collider } => {
                let set = Self::from_value(value).with_parameter(parameter);
                set.with_constraints(constraint_kind)
                    .with_index(block, CommandOptions::BLOCK)
                    .with_index(collider, CommandOptions::COLLIDER)
            }
            Action::Load { scene } => {
                Self { text: scene.to_wire(), ..Self::with_kind(kind::LOAD, 0) }
            }
            Action::Rewind { to_step, back_steps } => Self::from_rewind(to_step, back_steps),
            Action::Restore { contents, state_hash } => {
                let options = match contents {
                    RestoreContents::State => CommandOptions::STATE,
                    RestoreContents::Motion => CommandOptions::MOTION,
                };
                Self { options, ..Self::with_kind(kind::RESTORE, 0).with_long(state_hash) }
            }
            Action::Mark { text } => {
                Self { text: text.to_wire(), ..Self::with_kind(kind::MARK, 0) }
            }
            Action::DriveBody {
                collider,
                translation,
                rotation,
                velocity,
                angular_velocity,
                force,
                torque,
            } => Self {
                vectors: [translation, velocity, angular_velocity],
                rotation,
                ..Self::with_kind(kind::DRIVE_BODY, collider).with_wrench([force, torque])
            },
            Action::Unknown { number } => Self::unknown(number),
        }
    }

    /// A command that decodes as [`Action::Unknown`], with the number unless an empty command of that
    /// kind has a meaning.
    fn unknown(number: u32) -> Self {
        let command = Self::with_kind(number, 0);
        match command.action() {
            Action::Unknown { .. } => command,
            _ => Self::with_kind(kind::UNKNOWN, 0),
        }
    }

    fn with_kind(kind: u32, index: u32) -> Self {
        Self { kind, index, ..Self::zeroed() }
    }

    /// A step and a number of steps share a field, so a command with both keeps only the step. It is
    /// rejected in either form.
    fn from_rewind(to_step: Option<u64>, back_steps: Option<u32>) -> Self {
        let to = if to_step.is_some() { CommandOptions::TO } else { 0 };
        let back = if back_steps.is_some() { CommandOptions::BACK } else { 0 };
        let long = to_step.unwrap_or(u64::from(back_steps.unwrap_or(0)) << 32);
        Self { options: to | back, ..Self::with_kind(kind::REWIND, 0).with_long(long) }
    }

    /// Sets `index` to the low half of a number, and `count` to the high half.
    fn with_long(self, number: u64) -> Self {
        let [low, high] = bytemuck::cast(number.to_le());
        Self { index: u32::from_le(low), count: u32::from_le(high), ..self }
    }

    fn long(&self) -> u64 {
        u64::from(self.count) << 32 | u64::from(self.index)
    }

    fn with_vector(self, vector: [f32; 3], number: f32) -> Self {
        Self { vectors: [vector, ZERO, ZERO], number, ..self }
    }

    fn with_wrench(self, wrench: [[f32; 3]; 2]) -> Self {
        let mut command = self;
        command.text[..WRENCH_SIZE_BYTES].copy_from_slice(bytemuck::bytes_of(&wrench));
        command
    }

    /// Force in N and torque in N m of `drive_body`: the first six f32 of `text`.
    pub fn wrench(&self) -> [[f32; 3]; 2] {
        bytemuck::pod_read_unaligned(&self.text[..WRENCH_SIZE_BYTES])
    }

    fn with_points(self, points: &[PathPoint]) -> Self {
        let mut command = self;
        command.count = u32::try_from(points.len()).unwrap_or(0);
        for (bytes, point) in command.text.chunks_exact_mut(POINT_SIZE_BYTES).zip(points) {
            let PathPoint { time, translation, rotation } = point;
            bytes[..8].copy_from_slice(&time.to_le_bytes());
            bytes[8..20].copy_from_slice(bytemuck::bytes_of(translation));
            bytes[20..].copy_from_slice(bytemuck::bytes_of(rotation));
        }
        command
    }

    /// Points of `follow`: `count` of them, each a time in s as an f64, a translation and a rotation, in `text`.
    /// `None` if there are more than [`PathPart::POINTS_MAX`].
    pub fn points(&self) -> Option<PathPart> {
        let point = |bytes: &[u8]| PathPoint {
            time: bytemuck::pod_read_unaligned(&bytes[..8]),
            translation: bytemuck::pod_read_unaligned(&bytes[8..20]),
            rotation: bytemuck::pod_read_unaligned(&bytes[20..]),
        };
        let all = self.text.chunks_exact(POINT_SIZE_BYTES).map(point);
        let points: [PathPoint; PathPart::POINTS_MAX] = all.collect::<Vec<_>>().try_into().ok()?;
        PathPart::new(points.get(..self.count as usize)?)
    }

    fn from_value(value: ParameterValue) -> Self {
        let empty = Self::with_kind(kind::SET, 0);
        match value {
            ParameterValue::Number(number) => {
                Self { number, options: CommandOptions::VALUE_NUMBER, ..empty }
            }
            ParameterValue::Vector(vector) => {
                Self { options: CommandOptions::VALUE_VECTOR, ..empty.with_vector(vector, 0.0) }
            }
            ParameterValue::Off => Self { options: CommandOptions::VALUE_OFF, ..empty },
        }
    }

    fn with_parameter(self, parameter: Text) -> Self {
        Self { text: parameter.to_wire(), ..self }
    }

    /// Restricts a set to the constraints of a kind.
    fn with_constraints(self, constraint_kind: Option<KindFilter>) -> Self {
        let Some(kind) = constraint_kind else { return self };
        let options = self.options | CommandOptions::CONSTRAINT_KIND;
        Self { count: kind.number(), options, ..self }
    }

    /// Restricts a set to the bends of a generated block, or to a collider. A command with both keeps the index of
    /// the last one. It is rejected in either form.
    fn with_index(self, index: Option<u32>, option: u32) -> Self {
        let Some(index) = index else { return self };
        Self { index, options: self.options | option, ..self }
    }

    /// Decodes the action. A kind that this version does not know, or a set without exactly one value,
    /// becomes [`Action::Unknown`]. Nothing else is checked here: the solver rejects wrong values
    /// with a reason.
    pub fn action(&self) -> Action {
        let Self { index, number, rotation, count, .. } = *self;
        let [first, second, third] = self.vectors;
        match self.kind {
            kind::PIN => Action::Pin { particle: index },
            kind::UNPIN => Action::Unpin { particle: index },
            kind::GRAB => Action::Grab { particle: index, target: first, over_s: number },
            kind::MOVE => Action::Move { particle: index, target: first, over_s: number },
            kind::RELEASE => {
                Action::Release { particle: index, force: self.has(CommandOptions::FORCE) }
            }
            kind::PAUSE => Action::Pause,
            kind::RESUME => Action::Resume,
            kind::STEP => Action::Step { count },
            kind::RESET => Action::Reset,
            kind::PUSH => Action::Push {
                center: first,
                radius: number,
                delta: second,
                limit: self.has(CommandOptions::LIMIT).then_some(self.limit),
            },
            kind::CUT => Action::Cut { constraint: index },
            kind::CUT_RADIUS => Action::CutRadius { center: first, radius: number },
            kind::CUT_SEGMENT => Action::CutSegment { from: first, to: second, direction: third },
            kind::MOVE_ANCHOR => {
                Action::MoveAnchor { anchor: index, translation: first, rotation, over_s: number }
            }
            kind::MOVE_COLLIDER => Action::MoveCollider {
                collider: index,
                translation: first,
                rotation,
                over_s: number,
            },
            kind::FOLLOW => match self.moved_object().zip(self.points()) {
                Some((object, path)) => Action::Follow {
                    object,
                    object_index: index,
                    path,
                    append: self.has(CommandOptions::APPEND),
                },
                None => Action::Unknown { number: kind::FOLLOW },
            },
            kind::SET => match self.set_value() {
                Some(value) => self.set_action(value),
                None => Action::Unknown { number: kind::SET },
            },
            kind::LOAD => Action::Load { scene: Text::from_wire(&self.text) },
            kind::REWIND => Action::Rewind {
                to_step: self.has(CommandOptions::TO).then(|| self.long()),
                back_steps: self.has(CommandOptions::BACK).then_some(count),
            },
            kind::RESTORE => match self.restore_contents() {
                Some(contents) => Action::Restore { contents, state_hash: self.long() },
                None => Action::Unknown { number: kind::RESTORE },
            },
            kind::MARK => Action::Mark { text: Text::from_wire(&self.text) },
            kind::DRIVE_BODY => {
                let [force, torque] = self.wrench();
                Action::DriveBody {
                    collider: index,
                    translation: first,
                    rotation,
                    velocity: second,
                    angular_velocity: third,
                    force,
                    torque,
                }
            }
            number => Action::Unknown { number },
        }
    }

    fn moved_object(&self) -> Option<MovedObject> {
        match self.options & (CommandOptions::ANCHOR | CommandOptions::COLLIDER) {
            0 => Some(MovedObject::Particle),
            CommandOptions::ANCHOR => Some(MovedObject::Anchor),
            CommandOptions::COLLIDER => Some(MovedObject::Collider),
            _ => None,
        }
    }

    fn restore_contents(&self) -> Option<RestoreContents> {
        match self.options & (CommandOptions::STATE | CommandOptions::MOTION) {
            CommandOptions::STATE => Some(RestoreContents::State),
            CommandOptions::MOTION => Some(RestoreContents::Motion),
            _ => None,
        }
    }

    /// Returns the command without the fields that the node replaces in its outcome: the step of a rewind
    /// and the hash of a restore.
    pub(crate) fn as_sent(self) -> Self {
        match self.kind {
            kind::REWIND => Self { index: 0, count: 0, options: 0, ..self },
            kind::RESTORE => Self { index: 0, count: 0, ..self },
            _ => self,
        }
    }

    fn has(&self, option: u32) -> bool {
        self.options & option != 0
    }

    fn set_action(&self, value: ParameterValue) -> Action {
        let has_kind = self.has(CommandOptions::CONSTRAINT_KIND);
        Action::Set {
            parameter: Text::from_wire(&self.text),
            value,
            constraint_kind: has_kind.then(|| KindFilter::from_number(self.count)),
            block: self.has(CommandOptions::BLOCK).then_some(self.index),
            collider: self.has(CommandOptions::COLLIDER).then_some(self.index),
        }
    }

    fn set_value(&self) -> Option<ParameterValue> {
        match self.options & CommandOptions::VALUE_ANY {
            CommandOptions::VALUE_NUMBER => Some(ParameterValue::Number(self.number)),
            CommandOptions::VALUE_VECTOR => Some(ParameterValue::Vector(self.vectors[0])),
            CommandOptions::VALUE_OFF => Some(ParameterValue::Off),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_action_survives_the_wire_with_its_sender() {
        for action in Action::samples() {
            let command = Command::new(11, 12, action);
            assert_eq!(command.action(), action);
            assert_eq!((command.client_id, command.sequence, command.spare), (11, 12, 0));
        }
    }

    #[test]
    fn kinds_are_numbered_in_the_order_of_the_actions() {
        let mut numbers: Vec<_> =
            Action::samples().into_iter().map(|action| Command::new(0, 0, action).kind).collect();
        numbers.dedup();
        let expected: Vec<_> = (1..=22).chain([99]).collect();
        assert_eq!(numbers, expected);
        for kind in (0..=1000).filter(|kind| !numbers.contains(kind)) {
            let action = Command { kind, ..Command::new(0, 0, Action::Pause) }.action();
            assert_eq!(action, Action::Unknown { number: kind }, "an action without a sample");
        }
    }

    #[test]
    fn an_unknown_action_never_becomes_a_known_one() {
        for number in (0..=100).chain([u32::MAX - 1, u32::MAX]) {
            let decoded = Command::new(0, 0, Action::Unknown { number }).action();
            let is_known =
                (1..=22).contains(&number) && ![kind::SET, kind::RESTORE].contains(&number);
            let expected = if is_known { u32::MAX } else { number };
            assert_eq!(decoded, Action::Unknown { number: expected });
        }
    }

    #[test]
    fn a_set_without_a_value_or_with_two_values_is_unknown() {
        let value = ParameterValue::Number(1.0);
        let parameter = Text::cut("damping");
        let action =
            Action::Set { parameter, value, constraint_kind: None, block: None, collider: None };
        let valid = Command::new(0, 0, action);
        for options in [0, CommandOptions::VALUE_NUMBER | CommandOptions::VALUE_OFF] {
            let command = Command { options, ..valid };
            assert_eq!(command.action(), Action::Unknown { number: kind::SET });
        }
    }

    #[test]
    fn a_constraint_kind_of_another_version_is_unknown() {
        let value = ParameterValue::Number(1.0);
        let constraint_kind = Some(KindFilter::Unknown);
        let parameter = Text::cut("compliance");
        let action = Action::Set { parameter, value, constraint_kind, block: None, collider: None };
        let command = Command { count: 4, ..Command::new(0, 0, action) };
        assert_eq!(command.action(), action);
    }

    #[test]
    fn text_ends_at_the_first_byte_that_is_not_utf8() {
        let mut command = Command::new(0, 0, Action::Load { scene: Text::cut("curtain") });
        command.text[3] = 0x80;
        assert_eq!(command.action(), Action::Load { scene: Text::cut("cur") });
    }
}
