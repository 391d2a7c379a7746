//! How fast a substep is, against the loop of a tutorial in the same run:
//! `cargo bench -p sim-solver --bench step [-- --json] [-- CASE ...]`
//!
//! The sheet: N x N particles, 2 m wide, let go from the horizontal, its top row pinned, unit
//! masses, structural and both diagonal links (4 N^2 - 6 N + 2), rigid, undamped, 60 frames a
//! second. "sheet" has nothing else; "torn" has one plane below it and 1 % of its links cut. Every
//! time is CPU time of this process, the median of interleaved runs.
#![allow(clippy::print_stdout, reason = "printing is what it is for")]
#![allow(clippy::unwrap_used, reason = "a panic is how a benchmark fails")]

mod naive;
mod quality;
mod sheet;

use rustix::time::{ClockId, clock_gettime};
use serde::Serialize;

use quality::Quality;
use sheet::Variant;

/// Runs of each program, in turn; odd, so that there is a median.
const ROUNDS: usize = 5;
/// Projections of one timed run: enough for tens of milliseconds.
const PROJECTIONS_PER_RUN: u64 = 12_000_000;

/// One line of the table.
#[derive(Debug, Serialize)]
struct Row {
    case: String,
    particles: usize,
    constraints: usize,
    substeps: u32,
    /// Of the whole substep: predict, project, collide, update, and the step's hash.
    ns_per_projection: f64,
    /// As fast as the tutorial's loop: one step of as many passes.
    ratio_to_naive: f64,
    naive_ns_per_projection: f64,
    steps_per_s: f64,
    #[serde(flatten)]
    quality: Option<Quality>,
}

fn main() {
    let args: Vec<_> = std::env::args().skip(1).filter(|arg| arg != "--bench").collect();
    let as_json = args.iter().any(|arg| arg == "--json");
    let wanted: Vec<_> = args.iter().filter(|arg| !arg.starts_with("--")).collect();
    for (columns, substeps) in [(32, 16), (100, 16), (316, 8), (1000, 4)] {
        for variant in [Variant::Plain, Variant::Torn] {
            let case = format!("{}-{columns}", variant.name());
            if wanted.is_empty() || wanted.iter().any(|part| case.contains(part.as_str())) {
                print_row(&row(case, variant, (columns, substeps)), as_json);
            }
        }
    }
}

fn print_row(row: &Row, as_json: bool) {
    if as_json {
        println!("{}", serde_json::to_string(row).unwrap());
        return;
    }
    println!(
        "{:<12} {:>7} particles {:>8} links x {:>2}: {:>6.2} ns per projection, naive {:>6.2}, ratio {:>5.2}, {:>8.1} steps/s",
        row.case,
        row.particles,
        row.constraints,
        row.substeps,
        row.ns_per_projection,
        row.naive_ns_per_projection,
        row.ratio_to_naive,
        row.steps_per_s
    );
    if let Some(quality) = &row.quality {
        println!("{:<12} {quality}", "");
    }
}

fn row(case: String, variant: Variant, (columns, substeps): (u32, u32)) -> Row {
    let mut solver = variant.solver(columns, substeps);
    let mut naive = naive::Sheet::new(columns);
    let links = solver.constraint_count();
    let per_step = links as u64 * u64::from(substeps);
    let steps = (PROJECTIONS_PER_RUN / per_step).max(1);
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        ours.push(cpu_ns(|| (0..steps).for_each(|_| solver.step())));
        theirs.push(cpu_ns(|| (0..steps).for_each(|_| naive.step(substeps))));
    }
    let projections = (steps * per_step) as f64;
    let (ours, theirs) = (median(ours) / projections, median(theirs) / projections);
    assert!(naive.is_finite(), "no ratio against numbers that are none");
    Row {
        case,
        particles: solver.particle_count(),
        constraints: links,
        substeps,
        ns_per_projection: ours,
        ratio_to_naive: theirs / ours,
        naive_ns_per_projection: theirs,
        steps_per_s: 1e9 / (ours * per_step as f64),
        // The reference of a bigger sheet takes minutes.
        quality: (variant == Variant::Plain && columns <= 100)
            .then(|| Quality::measure(columns, substeps)),
    }
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// CPU time of this process for some work, in ns.
fn cpu_ns(work: impl FnOnce()) -> f64 {
    let now = || {
        let time = clock_gettime(ClockId::ProcessCPUTime);
        time.tv_sec as f64 * 1e9 + time.tv_nsec as f64
    };
    let before = now();
    work();
    now() - before
}
