//! Commands as values, for `catenary_request` and `catenary_send`: those with options. The others are in `constructors.rs`.

use std::ffi::c_char;

use sim_contract::{
    Action, Command, KindFilter, MovedObject, ParameterValue, Part, PathPart, PathPoint, Text,
};

use crate::pointers::{numbers, text};

/// Encodes an action; `None`, because of a null pointer or a wrong text, becomes the empty command, which
/// is refused when it is sent.
fn command(action: Option<Action>) -> Command {
    action.map_or_else(Command::default, |action| Command::new(0, 0, action))
}

/// Encodes the action of these arguments, as [`command`] does.
pub(crate) fn made(action: impl FnOnce() -> Option<Action>) -> Command {
    command(action())
}

/// Changes the action of a command; `None` leaves the command as it is.
fn changed(from: Command, change: impl FnOnce(&mut Action) -> Option<()>) -> Command {
    let mut action = from.action();
    let is_changed = change(&mut action).is_some();
    if is_changed { Command::new(from.client_id, from.sequence, action) } else { from }
}

pub(crate) fn short_text(pointer: *const c_char) -> Option<Text> {
    Text::new(&text(pointer, "text").ok().flatten()?).ok()
}

/// Releases a particle that this client has grabbed, with the velocity of its last motion.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_release(particle: u32) -> Command {
    command(Some(Action::Release { particle, force: false }))
}

/// Releases a grabbed particle, whichever client has grabbed it.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_release_forced(particle: u32) -> Command {
    command(Some(Action::Release { particle, force: true }))
}

/// Sets the velocity of the free particles within a sphere (`center`: 3 numbers; both in m) to `delta`
/// (3 numbers, in m per step) times the rate.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_push(
    center: *const f32,
    radius: f32,
    delta: *const f32,
) -> Command {
    push(center, radius, delta, None)
}

/// Pushes like `catenary_command_push`, with a limit in m on each component of `delta`.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_push_limited(
    center: *const f32,
    radius: f32,
    delta: *const f32,
    limit: f32,
) -> Command {
    push(center, radius, delta, Some(limit))
}

fn push(center: *const f32, radius: f32, delta: *const f32, limit: Option<f32>) -> Command {
    let pair = numbers(center).zip(numbers(delta));
    command(pair.map(|(center, delta)| Action::Push { center, radius, delta, limit }))
}

/// Moves an anchor to a pose, where it stays: by the end of the next step, or in the time that
/// `catenary_command_with_over` gives. `translation` (3 numbers, in m) and `rotation` (quaternion x, y, z, w) are relative to
/// the pose at load. A null `rotation` is no rotation.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_move_anchor(
    anchor: u32,
    translation: *const f32,
    rotation: *const f32,
) -> Command {
    let rotation = numbers(rotation).unwrap_or(IDENTITY);
    let action = |translation| Action::MoveAnchor { anchor, translation, rotation, over_s: 0.0 };
    command(numbers(translation).map(action))
}

/// Moves a collider to a pose during the next step, with the velocity that this implies; see
/// `catenary_command_move_anchor`.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_move_collider(
    collider: u32,
    translation: *const f32,
    rotation: *const f32,
) -> Command {
    let rotation = numbers(rotation).unwrap_or(IDENTITY);
    let action =
        |translation| Action::MoveCollider { collider, translation, rotation, over_s: 0.0 };
    command(numbers(translation).map(action))
}

/// Gives a `catenary_command_move_anchor` or `catenary_command_move_collider` the time in which it reaches its pose, in
/// seconds: 0 to 3600, rounded up to whole steps, at least one. Other commands stay as they are.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_with_over(motion: Command, over_s: f32) -> Command {
    changed(motion, |action| match action {
        Action::MoveAnchor { over_s: own, .. } | Action::MoveCollider { over_s: own, .. } => {
            *own = over_s;
            Some(())
        }
        _ => None,
    })
}

/// Leads an object (`object` is a `catenary_moved_object`) along the points of `catenary_command_with_point`: an anchor, a
/// collider, or a particle that this client has grabbed.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_follow(object: u32, object_index: u32) -> Command {
    let (path, append) = (PathPart::EMPTY, false);
    command(MovedObject::from_number(object).map(|object| Action::Follow {
        object,
        object_index,
        path,
        append,
    }))
}

/// Adds a point to a `catenary_command_follow`, which has at most 4: the time in seconds after the step of the command that
/// begins the motion, ascending, and a pose as in `catenary_command_move_anchor`; for a particle a position, in m. A
/// fifth point or a null translation makes the empty command. Other commands stay as they are.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_with_point(
    follow: Command,
    time_s: f64,
    translation: *const f32,
    rotation: *const f32,
) -> Command {
    let Action::Follow { object, object_index, path, append } = follow.action() else {
        return follow;
    };
    let point = |translation| PathPoint {
        time: time_s,
        translation,
        rotation: numbers(rotation).unwrap_or(IDENTITY),
    };
    let points = |point| [path.points(), &[point]].concat();
    let path = numbers(translation).map(point).and_then(|point| PathPart::new(&points(point)));
    command(path.map(|path| Action::Follow { object, object_index, path, append }))
}

/// Appends the points of a `catenary_command_follow` to the motion that an earlier one began, and whose times go on. Other
/// commands stay as they are.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_appended(follow: Command) -> Command {
    changed(follow, |action| match action {
        Action::Follow { append, .. } => {
            *append = true;
            Some(())
        }
        _ => None,
    })
}

/// Moves a body through the next step, with its mass and inertia. `translation` and `rotation` are as in
/// `catenary_command_move_anchor`; `velocity` (m/s) and `angular_velocity` (rad/s) are those at the start of the step.
/// A null velocity is 0. `catenary_command_with_wrench` adds a force and a torque.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_drive_body(
    collider: u32,
    translation: *const f32,
    rotation: *const f32,
    velocity: *const f32,
    angular_velocity: *const f32,
) -> Command {
    let action = |translation| Action::DriveBody {
        collider,
        translation,
        rotation: numbers(rotation).unwrap_or(IDENTITY),
        velocity: numbers(velocity).unwrap_or_default(),
        angular_velocity: numbers(angular_velocity).unwrap_or_default(),
        force: [0.0; 3],
        torque: [0.0; 3],
    };
    command(numbers(translation).map(action))
}

/// Adds a force (N) on the center of the body and a torque (N m) about it to a `catenary_command_drive_body`,
/// beside gravity and the contacts. A null vector is 0. Other commands stay as they are.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_with_wrench(
    command: Command,
    force: *const f32,
    torque: *const f32,
) -> Command {
    changed(command, |action| match action {
        Action::DriveBody { force: own_force, torque: own_torque, .. } => {
            *own_force = numbers(force).unwrap_or_default();
            *own_torque = numbers(torque).unwrap_or_default();
            Some(())
        }
        _ => None,
    })
}

/// No rotation.
const IDENTITY: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// Sets a parameter, such as "damping", to a number.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_set(parameter: *const c_char, value: f32) -> Command {
    set(parameter, Some(ParameterValue::Number(value)))
}

/// Sets a parameter, such as "gravity", to three numbers.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_set_vector(
    parameter: *const c_char,
    value: *const f32,
) -> Command {
    set(parameter, numbers(value).map(ParameterValue::Vector))
}

/// Switches a parameter off, such as the limit `tear_force`.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_set_off(parameter: *const c_char) -> Command {
    set(parameter, Some(ParameterValue::Off))
}

/// Returns a command that sets "compliance" or "stiffness", for the constraints of one kind only (a
/// `catenary_constraint_kind`). Any other command is returned unchanged.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_for_kind(set: Command, constraint_kind: u32) -> Command {
    changed(set, |action| match action.for_part(Part::All) {
        Action::Set { parameter, value, block, collider, .. } => {
            let constraint_kind = Some(KindFilter::from_number(constraint_kind));
            *action = Action::Set { parameter, value, constraint_kind, block, collider };
            Some(())
        }
        _ => None,
    })
}

/// Returns a command that sets "bending", for the bends of one generated block only: the index of the
/// `[[generate]]` block in the scene. A node rejects a block for another parameter. Any command other than a set is
/// returned unchanged.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_for_block(set: Command, block: u32) -> Command {
    for_part(set, Part::Block(block))
}

/// Returns a command that sets "friction" or "restitution", for one collider only: its index in the scene. A node
/// rejects a collider for another parameter. Any command other than a set is returned unchanged.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_for_collider(set: Command, collider: u32) -> Command {
    for_part(set, Part::Collider(collider))
}

fn for_part(set: Command, part: Part) -> Command {
    changed(set, |action| {
        *action = action.for_part(part);
        matches!(action, Action::Set { .. }).then_some(())
    })
}

fn set(parameter: *const c_char, value: Option<ParameterValue>) -> Command {
    let pair = short_text(parameter).zip(value);
    command(pair.map(|(parameter, value)| Action::set(parameter.as_str(), value)))
}

/// Puts the nearest kept state at or before a step of this run in place; `catenary_command_rewound_step` of the outcome's command
/// returns its step.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_rewind_to(step: u64) -> Command {
    command(Some(Action::Rewind { to_step: Some(step), back_steps: None }))
}

/// Returns the step of the state that a rewind has put in place, from the command of its outcome; `UINT64_MAX` for another
/// command.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_rewound_step(rewind: Command) -> u64 {
    match rewind.action() {
        Action::Rewind { to_step: Some(step), .. } => step,
        _ => u64::MAX,
    }
}

/// Puts the nearest kept state at least a number of steps ago in place.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_rewind_back(steps: u32) -> Command {
    command(Some(Action::Rewind { to_step: None, back_steps: Some(steps) }))
}
