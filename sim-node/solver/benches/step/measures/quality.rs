//! Quality of a sheet's motion: stretch, energy, and distance from a run with very small steps.

use serde::Serialize;
use sim_solver::{ConstraintKind, Solver};

use crate::measures::clock::cpu_ns;
use crate::options::Options;
use crate::programs::reference;
use crate::report::{self, cell};
use crate::scenes::sheet::{SIDE, Sheet};

/// Frames after which the motion is compared: half a second, before it becomes chaotic.
const COMPARED_FRAMES: u32 = 30;
/// Frames of a measurement. Stretch is measured in the second half.
const FRAMES: u32 = 120;
/// Largest sheet whose reference takes seconds. 316 takes half a minute.
const REFERENCE_COLUMNS_MAX: u32 = 100;

/// Measurements of two seconds.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Quality {
    /// CPU time of the slowest frame.
    slowest_frame_ms: f64,
    /// Mean |length / rest - 1| of the structural links: the mean over the frames 61..=120.
    stretch_mean_percent: f64,
    /// Largest |length / rest - 1|: the mean over the same frames.
    stretch_max_percent: f64,
    /// Largest energy of all frames minus that at the start, relative to m g 2 m for each particle.
    energy_gain_percent: f64,
    /// Root mean square distance from the reference at half a second, in mm. None if the reference
    /// takes long and was not requested.
    rms_to_reference_mm: Option<f64>,
}

/// Quality and cost of a sheet.
#[derive(Debug, Serialize)]
pub(crate) struct Row {
    case: String,
    substeps: u32,
    tethers: u32,
    ms_per_frame: f64,
    #[serde(flatten)]
    pub(crate) quality: Quality,
}

impl Row {
    /// Measures a sheet. `case` decides whether to compute a long reference.
    pub(crate) fn measure(case: &str, sheet: &Sheet, ms_per_frame: f64, options: &Options) -> Self {
        let has_reference = sheet.columns <= REFERENCE_COLUMNS_MAX || options.wants_all_of(case);
        Self {
            case: case.to_owned(),
            substeps: sheet.substeps,
            tethers: sheet.tethers,
            ms_per_frame,
            quality: Quality::measure(sheet, has_reference),
        }
    }
}

impl report::Row for Row {
    const HEADINGS: &'static [&'static str] = &[
        "substeps",
        "tethers",
        "ms a frame",
        "slowest",
        "stretch mean %",
        "max %",
        "energy gain %",
        "mm from the reference",
    ];

    fn case(&self) -> &str {
        &self.case
    }

    fn cells(&self) -> Vec<String> {
        let quality = &self.quality;
        vec![
            self.substeps.to_string(),
            self.tethers.to_string(),
            format!("{:.2}", self.ms_per_frame),
            format!("{:.2}", quality.slowest_frame_ms),
            format!("{:.3}", quality.stretch_mean_percent),
            format!("{:.2}", quality.stretch_max_percent),
            format!("{:+.3}", quality.energy_gain_percent),
            cell(quality.rms_to_reference_mm, 1),
        ]
    }
}

impl Quality {
    fn measure(sheet: &Sheet, has_reference: bool) -> Self {
        let mut solver = Solver::new(&sheet.scene());
        let energy = EnergyGain::new(&solver);
        let mut quality = Self {
            slowest_frame_ms: 0.0,
            stretch_mean_percent: 0.0,
            stretch_max_percent: 0.0,
            energy_gain_percent: f64::NEG_INFINITY,
            rms_to_reference_mm: None,
        };
        for frame in 1..=FRAMES {
            let ms = 1e-6 * cpu_ns(|| solver.step());
            quality.slowest_frame_ms = quality.slowest_frame_ms.max(ms);
            quality.energy_gain_percent = quality.energy_gain_percent.max(energy.percent(&solver));
            if frame == COMPARED_FRAMES && has_reference {
                let reference = reference::positions(sheet, COMPARED_FRAMES);
                quality.rms_to_reference_mm = Some(1000.0 * rms(&solver, &reference));
            }
            if frame > FRAMES / 2 {
                let (mean, max) = stretch(&solver);
                let share = 100.0 / f64::from(FRAMES / 2);
                quality.stretch_mean_percent += share * mean;
                quality.stretch_max_percent += share * max;
            }
        }
        quality
    }
}

/// Energy of a sheet relative to the start.
#[derive(Debug)]
pub(crate) struct EnergyGain {
    start: f64,
    /// Energy of the whole sheet 2 m lower.
    range: f64,
}

impl EnergyGain {
    pub(crate) fn new(solver: &Solver) -> Self {
        Self { start: energy(solver), range: 9.81 * SIDE * solver.particle_count() as f64 }
    }

    /// Returns the gain in percent of the range.
    pub(crate) fn percent(&self, solver: &Solver) -> f64 {
        100.0 * (energy(solver) - self.start) / self.range
    }
}

/// Returns the kinetic and potential energy in J. Every mass is 1 kg.
fn energy(solver: &Solver) -> f64 {
    let of = |index: usize| {
        let one = solver.particle(index);
        let squared: f64 = one.velocity.iter().map(|axis| f64::from(*axis).powi(2)).sum();
        squared / 2.0 + 9.81 * f64::from(one.position[1])
    };
    (0..solver.particle_count()).map(of).sum()
}

fn position(solver: &Solver, index: usize) -> [f64; 3] {
    solver.particle(index).position.map(f64::from)
}

/// Returns the mean and the largest |length / rest - 1| of the structural links.
fn stretch(solver: &Solver) -> (f64, f64) {
    let structural = solver.constraints().filter(|one| one.kind == ConstraintKind::Structural);
    let strains = structural.map(|one| {
        let (a, b) = (position(solver, one.a as usize), position(solver, one.b as usize));
        (distance_squared(a, b).sqrt() / f64::from(one.rest_length) - 1.0).abs()
    });
    let (mut sum, mut max, mut count) = (0.0, 0.0, 0.0);
    for strain in strains {
        (sum, max, count) = (sum + strain, f64::max(max, strain), count + 1.0);
    }
    (sum / count, max)
}

fn rms(solver: &Solver, reference: &[[f64; 3]]) -> f64 {
    let squares = (reference.iter().enumerate())
        .map(|(index, expected)| distance_squared(position(solver, index), *expected));
    (squares.sum::<f64>() / reference.len() as f64).sqrt()
}

fn distance_squared(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (b[axis] - a[axis]).powi(2)).sum()
}
