//! `recorder record --compression none` against a subscriber that writes the same bytes.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Stdio;

use sim_contract::ScratchDomain;

use crate::process::{RECORDER, Times, measure, start};
use crate::verify::cloth_scene;
use crate::{PLAIN_WRITER, print_row};

/// Measurements of each program, which take turns.
const ROUNDS: usize = 3;
/// 10 s of a sheet of 10,000 particles at 240 Hz: 768 MB.
const STEPS: &str = "2400";

pub(crate) fn run() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let played = folder.join("speed-played.mcap");
    let arguments = ["simulate", &cloth_scene(), "--steps", STEPS, "--overwrite", "--output"];
    measure(RECORDER, &[&arguments[..], &[text(&played)]].concat());
    let (plain_path, recorded) = (folder.join("speed-plain"), folder.join("speed-recorded.mcap"));
    let bench = std::env::current_exe().unwrap();
    let (mut plain, mut recorder) = (Times::MAX, Times::MAX);
    let mut sizes = [0; 2];
    for _ in 0..ROUNDS {
        plain = plain.best(with_replay(&played, |domain| {
            measure(text(&bench), &[PLAIN_WRITER, domain, text(&plain_path)])
        }));
        recorder = recorder.best(with_replay(&played, |domain| {
            let file = ["--output", text(&recorded), "--overwrite", "--compression", "none"];
            // Both wait for the disk at the end only.
            let arguments = ["record", "--no-sync", "--domain", domain];
            measure(RECORDER, &[&arguments[..], &file].concat())
        }));
        // A program that replaces a file needs memory for both, which the system may not have at hand.
        sizes = [&plain_path, &recorded].map(|path| {
            let size_bytes = fs::metadata(path).unwrap().len();
            fs::remove_file(path).unwrap();
            size_bytes
        });
    }
    fs::remove_file(played).unwrap();
    print_row(&format!("plain writer, {} bytes", sizes[0]), plain, "1");
    let ratio = format!("{:.2} (CPU)", recorder.cpu_s() / plain.cpu_s());
    print_row(&format!("record, {} bytes", sizes[1]), recorder, &ratio);
}

/// Measures a reader of a replay, which begins once the reader is there.
fn with_replay(played: &Path, reader: impl FnOnce(&str) -> Times) -> Times {
    let domain = ScratchDomain::new("speed");
    let arguments = ["play", text(played), "--domain", domain.name(), "--wait-for-readers", "1"];
    let mut player = start(RECORDER, &arguments, Stdio::piped());
    // The first message says that readers can attach.
    let mut messages = BufReader::new(player.stderr.take().unwrap());
    messages.read_line(&mut String::new()).unwrap();
    let times = reader(domain.name());
    assert!(player.wait().unwrap().success());
    times
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}
