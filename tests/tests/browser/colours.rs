//! Colours by tension, speed and kind: the legend has the values of closed forms, in the unit of the scene,
//! and says what is not known.

use serde_json::json;

use crate::browser::support::{Rig, Tab};

/// A chain of two compliant constraints with a weight of 1 kg at each, and a weight on a rigid one.
const CHAIN: &str = "
version = 1

[solver]
substeps = 8
damping = 4

[[particle]]
position = [0, 0, 0]
pinned = true

[[particle]]
position = [0, -1, 0]

[[particle]]
position = [0, -2, 0]

[[particle]]
position = [1, 0, 0]

[[constraint]]
particles = [0, 1]
compliance = 1e-3

[[constraint]]
particles = [1, 2]
compliance = 1e-3
kind = \"shear\"

[[constraint]]
particles = [0, 3]
";
/// Steps after which the chain hangs still.
const SETTLED: u64 = 9600;

const FALL: &str = "
version = 1
unit = \"cm\"
gravity = [0, -981, 0]

[[particle]]
position = [0, 0, 0]
";

fn choose(tab: &Tab, quantity: &str) {
    tab.evaluate(&format!(
        "(() => {{ const list = document.querySelector('#colour'); list.value = '{quantity}'; \
         list.dispatchEvent(new Event('change')); }})()"
    ));
    tab.wait(&format!("viewer.coloring.quantity === '{quantity}'"));
}

fn text(tab: &Tab, selector: &str) -> String {
    let text = tab.evaluate(&format!("document.querySelector('{selector}').textContent"));
    text.as_str().unwrap().to_owned()
}

fn assert_near(value: f64, expected: f64) {
    assert!((value - expected).abs() <= 2e-3 * expected.abs(), "{value} is not {expected}");
}

#[test]
#[ignore = "needs Chromium"]
fn the_tension_of_a_hanging_chain_is_the_weight_below_and_a_rigid_constraint_has_none() {
    let mut rig = Rig::with_scene(CHAIN, &["--paused", "--as-fast-as-possible"], "");
    rig.step(SETTLED);
    rig.settled();
    rig.tab.key('h');
    rig.tab.wait("document.querySelector('#legend').checkVisibility()");
    choose(&rig.tab, "tension");
    rig.tab.wait("viewer.coloring.known === 2");
    assert_near(rig.tab.number("viewer.coloring.min"), 9.81);
    assert_near(rig.tab.number("viewer.coloring.max"), 2.0 * 9.81);
    // The scale ends at a round number above the largest value, and begins at 0, because nothing is compressed.
    assert_eq!(rig.tab.evaluate("[viewer.coloring.low, viewer.coloring.high]"), json!([0, 20]));
    assert_eq!(text(&rig.tab, "#heat-extremes"), "min 9.81 N, max 19.6 N");
    assert!(text(&rig.tab, "#heat-note").contains("unknown: 1 of 3"));

    choose(&rig.tab, "kind");
    rig.tab.wait("document.querySelector('#heat-kinds').textContent === 'structural: 2shear: 1'");

    // A command that makes every constraint compliant makes every tension known.
    choose(&rig.tab, "tension");
    rig.tab.type_into("[aria-label='Compliance in m/N']", "0.002");
    rig.tab.wait("viewer.coloring.known === 3");
}

#[test]
#[ignore = "needs Chromium"]
fn speeds_come_from_the_node_and_are_in_the_unit_of_the_scene() {
    let mut rig =
        Rig::with_scene(FALL, &["--paused", "--as-fast-as-possible"], "show.heat=1&colour=speed");
    rig.step(120);
    rig.settled();
    rig.tab.wait("viewer.coloring.max > 490");
    assert_near(rig.tab.number("viewer.coloring.max"), 981.0 * 0.5);
    rig.tab.wait("document.querySelector('#heat-extremes').textContent.endsWith(' cm/s')");
    assert_eq!(rig.tab.evaluate("viewer.coloring.low"), 0);
}
