//! Carries colliders and anchors for clients, and lets them glide on when they are thrown.
//!
//! The node moves a collider to a pose within one step, at the velocity that this implies. A page sends one
//! target per frame, which takes several steps, so the bridge sends a pose for each of them.

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use sim_contract::{Action, ColliderFields, ColliderShape, ColliderState, ParticleFlags, Reason};
use sim_solver::Pose;

use super::newest_state::LoadedState;
use crate::limits::CARRIED_MAX;
use crate::message::{Object, Refusal};
use crate::request::ClientId;
use crate::wire::to_f32;

/// Time in which a thrown object loses all but 1/e of its velocity, in s.
const GLIDE_S: f64 = 0.3;
/// Time after which it is at rest: at 1/3000 of its velocity, in s.
const GLIDE_END_S: f64 = 8.0 * GLIDE_S;
/// Flags of a particle that its anchor does not drive.
const NOT_DRIVEN: u32 = ParticleFlags::PINNED | ParticleFlags::GRABBED | ParticleFlags::FROZEN;

/// The objects that clients carry or have released in motion.
#[derive(Debug, Default)]
pub(super) struct Carrier {
    objects: BTreeMap<Object, Carried>,
}

/// The state in which an object is lifted.
#[derive(Debug, Clone, Copy)]
pub(super) struct LiftState<'a> {
    pub(super) state: &'a LoadedState<'a>,
    pub(super) colliders: &'a [ColliderState],
}

/// An object and its motion.
#[derive(Debug, Clone, Copy)]
struct Carried {
    /// The client that carries it; `None` once it is released.
    client: Option<ClientId>,
    /// Pose at which the client lifted it.
    begin: Pose,
    /// Offset from there in the last step that was sent.
    offset: [f64; 3],
    motion: Motion,
    moved: Moved,
}

/// The last move of a motion.
#[derive(Debug, Clone, Copy)]
enum Moved {
    /// There is none yet.
    Never,
    /// It followed the command at once, when the newest state may have been old.
    AtOnce { known_step: u64 },
    /// It followed the state of a step.
    After { step: u64 },
}

#[derive(Debug, Clone, Copy)]
enum Motion {
    /// It reaches the target with an equal part of the way in each step, and waits there.
    Towards { target: [f64; 3], steps_left: f64 },
    /// It slows down.
    Gliding { velocity: [f64; 3], left_s: f64 },
}

impl Carrier {
    /// Begins to carry an object.
    ///
    /// # Errors
    /// The scene has no such object, another client carries it, or too many objects are carried.
    pub(super) fn lift(
        &mut self,
        client: ClientId,
        object: Object,
        place: LiftState<'_>,
    ) -> Result<(), Refusal> {
        let known = self.objects.get(&object);
        if known.is_some_and(|one| one.client.is_some_and(|other| other != client)) {
            return Err(Reason::GrabbedByOther.into());
        }
        if known.is_none() && self.objects.len() >= CARRIED_MAX {
            return Err(Refusal::Busy);
        }
        let begin = place.pose(object)?;
        let motion = Motion::Towards { target: [0.0; 3], steps_left: 0.0 };
        let (client, offset, moved) = (Some(client), [0.0; 3], Moved::Never);
        self.objects.insert(object, Carried { client, begin, offset, motion, moved });
        Ok(())
    }

    /// Moves an object within `steps` steps towards an offset from the pose at which the client lifted it.
    ///
    /// # Errors
    /// This client does not carry it.
    pub(super) fn carry(
        &mut self,
        client: ClientId,
        object: Object,
        offset: [f32; 3],
        steps: f64,
    ) -> Result<(), Refusal> {
        let carried = self.find(client, object)?;
        let target = offset.map(f64::from);
        carried.begin(Motion::Towards { target, steps_left: steps.max(1.0) });
        Ok(())
    }

    /// Releases an object, which glides on with a velocity in m/s. Without one, it still reaches its target.
    ///
    /// # Errors
    /// This client does not carry it.
    pub(super) fn throw(
        &mut self,
        client: ClientId,
        object: Object,
        velocity: [f32; 3],
    ) -> Result<(), Refusal> {
        let carried = self.find(client, object)?;
        carried.client = None;
        let velocity = velocity.map(f64::from);
        if velocity != [0.0; 3] {
            carried.begin(Motion::Gliding { velocity, left_s: GLIDE_END_S });
        }
        self.remove_resting();
        Ok(())
    }

    fn find(&mut self, client: ClientId, object: Object) -> Result<&mut Carried, Refusal> {
        let carried = self.objects.get_mut(&object).filter(|one| one.client == Some(client));
        carried.ok_or(Reason::NotGrabbed.into())
    }

    /// Leaves what a client carries where it is.
    pub(super) fn remove_client(&mut self, client: ClientId) {
        self.objects.retain(|_, carried| carried.client != Some(client));
    }

    /// Forgets all objects: another state is in place.
    pub(super) fn clear(&mut self) {
        self.objects.clear();
    }

    /// Returns whether the next steps need poses.
    pub(super) fn is_moving(&self) -> bool {
        self.objects.values().any(Carried::is_moving)
    }

    /// Returns the moves for the step after the newest state.
    pub(super) fn advance(&mut self, state: &LoadedState<'_>) -> Vec<Action> {
        let step = state.header.step;
        let dt = 1.0 / f64::from(state.load.header.rate_hz.max(1));
        let mut moves = Vec::new();
        for (object, carried) in self.objects.iter_mut().filter(|(_, one)| one.is_moving()) {
            let passed = carried.pass(step);
            if passed > 0 {
                carried.advance(passed as f64, dt);
                let pose = carried.pose();
                let pose = if state.load.summary.is_planar { in_plane(pose) } else { pose };
                moves.push(move_to(*object, pose));
            }
        }
        self.remove_resting();
        moves
    }

    /// Forgets what nobody carries and nothing moves.
    fn remove_resting(&mut self) {
        self.objects.retain(|_, one| one.client.is_some() || one.is_moving());
    }
}

impl Carried {
    fn is_moving(&self) -> bool {
        match self.motion {
            Motion::Towards { steps_left, .. } => steps_left > 0.0,
            Motion::Gliding { left_s, .. } => left_s > 0.0,
        }
    }

    /// Begins another motion, which goes on without a pause if it moves already.
    fn begin(&mut self, motion: Motion) {
        if !self.is_moving() {
            self.moved = Moved::Never;
        }
        self.motion = motion;
    }

    /// Returns the number of steps since the last move, up to the step after the newest state.
    fn pass(&mut self, step: u64) -> u64 {
        let (passed, moved) = match self.moved {
            Moved::Never => (1, Moved::AtOnce { known_step: step }),
            Moved::AtOnce { known_step } if step > known_step => (1, Moved::After { step }),
            Moved::AtOnce { .. } => (0, self.moved),
            Moved::After { step: before } => (step.saturating_sub(before), Moved::After { step }),
        };
        self.moved = moved;
        passed
    }

    /// Moves it by a number of steps of `dt` seconds each.
    fn advance(&mut self, steps: f64, dt: f64) {
        match &mut self.motion {
            Motion::Towards { target, steps_left } => {
                let share = (steps / *steps_left).min(1.0);
                for (offset, target) in self.offset.iter_mut().zip(target) {
                    *offset += (*target - *offset) * share;
                }
                *steps_left -= steps;
            }
            Motion::Gliding { velocity, left_s } => {
                let left = (-steps * dt / GLIDE_S).exp();
                for (offset, velocity) in self.offset.iter_mut().zip(velocity) {
                    *offset += *velocity * GLIDE_S * (1.0 - left);
                    *velocity *= left;
                }
                *left_s -= steps * dt;
            }
        }
    }

    fn pose(&self) -> Pose {
        let Pose { translation, rotation } = self.begin;
        let along = |axis: usize| to_f32(f64::from(translation[axis]) + self.offset[axis]);
        Pose { translation: std::array::from_fn(along), rotation }
    }
}

/// Keeps a pose in the plane of a scene of two dimensions, which it must not leave by a rounding error.
fn in_plane(pose: Pose) -> Pose {
    let Pose { translation: [x, y, _], rotation: [_, _, z, w] } = pose;
    Pose { translation: [x, y, 0.0], rotation: [0.0, 0.0, z, w] }
}

fn move_to(object: Object, Pose { translation, rotation }: Pose) -> Action {
    match object {
        Object::Collider(collider) => {
            Action::MoveCollider { collider, translation, rotation, over_s: 0.0 }
        }
        Object::Anchor(anchor) => Action::MoveAnchor { anchor, translation, rotation, over_s: 0.0 },
    }
}

impl LiftState<'_> {
    /// Returns the present pose of an object, relative to that at load.
    fn pose(&self, object: Object) -> Result<Pose, Refusal> {
        let poses = &self.state.load.summary.poses;
        match object {
            Object::Collider(index) => {
                let fields = self.colliders.get(index as usize).and_then(fields);
                let pose = fields.and_then(|fields| poses.collider(index, &fields));
                pose.ok_or(Reason::UnknownCollider.into())
            }
            Object::Anchor(index) if poses.anchored().nth(index as usize).is_none() => {
                Err(Reason::UnknownAnchor.into())
            }
            Object::Anchor(index) => {
                let position = |particle: u32| {
                    let particle = self.state.particles.get(particle as usize)?;
                    (particle.flags & NOT_DRIVEN == 0).then_some(particle.position)
                };
                poses.anchor(index, position).ok_or(Reason::GrabbedByOther.into())
            }
        }
    }
}

/// Reads shape and pose. `None` for a shape that this version does not know.
fn fields(collider: &ColliderState) -> Option<ColliderFields> {
    let &ColliderState { radius, offset, normal, center, half_extents, rotation, a, b, .. } =
        collider;
    let shape = ColliderShape::from_number(collider.shape)?;
    Some(ColliderFields { shape, radius, offset, normal, center, half_extents, rotation, a, b })
}
