//! Driven particles: they go to a target, whatever pulls on them.

use serde::{Deserialize, Serialize};

use crate::bodies::{Bodies, Place};

/// One grabbed particle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Grab {
    pub(crate) particle: u32,
    pub(crate) client_id: u64,
    pub(crate) target: [f32; 3],
    /// Steps that are left until the target is reached.
    pub(crate) steps_left: u32,
}

/// A substep of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Substep {
    /// From 0.
    pub(crate) index: u32,
    /// Substeps of the step.
    pub(crate) count: u32,
}

impl Substep {
    pub(crate) fn is_first(self) -> bool {
        self.index == 0
    }

    /// Substeps that are left in this step, this one included.
    pub(crate) fn left(self) -> u32 {
        self.count - self.index
    }
}

/// Moves each grabbed particle by its share of the way that is left, in a straight line, but not
/// further than `reach` (`max_speed` h) in one substep: then it follows at that speed.
pub(crate) fn drive_grabbed(bodies: &mut Bodies, grabs: &[Grab], substep: Substep, reach: f32) {
    for grab in grabs {
        let substeps_left = (grab.steps_left.max(1) - 1) * substep.count + substep.left();
        step_towards(bodies, bodies.place(grab.particle), (grab.target, substeps_left), reach);
    }
}

/// A step of every grab has been made.
pub(crate) fn count_step(grabs: &mut [Grab]) {
    for grab in grabs {
        grab.steps_left = grab.steps_left.saturating_sub(1);
    }
}

/// Sets the displacement of a driven particle to its share of the way that is left.
pub(crate) fn step_towards(
    bodies: &mut Bodies,
    place: Place,
    (target, substeps_left): ([f32; 3], u32),
    reach: f32,
) {
    let position = bodies.position(place);
    // Exact to 2^24 substeps; a grab lasts at most 0.25 s of 10^5 steps of 10^3 substeps, for
    // which the rounding of the count changes the share by less than the rounding of the way.
    let share = |axis: usize| (target[axis] - position[axis]) / substeps_left as f32;
    let way = [share(0), share(1), share(2)];
    let length = (way[0] * way[0] + way[1] * way[1] + way[2] * way[2]).sqrt();
    let scale = if length > reach { reach / length } else { 1.0 };
    bodies.set_displacement(place, way.map(|axis| axis * scale));
}
