//! From an action to what the solver does. A running node has its own: there, pause, step and load
//! do something, and the time scale is its pace.

use sim_contract::{Action, Reason, SettingKind, SettingValue};
use sim_solver::{Ball, ConstraintKind, Grip, Pose, Push, Rejection, Setting, Solver, Sweep};

/// Applies an action at the boundary before a step. A rejected one changes nothing.
pub(crate) fn apply(solver: &mut Solver, client_id: u64, action: Action) -> Result<(), Reason> {
    match action {
        _ if is_control(action) => Ok(()),
        Action::Set { parameter, value, constraint_kind } => {
            let kind = constraint_kind.map(known_kind).transpose()?;
            solver.set(parameter.as_str(), setting(value), kind).map_err(reason)
        }
        _ => change(solver, client_id, action).map_err(reason),
    }
}

/// Whether the action only says when steps are made, and nothing about the state.
pub(crate) fn is_control(action: Action) -> bool {
    matches!(action, Action::Pause | Action::Resume | Action::Step { .. })
}

fn change(solver: &mut Solver, client_id: u64, action: Action) -> Result<(), Rejection> {
    match action {
        Action::Pin { particle } => solver.pin(particle),
        Action::Unpin { particle } => solver.unpin(particle),
        Action::Grab { particle, target, over_s } => {
            solver.grab(client_id, Grip { particle, target, over_s })
        }
        Action::Move { particle, target, over_s } => {
            solver.move_grabbed(client_id, Grip { particle, target, over_s })
        }
        Action::Release { particle } => solver.release(client_id, particle),
        Action::Push { center, radius, delta, limit } => {
            solver.push(Push { ball: Ball { center, radius }, delta, limit })
        }
        Action::Cut { constraint } => solver.cut(constraint),
        Action::CutRadius { center, radius } => solver.cut_radius(Ball { center, radius }),
        Action::CutSegment { from, to, direction } => {
            solver.cut_segment(Sweep { from, to, direction })
        }
        Action::MoveAnchor { anchor, translation, rotation } => {
            solver.move_anchor(anchor, Pose { translation, rotation })
        }
        Action::MoveCollider { collider, translation, rotation } => {
            solver.move_collider(collider, Pose { translation, rotation })
        }
        Action::Reset => {
            solver.reset();
            Ok(())
        }
        // A recording is of one scene: a load ends it. And kinds of other versions.
        _ => Err(Rejection::NoEffectHere),
    }
}

fn setting(value: SettingValue) -> Setting {
    match value {
        SettingValue::Number(number) => Setting::Number(number),
        SettingValue::Vector(vector) => Setting::Vector(vector),
        SettingValue::Off => Setting::Off,
    }
}

fn known_kind(kind: SettingKind) -> Result<ConstraintKind, Reason> {
    let SettingKind::Known(kind) = kind else { return Err(Reason::OutOfRange) };
    Ok(match kind {
        sim_contract::ConstraintKind::Structural => ConstraintKind::Structural,
        sim_contract::ConstraintKind::Shear => ConstraintKind::Shear,
        sim_contract::ConstraintKind::Bend => ConstraintKind::Bend,
        sim_contract::ConstraintKind::Tether => ConstraintKind::Tether,
    })
}

fn reason(rejection: Rejection) -> Reason {
    Reason::from_name(rejection.name()).unwrap_or(Reason::NoEffectHere)
}
