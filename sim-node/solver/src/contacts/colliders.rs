//! Colliders and their motion.

use std::sync::Arc;

use glam::{DVec3, Quat, Vec3};
use sim_scene::rotation::rotation_about;
use sim_scene::scene::{ColliderBody, ColliderGeometry, SceneCollider};
use sim_types::Reason;

use super::bodies::driven_body::{BodyMotion, BodyState, DrivenBody};
use super::contact_substep::ContactSubstep;
use super::mesh::collision_mesh::CollisionMesh;
use super::placed_shape::PlacedShape;
use crate::frame::{Frame, angular_velocity};
use crate::motion::{Motion, Path};
use crate::parameters::surfaces::ColliderSurface;

/// A collider and its motion.
#[derive(Debug, Clone)]
pub(crate) struct Collider {
    at_load: PlacedShape,
    /// The triangles of a mesh.
    pub(crate) mesh: Option<Arc<CollisionMesh>>,
    /// Friction and restitution by the parameters.
    pub(crate) surface: ColliderSurface,
    velocity: DVec3,
    angular_velocity: DVec3,
    pub(crate) body: Option<ColliderBody>,
    /// The copy of the body in the next or the running step; None in a step without its command.
    pub(crate) driven: Option<DrivenBody>,
    /// Its path in the scene, in place of a constant velocity.
    path: Path,
    /// Frame to which a client has moved it; it replaces the collider's own motion.
    pub(crate) moved: Option<Frame>,
    /// The motion of a client, which moves that frame.
    pub(crate) motion: Option<Motion>,
    /// Frame at the start of the running step.
    start: Frame,
    /// Frame at the end of the running step.
    end: Frame,
    /// Velocity in the running step, or in the last one between two steps.
    pub(crate) linear: Vec3,
    /// Angular velocity in rad/s, likewise.
    pub(crate) angular: Vec3,
}

/// A collider at its current pose, for drawing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedCollider {
    /// Shape and pose; a plane's normal and the rotation of a box or mesh are normalised.
    pub shape: ColliderGeometry,
    /// Fraction of the approach speed with which a particle bounces.
    pub restitution: f32,
    /// Coefficient of Coulomb friction.
    pub friction: f32,
    /// Velocity in the last step, in units per second.
    pub velocity: [f32; 3],
    /// Angular velocity in the last step, in rad/s.
    pub angular_velocity: [f32; 3],
}

impl Collider {
    /// `index` is that of the collider in the scene.
    pub(crate) fn new(index: usize, scene: &SceneCollider) -> Self {
        let mut collider = Self {
            at_load: PlacedShape::new(&scene.shape),
            mesh: scene.mesh.as_ref().map(|mesh| Arc::new(CollisionMesh::new(mesh, index))),
            surface: ColliderSurface::from(scene),
            velocity: Vec3::from_array(scene.velocity).as_dvec3(),
            angular_velocity: Vec3::from_array(scene.angular_velocity).as_dvec3(),
            body: scene.body,
            driven: None,
            path: Path::new(&scene.path, scene.repeat),
            moved: None,
            motion: None,
            start: Frame::AT_LOAD,
            end: Frame::AT_LOAD,
            linear: Vec3::from_array(scene.velocity),
            angular: Vec3::from_array(scene.angular_velocity),
        };
        if !collider.path.is_empty() {
            collider.place(0.0);
        }
        collider
    }

    /// Prepares a solid mesh for many steps.
    pub(crate) fn for_steps(mut self) -> Self {
        if let Some(mesh) = self.mesh.as_mut().and_then(Arc::get_mut) {
            mesh.find_cells();
        }
        self
    }

    /// True if a client may set this frame: bounds do not rotate.
    pub(crate) fn accepts(&self, frame: &Frame) -> bool {
        frame.rotation == Quat::IDENTITY || !matches!(self.at_load, PlacedShape::Bounds { .. })
    }

    /// Moves it to a frame that it accepts by the end of the next step.
    pub(crate) fn move_to(&mut self, frame: Frame) {
        (self.moved, self.motion) = (Some(frame), None);
        self.driven = None;
    }

    /// Moves it along a motion whose frames it accepts.
    pub(crate) fn follow_motion(&mut self, motion: Motion) {
        (self.moved, self.motion) = (Some(self.end), Some(motion));
        self.driven = None;
    }

    /// Its frame between two steps.
    pub(crate) fn current(&self) -> Frame {
        self.end
    }

    /// Drives its body in the next step, which takes `dt` seconds, from a frame.
    pub(crate) fn drive(
        &mut self,
        frame: Frame,
        motion: &BodyMotion,
        dt: f32,
    ) -> Result<(), Reason> {
        let body = self.body.as_ref().ok_or(Reason::NoEffectHere)?;
        let at_load = (self.at_load.center(), self.at_load.axes());
        let driven = DrivenBody::new(body, at_load, frame, motion);
        if !driven.bears_wrench(dt) {
            return Err(Reason::OutOfRange);
        }
        (self.moved, self.motion) = (Some(frame), None);
        self.driven = Some(driven);
        Ok(())
    }

    /// Forgets the frame and the motion that clients have set.
    pub(crate) fn reset(&mut self) {
        (self.moved, self.motion, self.driven) = (None, None, None);
        self.place(0.0);
    }

    /// Places it as after a step that ends at `time_s`, in seconds.
    pub(crate) fn place(&mut self, time_s: f64) {
        self.driven = None;
        self.end = self.frame(time_s);
        self.start = self.end;
        let is_own = self.moved.is_none() && self.path.is_empty();
        self.linear = if is_own { self.velocity.as_vec3() } else { Vec3::ZERO };
        self.angular = if is_own { self.angular_velocity.as_vec3() } else { Vec3::ZERO };
    }

    /// Begins a step that ends as `scene_step`, at `time_s`, and takes `dt`, both in seconds.
    pub(crate) fn begin_step(&mut self, scene_step: u64, time_s: f64, dt: f32) {
        self.start = self.end;
        if let Some(motion) = &self.motion {
            self.moved = Some(motion.frame(scene_step));
        }
        self.end = self.frame(time_s);
        if let Some(body) = &self.driven {
            self.follow(body.at_start());
            self.start = self.end;
        } else if self.moved.is_some() || !self.path.is_empty() {
            self.linear = (self.end.translation - self.start.translation) / dt;
            self.angular = angular_velocity(self.start.rotation, self.end.rotation, dt);
        }
    }

    /// Begins a substep of a driven body. Returns false if the collider is none in this step.
    pub(crate) fn begin_body_substep(&mut self, substep: &ContactSubstep) -> bool {
        let Some(body) = &mut self.driven else { return false };
        body.begin_substep(substep.h, substep.gain);
        self.start = body.before();
        self.follow_body();
        true
    }

    /// Places it at the pose of its driven body at the end of the running substep.
    pub(crate) fn follow_body(&mut self) {
        if let Some(body) = &self.driven {
            self.follow(body.state());
        }
    }

    /// Ends a step. The copy of the body is gone, and the collider stays where it came.
    pub(crate) fn end_step(&mut self) {
        if let Some(body) = self.driven.take() {
            let BodyState { frame, .. } = body.state();
            self.start = body.at_start().frame;
            self.moved = Some(frame);
        }
    }

    fn follow(&mut self, BodyState { frame, linear, angular }: BodyState) {
        (self.end, self.linear, self.angular) = (frame, linear, angular);
    }

    /// True for a body that stands in the running step, because its program has not sent its command.
    pub(crate) fn is_left_standing(&self) -> bool {
        self.body.is_some() && self.moved.is_some() && self.driven.is_none() && !self.is_moving()
    }

    /// Frame by its own motion, or the one to which a client has moved it.
    fn frame(&self, time_s: f64) -> Frame {
        if let Some(moved) = self.moved {
            return moved;
        }
        if !self.path.is_empty() {
            return self.path.frame(time_s);
        }
        let speed = self.angular_velocity.dot(self.angular_velocity).sqrt();
        if speed == 0.0 {
            return Frame { translation: (self.velocity * time_s).as_vec3(), ..Frame::AT_LOAD };
        }
        let axis = self.angular_velocity * (1.0 / speed);
        Frame::new(self.velocity * time_s, rotation_about(axis, speed * time_s))
    }

    /// True if its pose changes in the running step.
    pub(crate) fn is_moving(&self) -> bool {
        self.start != self.end
    }

    /// Pose and velocity after the last step.
    pub(crate) fn placed(&self) -> PlacedCollider {
        PlacedCollider {
            shape: self.shape_at(1.0).to_scene(),
            restitution: self.surface.restitution,
            friction: self.surface.friction,
            velocity: self.linear.to_array(),
            angular_velocity: self.angular.to_array(),
        }
    }

    /// Shape after a fraction of the running step.
    pub(crate) fn shape_at(&self, share: f32) -> PlacedShape {
        self.at_load.moved(&self.frame_at(share))
    }

    /// Center of rotation after a fraction of the running step.
    pub(crate) fn pivot(&self, share: f32) -> Vec3 {
        self.at_load.center() + self.frame_at(share).translation
    }

    fn frame_at(&self, share: f32) -> Frame {
        match share {
            _ if !self.is_moving() => self.end,
            0.0 => self.start,
            1.0 => self.end,
            share => self.start.towards(&self.end, share),
        }
    }
}
