//! Cost of measuring forces: the same scene with and without.

use serde::Serialize;
use sim_solver::{Scene, Solver, builtin};

use crate::measures::clock::{median, wall_ns};
use crate::options::Options;
use crate::report::{Report, Row};

/// Steps of each solver, which take turns.
const ROUNDS: usize = 1001;

/// A scene with and without the measurement.
#[derive(Debug, Serialize)]
struct Forces {
    case: String,
    particles: usize,
    off_us: f64,
    on_us: f64,
    ratio: f64,
}

impl Row for Forces {
    const HEADINGS: &'static [&'static str] =
        &["particles", "a step in us", "with forces", "ratio"];

    fn case(&self) -> &str {
        &self.case
    }

    fn cells(&self) -> Vec<String> {
        vec![
            self.particles.to_string(),
            format!("{:.2}", self.off_us),
            format!("{:.2}", self.on_us),
            format!("{:.3}", self.ratio),
        ]
    }
}

/// A sheet that lies on a ball, and one that hangs from its top row in front of it.
const SHEETS: [(&str, &str); 2] = [
    (
        "lying",
        "pinned = \"none\"\norigin = [-0.99, 1.01, -0.99]\ndown = [0, 0, 1]\n[[collider]]\n\
         shape = \"sphere\"\ncenter = [0, 0, 0]\nradius = 1\nfriction = 1\n",
    ),
    (
        "hanging",
        "origin = [-0.99, 1, 0]\n[[collider]]\nshape = \"sphere\"\ncenter = [0, 0, 0.3]\nradius = 0.25\n",
    ),
];

pub(crate) fn run(options: &Options, report: &mut Report) {
    for name in ["curtain", "flag", "ragdoll", "rope-bridge", "covered-bust"] {
        let text = builtin::text(name).unwrap();
        measure(options, report, name, text);
    }
    for (name, rest) in SHEETS {
        let text = format!(
            "version = 1\n[solver]\nrate_hz = 240\nsubsteps = 4\ndamping = 1\n[[generate]]\nshape = \"cloth\"\n\
             columns = 100\nrows = 100\nspacing = 0.02\nmass = 0.001\n{rest}"
        );
        measure(options, report, name, &text);
    }
}

fn measure(options: &Options, report: &mut Report, name: &str, text: &str) {
    let case = format!("forces-{name}");
    if !options.wants(&case) {
        return;
    }
    let scene = Scene::from_toml(text, name).unwrap();
    let mut solvers = [Solver::new(&scene), Solver::new(&scene)];
    solvers[1].compute_forces(true);
    let mut times_ns = [const { Vec::new() }; 2];
    for round in 0..options.count(ROUNDS) {
        // The first of two solvers finds the caches of the other one.
        for turn in [round % 2, 1 - round % 2] {
            times_ns[turn].push(wall_ns(|| solvers[turn].step()));
        }
    }
    let [off, on] = times_ns.map(median);
    report.push(&Forces {
        case,
        particles: solvers[0].particle_count(),
        off_us: 1e-3 * off,
        on_us: 1e-3 * on,
        ratio: on / off,
    });
}
