//! The mechanical energy of a state.

use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use sim_scene::constraints::bends::{Bend, BendShape};
use sim_scene::constraints::sides::TornSides;
use sim_scene::model::Model;
use sim_scene::scene::Scene;
use sim_types::{ConstraintKind, Method, Parameter, ParameterValues};

use crate::solver::Solver;
use crate::state::particles::Particle;

/// The mechanical energy of a state, in kg unit^2 / s^2: J if the scene's unit is the metre.
///
/// Wind, damping, friction, contacts, anchors and clients change it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Energy {
    /// Of the free particles: the sum of m v^2 / 2.
    pub kinetic: f64,
    /// Of the free particles in gravity: the sum of -m g.x, with x from the origin of the scene.
    pub potential: f64,
    /// Of the constraints and bends that are not torn: the sum of C^2 / (2 alpha), where alpha is the compliance. A rigid
    /// constraint stores nothing, a tether only beyond its length, and `stiffness` in the method pbd defines no energy.
    pub elastic: f64,
}

impl Energy {
    /// Returns the sum.
    pub fn total(&self) -> f64 {
        self.kinetic + self.potential + self.elastic
    }

    /// The energy of free particles in gravity, without the energy of constraints. A held particle has the inverse mass 0, and
    /// does not count.
    pub fn of_particles(particles: &[Particle], gravity: [f32; 3]) -> Self {
        let gravity = vector(gravity);
        let mut energy = Self::default();
        for particle in particles.iter().filter(|particle| particle.inverse_mass > 0.0) {
            let mass = 1.0 / f64::from(particle.inverse_mass);
            energy.kinetic += 0.5 * mass * vector(particle.velocity).length_squared();
            energy.potential -= mass * gravity.dot(vector(particle.position));
        }
        energy
    }
}

/// Measures the energy of the states of a scene, in any process.
#[derive(Debug, Clone)]
pub struct EnergyMeter {
    model: Arc<Model>,
    /// The torn constraints of the newest state.
    torn: Vec<u32>,
    /// By constraint: `true` if it is torn.
    is_torn: Vec<bool>,
    /// The sides of the paths of bends.
    bend_sides: TornSides,
}

impl EnergyMeter {
    /// Prepares the measurement for a scene.
    pub fn new(scene: &Scene) -> Self {
        Self::of_model(Arc::new(scene.model()))
    }

    /// Prepares the measurement for the scene of a solver, whose model it shares.
    pub fn of(solver: &Solver) -> Self {
        Self::of_model(Arc::clone(&solver.model))
    }

    fn of_model(model: Arc<Model>) -> Self {
        Self {
            torn: Vec::new(),
            is_torn: vec![false; model.constraints.len()],
            bend_sides: model.bend_sides(),
            model,
        }
    }

    /// Returns the energy of a state with these torn constraints and these values of the parameters. None if the state
    /// has another number of particles than the scene, or an unknown constraint is torn.
    pub fn measure(
        &mut self,
        particles: &[Particle],
        torn: impl Iterator<Item = u32>,
        parameters: &ParameterValues,
    ) -> Option<Energy> {
        if particles.len() != self.model.particles.len() || !self.follow(torn) {
            return None;
        }
        let of_particles = Energy::of_particles(particles, parameters.vector(Parameter::Gravity));
        let of_constraints = match self.model.method {
            Method::Xpbd => self.of_constraints(particles, parameters),
            Method::Pbd => 0.0,
        };
        let elastic = of_constraints + self.of_bends(particles, parameters);
        Some(Energy { elastic, ..of_particles })
    }

    /// Returns the energy of a solver of the same scene after its last step.
    ///
    /// # Panics
    /// The solver has another number of particles than the scene.
    pub fn measure_solver(&mut self, solver: &Solver) -> Energy {
        let torn = solver.torn().iter().copied();
        let energy = self.measure(solver.particles(), torn, solver.parameter_values());
        let Some(energy) = energy else { unreachable!("the solver is of another scene") };
        energy
    }

    /// Replaces the torn constraints. Returns false if one of them is unknown.
    fn follow(&mut self, torn: impl Iterator<Item = u32>) -> bool {
        let torn: Vec<u32> = torn.collect();
        if torn == self.torn {
            return true;
        }
        if torn.iter().any(|constraint| *constraint as usize >= self.is_torn.len()) {
            return false;
        }
        self.is_torn.fill(false);
        for constraint in &torn {
            self.is_torn[*constraint as usize] = true;
        }
        let named_once = (0_u32..).zip(&self.is_torn).filter(|(_, is_torn)| **is_torn);
        self.bend_sides.set_torn(named_once.map(|(constraint, _)| constraint));
        self.torn = torn;
        true
    }

    fn of_constraints(&self, particles: &[Particle], parameters: &ParameterValues) -> f64 {
        let softness = parameters.softness();
        let constraints = self.model.constraints.iter().zip(&self.is_torn);
        let energies = constraints.filter(|(_, is_torn)| !**is_torn).map(|(constraint, _)| {
            let own = constraint.compliance;
            let compliance = softness[constraint.kind as usize].unwrap_or(own);
            if compliance == 0.0 {
                return 0.0;
            }
            let [a, b] = [constraint.a, constraint.b].map(|end| position(particles, end));
            let error = a.distance(b) - f64::from(constraint.rest_length);
            let is_slack = constraint.kind == ConstraintKind::Tether && error < 0.0;
            if is_slack { 0.0 } else { error * error / (2.0 * f64::from(compliance)) }
        });
        energies.sum()
    }

    fn of_bends(&self, particles: &[Particle], parameters: &ParameterValues) -> f64 {
        let bends = (0_u32..).zip(&self.model.bends);
        let whole = bends.filter(|(index, _)| self.bend_sides.is_whole(*index));
        let energies = whole.map(|(_, bend)| {
            let rigidity = parameters.bending(bend.block).unwrap_or(bend.rigidity);
            if rigidity == 0.0 || bend.geometry == 0.0 {
                return 0.0;
            }
            let square = bend_error(bend, particles).length_squared();
            square * f64::from(rigidity) / (2.0 * f64::from(bend.geometry))
        });
        energies.sum()
    }
}

/// C of a bend, less its rest value along the normal of a hinge.
fn bend_error(bend: &Bend, particles: &[Particle]) -> DVec3 {
    let [a, b, c, d] = bend.particles.map(|particle| position(particles, particle));
    let terms = [a, b, c, d].into_iter().zip(bend.coefficients);
    let value: DVec3 =
        terms.map(|(corner, coefficient)| f64::from(coefficient) * (corner - b)).sum();
    let BendShape::Hinge { rest, area_ratio } = bend.shape else { return value };
    let normal = (c - b).cross(a - b) + f64::from(area_ratio) * (d - b).cross(c - b);
    value - f64::from(rest) * normal.normalize_or_zero()
}

fn position(particles: &[Particle], particle: u32) -> DVec3 {
    vector(particles[particle as usize].position)
}

fn vector(components: [f32; 3]) -> DVec3 {
    DVec3::from_array(components.map(f64::from))
}
