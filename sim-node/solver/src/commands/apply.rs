//! Applies actions: the only way from a command to the state.

use sim_scene::rotation::Pose;
use sim_types::{
    Action, CLIENT_ID_END, MovedObject, Parameter, ParameterValue, Part, Reason, Text,
};

use super::cut::{Sphere, Sweep};
use super::moves::Follow;
use super::{Grab, Push};
use crate::contacts::bodies::driven_body::BodyMotion;
use crate::parameters::part_of_command;
use crate::solver::Solver;

/// Effect of an applied action.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Applied {
    /// The state or a parameter changed, or already was as the action asks.
    State,
    /// A grab has a new target, or a body its motion in the next step. The next keyframe can wait.
    Target,
    /// The next step shows a state that was put in place.
    InPlace,
    /// Nothing changed in the solver: the action concerns the process that steps it.
    Control(Control),
}

/// An action for the process that steps a solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Control {
    /// Stop stepping.
    Pause,
    /// Go on stepping.
    Resume,
    /// Make `count` steps while paused.
    Step {
        /// Number of steps.
        count: u32,
    },
    /// Change the pace, in multiples of real time; the value has been checked.
    TimeScale(f32),
    /// Replace the scene.
    Load {
        /// Name of a built-in scene, or path of a file.
        scene: Text,
    },
    /// Put an earlier state in place, with [`Solver::put_in_place`].
    Rewind {
        /// Step of the run.
        to_step: Option<u64>,
        /// Number of steps back.
        back_steps: Option<u32>,
    },
    /// Put a state in place that belongs to the command.
    Restore,
    /// Nothing: the log has the mark.
    Mark,
}

impl Solver {
    /// Applies an action at the boundary before the next step.
    ///
    /// `client_id` names the sender: only the client that grabbed a particle can move or release
    /// it. It is below [`CLIENT_ID_END`].
    ///
    /// # Errors
    /// The action is wrong or has no effect here. A rejected action changes no bit of the state.
    pub fn apply(&mut self, client_id: u64, action: &Action) -> Result<Applied, Reason> {
        self.assert_whole();
        if client_id >= CLIENT_ID_END {
            return Err(Reason::OutOfRange);
        }
        action.validate()?;
        match *action {
            Action::Pin { particle } => self.pin(particle)?,
            Action::Unpin { particle } => self.unpin(particle)?,
            Action::Grab { particle, target, over_s } => {
                self.grab(client_id, Grab { particle, target, over_s })?;
            }
            Action::Move { particle, target, over_s } => {
                self.move_grabbed(client_id, Grab { particle, target, over_s })?;
                return Ok(Applied::Target);
            }
            Action::Release { particle, force: false } => self.release(client_id, particle)?,
            Action::Release { particle, force: true } => self.release_of_any(particle)?,
            Action::Push { center, radius, delta, limit } => {
                self.push(Push { sphere: Sphere { center, radius }, delta, limit })?;
            }
            Action::Cut { constraint } => self.cut(constraint)?,
            Action::CutRadius { center, radius } => self.cut_radius(Sphere { center, radius })?,
            Action::CutSegment { from, to, direction } => {
                self.cut_segment(Sweep { from, to, direction })?;
            }
            Action::MoveAnchor { anchor, translation, rotation, over_s } => {
                self.move_anchor_over(anchor, Pose { translation, rotation }, over_s)?;
            }
            Action::MoveCollider { collider, translation, rotation, over_s } => {
                self.move_collider_over(collider, Pose { translation, rotation }, over_s)?;
            }
            Action::Follow { object, object_index: index, path, append } => {
                self.follow(client_id, &Follow { object, index, points: path.points(), append })?;
                if object == MovedObject::Particle {
                    return Ok(Applied::Target);
                }
            }
            Action::DriveBody {
                collider,
                translation,
                rotation,
                velocity,
                angular_velocity,
                force,
                torque,
            } => {
                let motion = BodyMotion { velocity, angular_velocity, force, torque };
                self.drive_body(collider, Pose { translation, rotation }, &motion)?;
                return Ok(Applied::Target);
            }
            Action::Set { parameter, value, constraint_kind, block, collider } => {
                let part = part_of_command(constraint_kind, block, collider)?;
                return self.apply_setting(parameter.as_str(), value, part);
            }
            Action::Reset => {
                self.reset();
                return Ok(Applied::InPlace);
            }
            Action::Pause => return Ok(Applied::Control(Control::Pause)),
            Action::Resume => return Ok(Applied::Control(Control::Resume)),
            Action::Step { count } => return Ok(Applied::Control(Control::Step { count })),
            Action::Load { scene } => return Ok(Applied::Control(Control::Load { scene })),
            Action::Rewind { to_step, back_steps } => {
                return Ok(Applied::Control(Control::Rewind { to_step, back_steps }));
            }
            Action::Restore { .. } => return Ok(Applied::Control(Control::Restore)),
            Action::Mark { .. } => return Ok(Applied::Control(Control::Mark)),
            Action::Unknown { .. } => return Err(Reason::NoEffectHere),
        }
        Ok(Applied::State)
    }

    fn apply_setting(
        &mut self,
        parameter: &str,
        value: ParameterValue,
        part: Part,
    ) -> Result<Applied, Reason> {
        self.set_for(parameter, value, part)?;
        match value {
            ParameterValue::Number(scale) if parameter == Parameter::TimeScale.name() => {
                Ok(Applied::Control(Control::TimeScale(scale)))
            }
            _ => Ok(Applied::State),
        }
    }
}
