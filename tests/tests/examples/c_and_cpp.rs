//! The examples in C and C++ compile with the commands of their README, and work against a node.

use std::path::Path;
use std::process::Command;

use integration_tests::{Process, Program, Sandbox, ctl};

const README: &str = include_str!("../../../sim-node/c/README.md");

/// Compiles a program as the README does, but with the libraries of this build, without a warning, and
/// beside them.
#[allow(clippy::disallowed_methods, reason = "a test starts the compiler")]
fn compile(program: Program) {
    let path = program.path();
    let (folder, name) = (path.parent().unwrap(), path.file_name().unwrap().to_str().unwrap());
    let command = README.lines().find(|line| line.contains(&format!(" -o {name} "))).unwrap();
    let folder = folder.to_str().unwrap();
    let command = command
        .replace("$PWD/target/release", folder)
        .replace("target/release", folder)
        .replace(&format!("-o {name} "), &format!("-o {folder}/{name} "));
    let output = Command::new("sh")
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap())
        .args(["-c", &format!("{command} -Wall -Wextra -Wpedantic -Werror")])
        .output()
        .unwrap();
    assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Runs the example in C against the curtain.
fn pull_corner(program: Program) {
    compile(program);
    let sandbox = Sandbox::new();
    let finished = Process::run(program, &sandbox, &[]);
    let expected = Process::run(Program::SimNode, &sandbox, &["ctl", "status"]);
    assert_eq!((finished.code, expected.code), (Some(1), Some(1)));
    assert_eq!(finished.stderr, expected.stderr, "the sentence of ctl");

    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let printed = Process::run(program, &sandbox, &["0.75"]).success();
    let (pulled, released) = printed.split_once("released\n").unwrap();
    let heights = |text: &str| -> Vec<f32> {
        let lines = text.lines().filter(|line| line.ends_with(" m"));
        lines.map(|line| line.split(' ').nth(2).unwrap().parse().unwrap()).collect()
    };
    // The corner hangs at the height 0, is pulled by 0.3 m within a quarter of a second, and then held: released in
    // motion, it would rise first.
    let (pulled, released) = (heights(pulled), heights(released));
    assert_eq!((pulled.len(), released.len()), (3, 3), "{printed}");
    assert!(pulled[0] < 0.1 && pulled[1] > 0.25, "{printed}");
    // How far the corner falls depends on how the curtain moved before.
    assert!(released[2] < released[0] - 0.05, "{printed}");
    let status = ctl(&sandbox, &["status"]);
    let counts = (status["outcomes"].as_u64(), status["rejected_commands"].as_u64());
    assert_eq!(counts, (Some(2), Some(0)));
}

#[test]
fn the_c_example_pulls_the_corner_of_the_curtain() {
    pull_corner(Program::PullCorner);
}

#[test]
fn the_c_example_works_with_the_static_library() {
    pull_corner(Program::PullCornerStatic);
}

#[test]
#[ignore = "needs a C++ compiler"]
fn the_cpp_example_brings_a_pendulum_to_rest() {
    compile(Program::HoldInCpp);
    let sandbox = Sandbox::new();
    let args = ["run", "pendulum", "--as-fast-as-possible"];
    let _node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let printed = Process::run(Program::HoldInCpp, &sandbox, &["4800"]).success();
    let speed = printed.strip_prefix("the mass moves at ").and_then(|rest| rest.split(' ').next());
    // It swings at 3 m/s without control.
    assert!(speed.unwrap().parse::<f32>().unwrap() < 0.001, "{printed}");
}

#[test]
fn the_c_examples_stay_short() {
    for source in [
        include_str!("../../../sim-node/c/examples/pull_corner.c"),
        include_str!("../../../sim-node/c/examples/hold.cpp"),
    ] {
        assert!(source.lines().count() <= 60);
    }
}
