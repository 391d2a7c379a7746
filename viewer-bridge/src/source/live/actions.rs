//! From a page's command to what a node is asked for.

use sim_contract::{Action, Parameter, ParameterValue, ParticleState, Text};

use super::brush::Stroke;
use crate::message::Command;
use crate::message::reason;
use crate::scene::catalog;

/// What a command refers to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Context<'a> {
    pub(super) epoch: u32,
    pub(super) rate_hz: u32,
    pub(super) is_planar: bool,
    pub(super) particles: &'a [ParticleState],
}

/// The actions of a command, in order; none where nothing is to do. `Err` is the word of a reason.
pub(super) fn actions(command: Command, context: Context<'_>) -> Result<Vec<Action>, &'static str> {
    let action = match command {
        Command::DragBegin { particle, target, over_s } => {
            Action::Grab { particle, target, over_s }
        }
        Command::DragMove { particle, target, over_s } => Action::Move { particle, target, over_s },
        Command::DragEnd { particle } => Action::Release { particle },
        Command::Brush { eye, ray, radius, delta, over_s, cap } => {
            let stroke = Stroke { eye, ray, radius, delta, over_s, cap };
            let push = stroke.push(context.particles, context.is_planar, context.rate_hz);
            return Ok(push.into_iter().collect());
        }
        Command::Pin { particle } => Action::Pin { particle },
        Command::Unpin { particle } => Action::Unpin { particle },
        Command::Cut { epoch, .. } if epoch != context.epoch => return Err(reason::STALE_EPOCH),
        Command::Cut { constraints, .. } => {
            return Ok(constraints
                .into_iter()
                .map(|constraint| Action::Cut { constraint })
                .collect());
        }
        Command::CutSegment { from, to, direction } => Action::CutSegment { from, to, direction },
        Command::CutRadius { center, radius } => Action::CutRadius { center, radius },
        Command::MoveCollider { collider, translation, rotation } => {
            Action::MoveCollider { collider, translation, rotation }
        }
        Command::MoveAnchor { anchor, translation, rotation } => {
            Action::MoveAnchor { anchor, translation, rotation }
        }
        Command::Pause {} => Action::Pause,
        Command::Resume {} => Action::Resume,
        Command::Step { count } => {
            Action::Step { count: u32::try_from(count).map_err(|_| reason::ONLY_REPLAY)? }
        }
        Command::Reset {} => Action::Reset,
        // A path would let whoever opens the page read the files of the node's user.
        Command::Load { scene } if !catalog::is_known(&scene) => return Err("out_of_range"),
        Command::Load { scene } => {
            Action::Load { scene: Text::new(&scene).map_err(|_| "out_of_range")? }
        }
        Command::Set { parameter, value, constraint_kind } => Action::Set {
            parameter: Text::new(&parameter).map_err(|_| "unknown_parameter")?,
            value,
            constraint_kind,
        },
        Command::Rate { value } => Action::Set {
            parameter: Text::cut(Parameter::TimeScale.name()),
            value: ParameterValue::Number(value),
            constraint_kind: None,
        },
        Command::Seek { .. } | Command::Loop { .. } => return Err(reason::ONLY_REPLAY),
    };
    Ok(vec![action])
}
