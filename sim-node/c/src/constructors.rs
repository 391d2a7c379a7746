//! The constructors of commands whose arguments are their fields. Generated from the table of actions; do not edit.

use std::ffi::c_char;

use sim_contract::{Action, Command};

use crate::commands::{made, short_text};
use crate::pointers::numbers;

/// Holds a particle in place.
///
/// - `particle`: Index of the particle.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_pin(particle: u32) -> Command { made(|| Some(Action::Pin { particle })) }

/// Frees a pinned particle. Its velocity is 0.
///
/// - `particle`: Index of the particle.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_unpin(particle: u32) -> Command { made(|| Some(Action::Unpin { particle })) }

/// Grabs a particle, which moves along a straight line to a target.
///
/// - `particle`: Index of the particle.
/// - `target` (3 numbers): Target in m, relative to the scene's origin.
/// - `over_s`: Time to the target in seconds, 0..=3600, rounded up to whole steps.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_grab(particle: u32, target: *const f32, over_s: f32) -> Command { made(|| Some(Action::Grab { particle, target: numbers(target)?, over_s })) }

/// Sets a new target for a particle that this client has grabbed.
///
/// - `particle`: Index of the particle.
/// - `target` (3 numbers): Target in m, relative to the scene's origin.
/// - `over_s`: Time to the target in seconds, 0..=3600, rounded up to whole steps.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_move(particle: u32, target: *const f32, over_s: f32) -> Command { made(|| Some(Action::Move { particle, target: numbers(target)?, over_s })) }

/// Pauses the node at this boundary.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_pause() -> Command { made(|| Some(Action::Pause)) }

/// Resumes a paused node.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_resume() -> Command { made(|| Some(Action::Resume)) }

/// Makes a paused node perform `count` steps.
///
/// - `count`: Number of steps, 1 or more.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_step(count: u32) -> Command { made(|| Some(Action::Step { count })) }

/// Restores the initial state as the state of the next step. The step number continues.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_reset() -> Command { made(|| Some(Action::Reset)) }

/// Tears a constraint.
///
/// - `constraint`: Index of the constraint.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_cut(constraint: u32) -> Command { made(|| Some(Action::Cut { constraint })) }

/// Tears every constraint with an end inside a sphere.
///
/// - `center` (3 numbers): Center of the sphere in m, relative to the scene's origin.
/// - `radius`: Radius of the sphere in m. An end at exactly this distance is outside.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_cut_radius(center: *const f32, radius: f32) -> Command { made(|| Some(Action::CutRadius { center: numbers(center)?, radius })) }

/// Tears every constraint that crosses a strip: a segment extended to both sides.
///
/// - `from` (3 numbers): Start of the segment in m, relative to the scene's origin.
/// - `to` (3 numbers): End of the segment in m, relative to the scene's origin.
/// - `direction` (3 numbers): Direction in which the segment extends to both sides without limit; [0, 0, 1] for a planar scene.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_cut_segment(from: *const f32, to: *const f32, direction: *const f32) -> Command { made(|| Some(Action::CutSegment { from: numbers(from)?, to: numbers(to)?, direction: numbers(direction)? })) }

/// Replaces the scene.
///
/// - `scene`: Name of a built-in scene, or path of a file on the node's host.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_load(scene: *const c_char) -> Command { made(|| Some(Action::Load { scene: short_text(scene)? })) }

/// Marks the step in the log. Changes nothing else.
///
/// - `text`: Text for people and for programs that read the log. Empty text is rejected.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_command_mark(text: *const c_char) -> Command { made(|| Some(Action::Mark { text: short_text(text)? })) }
