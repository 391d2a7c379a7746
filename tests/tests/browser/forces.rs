//! Forces as arrows: those of a hanging sheet add up to its weight, and nothing reads them while they are
//! not shown.

use std::time::Duration;

use integration_tests::{Process, Program, Sandbox, wait_for};
use serde_json::Value;
use sim_contract::Client;

use crate::browser::support::{Button, ReplayRig, Rig, Tab, is_force};

/// A sheet of 9 x 8 particles that hangs from its upper row, above a floor that it does not reach.
const HANGING: &str = "
version = 1

[solver]
substeps = 8
damping = 4

[[collider]]
shape = \"plane\"
normal = [0, 1, 0]
offset = -2

[[generate]]
shape = \"cloth\"
columns = 9
rows = 8
spacing = 0.1
mass = 0.01
pinned = \"top\"
";
const COLUMNS: usize = 9;
/// Weight of the free particles in N.
const WEIGHT: f64 = 63.0 * 0.01 * 9.81;
/// Steps after which the sheet hangs still.
const SETTLED: u64 = 4800;

/// A drawn arrow.
#[derive(Debug)]
struct Arrow {
    kind: String,
    index: usize,
    from: [f64; 3],
    force: [f64; 3],
}

fn arrows(tab: &Tab) -> Vec<Arrow> {
    let vector = |value: &Value| [0, 1, 2].map(|axis| value[axis].as_f64().unwrap());
    let drawn = tab.evaluate("viewer.arrows");
    let arrow = |one: &Value| Arrow {
        kind: one["kind"].as_str().unwrap().to_owned(),
        index: serde_json::from_value(one["index"].clone()).unwrap(),
        from: vector(&one["from"]),
        force: vector(&one["force"]),
    };
    drawn.as_array().unwrap().iter().map(arrow).collect()
}

fn assert_weight(shown: &[Arrow]) {
    let sum = [0, 1, 2].map(|axis| shown.iter().map(|one| one.force[axis]).sum::<f64>());
    assert!((sum[1] + WEIGHT).abs() <= 1e-3 * WEIGHT, "{sum:?}");
    assert!(sum[0].abs() + sum[2].abs() <= 1e-3 * WEIGHT, "{sum:?}");
}

/// Makes steps until the page draws arrows, and returns those of the last step. The first step after a
/// request can precede the reader.
fn step_until_drawn(rig: &mut Rig) -> Vec<Arrow> {
    wait_for("arrows", || {
        rig.step(1);
        rig.settled();
        Some(arrows(&rig.tab)).filter(|drawn| !drawn.is_empty())
    })
}

/// Returns whether the node has published forces in its last step. It publishes them while a program
/// reads them, and a program that comes later receives the newest.
fn are_published(rig: &mut Rig) -> bool {
    rig.step(1);
    let mut late = Client::attach(&rig.sandbox.endpoint()).unwrap();
    late.forces(Duration::from_millis(200)).unwrap().is_some()
}

#[test]
#[ignore = "needs Chromium"]
fn the_arrows_of_a_hanging_sheet_add_up_to_its_weight_and_end_with_their_toggle() {
    let mut rig = Rig::with_scene(HANGING, &["--paused", "--as-fast-as-possible"], "");
    rig.step(SETTLED);
    rig.settled();
    assert!(!are_published(&mut rig), "no page has asked for forces");
    let area = rig.tab.camera().area();
    let drawn = |rig: &Rig| rig.tab.screenshot().count(&area, is_force);
    assert_eq!((arrows(&rig.tab).len(), drawn(&rig)), (0, 0));

    rig.tab.click("#forces");
    rig.tab.wait("document.querySelector('#force-legend').checkVisibility()");
    let shown = step_until_drawn(&mut rig);
    let state = rig.state().clone();
    let indices: Vec<_> = shown.iter().map(|one| one.index).collect();
    assert_eq!(indices, (0..COLUMNS).collect::<Vec<_>>());
    for arrow in &shown {
        assert_eq!(arrow.kind, "particle");
        let position = state.particles[arrow.index].position.map(f64::from);
        let apart = (0..3).map(|axis| (arrow.from[axis] - position[axis]).abs());
        assert!(apart.fold(0.0, f64::max) < 1e-5, "{arrow:?} begins at {position:?}");
    }
    assert_weight(&shown);
    assert!(drawn(&rig) > 9 * 40, "{} px", drawn(&rig));
    let legend = rig.tab.evaluate("document.querySelector('#force-scale').textContent");
    assert!(legend.as_str().unwrap().ends_with(" N"), "{legend}");
    // The legend is a scale: its length in px stands for its number of newtons in the middle of the view.
    let error = rig.tab.number(
        "(() => { const { camera, unitsPerNewton } = viewer; \
         const half = camera.projection[5] * document.querySelector('#picture-canvas').clientHeight / 2; \
         const wide = parseFloat(document.querySelector('#force-arrow').style.width); \
         const newtons = parseFloat(document.querySelector('#force-scale').textContent); \
         return wide / (newtons * unitsPerNewton * half / camera.distance) - 1; })()",
    );
    assert!(error.abs() < 0.01, "{error}");
    wait_for("the newest forces", || are_published(&mut rig).then_some(()));

    // The toggle off: the bridge reads no forces any longer, and the page draws none.
    rig.tab.key('n');
    wait_for("the end of the reading", || (!are_published(&mut rig)).then_some(()));
    rig.settled();
    assert_eq!((arrows(&rig.tab).len(), drawn(&rig)), (0, 0));
    assert_eq!(
        rig.tab.evaluate("document.querySelector('#force-legend').checkVisibility()"),
        false
    );

    // A page that closes reads none either.
    let other = rig.another_tab("show.forces=1");
    wait_for("the reading of the other page", || are_published(&mut rig).then_some(()));
    drop(other);
    wait_for("the end of the reading", || (!are_published(&mut rig)).then_some(()));
}

#[test]
#[ignore = "needs Chromium"]
fn a_replay_shows_the_recorded_forces_of_the_step_on_show() {
    let sandbox = Sandbox::new();
    let (scene, file) = (sandbox.write("hanging.toml", HANGING), sandbox.path("run.mcap"));
    let steps = SETTLED.to_string();
    let args = ["simulate", &scene, "--steps", &steps, "--forces", "-o", &file];
    Process::run(Program::Recorder, &sandbox, &args).success();

    let replay = ReplayRig::open(sandbox, &file, "");
    let tab = &replay.tab;
    let (from, to) = (tab.pixel("#seek", 0.1), tab.pixel("#seek", 0.98));
    tab.press(from, Button::Left);
    tab.stroke(from, to, 8);
    tab.release(to);
    let step = tab.number("document.querySelector('#seek').valueAsNumber");
    assert!(step > 0.9 * SETTLED as f64, "{step}");
    tab.wait(&format!("viewer.paused && viewer.step === {step}"));
    assert!(arrows(tab).is_empty());
    // The step that is on show already is shown again with its forces.
    tab.key('n');
    tab.wait("viewer.arrows.length > 0");
    let shown = arrows(tab);
    assert_eq!(shown.len(), COLUMNS);
    assert_weight(&shown);
    tab.key(',');
    tab.wait(&format!("viewer.step === {step} - 1 && viewer.arrows.length === {COLUMNS}"));

    // No step has led to the first state.
    tab.press(to, Button::Left);
    tab.stroke(to, tab.pixel("#seek", 0.0), 8);
    tab.release(tab.pixel("#seek", 0.0));
    tab.wait("viewer.step === 0 && viewer.arrows.length === 0");
    tab.wait("document.querySelector('#force-scale').textContent === 'none recorded of this step'");
}
