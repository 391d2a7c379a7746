//! Cost of contacts: the same sheet without them, with those of particles, and with those of surfaces.

use serde::Serialize;
use sim_solver::{Scene, Solver};

use crate::measures::clock::wall_ns;
use crate::options::Options;
use crate::report::{Report, Row};
use crate::scenes::touching::{TouchingSheet, ball, ground};

/// Distance of neighbours in m, which is also the contact distance.
const SPACING: f64 = 0.02;
/// Rates and numbers of substeps: 960 substeps per second each.
const RATES: [(u32, u32); 2] = [(240, 4), (60, 16)];

/// Modes of contact that are compared.
const MODES: [&str; 3] = ["off", "particles", "surfaces"];

/// A sheet with contacts and without.
#[derive(Debug, Serialize)]
struct Contacts {
    case: String,
    /// Median over the steps, for each particle and substep.
    off_ns: f64,
    particles_ns: f64,
    surfaces_ns: f64,
    /// Time with contacts relative to the time without.
    particles_ratio: f64,
    surfaces_ratio: f64,
}

impl Row for Contacts {
    const HEADINGS: &'static [&'static str] =
        &["off: ns a particle and substep", "particles", "ratio", "surfaces", "ratio"];

    fn case(&self) -> &str {
        &self.case
    }

    fn cells(&self) -> Vec<String> {
        vec![
            format!("{:.1}", self.off_ns),
            format!("{:.1}", self.particles_ns),
            format!("{:.2}", self.particles_ratio),
            format!("{:.1}", self.surfaces_ns),
            format!("{:.2}", self.surfaces_ratio),
        ]
    }
}

/// A falling sheet of `side` x `side` particles.
struct Fall {
    name: &'static str,
    side: u32,
    /// Where the time is measured, in s.
    from_s: f64,
    to_s: f64,
}

const FALLS: [Fall; 3] = [
    // Level, in free fall.
    Fall { name: "flat", side: 100, from_s: 0.0, to_s: 0.25 },
    // Onto a ball on the ground.
    Fall { name: "ball", side: 100, from_s: 0.3, to_s: 1.0 },
    // On its edge.
    Fall { name: "heap", side: 48, from_s: 0.3, to_s: 2.0 },
];

impl Fall {
    fn scene(&self, (rate_hz, substeps): (u32, u32), mode: &str) -> Scene {
        let length = f64::from(self.side - 1) * SPACING;
        let above = [-length / 2.0, 0.5, -length / 2.0];
        let ground = ground(0.01);
        let (origin, right, down, colliders) = match self.name {
            "heap" => ([0.0, length + 0.01, 0.0], [1.0, 0.0, 0.01], [0.02, -1.0, 0.01], ground),
            "ball" => (above, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], ball(0.15, 0.16) + &ground),
            _ => (above, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], String::new()),
        };
        let (side, spacing) = (self.side, SPACING);
        TouchingSheet { rate_hz, substeps, mode, side, spacing, origin, right, down, colliders }
            .scene()
    }
}

pub(crate) fn run(options: &Options, report: &mut Report) {
    for fall in &FALLS {
        for rates in RATES {
            let case = format!("contacts-{}-{}x{}", fall.name, rates.0, rates.1);
            if options.wants(&case) {
                report.push(&measure(case, fall, rates));
            }
        }
    }
}

/// Steps all modes in turns, so that disturbances affect them alike.
fn measure(case: String, fall: &Fall, rates: (u32, u32)) -> Contacts {
    let mut solvers = MODES.map(|mode| Solver::new(&fall.scene(rates, mode)));
    let mut times_ns = MODES.map(|_| Vec::new());
    let time_s = |step: u32| f64::from(step) / f64::from(rates.0);
    for step in (0..).take_while(|step| time_s(*step) < fall.to_s) {
        for (solver, times_ns) in solvers.iter_mut().zip(&mut times_ns) {
            let time_ns = wall_ns(|| solver.step());
            if time_s(step) >= fall.from_s {
                times_ns.push(time_ns);
            }
        }
    }
    let work = f64::from(rates.1) * f64::from(fall.side * fall.side);
    let medians = times_ns.map(|mut times_ns| {
        times_ns.sort_by(f64::total_cmp);
        times_ns[times_ns.len() / 2] / work
    });
    let [off_ns, particles_ns, surfaces_ns] = medians;
    Contacts {
        case,
        off_ns,
        particles_ns,
        surfaces_ns,
        particles_ratio: particles_ns / off_ns,
        surfaces_ratio: surfaces_ns / off_ns,
    }
}
