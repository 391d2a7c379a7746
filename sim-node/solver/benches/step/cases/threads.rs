//! Gain by a second thread, in wall-clock time, without contacts and with them.

use serde::Serialize;
use sim_solver::{Scene, Solver};

use crate::measures::clock::{tenth_percentile, wall_ns};
use crate::options::Options;
use crate::report::{Report, Row};
use crate::scenes::sheet::Sheet;
use crate::scenes::touching::{TouchingSheet, ball, ground};

/// Side of the sheet, substeps, and turns.
const SHEETS: [(u32, u32, usize); 4] = [(32, 16, 60), (100, 16, 30), (316, 8, 8), (1000, 4, 2)];
/// Sides of the sheets that touch themselves, and turns.
const TOUCHING: [(u32, usize); 2] = [(100, 12), (316, 3)];
/// Modes of contact.
const MODES: [&str; 2] = ["particles", "surfaces"];
/// Consecutive steps of one solver. A thread that still waits for work disturbs only the first step
/// of the other solver.
const STEPS_PER_TURN: usize = 5;
/// Pairs of solvers. They take turns in being created first, because the place of the arrays in memory
/// matters by a few percent.
const PAIRS: usize = 4;

/// A sheet with one thread and with two.
#[derive(Debug, Serialize)]
struct Threads {
    case: String,
    substeps: u32,
    /// The tenth percentile of the steps, because other processes slow down some of them. CPU time
    /// would include the waiting.
    one_thread_p10_ms: f64,
    two_threads_p10_ms: f64,
    /// Speed with two threads relative to one.
    speedup: f64,
}

impl Row for Threads {
    const HEADINGS: &'static [&'static str] =
        &["substeps", "1 thread: ms a step (p10)", "2 threads", "speed-up"];

    fn case(&self) -> &str {
        &self.case
    }

    fn cells(&self) -> Vec<String> {
        vec![
            self.substeps.to_string(),
            format!("{:.3}", self.one_thread_p10_ms),
            format!("{:.3}", self.two_threads_p10_ms),
            format!("{:.2}", self.speedup),
        ]
    }
}

pub(crate) fn run(options: &Options, report: &mut Report) {
    for (columns, substeps, turns) in SHEETS {
        let case = format!("threads-{columns}");
        if options.wants(&case) {
            let scene = Sheet::swing(columns, substeps).scene();
            report.push(&measure(case, &scene, options.count(turns)));
        }
    }
    for (columns, turns) in TOUCHING {
        for mode in MODES {
            let case = format!("threads-{columns}-{mode}");
            if options.wants(&case) {
                let scene = falling(columns, mode);
                report.push(&measure(case, &scene, options.count(turns)));
            }
        }
    }
}

/// A sheet that falls on a ball and folds, 60 x 16 substeps a second.
fn falling(side: u32, mode: &str) -> Scene {
    let spacing = 0.02;
    let half = spacing * f64::from(side - 1) / 2.0;
    let radius = half / 4.0;
    let sheet = TouchingSheet {
        rate_hz: 60,
        substeps: 16,
        mode,
        side,
        spacing,
        origin: [-half, 2.1 * radius, -half],
        right: [1.0, 0.0, 0.0],
        down: [0.0, 0.0, 1.0],
        colliders: ball(radius, radius) + &ground(0.0),
    };
    sheet.scene()
}

/// Measures in turns, so that disturbances affect both alike.
fn measure(case: String, scene: &Scene, turns: usize) -> Threads {
    let (mut ones, mut twos) = (Vec::new(), Vec::new());
    for pair in 0..PAIRS {
        let mut two = (pair % 2 == 0).then(|| with_threads(scene, 2));
        let mut one = with_threads(scene, 1);
        let two = two.get_or_insert_with(|| with_threads(scene, 2));
        for _ in 0..turns {
            time_steps(&mut one, &mut ones);
            time_steps(two, &mut twos);
        }
        assert_eq!(one.state_hash(), two.state_hash(), "{case}: the bits depend on the threads");
    }
    let (one_ns, two_ns) = (tenth_percentile(ones), tenth_percentile(twos));
    Threads {
        case,
        substeps: scene.solver.substeps,
        one_thread_p10_ms: 1e-6 * one_ns,
        two_threads_p10_ms: 1e-6 * two_ns,
        speedup: one_ns / two_ns,
    }
}

fn with_threads(scene: &Scene, count: usize) -> Solver {
    let mut solver = Solver::new(scene);
    solver.set_threads(count);
    solver
}

fn time_steps(solver: &mut Solver, times_ns: &mut Vec<f64>) {
    times_ns.extend((0..STEPS_PER_TURN).map(|_| wall_ns(|| solver.step())));
}
