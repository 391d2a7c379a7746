//! Grabbed particles: driven to a target, whatever pulls on them.

use serde::{Deserialize, Serialize};

use crate::particles::Particles;

/// One grabbed particle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Grab {
    pub(crate) particle: u32,
    pub(crate) client_id: u64,
    pub(crate) target: [f32; 3],
    /// Substeps that are left until the target is reached.
    pub(crate) substeps_left: u32,
}

/// Moves each grabbed particle by its share of the way that is left, in a straight line, but not
/// further than `reach` (`max_speed` h) in one substep: then it follows at that speed.
pub(crate) fn drive_grabbed(particles: &mut Particles, grabs: &mut [Grab], reach: f32) {
    for grab in grabs {
        let index = grab.particle as usize;
        let position = particles.positions[index];
        let substeps_left = grab.substeps_left.max(1);
        // Exact to 2^24 substeps; a grab lasts at most 0.25 s of 10^5 steps of 10^3 substeps, for
        // which the rounding of the count changes the share by less than the rounding of the way.
        let share = |axis: usize| (grab.target[axis] - position[axis]) / substeps_left as f32;
        let way = [share(0), share(1), share(2)];
        let length = (way[0] * way[0] + way[1] * way[1] + way[2] * way[2]).sqrt();
        let scale = if length > reach { reach / length } else { 1.0 };
        particles.displacements[index] = [way[0] * scale, way[1] * scale, way[2] * scale, 0.0];
        grab.substeps_left = substeps_left - 1;
    }
}
