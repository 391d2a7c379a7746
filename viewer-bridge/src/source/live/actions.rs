//! Translates a command of a client into actions of the node.

use sim_contract::{Action, Parameter, ParticleState};

use crate::message::{Brush, CommandKind, Refusal};
use crate::scene::catalog::Catalog;
use crate::wire::to_f32;

/// The state to which a command refers.
#[derive(Debug, Clone, Copy)]
pub(super) struct CommandContext<'a> {
    /// Number of the load on show.
    pub(super) epoch: u32,
    /// Steps per second.
    pub(super) rate_hz: u32,
    /// The scene has two dimensions.
    pub(super) is_planar: bool,
    /// A recording plays on the node's services.
    pub(super) is_replay: bool,
    pub(super) particles: &'a [ParticleState],
}

/// Returns the actions of a command, in order. The list is empty if there is nothing to do.
pub(super) fn actions(
    kind: &CommandKind,
    context: CommandContext<'_>,
    catalog: &Catalog,
) -> Result<Vec<Action>, Refusal> {
    if context.is_replay && changes_simulation(kind) {
        return Err(Refusal::OnlyLive);
    }
    match kind {
        // A path would let anybody with the page read the files of the node's user.
        CommandKind::Action(Action::Load { scene }) => {
            let scene = catalog.source(scene.as_str()).ok_or(Refusal::UnknownScene)?;
            Ok(vec![Action::Load { scene }])
        }
        CommandKind::Action(action) => Ok(vec![*action]),
        CommandKind::Brush(brush) => Ok(brush.push(context).into_iter().collect()),
        CommandKind::CutConstraints { epoch, .. } if *epoch != context.epoch => {
            Err(Refusal::StaleEpoch)
        }
        CommandKind::CutConstraints { constraints, .. } => {
            Ok(constraints.iter().map(|&constraint| Action::Cut { constraint }).collect())
        }
        CommandKind::Seek { .. }
        | CommandKind::StepBack { .. }
        | CommandKind::Loop { .. }
        | CommandKind::Ghost { .. } => Err(Refusal::OnlyReplay),
        // The server of the pages and the link answer them.
        CommandKind::Look { .. }
        | CommandKind::Lift { .. }
        | CommandKind::Carry { .. }
        | CommandKind::Throw { .. }
        | CommandKind::Undo { .. }
        | CommandKind::Record {}
        | CommandKind::StopRecording {} => Err(Refusal::OnlyLive),
    }
}

/// Returns whether `recorder play` refuses a command that a node would apply.
fn changes_simulation(kind: &CommandKind) -> bool {
    match kind {
        CommandKind::Action(
            Action::Pause | Action::Resume | Action::Step { .. } | Action::Rewind { .. },
        )
        | CommandKind::Seek { .. }
        | CommandKind::StepBack { .. }
        | CommandKind::Ghost { .. }
        | CommandKind::Loop { .. } => false,
        CommandKind::Action(Action::Set { parameter, .. }) => {
            parameter.as_str() != Parameter::TimeScale.name()
        }
        _ => true,
    }
}

impl Brush {
    /// Returns the action for the node, or `None` if the ray hits nothing.
    pub(super) fn push(&self, context: CommandContext<'_>) -> Option<Action> {
        let CommandContext { rate_hz, is_planar, particles, .. } = context;
        let center = if is_planar { self.hit_plane()? } else { self.hit_particles(particles)? };
        // A push is a displacement per step: its velocity is delta * rate.
        let share = 1.0 / (self.over_s * rate_hz as f32);
        let mut delta = self.delta.map(|axis| axis * share);
        if is_planar {
            delta[2] = 0.0;
        }
        let limit = self.cap.map(|cap| cap * share);
        Some(Action::Push { center, radius: self.radius, delta, limit })
    }

    /// Returns the point of the ray with z = 0.
    fn hit_plane(&self) -> Option<[f32; 3]> {
        if self.ray[2] == 0.0 {
            return None;
        }
        let distance = -self.eye[2] / self.ray[2];
        let at = |axis: usize| self.eye[axis] + distance * self.ray[axis];
        let hit = [at(0), at(1), 0.0];
        hit.iter().all(|axis| axis.is_finite()).then_some(hit)
    }

    /// Among the particles within the radius of the ray, finds the one nearest to the eye. Returns the
    /// point of the ray closest to it.
    fn hit_particles(&self, particles: &[ParticleState]) -> Option<[f32; 3]> {
        let direction = self.ray.map(f64::from);
        let length = dot(direction, direction).sqrt();
        let direction = direction.map(|axis| axis / length);
        let eye = self.eye.map(f64::from);
        let radius_squared = f64::from(self.radius).powi(2);
        let distances = particles.iter().filter_map(|particle| {
            let offset: [f64; 3] =
                std::array::from_fn(|axis| f64::from(particle.position[axis]) - eye[axis]);
            let distance = dot(offset, direction);
            let aside_squared = dot(offset, offset) - distance * distance;
            (distance > 0.0 && aside_squared < radius_squared).then_some(distance)
        });
        let nearest = distances.reduce(f64::min)?;
        Some(std::array::from_fn(|axis| to_f32(eye[axis] + nearest * direction[axis])))
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    const BRUSH: Brush = Brush {
        eye: [0.0, 0.0, 5.0],
        ray: [0.0, 0.0, -2.0],
        radius: 0.5,
        delta: [0.2, 0.0, 0.1],
        over_s: 0.1,
        cap: Some(0.15),
    };

    const PLANAR: CommandContext<'_> =
        CommandContext { epoch: 1, rate_hz: 60, is_planar: true, is_replay: false, particles: &[] };

    /// A scene in three dimensions with 100 steps per second.
    fn solid(particles: &[ParticleState]) -> CommandContext<'_> {
        CommandContext { epoch: 1, rate_hz: 100, is_planar: false, is_replay: false, particles }
    }

    fn at(position: [f32; 3]) -> ParticleState {
        ParticleState { position, ..ParticleState::default() }
    }

    #[test]
    fn the_particle_nearest_to_the_eye_is_the_center_and_gets_the_pointers_velocity() {
        let particles =
            [at([0.0, 0.1, -1.0]), at([0.3, 0.3, 1.0]), at([0.4, 0.4, 2.0]), at([0.0, 0.0, 6.0])];
        let push = BRUSH.push(solid(&particles));
        let Some(Action::Push { center, radius, delta, limit }) = push else {
            panic!("no push");
        };
        assert_eq!((center, radius), ([0.0, 0.0, 1.0], 0.5));
        // 0.2 m in 0.1 s is 2 m/s: 0.02 m per step of 10 ms.
        assert!((delta[0] - 0.02).abs() < 1e-7 && (limit.unwrap() - 0.015).abs() < 1e-7);
    }

    #[test]
    fn in_two_dimensions_the_center_is_on_the_plane() {
        let brush = Brush { eye: [1.0, 2.0, 5.0], ray: [1.0, 0.0, -5.0], ..BRUSH };
        let Some(Action::Push { center, delta, .. }) = brush.push(PLANAR) else {
            panic!("no push");
        };
        assert_eq!((center, delta[2]), ([2.0, 2.0, 0.0], 0.0));
        assert!(Brush { ray: [1.0, 0.0, 0.0], ..BRUSH }.push(PLANAR).is_none());
    }

    #[test]
    fn a_ray_that_hits_nothing_pushes_nothing() {
        assert!(BRUSH.push(solid(&[at([0.0, 0.6, 0.0]), at([0.0, 0.0, 9.0])])).is_none());
    }
}
