//! How fast a substep is, against the loop of a tutorial in the same run.
//!
//! Both begin with the scene as the solver has it after half a second, and go through the next two
//! again and again: what falls does not fall for hours. Every time is CPU time of this process, the
//! median of runs in turn.
//!
//! The first frames are no measure of the others: of a sheet that was level, most displacements are
//! 0, and those ahead of the wave that runs through it are below the smallest normal f32, which
//! many processors are slow at. What that costs is the slowest frame of the sheet's quality.

use serde::Serialize;
use sim_solver::{Scene, Solver};

use super::clock::{cpu_ns, median};
use super::graphs::Graph;
use super::memory::Footprint;
use super::naive::Naive;
use super::options::Options;
use super::quality::{self, Quality};
use super::report::{Report, Row, cell};
use super::sheet::Sheet;

/// Sheets: particles along a side, and substeps.
const SHEETS: [(u32, u32); 4] = [(32, 16), (100, 16), (316, 8), (1000, 4)];
/// Sheets whose motion is looked at, too; the biggest has no room for it.
const QUALITY_COLUMNS_MAX: u32 = 316;
/// Runs of each program, in turn; odd, so that there is a median.
const ROUNDS: usize = 5;
/// Seconds of the scene after which it begins again.
const COURSE_SECONDS: u32 = 2;

/// What is measured of a case.
#[derive(Debug, Serialize)]
struct Speed {
    case: String,
    particles: usize,
    constraints: usize,
    substeps: u32,
    iterations: u32,
    /// Constraints that are whole, times substeps, times iterations.
    projections_per_step: u64,
    /// Of the whole substep: predict, project, collide, update, and the step's hash.
    ns_per_projection: f64,
    /// How many times as fast as the tutorial's loop: one step of as many passes. None if its
    /// numbers are none.
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

/// Scenes whose links form any graph.
pub(crate) fn run_graphs(options: &Options, report: &mut Report) {
    for graph in Graph::all() {
        let case = graph.name();
        if options.wants(&case) {
            let scene = graph.scene();
            report.push(&speed(&case, &scene, Solver::new(&scene), options));
        }
    }
}

/// A sheet, with how well it moves.
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

/// Measures a scene that a solver is at the beginning of.
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

/// A program that begins again after a number of steps.
struct Course<T> {
    start: T,
    now: T,
    step: fn(&mut T),
    is_finite: fn(&T) -> bool,
    period: u64,
    steps_left: u64,
    /// Whether its numbers were finite at the end of every run, and whenever it began again.
    was_finite: bool,
}

impl<T: Clone> Course<T> {
    fn new(start: T, period: u64, step: fn(&mut T), is_finite: fn(&T) -> bool) -> Self {
        let now = start.clone();
        Self { start, now, step, is_finite, period, steps_left: period, was_finite: true }
    }

    /// CPU time of the next steps, in ns. Beginning again is not part of it.
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
