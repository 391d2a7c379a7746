//! Gain of energy in undamped sheets: a minute of every start, size and number of substeps.

use serde::Serialize;
use sim_solver::Solver;

use crate::measures::clock::Pacer;
use crate::measures::quality::EnergyGain;
use crate::options::Options;
use crate::report::{Report, Row};
use crate::scenes::sheet::{Sheet, Start};

const STARTS: [Start; 3] = [Start::Swing, Start::Hang, Start::Corners];
const COLUMNS: [u32; 4] = [8, 32, 100, 316];
const SUBSTEPS: [u32; 7] = [1, 2, 4, 8, 16, 32, 64];
/// Largest energy above that at the start, in percent of m g 2 m for each particle.
const ENERGY_GAIN_MAX_PERCENT: f64 = 1.0;

/// Result of one sheet.
#[derive(Debug, Serialize)]
struct Stability {
    case: String,
    substeps: u32,
    frames: u32,
    /// All numbers were finite in all frames.
    is_finite: bool,
    /// Largest energy of all frames minus that at the start, relative to m g 2 m for each particle.
    energy_gain_percent: f64,
}

impl Stability {
    fn is_stable(&self) -> bool {
        self.is_finite && self.energy_gain_percent <= ENERGY_GAIN_MAX_PERCENT
    }
}

impl Row for Stability {
    const HEADINGS: &'static [&'static str] = &["frames", "finite", "energy gain %", "stable"];

    fn case(&self) -> &str {
        &self.case
    }

    fn cells(&self) -> Vec<String> {
        let word = |holds| if holds { "yes" } else { "NO" }.to_owned();
        vec![
            self.frames.to_string(),
            word(self.is_finite),
            format!("{:+.3}", self.energy_gain_percent),
            word(self.is_stable()),
        ]
    }
}

/// Runs the requested cases. Returns `true` if all of them are stable.
pub(crate) fn run(options: &Options, report: &mut Report) -> bool {
    let mut are_stable = true;
    for (start, columns, substeps) in combinations() {
        let case = format!("stability-{}-{columns}-{substeps}", start.name());
        if options.wants_long(&case) {
            let sheet = Sheet { columns, substeps, start, tethers: 0 };
            let result = watch(case, &sheet, options.stability_frames());
            are_stable &= result.is_stable();
            report.push(&result);
        }
    }
    are_stable
}

fn combinations() -> impl Iterator<Item = (Start, u32, u32)> {
    STARTS.into_iter().flat_map(|start| {
        COLUMNS
            .into_iter()
            .flat_map(move |columns| SUBSTEPS.map(|substeps| (start, columns, substeps)))
    })
}

/// Runs a sheet until its first NaN, after which the numbers have no meaning.
fn watch(case: String, sheet: &Sheet, frames: u32) -> Stability {
    let mut solver = Solver::new(&sheet.scene());
    let energy = EnergyGain::new(&solver);
    let mut pacer = Pacer::new();
    let mut result = Stability {
        case,
        substeps: sheet.substeps,
        frames: 0,
        is_finite: true,
        energy_gain_percent: f64::NEG_INFINITY,
    };
    while result.frames < frames && result.is_finite {
        solver.step();
        result.frames += 1;
        result.energy_gain_percent = result.energy_gain_percent.max(energy.percent(&solver));
        // The solver freezes particles at once when their state is not finite.
        result.is_finite = solver.frozen_count() == 0;
        if pacer.is_due() {
            eprintln!("{}: frame {} of {frames}", result.case, result.frames);
        }
    }
    result
}
