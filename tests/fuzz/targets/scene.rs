//! Scenes: an accepted one prints as TOML that reads back equal, and steps.
#![no_main]

use fuzz::simulation::Pair;
use libfuzzer_sys::fuzz_target;
use sim_solver::{Scene, warnings};

/// Most digits of a whole number in the text. Greater numbers find nothing new, but make large scenes.
const WHOLE_NUMBER_DIGITS_MAX: usize = 3;
/// Most particles and constraints of a scene to step.
const ELEMENTS_MAX: usize = 2000;
/// The mesh that every path of a scene leads to.
const MESH: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\ng left\nf 1 2 3\ng right\nf 1 3 4\n";

fuzz_target!(|text: &str| {
    if has_large_number(text) {
        return;
    }
    let read_file = |_: &str| Ok(MESH.to_owned());
    let Ok(scene) = Scene::from_toml_with_files(text, "scene.toml", &read_file) else { return };
    let printed = scene.to_toml();
    let again = Scene::from_toml(&printed, "scene.toml").expect("a printed scene is valid");
    assert_eq!(Scene { read_warnings: scene.read_warnings.clone(), ..again }, scene);
    _ = warnings(&scene);
    let counts = scene.counts();
    if counts.particles.max(counts.constraints) <= ELEMENTS_MAX {
        step(&scene);
    }
});

fn has_large_number(text: &str) -> bool {
    let is_part = |at: char| at.is_ascii_digit() || ['_', '.'].contains(&at);
    let whole = |number: &str| number.split('.').next().map_or(0, str::len);
    text.split(|at| !is_part(at)).any(|number| whole(number) > WHOLE_NUMBER_DIGITS_MAX)
}

fn step(scene: &Scene) {
    let mut pair = Pair::new(scene);
    if pair.is_cheap() {
        pair.step();
        pair.step();
        pair.check_restored(scene);
    }
}
