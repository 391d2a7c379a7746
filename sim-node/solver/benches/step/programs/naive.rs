//! The loop of a tutorial: particles as structs, sticks in the order in which the scene lists them,
//! one step of many passes. (With small steps of one pass its numbers soon become NaN.)
//!
//! It has no colliders, wind, softness or limits. Their absence makes it faster.

use glam::Vec3;
use sim_solver::{Scene, Solver};

#[derive(Debug, Clone)]
struct Particle {
    position: Vec3,
    previous: Vec3,
    inverse_mass: f32,
}

#[derive(Debug, Clone)]
struct Stick {
    a: usize,
    b: usize,
    length: f32,
}

/// The particles and sticks of a scene.
#[derive(Debug, Clone)]
pub(crate) struct Naive {
    particles: Vec<Particle>,
    sticks: Vec<Stick>,
    gravity: Vec3,
    dt: f32,
    passes: u32,
}

impl Naive {
    /// Copies the current state of a solver without its torn constraints. A step makes as many passes
    /// as a step of the solver.
    pub(crate) fn new(scene: &Scene, solver: &Solver) -> Self {
        let dt = 1.0 / scene.solver.rate_hz as f32;
        let particles = (0..solver.particle_count()).map(|index| {
            let one = solver.particle(index);
            let position = Vec3::from_array(one.position);
            let previous = position - dt * Vec3::from_array(one.velocity);
            Particle { position, previous, inverse_mass: one.inverse_mass }
        });
        let mut is_whole = vec![true; solver.constraint_count()];
        for index in solver.torn() {
            is_whole[*index as usize] = false;
        }
        let whole = solver.constraints().zip(is_whole).filter(|(_, is_whole)| *is_whole);
        let sticks = whole.map(|(one, _)| Stick {
            a: one.a as usize,
            b: one.b as usize,
            length: one.rest_length,
        });
        Self {
            particles: particles.collect(),
            sticks: sticks.collect(),
            gravity: Vec3::from_array(scene.gravity),
            dt,
            passes: scene.solver.substeps * scene.solver.iterations,
        }
    }

    /// Makes a step of Verlet, followed by the passes.
    pub(crate) fn step(&mut self) {
        let dt = self.dt;
        for particle in &mut self.particles {
            if particle.inverse_mass > 0.0 {
                let velocity = particle.position - particle.previous;
                particle.previous = particle.position;
                particle.position += velocity + self.gravity * dt * dt;
            }
        }
        for _ in 0..self.passes {
            for stick in &self.sticks {
                let way = self.particles[stick.b].position - self.particles[stick.a].position;
                let length = way.length();
                let sum =
                    self.particles[stick.a].inverse_mass + self.particles[stick.b].inverse_mass;
                if length == 0.0 || sum == 0.0 {
                    continue;
                }
                let push = way * ((length - stick.length) / (length * sum));
                let (w_a, w_b) =
                    (self.particles[stick.a].inverse_mass, self.particles[stick.b].inverse_mass);
                self.particles[stick.a].position += push * w_a;
                self.particles[stick.b].position -= push * w_b;
            }
        }
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.particles.iter().all(|particle| particle.position.is_finite())
    }
}
