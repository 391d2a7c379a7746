//! Commands that move anchors and colliders, and lead them and grabbed particles along points in time.

use glam::Vec3;
use sim_scene::rotation::Pose;
use sim_types::{Action, MovedObject, PathPoint, Reason};

use crate::frame::Frame;
use crate::motion::{MOTION_POINTS_MAX, Motion, steps_at};
use crate::solver::Solver;

/// Points in time for a grabbed particle, an anchor or a collider.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Follow<'a> {
    pub(crate) object: MovedObject,
    pub(crate) index: u32,
    pub(crate) points: &'a [PathPoint],
    /// Appends the points to the motion under way.
    pub(crate) append: bool,
}

impl Solver {
    /// Moves the frame of an anchor to a pose by the end of the next step, where it stays.
    ///
    /// # Errors
    /// Same as [`Self::move_anchor_over`].
    pub fn move_anchor(&mut self, anchor: u32, pose: Pose) -> Result<(), Reason> {
        self.move_anchor_over(anchor, pose, 0.0)
    }

    /// Moves the frame of an anchor to a pose within `over_s` seconds, linearly, where it stays. The time is rounded up
    /// to whole steps, at least one.
    ///
    /// # Errors
    /// The anchor is unknown, a number is not finite or out of range, or too many motions are under way.
    pub fn move_anchor_over(&mut self, anchor: u32, pose: Pose, over_s: f32) -> Result<(), Reason> {
        let Pose { translation, rotation } = pose;
        Action::MoveAnchor { anchor, translation, rotation, over_s }.validate()?;
        let frame = Frame::check(&pose, self.context())?;
        let object = (MovedObject::Anchor, anchor);
        let current = self.current_frame(object)?;
        let (moved, motion) = match self.grab_steps(over_s) {
            1 => (frame, None),
            steps => (current, Some(self.motion_to(object, frame, steps)?)),
        };
        self.anchors.moved[anchor as usize] = Some(moved);
        self.anchors.motions[anchor as usize] = motion;
        Ok(())
    }

    /// Moves a collider to a pose relative to its pose at load, by the end of the next step and with
    /// the velocity that this implies. There it stays. It rotates about its own center; bounds do
    /// not rotate.
    ///
    /// # Errors
    /// Same as [`Self::move_collider_over`].
    pub fn move_collider(&mut self, collider: u32, pose: Pose) -> Result<(), Reason> {
        self.move_collider_over(collider, pose, 0.0)
    }

    /// Moves a collider as [`Self::move_collider`] does, but within `over_s` seconds, linearly. The time is rounded up
    /// to whole steps, at least one.
    ///
    /// # Errors
    /// The collider is unknown, a number is not finite or out of range, or too many motions are under way.
    pub fn move_collider_over(
        &mut self,
        collider: u32,
        pose: Pose,
        over_s: f32,
    ) -> Result<(), Reason> {
        let Pose { translation, rotation } = pose;
        Action::MoveCollider { collider, translation, rotation, over_s }.validate()?;
        let frame = Frame::check(&pose, self.context())?;
        let object = (MovedObject::Collider, collider);
        self.check_accepted(object, &frame)?;
        match self.grab_steps(over_s) {
            1 => self.colliders[collider as usize].move_to(frame),
            steps => {
                let motion = self.motion_to(object, frame, steps)?;
                self.colliders[collider as usize].follow_motion(motion);
            }
        }
        Ok(())
    }

    /// Leads a particle that this client has grabbed, an anchor or a collider along points in time.
    ///
    /// # Errors
    /// The object is unknown or not grabbed, a number is not finite or out of range, the times do not ascend, there is
    /// no motion to which the points could be appended, or too many points are on their way.
    pub(crate) fn follow(&mut self, client_id: u64, follow: &Follow<'_>) -> Result<(), Reason> {
        let object = (follow.object, follow.index);
        if follow.object == MovedObject::Particle {
            self.find_unfrozen(follow.index)?;
            self.find_own_grab(client_id, follow.index)?;
        }
        let current = self.current_frame(object)?;
        let points = self.check_points(object, follow.points)?;
        let motion = if follow.append {
            let motion = self.motion_of(object).ok_or(Reason::NoEffectHere)?;
            motion.extended(self.scene_step, &points).ok_or(Reason::OutOfRange)?
        } else {
            Motion::along(self.scene_step, current, &points)
        };
        self.check_room(object, &motion)?;
        self.set_motion(object, current, motion)
    }

    fn set_motion(
        &mut self,
        (object, index): (MovedObject, u32),
        current: Frame,
        motion: Motion,
    ) -> Result<(), Reason> {
        match object {
            MovedObject::Particle => {
                let place = self.find_grab(index).map_err(|_| Reason::NotGrabbed)?;
                self.grabs[place].motion = Some(motion);
            }
            MovedObject::Anchor => {
                self.anchors.moved[index as usize] = Some(current);
                self.anchors.motions[index as usize] = Some(motion);
            }
            MovedObject::Collider => self.colliders[index as usize].follow_motion(motion),
        }
        Ok(())
    }

    /// The motion of an object from where it is.
    pub(super) fn motion_to(
        &self,
        object: (MovedObject, u32),
        target: Frame,
        steps: u32,
    ) -> Result<Motion, Reason> {
        let current = self.current_frame(object)?;
        let motion = Motion::between(self.scene_step, current, target, steps);
        self.check_room(object, &motion)?;
        Ok(motion)
    }

    /// Where an object is between two steps.
    fn current_frame(&self, (object, index): (MovedObject, u32)) -> Result<Frame, Reason> {
        match object {
            MovedObject::Particle => {
                let particle = self.particles.states.get(index as usize);
                let position = particle.ok_or(Reason::UnknownParticle)?.position;
                Ok(Frame { translation: Vec3::from_array(position), ..Frame::AT_LOAD })
            }
            MovedObject::Anchor => {
                let frame = self.anchors.frame(index, self.scene_time_s());
                frame.ok_or(Reason::UnknownAnchor)
            }
            MovedObject::Collider => {
                let collider = self.colliders.get(index as usize);
                Ok(collider.ok_or(Reason::UnknownCollider)?.current())
            }
        }
    }

    fn motion_of(&self, (object, index): (MovedObject, u32)) -> Option<&Motion> {
        match object {
            MovedObject::Particle => self.grabs[self.find_grab(index).ok()?].motion.as_ref(),
            MovedObject::Anchor => self.anchors.motions.get(index as usize)?.as_ref(),
            MovedObject::Collider => self.colliders.get(index as usize)?.motion.as_ref(),
        }
    }

    /// The points with their times in steps.
    fn check_points(
        &self,
        object: (MovedObject, u32),
        points: &[PathPoint],
    ) -> Result<Vec<(f64, Frame)>, Reason> {
        let mut checked: Vec<(f64, Frame)> = Vec::with_capacity(points.len());
        for &PathPoint { time, translation, rotation } in points {
            let frame = Frame::check(&Pose { translation, rotation }, self.context())?;
            self.check_accepted(object, &frame)?;
            let steps = steps_at(time, self.settings.rate_hz);
            // Times that ascend can round to the same time in steps.
            if checked.last().is_some_and(|(before, _)| *before >= steps) {
                return Err(Reason::OutOfRange);
            }
            checked.push((steps, frame));
        }
        Ok(checked)
    }

    /// Checks that an object can have a frame: bounds do not rotate, and neither do particles.
    fn check_accepted(
        &self,
        (object, index): (MovedObject, u32),
        frame: &Frame,
    ) -> Result<(), Reason> {
        let is_accepted = match object {
            MovedObject::Particle => frame.rotation == Frame::AT_LOAD.rotation,
            MovedObject::Anchor => true,
            MovedObject::Collider => {
                self.colliders.get(index as usize).ok_or(Reason::UnknownCollider)?.accepts(frame)
            }
        };
        if is_accepted { Ok(()) } else { Err(Reason::OutOfRange) }
    }

    /// Checks that the points of all motions fit into a keyframe if this motion replaces the present motion of its object.
    fn check_room(&self, object: (MovedObject, u32), motion: &Motion) -> Result<(), Reason> {
        let count = |motion: &Motion| motion.point_count(self.scene_step);
        let replaced = self.motion_of(object).map_or(0, count);
        let all = self.motions().map(count).sum::<usize>() - replaced + count(motion);
        if all <= MOTION_POINTS_MAX { Ok(()) } else { Err(Reason::OutOfRange) }
    }

    /// Returns `true` if the last step may have changed more of the keyframe than the step of the scene, even without
    /// commands, tears and frozen particles: a client grabs a particle, or a motion was under way.
    pub fn changes_without_commands(&self) -> bool {
        let before = self.scene_step().saturating_sub(1);
        !self.grabs.is_empty() || self.motions().any(|motion| motion.is_under_way(before))
    }

    /// The motions of clients.
    fn motions(&self) -> impl Iterator<Item = &Motion> {
        let grabs = self.grabs.iter().filter_map(|grab| grab.motion.as_ref());
        let colliders = self.colliders.iter().filter_map(|collider| collider.motion.as_ref());
        grabs.chain(self.anchors.motions.iter().flatten()).chain(colliders)
    }
}
