//! The speed of the recorder against programs that do only the unavoidable part of the same work, in the
//! same run.
//!
//! `cargo bench -p recorder --bench speed [-- CASE ...]`
//!
//! | cases | what they measure |
//! |---|---|
//! | verify-curtain, verify-cloth | `recorder verify` against `recorder simulate` without a file: the solver alone |
//! | record | `recorder record --compression none` against a subscriber that writes the particles with a `BufWriter` |
//!
//! Both programs of a case take turns. Each number is the smallest of its rounds, in seconds: on a machine
//! with other work, compare the CPU times. `main thread` is the part of the CPU time that the solver's
//! thread takes. The last column is the speed, or for `record` the cost, against the other program.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "printing is what it is for")]
#![allow(clippy::unwrap_used, reason = "a panic is how a benchmark fails")]

mod plain_writer;
mod process;
mod record;
mod verify;

use std::process::ExitCode;

use process::Times;

/// Exit code for wrong arguments.
const USAGE: u8 = 2;
/// The first argument of the process that writes the particles.
const PLAIN_WRITER: &str = "plain-writer";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<_> = arguments.iter().map(String::as_str).collect();
    if let [PLAIN_WRITER, domain, path] = arguments.as_slice() {
        plain_writer::run(domain, path);
        return ExitCode::SUCCESS;
    }
    // Cargo adds an option of its own.
    let names: Vec<_> = arguments.into_iter().filter(|name| *name != "--bench").collect();
    let cases: [(&str, fn()); 3] = [
        ("verify-curtain", verify::run_curtain),
        ("verify-cloth", verify::run_cloth),
        ("record", record::run),
    ];
    if let Some(unknown) = names.iter().find(|name| cases.iter().all(|(case, _)| case != *name)) {
        eprintln!("no case has the name {unknown}");
        return ExitCode::from(USAGE);
    }
    println!("| program | wall | CPU | user | system | main thread | ratio |");
    println!("|---|---|---|---|---|---|---|");
    for (case, run) in cases {
        if names.is_empty() || names.contains(&case) {
            run();
        }
    }
    ExitCode::SUCCESS
}

/// Prints the times of a program.
fn print_row(program: &str, times: Times, ratio: &str) {
    let Times { wall_s, user_s, system_s, main_thread_s } = times;
    let cpu_s = times.cpu_s();
    println!(
        "| {program} | {wall_s:.2} | {cpu_s:.2} | {user_s:.2} | {system_s:.2} | {main_thread_s:.2} | {ratio} |"
    );
}
