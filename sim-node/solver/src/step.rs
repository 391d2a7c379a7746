//! One step, as a list of its stages. Only + - * / and sqrt, in a fixed order; nothing is
//! allocated, locked, read from a clock or printed.

use std::ops::Range;

use crate::Solver;
use crate::constraints::Constraints;
use crate::drive::drive_grabbed;
use crate::hash::state_hash;
use crate::particles::{Particles, flag};
use crate::scene::{Method, SolverSettings};

/// Below this squared length a pair has no direction to be moved along.
const LENGTH_SQUARED_MIN: f32 = f32::MIN_POSITIVE;

impl Solver {
    /// Makes one step of 1/rate seconds; right after a reset it shows the state put in place
    /// instead, and integrates nothing.
    ///
    /// Position based dynamics in small steps (Macklin et al. 2019) on positions and explicit
    /// velocities: a substep works on the displacement d = h v beside the position, so that
    /// gravity survives where h^2 g is below the resolution of the position.
    pub fn step(&mut self) {
        if self.is_restored {
            self.is_restored = false;
            self.scene_step = 0;
        } else {
            self.particles.step_starts.copy_from_slice(&self.particles.positions);
            for _ in 0..self.settings.substeps {
                self.substep();
            }
            self.frozen_count += freeze_non_finite(&mut self.particles);
            let flags = &self.particles.flags;
            self.grabs.retain(|grab| flags[grab.particle as usize] & flag::GRABBED != 0);
            self.scene_step += 1;
        }
        make_zeros_canonical(&mut self.particles);
        self.state_hash = state_hash(&self.particles, self.torn());
    }

    fn substep(&mut self) {
        let h = self.settings.h();
        predict(&mut self.particles, &Prediction::new(&self.settings, self.gravity));
        drive_grabbed(&mut self.particles, &mut self.grabs, self.settings.max_speed * h);
        self.constraints.multipliers.fill(0.0);
        for _ in 0..self.settings.iterations {
            project_constraints(&mut self.particles, &mut self.constraints, self.settings.method);
        }
        update(&mut self.particles, h);
    }
}

/// What the prediction of a substep needs: all the same for every particle.
struct Prediction {
    /// Seconds.
    h: f32,
    /// The share of the velocity that damping leaves in a substep: max(0, 1 - damping h).
    kept: f32,
    /// Velocity gained in a substep.
    gain: [f32; 3],
    max_speed: f32,
}

impl Prediction {
    fn new(settings: &SolverSettings, acceleration: [f32; 3]) -> Self {
        let h = settings.h();
        let kept = 1.0 - settings.damping * h;
        Self {
            h,
            kept: if kept > 0.0 { kept } else { 0.0 },
            gain: acceleration.map(|axis| h * axis),
            max_speed: settings.max_speed,
        }
    }
}

/// v = max(0, 1 - c h) v + h a, |v| <= `max_speed`, d = h v; fixed particles: d = 0.
fn predict(particles: &mut Particles, prediction: &Prediction) {
    let Prediction { h, kept, gain, max_speed } = *prediction;
    let states = particles.positions.iter().zip(&mut particles.velocities);
    for ((position, velocity), displacement) in states.zip(&mut particles.displacements) {
        if position[3] == 0.0 {
            *displacement = [0.0; 4];
            continue;
        }
        let [x, y, z, _] = *velocity;
        let [mut x, mut y, mut z] = [kept * x + gain[0], kept * y + gain[1], kept * z + gain[2]];
        let speed_squared = x * x + y * y + z * z;
        if speed_squared > max_speed * max_speed {
            let scale = max_speed / speed_squared.sqrt();
            (x, y, z) = (x * scale, y * scale, z * scale);
        }
        *displacement = [h * x, h * y, h * z, 0.0];
    }
}

/// One pass over all constraints, group by group.
fn project_constraints(particles: &mut Particles, constraints: &mut Constraints, method: Method) {
    for group in 0..constraints.groups.len() {
        let range = constraints.groups[group].clone();
        match method {
            Method::Xpbd => project_compliant(particles, constraints, range),
            Method::Pbd => project_stiff(particles, constraints, range),
        }
    }
}

/// Moves each constrained pair towards its rest length, in array order (Gauss-Seidel).
///
/// C = |r| - L with r = (`x_b` - `x_a`) + (`d_b` - `d_a`), w = inverse mass, a = compliance / h^2:
/// `delta_lambda` = -(C + a lambda) / (`w_a` + `w_b` + a), lambda from 0 in each substep
/// (XPBD: Macklin, Mueller, Chentanez 2016, equation 18).
fn project_compliant(
    particles: &mut Particles,
    constraints: &mut Constraints,
    group: Range<usize>,
) {
    let rests =
        constraints.pairs[group.clone()].iter().zip(&constraints.rest_lengths[group.clone()]);
    let bounds =
        constraints.softness[group.clone()].iter().zip(&constraints.pull_only[group.clone()]);
    let multipliers = &mut constraints.multipliers[group];
    for (((pair, rest_length), (softness, pull_only)), multiplier) in
        rests.zip(bounds).zip(multipliers)
    {
        let Some(gap) = Gap::between(particles, *pair) else { continue };
        let error = gap.length - *rest_length;
        if *pull_only && error <= 0.0 {
            continue;
        }
        let delta = -(error + *softness * *multiplier) / (gap.inverse_mass_sum + *softness);
        *multiplier += delta;
        gap.close(particles, *pair, delta);
    }
}

/// As [`project_compliant`], but takes the share k' of the error away: lambda =
/// -k' C / (`w_a` + `w_b`)
/// (Position Based Dynamics: Mueller et al. 2007, section 3.3).
fn project_stiff(particles: &mut Particles, constraints: &mut Constraints, group: Range<usize>) {
    let rests =
        constraints.pairs[group.clone()].iter().zip(&constraints.rest_lengths[group.clone()]);
    let bounds = constraints.softness[group.clone()].iter().zip(&constraints.pull_only[group]);
    for ((pair, rest_length), (stiffness, pull_only)) in rests.zip(bounds) {
        let Some(gap) = Gap::between(particles, *pair) else { continue };
        let error = gap.length - *rest_length;
        if *pull_only && error <= 0.0 {
            continue;
        }
        gap.close(particles, *pair, -(*stiffness * error) / gap.inverse_mass_sum);
    }
}

/// The way from particle a to particle b in the middle of a substep.
struct Gap {
    /// `x_b` - `x_a`, displacements included.
    separation: [f32; 3],
    length: f32,
    inverse_mass_sum: f32,
}

impl Gap {
    /// `None` where a projection can do nothing: both ends are fixed, or they coincide and there
    /// is no direction.
    #[inline]
    fn between(particles: &Particles, [a, b]: [u32; 2]) -> Option<Self> {
        let (a, b) = (a as usize, b as usize);
        let (position_a, position_b) = (particles.positions[a], particles.positions[b]);
        let (d_a, d_b) = (particles.displacements[a], particles.displacements[b]);
        let along = |axis: usize| (position_b[axis] - position_a[axis]) + (d_b[axis] - d_a[axis]);
        let separation = [along(0), along(1), along(2)];
        let [x, y, z] = separation;
        let length_squared = x * x + y * y + z * z;
        let inverse_mass_sum = position_a[3] + position_b[3];
        if length_squared < LENGTH_SQUARED_MIN || inverse_mass_sum == 0.0 {
            return None;
        }
        Some(Self { separation, length: length_squared.sqrt(), inverse_mass_sum })
    }

    /// `d_a` -= `w_a` lambda n, `d_b` += `w_b` lambda n, with n = r/|r|.
    #[inline]
    fn close(&self, particles: &mut Particles, [a, b]: [u32; 2], lambda: f32) {
        let (a, b) = (a as usize, b as usize);
        let scale = lambda / self.length;
        let (w_a, w_b) = (particles.positions[a][3], particles.positions[b][3]);
        let (scale_a, scale_b) = (w_a * scale, w_b * scale);
        // An end without weight is left out, not moved by 0: a state that blows up gives 0 times
        // infinity, and must not reach what is held.
        if w_a != 0.0 {
            for (axis, along) in self.separation.iter().enumerate() {
                particles.displacements[a][axis] -= scale_a * along;
            }
        }
        if w_b != 0.0 {
            for (axis, along) in self.separation.iter().enumerate() {
                particles.displacements[b][axis] += scale_b * along;
            }
        }
    }
}

/// x += d, v = d / h.
fn update(particles: &mut Particles, h: f32) {
    let states = particles.positions.iter_mut().zip(&mut particles.velocities);
    for ((position, velocity), displacement) in states.zip(&particles.displacements) {
        for axis in 0..3 {
            position[axis] += displacement[axis];
            velocity[axis] = displacement[axis] / h;
        }
    }
}

/// Takes particles out whose state is no longer finite: they stand where they were at the start of
/// the step, for good. Returns how many.
fn freeze_non_finite(particles: &mut Particles) -> u64 {
    let mut count = 0;
    for index in 0..particles.count() {
        let state = particles.positions[index].iter().chain(&particles.velocities[index]);
        if state.into_iter().all(|number| number.is_finite()) {
            continue;
        }
        particles.positions[index] = particles.step_starts[index];
        particles.stop(index);
        particles.change_flags(index, flag::FROZEN, flag::GRABBED);
        count += 1;
    }
    count
}

/// -0 becomes +0, in the state itself: the same numbers have the same bits, and thus the same hash.
fn make_zeros_canonical(particles: &mut Particles) {
    for vector in particles.positions.iter_mut().chain(&mut particles.velocities) {
        for number in vector {
            *number += 0.0;
        }
    }
}
