//! [`Action`] on the wire.

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use sim_types::{Action, KindFilter, ParameterValue, Text};

/// Client that every `sim-node ctl` sends as: what one call grabs, a later call releases.
pub const CONSOLE_CLIENT_ID: u64 = 0;

/// A command on the wire: 256 bytes, alignment 8. Written by clients, read by the owner of the
/// name; also the last part of an [`crate::Outcome`].
///
/// What a kind does not use is 0. Lengths are in m and relative to the scene's origin, times in s.
///
/// | kind | `index` | `vectors` | others |
/// |---|---|---|---|
/// | 1 pin, 2 unpin, 5 release | particle | | |
/// | 3 grab, 4 move | particle | target | `number` over_s |
/// | 6 pause, 7 resume, 9 reset | | | |
/// | 8 step | | | `count` steps |
/// | 10 push | | center, delta | `number` radius, `limit` |
/// | 11 cut | constraint | | |
/// | 12 cut_radius | | center | `number` radius |
/// | 13 cut_segment | | from, to, direction | |
/// | 14 move_anchor | anchor | translation | `rotation` |
/// | 15 move_collider | collider | translation | `rotation` |
/// | 16 set | | value, if a vector | `text` parameter, `number` value, `count` constraint kind |
/// | 17 load | | | `text` scene |
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.Command")]
pub struct Command {
    /// Which action it is, by the numbers above.
    pub kind: u32,
    /// The particle, constraint, anchor or collider.
    pub index: u32,
    /// Random number of the sender, below 2^53 (exact in JSON); 0 is the console.
    pub client_id: u64,
    /// Number of the command within its client, ascending, below 2^53.
    pub sequence: u64,
    /// Points, offsets and directions, in the order of the table.
    pub vectors: [[f32; 3]; 3],
    /// Quaternion x, y, z, w.
    pub rotation: [f32; 4],
    /// Seconds of grab and move, radius of push and `cut_radius`, value of set.
    pub number: f32,
    /// Limit of push, if [`CommandOptions::LIMIT`] is set.
    pub limit: f32,
    /// Steps of step; [`crate::ConstraintKind`] of set, if [`CommandOptions::CONSTRAINT_KIND`] is.
    pub count: u32,
    /// [`CommandOptions`] bits.
    pub options: u32,
    /// UTF-8, zeros behind it.
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

/// The bits of [`Command::options`]; all others are 0. A set has exactly one bit for its value.
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
    /// A set is for one kind of constraints.
    pub const CONSTRAINT_KIND: u32 = 1 << 4;

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
}

const ZERO: [f32; 3] = [0.0; 3];

impl Command {
    /// Puts an action on the wire. `client_id` and `sequence` as in the fields of that name.
    pub fn new(client_id: u64, sequence: u64, action: Action) -> Self {
        Self { client_id, sequence, ..Self::unsent(action) }
    }

    /// The action, without a sender.
    fn unsent(action: Action) -> Self {
        match action {
            Action::Pin { particle } => Self::of(kind::PIN, particle),
            Action::Unpin { particle } => Self::of(kind::UNPIN, particle),
            Action::Grab { particle, target, over_s } => {
                Self::of(kind::GRAB, particle).at(target, over_s)
            }
            Action::Move { particle, target, over_s } => {
                Self::of(kind::MOVE, particle).at(target, over_s)
            }
            Action::Release { particle } => Self::of(kind::RELEASE, particle),
            Action::Pause => Self::of(kind::PAUSE, 0),
            Action::Resume => Self::of(kind::RESUME, 0),
            Action::Step { count } => Self { count, ..Self::of(kind::STEP, 0) },
            Action::Reset => Self::of(kind::RESET, 0),
            Action::Push { center, radius, delta, limit } => Self {
                vectors: [center, delta, ZERO],
                limit: limit.unwrap_or_default(),
                options: if limit.is_some() { CommandOptions::LIMIT } else { 0 },
                ..Self::of(kind::PUSH, 0).at(center, radius)
            },
            Action::Cut { constraint } => Self::of(kind::CUT, constraint),
            Action::CutRadius { center, radius } => {
                Self::of(kind::CUT_RADIUS, 0).at(center, radius)
            }
            Action::CutSegment { from, to, direction } => {
                Self { vectors: [from, to, direction], ..Self::of(kind::CUT_SEGMENT, 0) }
            }
            Action::MoveAnchor { anchor, translation, rotation } => {
                Self { rotation, ..Self::of(kind::MOVE_ANCHOR, anchor).at(translation, 0.0) }
            }
            Action::MoveCollider { collider, translation, rotation } => {
                Self { rotation, ..Self::of(kind::MOVE_COLLIDER, collider).at(translation, 0.0) }
            }
            Action::Set { parameter, value, constraint_kind } => {
                Self { text: parameter.to_wire(), ..Self::setting(value, constraint_kind) }
            }
            Action::Load { scene } => Self { text: scene.to_wire(), ..Self::of(kind::LOAD, 0) },
            Action::Unknown { number } => Self::of(number, 0),
        }
    }

    fn of(kind: u32, index: u32) -> Self {
        Self { kind, index, ..Self::zeroed() }
    }

    fn at(self, point: [f32; 3], number: f32) -> Self {
        Self { vectors: [point, ZERO, ZERO], number, ..self }
    }

    fn setting(value: ParameterValue, constraint_kind: Option<KindFilter>) -> Self {
        let empty = Self::of(kind::SET, 0);
        let mut command = match value {
            ParameterValue::Number(number) => {
                Self { number, options: CommandOptions::VALUE_NUMBER, ..empty }
            }
            ParameterValue::Vector(vector) => {
                Self { options: CommandOptions::VALUE_VECTOR, ..empty.at(vector, 0.0) }
            }
            ParameterValue::Off => Self { options: CommandOptions::VALUE_OFF, ..empty },
        };
        if let Some(constraint_kind) = constraint_kind {
            command.count = constraint_kind.number();
            command.options |= CommandOptions::CONSTRAINT_KIND;
        }
        command
    }

    /// Reads the action; a kind that this version does not know, and a set without a value, is
    /// [`Action::Unknown`]. Nothing else is checked here: the solver refuses wrong values with a
    /// reason.
    pub fn action(&self) -> Action {
        let Self { index, number, rotation, count, .. } = *self;
        let [first, second, third] = self.vectors;
        match self.kind {
            kind::PIN => Action::Pin { particle: index },
            kind::UNPIN => Action::Unpin { particle: index },
            kind::GRAB => Action::Grab { particle: index, target: first, over_s: number },
            kind::MOVE => Action::Move { particle: index, target: first, over_s: number },
            kind::RELEASE => Action::Release { particle: index },
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
            kind::MOVE_ANCHOR => Action::MoveAnchor { anchor: index, translation: first, rotation },
            kind::MOVE_COLLIDER => {
                Action::MoveCollider { collider: index, translation: first, rotation }
            }
            kind::SET => match self.value() {
                Some(value) => self.set(value),
                None => Action::Unknown { number: kind::SET },
            },
            kind::LOAD => Action::Load { scene: Text::from_wire(&self.text) },
            number => Action::Unknown { number },
        }
    }

    fn has(&self, option: u32) -> bool {
        self.options & option != 0
    }

    fn set(&self, value: ParameterValue) -> Action {
        let is_for_one_kind = self.has(CommandOptions::CONSTRAINT_KIND);
        Action::Set {
            parameter: Text::from_wire(&self.text),
            value,
            constraint_kind: is_for_one_kind.then(|| KindFilter::from_number(self.count)),
        }
    }

    fn value(&self) -> Option<ParameterValue> {
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
    fn kinds_have_their_numbers_in_the_order_of_the_actions() {
        let mut numbers: Vec<_> =
            Action::samples().into_iter().map(|action| Command::new(0, 0, action).kind).collect();
        numbers.dedup();
        let expected: Vec<_> = (1..=17).chain([99]).collect();
        assert_eq!(numbers, expected);
    }

    #[test]
    fn a_set_with_no_value_or_with_two_is_unknown() {
        let value = ParameterValue::Number(1.0);
        let action = Action::Set { parameter: Text::cut("damping"), value, constraint_kind: None };
        let good = Command::new(0, 0, action);
        for options in [0, CommandOptions::VALUE_NUMBER | CommandOptions::VALUE_OFF] {
            let command = Command { options, ..good };
            assert_eq!(command.action(), Action::Unknown { number: kind::SET });
        }
    }

    #[test]
    fn a_kind_of_constraints_from_another_version_is_unknown() {
        let value = ParameterValue::Number(1.0);
        let constraint_kind = Some(KindFilter::Unknown);
        let action = Action::Set { parameter: Text::cut("compliance"), value, constraint_kind };
        let command = Command { count: 4, ..Command::new(0, 0, action) };
        assert_eq!(command.action(), action);
    }

    #[test]
    fn a_text_that_is_no_utf8_is_read_as_far_as_it_is() {
        let mut command = Command::new(0, 0, Action::Load { scene: Text::cut("curtain") });
        command.text[3] = 0x80;
        assert_eq!(command.action(), Action::Load { scene: Text::cut("cur") });
    }
}
