//! Cost of a step beside its substeps, and cost of publishing it.

use serde::Serialize;
use sim_solver::{Particle, Scene, Solver};

use crate::measures::clock::{cpu_ns, median};
use crate::options::Options;
use crate::report::{Report, Row};
use crate::scenes::sheet::Sheet;

const COLUMNS: u32 = 316;
const SUBSTEPS: u32 = 8;
/// Substeps of the second scene of free particles.
const MORE_SUBSTEPS: u32 = 5;
/// Steps of each program, which take turns.
const ROUNDS: usize = 41;
/// Buffers for publishing, used in turn, because a reader keeps some of them.
const LOANS: usize = 4;

/// The cost of a step of the sheet that does not depend on its constraints.
#[derive(Debug, Serialize)]
struct Cost {
    case: String,
    particles: usize,
    substeps: u32,
    step_ms: f64,
    /// Cost of a step of free particles beside its substeps: reading every number once, packing and
    /// hashing the state. It is computed from steps of 1 and 5 substeps, which differ by 4 substeps.
    pack_and_hash_ns_per_particle: f64,
    pack_and_hash_gb_per_s: f64,
    pack_and_hash_percent_of_step: f64,
    /// Cost of writing the state into a buffer of 32 B per particle.
    publish_ns_per_particle: f64,
    publish_gb_per_s: f64,
    publish_percent_of_step: f64,
}

impl Row for Cost {
    const HEADINGS: &'static [&'static str] = &[
        "step ms",
        "pack and hash ns/particle",
        "GB/s",
        "% of a step",
        "publish ns/particle",
        "GB/s",
        "% of a step",
    ];

    fn case(&self) -> &str {
        &self.case
    }

    fn cells(&self) -> Vec<String> {
        vec![
            format!("{:.2}", self.step_ms),
            format!("{:.2}", self.pack_and_hash_ns_per_particle),
            format!("{:.1}", self.pack_and_hash_gb_per_s),
            format!("{:.1}", self.pack_and_hash_percent_of_step),
            format!("{:.2}", self.publish_ns_per_particle),
            format!("{:.1}", self.publish_gb_per_s),
            format!("{:.1}", self.publish_percent_of_step),
        ]
    }
}

pub(crate) fn run(options: &Options, report: &mut Report) {
    let case = format!("cost-{COLUMNS}");
    if options.wants(&case) {
        report.push(&measure(case, options));
    }
}

fn measure(case: String, options: &Options) -> Cost {
    let mut sheet = Solver::new(&Sheet::swing(COLUMNS, SUBSTEPS).scene());
    let [mut short, mut long] =
        [1, MORE_SUBSTEPS].map(|substeps| Solver::new(&free_particles(substeps)));
    let count = sheet.particle_count();
    let mut loans = vec![vec![Particle::default(); count]; LOANS];
    let [mut steps, mut shorts, mut longs, mut publications] = [const { Vec::new() }; 4];
    for round in 0..options.count(ROUNDS) {
        shorts.push(cpu_ns(|| short.step()));
        longs.push(cpu_ns(|| long.step()));
        steps.push(cpu_ns(|| sheet.step()));
        publications.push(cpu_ns(|| publish(&sheet, &mut loans[round % LOANS])));
    }
    let (step, short, long) = (median(steps), median(shorts), median(longs));
    let pack_and_hash = short - (long - short) / f64::from(MORE_SUBSTEPS - 1);
    let publish = median(publications);
    let (particles, bytes) = (count as f64, (count * size_of::<Particle>()) as f64);
    Cost {
        case,
        particles: count,
        substeps: SUBSTEPS,
        step_ms: 1e-6 * step,
        pack_and_hash_ns_per_particle: pack_and_hash / particles,
        pack_and_hash_gb_per_s: bytes / pack_and_hash,
        pack_and_hash_percent_of_step: 100.0 * pack_and_hash / step,
        publish_ns_per_particle: publish / particles,
        publish_gb_per_s: bytes / publish,
        publish_percent_of_step: 100.0 * publish / step,
    }
}

/// Writes the state into a buffer in place of a loan of shared memory.
fn publish(solver: &Solver, loan: &mut [Particle]) {
    loan.copy_from_slice(solver.particles());
    std::hint::black_box(loan);
}

/// Returns a scene with the particles of the sheet, but without constraints and colliders.
fn free_particles(substeps: u32) -> Scene {
    let text = format!(
        "version = 1\n[solver]\nrate_hz = 60\nsubsteps = {substeps}\n[[generate]]\nshape = \"cloth\"\n\
         columns = {COLUMNS}\nrows = {COLUMNS}\nspacing = 0.01\nlinks = []\npinned = \"none\"\n"
    );
    Scene::from_toml(&text, "free particles").unwrap()
}
