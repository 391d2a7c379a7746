//! How well a sheet moves: its stretch, its energy, and how far it is from a run in very small
//! steps.

use std::fmt;

use serde::Serialize;
use sim_solver::Solver;

use super::sheet::Variant;

/// Substeps of the reference.
const REFERENCE_SUBSTEPS: u32 = 256;
/// Frames after which the motion is compared: half a second, before it is chaotic.
const COMPARED_FRAMES: u32 = 30;

/// What is measured in the frames 61..=120, and at half a second.
#[derive(Debug, Serialize)]
pub(crate) struct Quality {
    stretch_mean_percent: f64,
    stretch_max_percent: f64,
    /// Largest energy of all frames, against the largest that there is to lose.
    energy_gain_percent: f64,
    /// Root mean square distance to the same sheet in 256 substeps, in mm.
    rms_to_reference_mm: f64,
}

impl Quality {
    pub(crate) fn measure(columns: u32, substeps: u32) -> Self {
        let mut solver = Variant::Plain.solver(columns, substeps);
        let mut reference = Variant::Plain.solver(columns, REFERENCE_SUBSTEPS);
        (0..COMPARED_FRAMES).for_each(|_| reference.step());
        let start = energy(&solver);
        // All of it 2 m lower.
        let range = 9.81 * 2.0 * solver.particle_count() as f64;
        let mut quality = Self {
            stretch_mean_percent: 0.0,
            stretch_max_percent: 0.0,
            energy_gain_percent: f64::NEG_INFINITY,
            rms_to_reference_mm: 0.0,
        };
        for frame in 1..=120_u32 {
            solver.step();
            let gain = 100.0 * (energy(&solver) - start) / range;
            quality.energy_gain_percent = quality.energy_gain_percent.max(gain);
            if frame == COMPARED_FRAMES {
                quality.rms_to_reference_mm = 1000.0 * rms(&solver, &reference);
            }
            if frame > 60 {
                let (mean, max) = stretch(&solver);
                quality.stretch_mean_percent += 100.0 * mean / 60.0;
                quality.stretch_max_percent += 100.0 * max / 60.0;
            }
        }
        quality
    }
}

impl fmt::Display for Quality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "stretch mean {:.3} % max {:.2} %, energy at most {:+.3} %, {:.1} mm from 256 substeps",
            self.stretch_mean_percent,
            self.stretch_max_percent,
            self.energy_gain_percent,
            self.rms_to_reference_mm
        )
    }
}

fn position(solver: &Solver, index: usize) -> [f64; 3] {
    solver.particle(index).position.map(f64::from)
}

/// Mean and largest |length / rest - 1| of the structural links.
fn stretch(solver: &Solver) -> (f64, f64) {
    let structural =
        solver.constraints().filter(|one| one.kind == sim_solver::ConstraintKind::Structural);
    let strains = structural.map(|one| {
        let (a, b) = (position(solver, one.a as usize), position(solver, one.b as usize));
        let square: f64 = (0..3).map(|axis| (b[axis] - a[axis]).powi(2)).sum();
        (square.sqrt() / f64::from(one.rest_length) - 1.0).abs()
    });
    let (mut sum, mut max, mut count) = (0.0, 0.0, 0.0);
    for strain in strains {
        (sum, max, count) = (sum + strain, f64::max(max, strain), count + 1.0);
    }
    (sum / count, max)
}

fn energy(solver: &Solver) -> f64 {
    let of = |index: usize| {
        let one = solver.particle(index);
        let squared: f64 = one.velocity.iter().map(|axis| f64::from(*axis).powi(2)).sum();
        squared / 2.0 + 9.81 * f64::from(one.position[1])
    };
    (0..solver.particle_count()).map(of).sum()
}

fn rms(solver: &Solver, reference: &Solver) -> f64 {
    let squares = (0..solver.particle_count()).map(|index| {
        let (a, b) = (position(solver, index), position(reference, index));
        (0..3).map(|axis| (b[axis] - a[axis]).powi(2)).sum::<f64>()
    });
    (squares.sum::<f64>() / solver.particle_count() as f64).sqrt()
}
