//! Speed of a substep, compared with the loop of a tutorial in the same run.
//!
//! Both start from the solver's state after half a second and repeat the next two seconds, so that
//! nothing falls for hours. Every time is CPU time of this process, the median of runs that take turns.
//!
//! The first frames are not representative. In a level sheet most displacements are 0, and those ahead
//! of the wave that runs through it are subnormal, which is slow on many processors. The slowest frame
//! in the sheet's quality shows this cost.

use serde::Serialize;
use sim_solver::{Scene, Solver};

use crate::measures::clock::{cpu_ns, median};
use crate::measures::memory::Footprint;
use crate::measures::quality::{self, Quality};
use crate::options::Options;
use crate::programs::naive::Naive;
use crate::report::{Report, Row, cell};
use crate::scenes::graphs::Graph;
use crate::scenes::sheet::Sheet;

/// Sheets: particles along a side, and substeps.
const SHEETS: [(u32, u32); 4] = [(32, 16), (100, 16), (316, 8), (1000, 4)];
/// Sheets whose quality is measured, too. The largest would take too long.
const QUALITY_COLUMNS_MAX: u32 = 316;
/// Runs of each program, which take turns. The number is odd, so that there is a median.
const ROUNDS: usize = 5;
/// Seconds of the scene after which it starts again.
const COURSE_SECONDS: u32 = 2;

/// Measurements of a case.
#[derive(Debug, Serialize)]
struct Speed {
    case: String,
    particles: usize,
    constraints: usize,
    substeps: u32,
    iterations: u32,
    /// Intact constraints times substeps times iterations.
    projections_per_step: u64,
    /// Time of a whole substep: predict, project, collide, update, and its part of the hash.
    ns_per_projection: f64,
    /// Speed relative to the tutorial's loop, which makes one step of as many passes. None if the
    /// loop's numbers become NaN.
    ratio_to_naive: Option<f64>,
    naive_ns_per_projection: Option<f64>,
    steps_per_s: f64,
    #[serde(flatten)]
    footprint: Footprint,
    #[serde(flatten)]
    quality: Option<Quality>,
}

impl Row for Speed {
    const HEADINGS: &'static [&'static str] = &[
        "particles",
        "links",
        "substeps x iterations",
        "ns per projection",
        "naive",
        "ratio",
        "steps/s",
        "B/particle",
        "B/link",
    ];

    fn case(&self) -> &str {
        &self.case
    }

    fn cells(&self) -> Vec<String> {
        vec![
            self.particles.to_string(),
            self.constraints.to_string(),
            format!("{} x {}", self.substeps, self.iterations),
            format!("{:.2}", self.ns_per_projection),
            cell(self.naive_ns_per_projection, 2),
            cell(self.ratio_to_naive, 2),
            format!("{:.1}", self.steps_per_s),
            format!("{:.0}", self.footprint.bytes_per_particle),
            format!("{:.0}", self.footprint.bytes_per_constraint),
        ]
    }
}

pub(crate) fn run_sheets(options: &Options, report: &mut Report) {
    for (columns, substeps) in SHEETS {
        let sheet = Sheet::swing(columns, substeps);
        let case = format!("sheet-{columns}");
        if options.wants(&case) {
            push_sheet(&case, &sheet, options, report);
        }
        let case = format!("torn-{columns}");
        if options.wants(&case) {
            let scene = sheet.scene();
            let mut solver = Solver::new(&scene);
            cut_one_in_a_hundred(&mut solver);
            report.push(&speed(&case, &scene, solver, options));
        }
    }
}

/// Runs the scenes whose links form an arbitrary graph.
pub(crate) fn run_graphs(options: &Options, report: &mut Report) {
    for graph in Graph::all() {
        let case = graph.name();
        if options.wants(&case) {
            let scene = graph.scene();
            report.push(&speed(&case, &scene, Solver::new(&scene), options));
        }
    }
}

/// Runs a sheet, with its quality.
fn push_sheet(case: &str, sheet: &Sheet, options: &Options, report: &mut Report) {
    let scene = sheet.scene();
    let mut speed = speed(case, &scene, Solver::new(&scene), options);
    if sheet.columns > QUALITY_COLUMNS_MAX {
        report.push(&speed);
        return;
    }
    let row = quality::Row::measure(case, sheet, 1e3 / speed.steps_per_s, options);
    speed.quality = Some(row.quality.clone());
    report.push(&speed);
    report.tabulate(&row);
}

fn cut_one_in_a_hundred(solver: &mut Solver) {
    for index in (50..solver.constraint_count()).step_by(100) {
        solver.cut(u32::try_from(index).unwrap()).unwrap();
    }
}

/// Measures a scene with a solver at step 0.
fn speed(case: &str, scene: &Scene, mut solver: Solver, options: &Options) -> Speed {
    let settings = scene.solver;
    (0..options.lead_steps(settings.rate_hz)).for_each(|_| solver.step());
    let (particles, constraints) = (solver.particle_count(), solver.constraint_count());
    let whole = (constraints - solver.torn().len()) as u64;
    let projections_per_step =
        whole * u64::from(settings.substeps) * u64::from(settings.iterations);
    let steps = (options.projections_per_run() / projections_per_step).max(1);
    let period = u64::from(COURSE_SECONDS * settings.rate_hz);
    let mut naive = Course::new(Naive::new(scene, &solver), period, Naive::step, Naive::is_finite);
    let mut solver = Course::new(solver, period, Solver::step, |one| one.frozen_count() == 0);
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    for _ in 0..options.count(ROUNDS) {
        ours.push(solver.cpu_ns(steps));
        theirs.push(naive.cpu_ns(steps));
    }
    assert!(solver.was_finite, "{case}: no time of numbers that are none");
    let projections = (steps * projections_per_step) as f64;
    let ns_per_projection = median(ours) / projections;
    let naive_ns_per_projection = naive.was_finite.then(|| median(theirs) / projections);
    Speed {
        case: case.to_owned(),
        particles,
        constraints,
        substeps: settings.substeps,
        iterations: settings.iterations,
        projections_per_step,
        ns_per_projection,
        ratio_to_naive: naive_ns_per_projection.map(|naive| naive / ns_per_projection),
        naive_ns_per_projection,
        steps_per_s: 1e9 / (ns_per_projection * projections_per_step as f64),
        footprint: Footprint::measure(scene),
        quality: None,
    }
}

/// A program that starts again after a number of steps.
struct Course<T> {
    start: T,
    now: T,
    step: fn(&mut T),
    is_finite: fn(&T) -> bool,
    period: u64,
    steps_left: u64,
    /// Its numbers were finite at the end of every run and of every repetition.
    was_finite: bool,
}

impl<T: Clone> Course<T> {
    fn new(start: T, period: u64, step: fn(&mut T), is_finite: fn(&T) -> bool) -> Self {
        let now = start.clone();
        Self { start, now, step, is_finite, period, steps_left: period, was_finite: true }
    }

    /// Returns the CPU time of the next steps, in ns, without the time for starting again.
    fn cpu_ns(&mut self, mut steps: u64) -> f64 {
        let mut sum = 0.0;
        while steps > 0 {
            if self.steps_left == 0 {
                self.now = self.start.clone();
                self.steps_left = self.period;
            }
            let count = steps.min(self.steps_left);
            sum += cpu_ns(|| (0..count).for_each(|_| (self.step)(&mut self.now)));
            self.was_finite &= (self.is_finite)(&self.now);
            self.steps_left -= count;
            steps -= count;
        }
        sum
    }
}
