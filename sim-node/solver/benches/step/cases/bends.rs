//! Cost of a bend in a sheet, beside that of a distance: differences of steps with and without them.

use serde::Serialize;
use sim_solver::{Scene, Solver};

use crate::measures::clock::{cpu_ns, median};
use crate::options::Options;
use crate::report::{Report, Row};

const COLUMNS: [u32; 2] = [100, 316];
const SUBSTEPS: u32 = 8;
/// Rates of the scenes, in steps per second.
const RATE_HZ: u32 = 60;
/// Steps of each scene, which take turns.
const ROUNDS: usize = 41;

/// The cost of bends. All times are per substep.
#[derive(Debug, Serialize)]
struct BendCost {
    case: String,
    particles: usize,
    bends: usize,
    distance_ns: f64,
    second_difference_ns: f64,
    twist_ns: f64,
}

impl Row for BendCost {
    const HEADINGS: &'static [&'static str] =
        &["particles", "bends", "distance ns", "second difference ns", "twist ns"];

    fn case(&self) -> &str {
        &self.case
    }

    fn cells(&self) -> Vec<String> {
        vec![
            self.particles.to_string(),
            self.bends.to_string(),
            format!("{:.2}", self.distance_ns),
            format!("{:.2}", self.second_difference_ns),
            format!("{:.2}", self.twist_ns),
        ]
    }
}

pub(crate) fn run(options: &Options, report: &mut Report) {
    for columns in COLUMNS {
        let case = format!("bends-{columns}");
        if options.wants(&case) {
            report.push(&measure(case, columns, options));
        }
    }
}

fn measure(case: String, columns: u32, options: &Options) -> BendCost {
    let sheet = |keys: &str| {
        let mut solver = Solver::new(&scene(columns, keys));
        (0..options.lead_steps(RATE_HZ)).for_each(|_| solver.step());
        solver
    };
    let keys = ["links = [\"structural\"]", "", "bending = 0.01\ntwist = false", "bending = 0.01"];
    let mut sheets = keys.map(sheet);
    let mut times = [const { Vec::new() }; 4];
    for _ in 0..options.count(ROUNDS) {
        for (solver, times) in sheets.iter_mut().zip(&mut times) {
            times.push(cpu_ns(|| solver.step()));
        }
    }
    let [structural, distances, lines, all] = times.map(median);
    let constraints = [0, 1].map(|index: usize| sheets[index].constraint_count());
    let bends = [2, 3].map(|index: usize| sheets[index].bend_count());
    let each = |time: f64, count: usize| time / (count as f64 * f64::from(SUBSTEPS));
    BendCost {
        case,
        particles: sheets[0].particle_count(),
        bends: bends[1],
        distance_ns: each(distances - structural, constraints[1] - constraints[0]),
        second_difference_ns: each(lines - distances, bends[0]),
        twist_ns: each(all - lines, bends[1] - bends[0]),
    }
}

/// A sheet that swings from its upper side, 2 m wide, of 1 kg/m^2.
fn scene(columns: u32, keys: &str) -> Scene {
    let spacing = 2.0 / f64::from(columns - 1);
    let text = format!(
        "version = 1\n[solver]\nrate_hz = {RATE_HZ}\nsubsteps = {SUBSTEPS}\n[[generate]]\n\
         shape = \"cloth\"\ncolumns = {columns}\nrows = {columns}\nspacing = {spacing}\n\
         down = [0, 0, 1]\nmass = {}\n{keys}\n",
        spacing * spacing
    );
    Scene::from_toml(&text, "bends").unwrap()
}
