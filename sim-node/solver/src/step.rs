//! One step, as a list of its stages. Only + - * / and sqrt, in a fixed order; nothing is
//! allocated, locked, read from a clock or printed. (What commands left to be worked out at the
//! boundary before it may allocate, once: `finish_boundary`.)

use std::ops::Range;

use crate::Solver;
use crate::colliders::Moments;
use crate::constraints::Constraints;
use crate::contact::ContactStep;
use crate::drive::{Substep, count_step, drive_grabbed};
use crate::hash::state_hash;
use crate::particles::{Particles, flag};
use crate::project::{Pass, limit_stretch, project_group};
use crate::tear::Torn;
use crate::wind::Breeze;

impl Solver {
    /// Makes one step of 1/rate seconds; right after a reset it shows the state put in place
    /// instead, and integrates nothing.
    ///
    /// Position based dynamics in small steps (Macklin et al. 2019) on positions and explicit
    /// velocities: a substep works on the displacement d = h v beside the position, so that
    /// gravity survives where h^2 g is below the resolution of the position.
    pub fn step(&mut self) {
        self.finish_boundary();
        if self.is_restored {
            self.is_restored = false;
            self.scene_step = 0;
            for collider in &mut self.colliders {
                collider.place(0.0);
            }
        } else {
            self.begin_step();
            for index in 0..self.parameters.substeps {
                self.substep(Substep { index, count: self.parameters.substeps });
            }
            self.end_step();
        }
        if self.torn.end_step(&mut self.constraints) {
            self.tethers.drop_torn(&self.constraints);
        }
        make_zeros_canonical(&mut self.particles);
        self.state_hash = state_hash(&self.particles, self.torn.hash_seed());
    }

    /// Works out where everything that moves by itself is to be at the end of the step.
    fn begin_step(&mut self) {
        self.particles.step_starts.copy_from_slice(&self.particles.positions);
        self.scene_step += 1;
        let (time_s, dt) = (self.scene_time_s(), self.step_length());
        self.anchors.begin_step(time_s);
        for collider in &mut self.colliders {
            collider.begin_step(time_s, dt);
        }
    }

    fn substep(&mut self, substep: Substep) {
        let h = self.h();
        self.predict(h);
        self.drive(substep, self.parameters.max_speed * h);
        self.project();
        limit_stretch(&mut self.particles, &self.constraints);
        self.tethers.pull(&mut self.particles);
        let contact_step = self.contact_step(substep);
        self.collide(&contact_step);
        update(&mut self.particles, h);
        self.part(&contact_step);
    }

    /// Everything falls, is slowed down by damping, and is carried along by the wind.
    fn predict(&mut self, h: f32) {
        let prediction = Prediction {
            h,
            kept: kept_share(self.parameters.damping * h),
            max_speed: self.parameters.max_speed,
        };
        let fall = self.parameters.gravity.map(|axis| h * axis);
        if !(self.air.has_surface() && self.parameters.wind_drag > 0.0) {
            predict(&mut self.particles, &prediction, |_| fall);
            return;
        }
        let strength = self.air.strength(self.scene_step);
        let velocity = self.parameters.wind_velocity.map(|axis| strength * axis);
        let breeze = Breeze { velocity, drag: self.parameters.wind_drag, h };
        self.air.blow(&self.particles, &self.model.triangles, &breeze);
        let gains = &self.air.gains;
        predict(&mut self.particles, &prediction, |index| {
            let [x, y, z] = gains[index];
            [fall[0] + x, fall[1] + y, fall[2] + z]
        });
    }

    /// Anchored and grabbed particles go their own way; a hand is stronger than an anchor.
    fn drive(&mut self, substep: Substep, reach: f32) {
        self.anchors.drive(&mut self.particles, substep.left(), reach);
        drive_grabbed(&mut self.particles, &self.grabs, substep, reach);
    }

    /// The passes of a substep over all constraints, group by group.
    fn project(&mut self) {
        let Self { particles, constraints, torn, settings, parameters, .. } = self;
        let pass = Pass { method: settings.method, relaxation: parameters.relaxation };
        constraints.multipliers.fill(0.0);
        for iteration in 0..parameters.iterations {
            if iteration == 0 && !constraints.tear_lengths.is_empty() {
                project_measured(particles, constraints, torn, pass);
                continue;
            }
            for group in 0..constraints.groups.len() {
                let range = constraints.groups[group].clone();
                project_group(particles, constraints, range, pass);
            }
        }
        if !constraints.tear_multipliers.is_empty() {
            torn.mark_overloaded(constraints);
        }
    }

    /// Contacts come last, so that no published state is inside of a collider.
    fn collide(&mut self, step: &ContactStep) {
        for collider in &self.colliders {
            self.contacts.collide(&mut self.particles, collider, step);
        }
    }

    /// What touched something goes on with the velocity that its contacts leave it.
    fn part(&mut self, step: &ContactStep) {
        for collider in &self.colliders {
            self.contacts.settle(&mut self.particles, collider, step);
        }
        self.contacts.finish(&mut self.particles);
    }

    fn contact_step(&self, substep: Substep) -> ContactStep {
        let (h, [x, y, z]) = (self.h(), self.parameters.gravity);
        let count = substep.count as f32;
        ContactStep {
            h,
            rest_speed: 2.0 * (x * x + y * y + z * z).sqrt() * h,
            moments: Moments {
                start: substep.index as f32 / count,
                end: (substep.index + 1) as f32 / count,
            },
            is_planar: self.is_planar,
        }
    }

    /// Takes out what is no longer finite, and with it the hands that held it.
    fn end_step(&mut self) {
        count_step(&mut self.grabs);
        let frozen_count = freeze_non_finite(&mut self.particles);
        if frozen_count > 0 {
            self.frozen_count += frozen_count;
            let flags = &self.particles.flags;
            self.grabs.retain(|grab| flags[grab.particle as usize] & flag::GRABBED != 0);
        }
    }
}

/// A pass over all constraints that measures each before it is projected: those that share no
/// particle together, the others when their turn has come.
fn project_measured(
    particles: &mut Particles,
    constraints: &mut Constraints,
    torn: &mut Torn,
    pass: Pass,
) {
    let mut project = |range: Range<usize>, constraints: &mut Constraints| {
        torn.mark_overstretched(particles, constraints, range.clone());
        project_group(particles, constraints, range, pass);
    };
    for group in 0..constraints.independent_count {
        project(constraints.groups[group].clone(), constraints);
    }
    for slot in constraints.independent_end()..constraints.pairs.len() {
        project(slot..slot + 1, constraints);
    }
}

/// What the prediction of a substep needs: all the same for every particle.
struct Prediction {
    /// Seconds.
    h: f32,
    /// The share of the velocity that damping leaves in a substep.
    kept: f32,
    max_speed: f32,
}

/// max(0, 1 - c h).
fn kept_share(damping: f32) -> f32 {
    if damping < 1.0 { 1.0 - damping } else { 0.0 }
}

/// v = max(0, 1 - c h) v + h a, |v| <= `max_speed`, d = h v; fixed particles: d = 0.
/// `gain` is h a of a particle.
fn predict(particles: &mut Particles, prediction: &Prediction, gain: impl Fn(usize) -> [f32; 3]) {
    let Prediction { h, kept, max_speed } = *prediction;
    let states = particles.positions.iter().zip(&mut particles.velocities);
    for (index, ((position, velocity), displacement)) in
        states.zip(&mut particles.displacements).enumerate()
    {
        if position[3] == 0.0 {
            *displacement = [0.0; 4];
            continue;
        }
        let gain = gain(index);
        let [x, y, z, _] = *velocity;
        let [mut x, mut y, mut z] = [kept * x + gain[0], kept * y + gain[1], kept * z + gain[2]];
        let speed_squared = x * x + y * y + z * z;
        if speed_squared > max_speed * max_speed {
            let scale = max_speed / speed_squared.sqrt();
            (x, y, z) = (x * scale, y * scale, z * scale);
        }
        // Contacts ask for the predicted velocity.
        *velocity = [x, y, z, 0.0];
        *displacement = [h * x, h * y, h * z, 0.0];
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
