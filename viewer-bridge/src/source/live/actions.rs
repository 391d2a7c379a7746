//! Translates a command of a client into actions of the node.

use sim_contract::{Action, Parameter, Reason, Text};

use super::brush::Stroke;
use super::command_context::CommandContext;
use crate::message::{Command, Refusal};
use crate::scene::catalog::Catalog;

/// Returns the actions of a command, in order. The list is empty if there is nothing to do.
pub(super) fn actions(
    command: Command,
    context: CommandContext<'_>,
    catalog: &Catalog,
) -> Result<Vec<Action>, Refusal> {
    if context.is_replay && changes_simulation(&command) {
        return Err(Refusal::OnlyLive);
    }
    let action = match command {
        Command::Grab { particle, target, over_s } => Action::Grab { particle, target, over_s },
        Command::Move { particle, target, over_s } => Action::Move { particle, target, over_s },
        Command::Release { particle } => Action::Release { particle, force: false },
        Command::Brush { eye, ray, radius, delta, over_s, cap, stroke: _ } => {
            let stroke = Stroke { eye, ray, radius, delta, over_s, cap };
            let push = stroke.push(context);
            return Ok(push.into_iter().collect());
        }
        Command::Push { center, radius, delta, limit } => {
            Action::Push { center, radius, delta, limit }
        }
        Command::Pin { particle } => Action::Pin { particle },
        Command::Unpin { particle } => Action::Unpin { particle },
        Command::Cut { epoch, .. } if epoch != context.epoch => return Err(Refusal::StaleEpoch),
        Command::Cut { constraints, .. } => {
            return Ok(constraints
                .into_iter()
                .map(|constraint| Action::Cut { constraint })
                .collect());
        }
        Command::CutSegment { from, to, direction } => Action::CutSegment { from, to, direction },
        Command::CutRadius { center, radius } => Action::CutRadius { center, radius },
        Command::MoveCollider { collider, translation, rotation, over_s } => {
            Action::MoveCollider { collider, translation, rotation, over_s }
        }
        Command::DriveBody(drive) => drive.action(),
        Command::MoveAnchor { anchor, translation, rotation, over_s } => {
            Action::MoveAnchor { anchor, translation, rotation, over_s }
        }
        Command::Pause {} => Action::Pause,
        Command::Resume {} => Action::Resume,
        Command::Step { count } => {
            Action::Step { count: u32::try_from(count).map_err(|_| Refusal::OnlyReplay)? }
        }
        Command::Reset {} => Action::Reset,
        Command::Rewind { to_step } => Action::Rewind { to_step: Some(to_step), back_steps: None },
        // A path would let anybody with the page read the files of the node's user.
        Command::Load { scene } => {
            Action::Load { scene: catalog.source(&scene).ok_or(Refusal::UnknownScene)? }
        }
        Command::Mark { text } => {
            Action::Mark { text: Text::new(&text).map_err(|_| Reason::OutOfRange)? }
        }
        Command::Set { parameter, value, constraint_kind, block, collider, stroke: _ } => {
            let parameter = Text::new(&parameter).map_err(|_| Reason::UnknownParameter)?;
            Action::Set { parameter, value, constraint_kind, block, collider }
        }
        Command::Rate { value } => Action::set(Parameter::TimeScale.name(), value),
        Command::Seek { .. } | Command::Loop { .. } | Command::Ghost { .. } => {
            return Err(Refusal::OnlyReplay);
        }
        // The server of the pages and the link answer them.
        Command::Look { .. }
        | Command::Lift { .. }
        | Command::Carry { .. }
        | Command::Throw { .. }
        | Command::Undo { .. }
        | Command::Record {}
        | Command::StopRecording {} => return Err(Refusal::OnlyLive),
    };
    Ok(vec![action])
}

/// Returns whether `recorder play` refuses a command that a node would apply.
fn changes_simulation(command: &Command) -> bool {
    match command {
        Command::Pause {}
        | Command::Resume {}
        | Command::Step { .. }
        | Command::Rate { .. }
        | Command::Rewind { .. }
        | Command::Seek { .. }
        | Command::Ghost { .. }
        | Command::Loop { .. } => false,
        Command::Set { parameter, .. } => *parameter != Parameter::TimeScale.name(),
        _ => true,
    }
}
