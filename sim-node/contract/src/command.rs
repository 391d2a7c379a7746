//! What a client asks of a node: typed as [`Action`], on the wire as [`Command`].

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;
use serde::{Deserialize, Serialize};

use crate::plain_number::{number, vector};

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
    /// What this version does not know, by its number on the wire. Always rejected.
    Unknown {
        /// [`Command::kind`] as it came.
        number: u32,
    },
}

fn grab_over_s_default() -> f32 {
    GRAB_OVER_S_DEFAULT
}

/// A command on the wire: 256 bytes, alignment 8. Written by clients, read by the owner of the
/// name; also the last part of an [`crate::Outcome`]. Fields that a kind does not use are 0.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.Command")]
pub struct Command {
    /// 1 pin, 2 unpin, 3 grab, 4 move, 5 release, 6 pause, 7 resume, 8 step, 9 reset.
    pub kind: u32,
    /// Particle of pin, unpin, grab, move and release.
    pub particle: u32,
    /// Random number of the sender, below 2^53 (exact in JSON); 0 is the console.
    pub client_id: u64,
    /// Number of the command within its client, ascending, below 2^53.
    pub sequence: u64,
    /// Target of grab and move, in m, relative to the scene's origin.
    pub target: [f32; 3],
    /// Seconds of grab and move.
    pub over_s: f32,
    /// Steps of step.
    pub count: u32,
    /// Always 0.
    pub spare: [u32; 53],
}

const _: () = assert!(size_of::<Command>() == 256 && align_of::<Command>() == 8);

impl Default for Command {
    fn default() -> Self {
        Self::zeroed()
    }
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
}

impl Command {
    /// Puts an action on the wire. `client_id` and `sequence` as in the fields of that name.
    pub fn new(client_id: u64, sequence: u64, action: Action) -> Self {
        let empty = Self { client_id, sequence, ..Self::zeroed() };
        let of_particle = |kind, particle| Self { kind, particle, ..empty };
        match action {
            Action::Pin { particle } => of_particle(kind::PIN, particle),
            Action::Unpin { particle } => of_particle(kind::UNPIN, particle),
            Action::Grab { particle, target, over_s } => {
                Self { target, over_s, ..of_particle(kind::GRAB, particle) }
            }
            Action::Move { particle, target, over_s } => {
                Self { target, over_s, ..of_particle(kind::MOVE, particle) }
            }
            Action::Release { particle } => of_particle(kind::RELEASE, particle),
            Action::Pause => Self { kind: kind::PAUSE, ..empty },
            Action::Resume => Self { kind: kind::RESUME, ..empty },
            Action::Step { count } => Self { kind: kind::STEP, count, ..empty },
            Action::Reset => Self { kind: kind::RESET, ..empty },
            Action::Unknown { number } => Self { kind: number, ..empty },
        }
    }

    /// Reads the action; a kind that this version does not know is [`Action::Unknown`].
    /// Nothing else is checked here: the solver refuses wrong values with a reason.
    pub fn action(&self) -> Action {
        let Self { particle, target, over_s, count, .. } = *self;
        match self.kind {
            kind::PIN => Action::Pin { particle },
            kind::UNPIN => Action::Unpin { particle },
            kind::GRAB => Action::Grab { particle, target, over_s },
            kind::MOVE => Action::Move { particle, target, over_s },
            kind::RELEASE => Action::Release { particle },
            kind::PAUSE => Action::Pause,
            kind::RESUME => Action::Resume,
            kind::STEP => Action::Step { count },
            kind::RESET => Action::Reset,
            number => Action::Unknown { number },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all_actions() -> Vec<Action> {
        let target = [0.1, -2.0, 3.5];
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
            Action::Unknown { number: 99 },
        ]
    }

    #[test]
    fn every_action_survives_the_wire_with_its_sender() {
        for action in all_actions() {
            let command = Command::new(11, 12, action);
            assert_eq!(command.action(), action);
            assert_eq!((command.client_id, command.sequence), (11, 12));
        }
    }

    #[test]
    fn every_action_survives_json() {
        for action in all_actions() {
            let text = serde_json::to_string(&action).unwrap();
            assert_eq!(serde_json::from_str::<Action>(&text).unwrap(), action, "{text}");
        }
    }

    #[test]
    fn non_finite_numbers_are_strings_in_json() {
        let action = Action::Grab {
            particle: 1,
            target: [f32::NAN, f32::INFINITY, f32::NEG_INFINITY],
            over_s: 0.1,
        };
        let text = serde_json::to_string(&action).unwrap();
        assert_eq!(
            text,
            r#"{"kind":"grab","particle":1,"target":["nan","inf","-inf"],"over_s":0.1}"#
        );
        let Action::Grab { target, .. } = serde_json::from_str(&text).unwrap() else {
            panic!("not a grab: {text}");
        };
        assert!(target[0].is_nan());
        assert_eq!(target[1..], [f32::INFINITY, f32::NEG_INFINITY]);
    }

    #[test]
    fn over_s_of_a_grab_defaults_to_a_display_frame() {
        let action = serde_json::from_str(r#"{"kind":"grab","particle":1,"target":[0,1,2]}"#);
        let expected =
            Action::Grab { particle: 1, target: [0.0, 1.0, 2.0], over_s: GRAB_OVER_S_DEFAULT };
        assert_eq!(action.ok(), Some(expected));
    }

    #[test]
    fn an_unknown_field_or_kind_is_an_error() {
        for text in [
            r#"{"kind":"pin","particle":1,"colour":2}"#,
            r#"{"kind":"dance"}"#,
            r#"{"kind":"pin"}"#,
            r#"{"kind":"pin","particle":-1}"#,
        ] {
            assert!(serde_json::from_str::<Action>(text).is_err(), "{text}");
        }
    }
}
