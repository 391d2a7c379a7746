//! One step, as the list of its stages. The arithmetic is + - * / and sqrt in a fixed order. A step
//! allocates nothing, takes no lock, reads no clock and prints nothing.

pub(crate) mod air;
pub(crate) mod anchors;
pub(crate) mod drive;
pub(crate) mod particle_block;
pub(crate) mod particle_stages;
pub(crate) mod prediction;
pub(crate) mod schedule;
pub(crate) mod stage;
pub(crate) mod substep;
pub(crate) mod wind;

use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec3;
use sim_types::{Parameter, ParticleFlags};

use drive::{GRAB_HORIZON_S, GRAB_HORIZON_SUBSTEPS, begin_grabs, count_step, drive_grabbed};
use prediction::Prediction;
use stage::Stage;
use substep::{Substep, SubstepInputs};
use wind::WindStep;

use crate::constraints::builder::ConstraintBuilder;
use crate::contacts::contact_substep::{ContactSubstep, Interval};
use crate::contacts::obstacle::place_obstacles;
use crate::solver::Solver;
use crate::state::hash::state_hash;

impl Solver {
    /// Makes one step of 1/rate seconds. After a state was put in place, by a reset or another command, it
    /// publishes that state instead.
    ///
    /// A fault of the solver, which panics, leaves an incomplete state. Every later call that reads or changes the state
    /// panics then and says so.
    ///
    /// Position based dynamics in small steps (Macklin et al. 2019) on positions and explicit
    /// velocities: a substep works on the displacement d = h v beside the position, so that
    /// gravity survives where h^2 g is below the resolution of the position.
    pub fn step(&mut self) {
        // Nothing sets this flag, so the step is made.
        let _is_made = self.step_unless(&AtomicBool::new(false));
    }

    /// Makes a step as [`Self::step`] does, but gives it up soon after `stop` becomes true: a step of
    /// a large scene can take seconds. `stop` must stay true.
    ///
    /// Returns `false` if the step was given up. Its state is neither the old nor the new one, so the
    /// solver is of no further use. The caller knows that, so nothing is refused as it is after a panic.
    #[must_use]
    pub fn step_unless(&mut self, stop: &AtomicBool) -> bool {
        self.finish_boundary();
        // A panic leaves it set.
        self.is_poisoned = true;
        self.has_new_tethers = false;
        let is_made = if self.is_put_in_place {
            self.publish_put_in_place();
            true
        } else {
            let _running = self.store.with_workers().0.begin_step();
            self.make_step(stop)
        };
        self.is_poisoned = false;
        is_made
    }

    /// Returns `false` if the step was given up.
    fn make_step(&mut self, stop: &AtomicBool) -> bool {
        self.begin_step();
        let mut is_marked = false;
        for substep in Substep::all(self.parameters.values.count(Parameter::Substeps)) {
            for stage in Stage::OF_SUBSTEP {
                match stage {
                    Stage::Drive => self.drive(substep),
                    Stage::Wind => self.blow(substep),
                    Stage::Predict => is_marked |= self.sweep(substep, stop),
                    // The sweep that begins with `Predict` contains them.
                    Stage::Project
                    | Stage::Bend
                    | Stage::LimitStretch
                    | Stage::Tether
                    | Stage::ParticleContact
                    | Stage::Contact
                    | Stage::Advance => {}
                    Stage::Tear | Stage::Freeze | Stage::Hash => {
                        unreachable!("{stage:?} is not a stage of a substep")
                    }
                }
            }
            if let Some(measurement) = &mut self.measurement {
                measurement.end_substep(&mut self.store);
            }
            if stop.load(Ordering::Relaxed) {
                return false;
            }
        }
        count_step(&mut self.grabs);
        for collider in &mut self.colliders {
            self.standing_body_steps += u64::from(collider.is_left_standing());
            collider.end_step();
        }
        for stage in Stage::AFTER_SUBSTEPS {
            match stage {
                Stage::Tear => self.tear_marked(is_marked),
                Stage::Freeze => self.freeze(),
                Stage::Hash => self.hash(),
                Stage::Drive
                | Stage::Wind
                | Stage::Predict
                | Stage::Project
                | Stage::Bend
                | Stage::LimitStretch
                | Stage::Tether
                | Stage::ParticleContact
                | Stage::Contact
                | Stage::Advance => unreachable!("{stage:?} is a stage of a substep"),
            }
        }
        self.finish_forces();
        true
    }

    fn finish_forces(&mut self) {
        let h = self.h();
        if let Some(measurement) = &mut self.measurement {
            let states = self.particles.states.as_slice();
            measurement.end_step(&mut self.store, (&self.anchors, states), h);
        }
    }

    fn publish_put_in_place(&mut self) {
        self.is_put_in_place = false;
        let time_s = self.scene_time_s();
        for collider in &mut self.colliders {
            collider.place(time_s);
        }
        self.particles.make_zeros_canonical();
        self.finish_tears();
        self.hash();
        if let Some(measurement) = &mut self.measurement {
            measurement.clear();
        }
    }

    /// Unpacks the state, and computes the targets of anchors and colliders for the end of the step.
    fn begin_step(&mut self) {
        self.store.unpack(&self.particles.states);
        self.particle_contacts.begin_step(&self.torn);
        if let Some(measurement) = &mut self.measurement {
            measurement.begin_step();
        }
        self.scene_step += 1;
        let (time_s, dt) = (self.scene_time_s(), self.step_length());
        self.anchors.begin_step(self.scene_step, time_s);
        for collider in &mut self.colliders {
            collider.begin_step(self.scene_step, time_s, dt);
        }
        let substeps = self.parameters.values.count(Parameter::Substeps);
        let steps = (GRAB_HORIZON_SUBSTEPS / substeps).max(1);
        let horizon = self.grab_steps(GRAB_HORIZON_S).min(steps);
        begin_grabs(&mut self.grabs, self.scene_step, horizon);
    }

    /// [`Stage::Drive`]. A grab overrides an anchor. Moving roots of tethers are updated.
    fn drive(&mut self, substep: Substep) {
        let reach = self.parameters.values.number(Parameter::MaxSpeed) * self.h();
        let Self { store, particles, anchors, grabs, tethers, .. } = self;
        anchors.drive(store, particles, substep.left(), reach);
        drive_grabbed(store, grabs, substep, reach);
        tethers.update_roots(store);
    }

    /// [`Stage::Wind`].
    fn blow(&mut self, substep: Substep) {
        let values = &self.parameters.values;
        let drag = values.number(Parameter::WindDrag);
        if self.model.triangles.is_empty() || drag == 0.0 {
            return;
        }
        let strength = self.air.strength(self.scene_step);
        let velocity = values.vector(Parameter::WindVelocity).map(|axis| strength * axis);
        let wind = WindStep { velocity, drag, h: self.h(), is_first: substep.is_first() };
        self.store.blow(&wind);
    }

    /// [`Stage::Predict`] to [`Stage::Advance`]. Each sheet and the graph run them on their own
    /// particles, in one sweep, because their particles share no constraint. Contacts of particles with each
    /// other, if there are any, divide the sweep in two. Returns true if any constraint was marked as torn.
    fn sweep(&mut self, substep: Substep, stop: &AtomicBool) -> bool {
        let contact_substep = self.contact_substep(substep);
        place_obstacles(&mut self.obstacles, &self.colliders, &contact_substep);
        let prediction = self.prediction(substep);
        let values = &self.parameters.values;
        let relaxation = values.number(Parameter::Relaxation);
        let iterations = values.count(Parameter::Iterations);
        let inputs = SubstepInputs { prediction, relaxation, obstacles: &self.obstacles, stop };
        let is_marked = self.store.run_swept_stages(&inputs, iterations);
        if self.particle_contacts.are_on() {
            let friction = self.parameters.values.number(Parameter::ContactFriction);
            self.particle_contacts.push_apart(&mut self.store, substep, friction);
        }
        if self.body_contacts.are_on() {
            let (store, measurement) = (&mut self.store, self.measurement.as_deref_mut());
            self.body_contacts.push(store, &mut self.colliders, &contact_substep, measurement);
        }
        if self.particle_contacts.are_on() || self.body_contacts.are_on() {
            self.store.run_ending(&inputs);
        }
        is_marked
    }

    fn prediction(&self, substep: Substep) -> Prediction {
        let (h, values) = (self.h(), &self.parameters.values);
        Prediction {
            h,
            kept: kept_fraction(values.number(Parameter::Damping) * h),
            gain: values.vector(Parameter::Gravity).map(|axis| h * axis),
            reach: values.number(Parameter::MaxSpeed) * h,
            is_first: substep.is_first(),
        }
    }

    fn contact_substep(&self, substep: Substep) -> ContactSubstep {
        let (h, [x, y, z]) = (self.h(), self.parameters.values.vector(Parameter::Gravity));
        let count = substep.count as f32;
        ContactSubstep {
            h,
            rest_speed: 2.0 * (x * x + y * y + z * z).sqrt() * h,
            gain: Vec3::new(h * x, h * y, h * z),
            interval: Interval {
                start: substep.index as f32 / count,
                end: (substep.index + 1) as f32 / count,
            },
            is_planar: self.is_planar,
        }
    }

    /// [`Stage::Tear`].
    fn tear_marked(&mut self, is_any_marked: bool) {
        if is_any_marked {
            let builder =
                ConstraintBuilder::new(&self.model, &self.parameters, self.setup(&self.parameters));
            let torn = &mut self.torn;
            self.store.remove_marks(|constraint, mark| {
                torn.tear(constraint, builder.cause(constraint, mark));
            });
            for constraint in self.torn.new_tears() {
                self.store.tear(*constraint);
            }
        }
        self.finish_tears();
    }

    /// Ends a step for the torn constraints, those that commands cut included.
    fn finish_tears(&mut self) {
        if self.torn.end_step() {
            self.tethers.drop_torn(&self.torn, &mut self.store);
        }
    }

    /// [`Stage::Freeze`]. Writes the state back, with v = d / h. A particle that freezes is no longer
    /// grabbed.
    fn freeze(&mut self) {
        let h = self.h();
        let frozen_count = self.store.pack(&mut self.particles.states, h);
        if frozen_count > 0 {
            self.locate_forces();
            self.frozen_count += frozen_count;
            let states = &self.particles.states;
            self.grabs
                .retain(|grab| states[grab.particle as usize].flags & ParticleFlags::GRABBED != 0);
        }
    }

    /// [`Stage::Hash`].
    fn hash(&mut self) {
        self.state_hash = state_hash(&self.particles.states, self.torn.hash_seed());
    }
}

/// max(0, 1 - c h).
fn kept_fraction(damping: f32) -> f32 {
    if damping < 1.0 { 1.0 - damping } else { 0.0 }
}

#[cfg(test)]
mod tests {
    //! Calls after a panic within a step.
    use std::panic::{AssertUnwindSafe, catch_unwind};

    use sim_scene::scene::Scene;
    use sim_types::{Action, ParameterValue};

    use super::*;
    use crate::commands::cut::Sphere;

    type Call = fn(&mut Solver) -> String;

    /// Calls that read or change the state.
    const CALLS: [(&str, Call); 17] = [
        ("step", |solver| format!("{:?}", solver.step())),
        ("finish_boundary", |solver| format!("{:?}", solver.finish_boundary())),
        ("reset", |solver| format!("{:?}", solver.reset())),
        ("apply", |solver| format!("{:?}", solver.apply(1, &Action::Pause))),
        ("pin", |solver| format!("{:?}", solver.pin(0))),
        ("cut", |solver| format!("{:?}", solver.cut(0))),
        ("cut_radius", |solver| {
            format!("{:?}", solver.cut_radius(Sphere { center: [0.0; 3], radius: 1.0 }))
        }),
        ("set", |solver| format!("{:?}", solver.set("damping", ParameterValue::Off, None))),
        ("put_motion_in_place", |solver| format!("{:?}", solver.put_motion_in_place(&[]))),
        ("keyframe", |solver| format!("{:?}", solver.keyframe())),
        ("particles", |solver| format!("{:?}", solver.particles())),
        ("particle", |solver| format!("{:?}", solver.particle(0))),
        ("state_hash", |solver| format!("{:?}", solver.state_hash())),
        ("hash_in_place", |solver| format!("{:?}", solver.hash_in_place())),
        ("torn", |solver| format!("{:?}", solver.torn())),
        ("colliders", |solver| format!("{:?}", solver.colliders().count())),
        ("grabs", |solver| format!("{:?}", solver.grabs().count())),
    ];

    #[test]
    fn every_call_after_a_step_that_panicked_says_so() {
        let cloth =
            "version = 1\n[[generate]]\nshape = \"cloth\"\ncolumns = 9\nrows = 9\nspacing = 0.1\n";
        let mut solver = Solver::new(&Scene::from_toml(cloth, "test").unwrap());
        solver.step();
        // A fault: the store has one particle more.
        let last = solver.particles.states.pop().unwrap();
        assert!(catch_unwind(AssertUnwindSafe(|| solver.step())).is_err());
        solver.particles.states.push(last);
        for (name, call) in CALLS {
            let panic = catch_unwind(AssertUnwindSafe(|| call(&mut solver)));
            let panic = panic.expect_err(name).downcast::<&str>().unwrap();
            assert!(panic.starts_with("a step of this solver panicked"), "{name}: {panic}");
        }
        assert_eq!(solver.particle_count(), 81, "what the scene tells stays");
    }
}
