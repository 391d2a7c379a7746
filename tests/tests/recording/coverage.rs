//! The report of a verification names the content that it does not compare.

use integration_tests::{Process, Program, Sandbox};
use serde_json::Value;

#[test]
fn a_verification_names_the_content_that_it_does_not_compare() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let args = ["simulate", "pendulum", "--steps", "10", "-o", &file];
    Process::run(Program::Recorder, &sandbox, &args).success();
    let verdict = Process::run(Program::Recorder, &sandbox, &["verify", &file]).success();
    assert_eq!(verdict, "10 steps bit-identical (0..=10)\n", "the verdict stands alone");
    let text = Process::run(Program::Recorder, &sandbox, &["verify", &file, "-v"]).success();
    let lines: Vec<_> = text.lines().collect();
    assert_eq!(lines[..2], ["10 steps bit-identical (0..=10)", "not compared:"]);
    let report = Process::run(Program::Recorder, &sandbox, &["verify", &file, "--json"]).json();
    let listed: Vec<_> =
        report["not_covered"].as_array().unwrap().iter().map(Value::as_str).collect();
    let printed: Vec<_> = lines[2..].iter().map(|line| Some(line.trim())).collect();
    assert_eq!(listed, printed);
    assert!(listed.iter().flatten().any(|one| one.contains("measured times")), "{listed:?}");
}
