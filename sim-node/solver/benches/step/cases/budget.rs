//! Quality of a sheet with tethers, given a time budget per frame on one processor.

use serde::Serialize;
use sim_solver::Solver;

use crate::measures::clock::cpu_ns;
use crate::measures::quality;
use crate::options::Options;
use crate::report::{self, Report};
use crate::scenes::sheet::{Sheet, Start};

/// Side, start and tethers of the sheet, and the time budget of a frame in ms.
const BUDGETS: [(u32, Start, u32, f64); 3] =
    [(100, Start::Swing, 1, 2.0), (100, Start::Corners, 2, 2.0), (316, Start::Swing, 1, 8.0)];
/// Range in which the largest number of substeps within the budget is searched.
const SUBSTEPS_MIN: u32 = 8;
const SUBSTEPS_MAX: u32 = 64;
/// Frames over which the time is averaged: those in which quality is measured.
const FRAMES: usize = 120;

/// Quality within the budget. It is not measured with fewer than 8 substeps: then the time is that of
/// 8 substeps and exceeds the budget.
#[derive(Debug, Serialize)]
struct Budget {
    budget_ms: f64,
    #[serde(flatten)]
    row: quality::Row,
}

impl report::Row for Budget {
    const HEADINGS: &'static [&'static str] = <quality::Row as report::Row>::HEADINGS;

    fn case(&self) -> &str {
        self.row.case()
    }

    fn cells(&self) -> Vec<String> {
        self.row.cells()
    }
}

pub(crate) fn run(options: &Options, report: &mut Report) {
    for (columns, start, tethers, budget_ms) in BUDGETS {
        let case = format!("quality-{columns}-{}", start.name());
        if !options.wants(&case) {
            continue;
        }
        let sheet = Sheet { columns, substeps: SUBSTEPS_MIN, start, tethers };
        let (sheet, ms_per_frame) = finest_within(budget_ms, &sheet, options);
        let row = quality::Row::measure(&case, &sheet, ms_per_frame, options);
        report.push(&Budget { budget_ms, row });
    }
}

/// Returns the sheet with the most substeps within the budget, and the time of its frame in ms. It
/// bisects, because more substeps never take less time.
fn finest_within(budget_ms: f64, coarsest: &Sheet, options: &Options) -> (Sheet, f64) {
    let mut found = (*coarsest, ms_per_frame(coarsest, options));
    let (mut low, mut high) = (SUBSTEPS_MIN, SUBSTEPS_MAX);
    while low < high {
        let substeps = (low + high).div_ceil(2);
        let sheet = Sheet { substeps, ..*coarsest };
        let ms = ms_per_frame(&sheet, options);
        if ms <= budget_ms {
            (found, low) = ((sheet, ms), substeps);
        } else {
            high = substeps - 1;
        }
    }
    found
}

/// Returns the CPU time of a frame in ms, including the slow first frames.
fn ms_per_frame(sheet: &Sheet, options: &Options) -> f64 {
    let mut solver = Solver::new(&sheet.scene());
    let frames = options.count(FRAMES);
    1e-6 * cpu_ns(|| (0..frames).for_each(|_| solver.step())) / frames as f64
}
