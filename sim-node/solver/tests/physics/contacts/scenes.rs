//! The built-in scenes in which things touch.

use sim_solver::{Scene, Solver, builtin};

use super::super::step;
use super::cloths::crossings;

/// Steps a scene for 20 s, and checks ten times a second that nothing crosses itself.
fn assert_holds(name: &str, mode: &str) {
    let text = builtin::text(name).unwrap();
    assert!(text.contains("mode = \"particles\""), "{name}");
    let text = text.replace("mode = \"particles\"", &format!("mode = \"{mode}\""));
    let scene = Scene::from_toml(&text, name).unwrap();
    let mut solver = Solver::new(&scene);
    for tenth in 0..200 {
        step(&mut solver, scene.solver.rate_hz / 10);
        assert_eq!(crossings(&solver), 0, "{name}, {mode}, after {tenth} tenths of a second");
    }
}

#[test]
fn a_cloth_that_folds_on_a_ball_does_not_cross_itself() {
    assert_holds("folding-cloth", "particles");
    assert_holds("folding-cloth", "surfaces");
}

#[test]
fn a_cloth_on_a_bust_does_not_cross_itself() {
    assert_holds("covered-bust", "particles");
}

#[test]
fn ragdolls_do_not_cross_the_net_that_holds_them() {
    assert_holds("ragdolls-in-net", "particles");
    assert_holds("ragdolls-in-net", "surfaces");
}
