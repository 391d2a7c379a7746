//! One step, as a list of its stages. Only + - * / and sqrt, in a fixed order; nothing is
//! allocated, locked, read from a clock or printed. (What commands left to be worked out at the
//! boundary before it may allocate, once: `finish_boundary`.)

use sim_types::{ParticleFlags, TearCause};

use crate::Solver;
use crate::bodies::{Fall, Motion};
use crate::colliders::Moments;
use crate::constraints::Recipe;
use crate::contact::{ContactStep, place_obstacles};
use crate::drive::{Substep, count_step, drive_grabbed};
use crate::hash::state_hash;
use crate::project::BY_LENGTH;
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
            self.particles.make_zeros_canonical();
        } else {
            self.begin_step();
            let mut is_any_marked = false;
            for index in 0..self.parameters.substeps {
                is_any_marked |= self.substep(Substep { index, count: self.parameters.substeps });
            }
            self.end_step(is_any_marked);
        }
        if self.torn.end_step() {
            self.tethers.drop_torn(&self.torn, &mut self.bodies);
        }
        self.state_hash = state_hash(&self.particles.states, self.torn.hash_seed());
    }

    /// Takes over the state, and works out where everything that moves by itself is to be at the
    /// end of the step.
    fn begin_step(&mut self) {
        self.bodies.unpack(&self.particles.states);
        self.scene_step += 1;
        let (time_s, dt) = (self.scene_time_s(), self.step_length());
        self.anchors.begin_step(time_s);
        for collider in &mut self.colliders {
            collider.begin_step(time_s, dt);
        }
    }

    /// What is held goes its way, the wind blows; then everything falls, is brought back by its
    /// constraints, and by its tethers, and is pushed out of the colliders. Whether anything tears
    /// at the end of the step.
    fn substep(&mut self, substep: Substep) -> bool {
        self.drive(substep);
        self.blow(substep);
        let contact_step = self.contact_step(substep);
        place_obstacles(&mut self.obstacles, &self.colliders, &contact_step);
        let motion = Motion { fall: self.fall(substep), obstacles: &self.obstacles };
        self.bodies.substep(&motion, self.parameters.iterations)
    }

    /// Anchored and grabbed particles go their own way; a hand is stronger than an anchor. Tethers
    /// follow.
    fn drive(&mut self, substep: Substep) {
        let reach = self.parameters.max_speed * self.h();
        let Self { bodies, particles, anchors, grabs, tethers, .. } = self;
        anchors.drive(bodies, particles, (substep.left(), reach));
        drive_grabbed(bodies, grabs, substep, reach);
        tethers.follow_roots(bodies);
    }

    fn blow(&mut self, substep: Substep) {
        let drag = self.parameters.wind_drag;
        if !self.air.has_surface() || drag == 0.0 {
            return;
        }
        let strength = self.air.strength(self.scene_step);
        let velocity = self.parameters.wind_velocity.map(|axis| strength * axis);
        let breeze = Breeze { velocity, drag, h: self.h(), is_first: substep.is_first() };
        self.air.blow(&mut self.bodies, &self.model.triangles, &breeze);
    }

    fn fall(&self, substep: Substep) -> Fall {
        let (h, parameters) = (self.h(), &self.parameters);
        Fall {
            h,
            kept: kept_share(parameters.damping * h),
            gain: parameters.gravity.map(|axis| h * axis),
            reach: parameters.max_speed * h,
            is_first: substep.is_first(),
        }
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

    /// Gives the state back. What is no longer finite is taken out, and with it the hands that held
    /// it; what was marked tears.
    fn end_step(&mut self, is_any_marked: bool) {
        count_step(&mut self.grabs);
        let h = self.h();
        let frozen_count = self.bodies.pack(&mut self.particles.states, h);
        if frozen_count > 0 {
            self.frozen_count += frozen_count;
            let states = &self.particles.states;
            self.grabs
                .retain(|grab| states[grab.particle as usize].flags & ParticleFlags::GRABBED != 0);
        }
        if is_any_marked {
            self.tear_marked();
        }
    }

    fn tear_marked(&mut self) {
        let setup = self.setup();
        let recipe = Recipe::new(&self.model, &self.parameters, setup);
        let torn = &mut self.torn;
        self.bodies.take_marks(|constraint, mark| {
            let is_force = mark > BY_LENGTH;
            let cause = if is_force { TearCause::Force } else { recipe.length_cause(constraint) };
            torn.tear(constraint, cause);
        });
        for constraint in self.torn.new_ones() {
            self.bodies.tear(*constraint);
        }
    }
}

/// max(0, 1 - c h).
fn kept_share(damping: f32) -> f32 {
    if damping < 1.0 { 1.0 - damping } else { 0.0 }
}
