//! A fair benchmark: the speed of a substep against the loop of a tutorial, in the same run and on the
//! same particles and links, and the quality of a sheet's motion at that cost.
//!
//! `cargo bench -p sim-solver --bench step [-- --json] [--full] [--quick] [CASE ...]`
//!
//! Name a case in full or by its beginning: "torn" means "torn-32", "torn-100", and so on. Results go
//! to stdout: Markdown tables at the end, or with `--json` one object per line and case. `--full` also
//! runs the cases that take minutes. `--quick` checks that everything works, but not how fast.
//!
//! | cases | what they measure |
//! |---|---|
//! | sheet-N | a substep of the sheet, N = 32, 100, 316, 1000; up to 316 also its quality |
//! | torn-N | the same sheet with 1 % of the links cut |
//! | ragdolls-1000, web-large | 1,000 figures that fall on a plane; a web of 10,000 particles |
//! | mesh, mesh-shuffled | an imported mesh of 10,000 vertices, numbered as built or at random |
//! | rope-20, rope-50 | ropes of 20 and 50 particles |
//! | curtain, ragdoll, pendulum ... | every built-in scene that has links |
//! | quality-N-START | quality of a sheet with tethers at 2 ms (N = 100) or 8 ms (316) per frame |
//! | bends-N | the cost of a bend in a sheet, and of a distance, N = 100, 316 |
//! | cost-316 | packing, hashing and publishing, compared with a step of the sheet |
//! | threads-N | a step of the sheet with one and two threads, in wall-clock time |
//! | contacts-SHEET-RATE | a sheet that falls flat, on a ball, or on its edge, with contacts of particles and without |
//! | forces-SCENE | a step that measures forces on colliders and fixed particles, and one that does not |
//! | meshes-TRIANGLES | a sheet on a ball of triangles, and on a sphere; the time to load the mesh |
//! | stability-START-N-SUBSTEPS | a minute without a gain of 1 % in energy, else the exit code is 1; long |
//!
//! START is "swing" (level, pinned at one side), "hang" (upright) or "corners" (level, pinned at two
//! corners). The reference of 316 takes half a minute: name that case in full, or pass `--full`.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "printing is what it is for")]
#![allow(clippy::unwrap_used, reason = "a panic is how a benchmark fails")]

mod cases;
mod measures;
mod options;
mod programs;
mod report;
mod scenes;

use std::process::ExitCode;

use cases::{bends, budget, contacts, cost, forces, meshes, speed, stability, threads};
use options::Options;
use report::Report;

/// Exit code for wrong arguments.
const USAGE: u8 = 2;

fn main() -> ExitCode {
    let options = match Options::parse(std::env::args().skip(1)) {
        Ok(options) => options,
        Err(problem) => {
            eprintln!("{problem}");
            return ExitCode::from(USAGE);
        }
    };
    let mut report = Report::new(options.as_json);
    speed::run_sheets(&options, &mut report);
    speed::run_graphs(&options, &mut report);
    budget::run(&options, &mut report);
    bends::run(&options, &mut report);
    cost::run(&options, &mut report);
    threads::run(&options, &mut report);
    contacts::run(&options, &mut report);
    forces::run(&options, &mut report);
    meshes::run(&options, &mut report);
    let are_stable = stability::run(&options, &mut report);
    if report.is_empty() {
        eprintln!("no case has that name");
        return ExitCode::from(USAGE);
    }
    report.finish();
    if are_stable { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
