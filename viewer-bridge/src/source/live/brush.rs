//! The brush: gives the particles near the pointer's ray the pointer's velocity.

use sim_contract::{Action, ParticleState};

use super::command_context::CommandContext;
use crate::wire::convert::to_f32;

/// A brush stroke, in the units of the protocol.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stroke {
    pub(super) eye: [f32; 3],
    /// Any length except 0.
    pub(super) ray: [f32; 3],
    pub(super) radius: f32,
    pub(super) delta: [f32; 3],
    pub(super) over_s: f32,
    pub(super) cap: Option<f32>,
}

impl Stroke {
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

    const STROKE: Stroke = Stroke {
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
        let push = STROKE.push(solid(&particles));
        let Some(Action::Push { center, radius, delta, limit }) = push else {
            panic!("no push");
        };
        assert_eq!((center, radius), ([0.0, 0.0, 1.0], 0.5));
        // 0.2 m in 0.1 s is 2 m/s: 0.02 m per step of 10 ms.
        assert!((delta[0] - 0.02).abs() < 1e-7 && (limit.unwrap() - 0.015).abs() < 1e-7);
    }

    #[test]
    fn in_two_dimensions_the_center_is_on_the_plane() {
        let stroke = Stroke { eye: [1.0, 2.0, 5.0], ray: [1.0, 0.0, -5.0], ..STROKE };
        let Some(Action::Push { center, delta, .. }) = stroke.push(PLANAR) else {
            panic!("no push");
        };
        assert_eq!((center, delta[2]), ([2.0, 2.0, 0.0], 0.0));
        assert!(Stroke { ray: [1.0, 0.0, 0.0], ..STROKE }.push(PLANAR).is_none());
    }

    #[test]
    fn a_ray_that_hits_nothing_pushes_nothing() {
        assert!(STROKE.push(solid(&[at([0.0, 0.6, 0.0]), at([0.0, 0.0, 9.0])])).is_none());
    }
}
