//! Momentum and energy of a node and an engine together, which show whether their coupling is sound.

use rapier3d::glamx::{DVec3, Vec3};
use serde_json::{Value, json};
use sim_contract::{
    ConstraintState, ForceKind, Forces, Parameter, ParameterValues, ParticleState, SnapshotHeader,
};

use crate::world::World;

/// Sums over the steps that were observed.
#[derive(Default)]
pub(crate) struct Balance {
    steps: u64,
    before: Option<DVec3>,
    gravity: DVec3,
    dt: f64,
    /// Impulse on pinned, grabbed and anchored particles in the step, in N s.
    held: DVec3,
    /// Greatest of a step without damping and wind, in N s.
    momentum_error: f64,
    has_drag: bool,
    energy_min: Option<f64>,
    energy_rise: f64,
}

impl Balance {
    /// Number of observed steps after the first state.
    pub(crate) fn steps(&self) -> u64 {
        self.steps
    }

    /// Takes the external impulses of the next step to observe: gravity, and whatever holds particles.
    pub(crate) fn expect(&mut self, forces: &Forces, parameters: &ParameterValues) {
        self.steps += 1;
        self.gravity = Vec3::from(parameters.vector(Parameter::Gravity)).as_dvec3();
        self.has_drag |= [Parameter::Damping, Parameter::WindDrag]
            .iter()
            .any(|one| parameters.number(*one) != 0.0);
        self.dt = 1.0 / f64::from(forces.header.rate_hz);
        let held = forces.of_kind(ForceKind::Particle);
        self.held = held.map(|row| Vec3::from(row.impulse).as_dvec3()).sum();
    }

    /// Observes the state after a step.
    pub(crate) fn observe(
        &mut self,
        particles: &[ParticleState],
        constraints: &[ConstraintState],
        world: &World,
    ) {
        let free = || particles.iter().filter(|one| one.inverse_mass > 0.0);
        let mass = |one: &ParticleState| 1.0 / f64::from(one.inverse_mass);
        let velocity = |one: &ParticleState| Vec3::from(one.velocity).as_dvec3();
        let momentum =
            free().map(|one| velocity(one) * mass(one)).sum::<DVec3>() + world.momentum();
        if let Some(before) = self.before.replace(momentum) {
            let all = free().map(mass).sum::<f64>() + world.mass();
            let expected = before + self.gravity * (all * self.dt) - self.held;
            self.momentum_error = self.momentum_error.max((momentum - expected).length());
        }
        let moving = free().map(|one| {
            let height = -Vec3::from(one.position).as_dvec3().dot(self.gravity);
            mass(one) * (0.5 * velocity(one).length_squared() + height)
        });
        let energy = moving.sum::<f64>() + elastic_energy(particles, constraints) + world.energy();
        // Before the first step, gravity is unknown.
        if self.steps > 0 {
            let min = self.energy_min.map_or(energy, |min| min.min(energy));
            self.energy_rise = self.energy_rise.max(energy - min);
            self.energy_min = Some(min);
        }
    }

    /// The balance so far, in one line of JSON.
    pub(crate) fn report(&self, last: &SnapshotHeader, world: &World) -> Value {
        json!({
            "steps": self.steps,
            "state_hash": format!("{:016x}", last.state_hash),
            // Damping and wind change the momentum, too.
            "momentum_error_N_s": (!self.has_drag).then_some(self.momentum_error),
            "energy_rise_J": self.energy_rise,
            "speed_m_per_s": world.speed(),
            "height_m": world.height(),
        })
    }
}

/// Energy of stretched constraints in J; rigid ones have none.
fn elastic_energy(particles: &[ParticleState], constraints: &[ConstraintState]) -> f64 {
    let position = |index: u32| Vec3::from(particles[index as usize].position).as_dvec3();
    let soft = constraints.iter().filter(|one| one.compliance > 0.0);
    soft.map(|one| {
        let stretch = (position(one.b) - position(one.a)).length() - f64::from(one.rest_length);
        0.5 * stretch * stretch / f64::from(one.compliance)
    })
    .sum()
}
