//! A benchmark that cannot flatter: how fast a substep is against the loop of a tutorial, in the
//! same run and on the same particles and links, and how well a sheet moves at that cost.
//!
//! `cargo bench -p sim-solver --bench step [-- --json] [--full] [--quick] [CASE ...]`
//!
//! A case is named in full, or by how it begins: "torn" is "torn-32", "torn-100", and so on.
//! Results go to stdout: Markdown tables at the end, or with `--json` one object a line and case.
//! `--full` runs what takes minutes, too; `--quick` shows that everything works, not how fast.
//!
//! | cases | what they measure |
//! |---|---|
//! | sheet-N | a substep of the sheet, N = 32, 100, 316, 1000; and how well it moves, up to 316 |
//! | torn-N | the same with 1 % of the links cut |
//! | ragdolls-1000, web-large | 1,000 figures that fall on a plane; a web of 10,000 particles |
//! | mesh, mesh-shuffled | an imported mesh of 10,000 vertices, numbered as built or at random |
//! | rope-20, rope-50 | ropes of so many particles |
//! | curtain, ragdoll, pendulum ... | every built-in scene that has links |
//! | quality-N-START | how well a sheet with tethers moves in 2 ms (N = 100) or 8 ms (316) a frame |
//! | cost-316 | packing, hashing and publishing, against a step of the sheet |
//! | threads-N | a step of the sheet with one and two threads, on the wall clock |
//! | stability-START-N-SUBSTEPS | a minute without gaining 1 % of energy, or the exit code is 1; long |
//!
//! START is "swing" (level, held at one side), "hang" (upright) or "corners" (level, held at two).
//! The reference of 316 takes half a minute: name that case in full, or say `--full`.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "printing is what it is for")]
#![allow(clippy::unwrap_used, reason = "a panic is how a benchmark fails")]

mod budget;
mod clock;
mod cost;
mod graphs;
mod memory;
mod mesh;
mod naive;
mod options;
mod quality;
mod reference;
mod report;
mod sheet;
mod speed;
mod stability;
mod threads;

use std::process::ExitCode;

use options::Options;
use report::Report;

/// The exit code of arguments that mean nothing.
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
    cost::run(&options, &mut report);
    threads::run(&options, &mut report);
    let are_stable = stability::run(&options, &mut report);
    if report.is_empty() {
        eprintln!("there is no case of that name");
        return ExitCode::from(USAGE);
    }
    report.finish();
    if are_stable { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
