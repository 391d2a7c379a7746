//! The demo shows that it is building, runs all three programs until Ctrl-C, and describes the
//! recording.

use integration_tests::{
    Process, Program, Sandbox, build_products, build_products_and_bodies, ctl, wait_for,
};
use serde_json::json;

#[test]
fn the_demo_shows_its_progress_and_describes_the_recording_after_ctrl_c() {
    // The demo would build them too, but the deadline below does not allow for that.
    build_products().unwrap();
    let sandbox = Sandbox::new();
    let mut demo = Process::start(Program::Demo, &sandbox, &[]);
    demo.wait_for_line("building the programs");
    demo.wait_for_line("open in a browser:  http://127.0.0.1:");
    let finished = demo.interrupt();
    assert_eq!(finished.code, Some(0), "{}", finished.stderr);
    let (file, description) = finished.stdout.split_once('\n').unwrap_or_default();
    assert!(description.contains("drape"), "{description}");
    assert!(std::fs::remove_file(file).is_ok(), "no recording at {file}");
}

#[test]
fn a_demo_whose_programs_are_not_built_says_so_in_a_sentence() {
    let sandbox = Sandbox::new();
    let demo = Program::Demo.path();
    let script = r#"RUSTC=/nowhere exec "$0""#;
    let finished = Process::run(Program::Bash, &sandbox, &["-c", script, demo.to_str().unwrap()]);
    assert_eq!(finished.code, Some(1), "{}", finished.stderr);
    let last = finished.stderr.lines().last().unwrap();
    assert!(last.starts_with("error: the programs were not built"), "{}", finished.stderr);
}

#[test]
fn the_demo_with_bodies_drives_them_in_every_step() {
    build_products_and_bodies().unwrap();
    let sandbox = Sandbox::new();
    let mut demo = Process::start(Program::Demo, &sandbox, &["--bodies"]);
    demo.wait_for_line("open in a browser:  http://127.0.0.1:");
    let status = wait_for("a second of the bodies", || {
        let status = ctl(&sandbox, &["status"]);
        (status["step"].as_u64() > Some(240)).then_some(status)
    });
    assert_eq!((&status["scene"], &status["standing_body_steps"]), (&json!("bodies"), &json!(0)));
    let finished = demo.interrupt();
    assert_eq!(finished.code, Some(0), "{}", finished.stderr);
    let (file, description) = finished.stdout.split_once('\n').unwrap_or_default();
    assert!(description.contains("bodies"), "{description}");
    assert!(std::fs::remove_file(file).is_ok(), "no recording at {file}");
}
