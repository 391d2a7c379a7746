//! Stretch and energy of a state.

use sim_contract::{ConstraintKind, ConstraintState, ParticleState, TornConstraint};
use sim_solver::Energy;

use crate::wire::to_f32;

/// Stretch and energy of a state. NaN without any structural constraint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Measures {
    /// Mean of length / rest length - 1 over the structural constraints that are not torn.
    pub(crate) stretch_mean: f32,
    /// Maximum of the same.
    pub(crate) stretch_max: f32,
    /// Constraint with the maximum.
    pub(crate) stretch_max_constraint: u32,
    /// Kinetic energy of the free particles, m v^2 / 2, in J.
    pub(crate) kinetic_j: f64,
    /// Potential energy of the free particles, -m g.x, in J.
    pub(crate) potential_j: f64,
}

/// Marks the torn constraints.
pub(crate) fn torn_flags(constraint_count: usize, torn: &[TornConstraint]) -> Vec<bool> {
    let mut is_torn = vec![false; constraint_count];
    for TornConstraint { constraint, .. } in torn {
        is_torn[*constraint as usize] = true;
    }
    is_torn
}

/// Measures a state. Every end of a constraint must be one of its particles.
pub(crate) fn measure(
    particles: &[ParticleState],
    constraints: &[ConstraintState],
    is_torn: &[bool],
    gravity: [f32; 3],
) -> Measures {
    let (mut sum, mut count) = (0.0, 0_u32);
    let (mut max, mut max_constraint) = (f64::NEG_INFINITY, 0);
    for ((index, constraint), is_torn) in (0_u32..).zip(constraints).zip(is_torn) {
        if *is_torn
            || constraint.kind != ConstraintKind::Structural as u32
            || constraint.rest_length <= 0.0
        {
            continue;
        }
        let [a, b] = [constraint.a, constraint.b].map(|end| particles[end as usize].position);
        let stretch = distance(a, b) / f64::from(constraint.rest_length) - 1.0;
        sum += stretch;
        count += 1;
        if stretch > max {
            (max, max_constraint) = (stretch, index);
        }
    }
    let energy = Energy::of_particles(bytemuck::cast_slice(particles), gravity);
    Measures {
        stretch_mean: if count == 0 { f32::NAN } else { to_f32(sum / f64::from(count)) },
        stretch_max: if count == 0 { f32::NAN } else { to_f32(max) },
        stretch_max_constraint: max_constraint,
        kinetic_j: energy.kinetic,
        potential_j: energy.potential,
    }
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f64 {
    (0..3).map(|axis| (f64::from(a[axis]) - f64::from(b[axis])).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn particle(x: f32, inverse_mass: f32, speed: f32) -> ParticleState {
        ParticleState {
            position: [x, 2.0, 0.0],
            velocity: [speed, 0.0, 0.0],
            inverse_mass,
            flags: 0,
        }
    }

    fn constraint(a: u32, b: u32, kind: u32) -> ConstraintState {
        ConstraintState { a, b, rest_length: 1.0, kind, ..ConstraintState::default() }
    }

    #[test]
    fn stretch_covers_the_structural_constraints_that_are_not_torn() {
        let particles = [particle(0.0, 0.0, 0.0), particle(1.1, 1.0, 0.0), particle(2.4, 1.0, 0.0)];
        let constraints =
            [constraint(0, 1, 0), constraint(1, 2, 0), constraint(0, 2, 0), constraint(0, 2, 1)];
        let is_torn = [false, false, true, false];
        let measures = measure(&particles, &constraints, &is_torn, [0.0; 3]);
        assert!((measures.stretch_mean - 0.2).abs() < 1e-6, "{measures:?}");
        assert!((measures.stretch_max - 0.3).abs() < 1e-6, "{measures:?}");
        assert_eq!(measures.stretch_max_constraint, 1);
        assert!(measure(&particles, &[], &[], [0.0; 3]).stretch_max.is_nan());
    }

    #[test]
    fn energies_cover_the_free_particles() {
        let particles = [particle(0.0, 0.0, 9.0), particle(0.0, 0.5, 3.0)];
        let measures = measure(&particles, &[], &[], [0.0, -10.0, 0.0]);
        assert_eq!((measures.kinetic_j, measures.potential_j), (9.0, 40.0));
    }
}
