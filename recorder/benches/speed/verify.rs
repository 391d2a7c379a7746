//! `recorder verify` against the solver alone.

use std::fs;
use std::path::Path;

use crate::print_row;
use crate::process::{RECORDER, Times, measure};

/// Measurements of each program, which take turns.
const ROUNDS: usize = 5;

pub(crate) fn run_curtain() {
    run("curtain", "40000");
}

pub(crate) fn run_cloth() {
    let scene = cloth_scene();
    run(&scene, "2400");
}

/// Writes the scene of a sheet of 10,000 particles, which falls at 240 steps per second. Returns its path.
pub(crate) fn cloth_scene() -> String {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("speed-cloth.toml");
    let text = "version = 1\n\
        generate = [{ shape = 'cloth', columns = 100, rows = 100, spacing = 0.02 }]\n\
        [solver]\nrate_hz = 240\n";
    fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

fn run(scene: &str, steps: &str) {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("speed-verify.mcap");
    let file = path.to_str().unwrap();
    let simulate = ["simulate", scene, "--steps", steps];
    measure(RECORDER, &[&simulate[..], &["--output", file, "--overwrite"]].concat());
    let (mut solver, mut verify) = (Times::MAX, Times::MAX);
    for _ in 0..ROUNDS {
        solver = solver.best(measure(RECORDER, &simulate));
        verify = verify.best(measure(RECORDER, &["verify", file]));
    }
    fs::remove_file(&path).unwrap();
    let name = Path::new(scene).file_stem().unwrap().to_string_lossy();
    print_row(&format!("simulate {name}, {steps} steps"), solver, "1");
    let ratio = format!(
        "{:.2} (wall), {:.2} (main thread)",
        solver.wall_s / verify.wall_s,
        solver.main_thread_s / verify.main_thread_s
    );
    print_row(&format!("verify {name}, {steps} steps"), verify, &ratio);
}
