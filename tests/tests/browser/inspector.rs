//! The inspector and its plots: a click selects and changes nothing, values are those of the node, and the
//! table holds the values of the plots.

use std::time::Duration;

use serde_json::{Value, json};

use crate::browser::support::{Button, Rig, Tab};

/// A pendulum of a pinned and a free particle, and a free one that falls beside it.
const SCENE: &str = "
version = 1

[[particle]]
position = [0, 0, 0]
pinned = true

[[particle]]
position = [0.3, -0.8, 0]
mass = 2.5

[[particle]]
position = [1, 0, 0]

[[constraint]]
particles = [0, 1]
compliance = 1e-3
";

fn pixel(tab: &Tab, expression: &str) -> [f64; 2] {
    ["x", "y"].map(|axis| tab.number(&format!("({expression}).{axis}")))
}

fn click(tab: &Tab, at: [f64; 2]) {
    tab.move_to(at);
    tab.press(at, Button::Left);
    tab.release(at);
}

fn row(tab: &Tab, item: usize, name: &str) -> String {
    let value = tab.evaluate(&format!(
        "[...document.querySelectorAll('#inspected section')[{item}].querySelectorAll('dt')]\
         .find((one) => one.textContent === '{name}').nextElementSibling.textContent"
    ));
    value.as_str().unwrap().to_owned()
}

fn selected(tab: &Tab) -> Value {
    tab.evaluate("viewer.selected.map(({ kind, index }) => [kind, index])")
}

#[test]
#[ignore = "needs Chromium"]
fn a_click_selects_without_a_command_and_shows_the_values_of_the_node() {
    let mut rig = Rig::with_scene(SCENE, &["--paused", "--as-fast-as-possible"], "");
    rig.step(24);
    let state = rig.settled();
    let outcomes = rig.client().status(Duration::from_secs(5)).unwrap().unwrap().outcome_count;
    let at = pixel(&rig.tab, "viewer.project(1)");
    click(&rig.tab, at);
    rig.tab.wait("viewer.selected[0]?.speed > 0");
    assert_eq!(selected(&rig.tab), json!([["particle", 1]]));
    let velocity = state.particles[1].velocity.map(f64::from);
    let speed = velocity.iter().map(|axis| axis * axis).sum::<f64>().sqrt();
    assert!((rig.tab.number("viewer.selected[0].speed") - speed).abs() < 1e-6 * speed);
    rig.tab.wait("document.querySelector('#inspected').textContent.includes('2.5 kg')");
    assert_eq!(row(&rig.tab, 0, "Held by"), "nothing: it is free");

    // A click in the middle of the constraint; Shift adds it.
    rig.tab.evaluate("document.querySelector('#inspect').value = '0, c0'");
    rig.tab.evaluate("document.querySelector('#inspect').dispatchEvent(new Event('change'))");
    assert_eq!(selected(&rig.tab), json!([["particle", 0], ["constraint", 0]]));
    assert_eq!(row(&rig.tab, 0, "Held by"), "pinned");
    assert_eq!(row(&rig.tab, 1, "Kind"), "structural");
    let outcomes_after =
        rig.client().status(Duration::from_secs(5)).unwrap().unwrap().outcome_count;
    assert_eq!(outcomes_after, outcomes, "a click is no command");

    // Empty space ends the selection.
    let far = pixel(&rig.tab, "viewer.project(2)");
    click(&rig.tab, [far[0], far[1] - 150.0]);
    rig.tab.wait("viewer.selected.length === 0");
    assert!(!rig.tab.evaluate("viewer.notices.length > 0").as_bool().unwrap());
}

#[test]
#[ignore = "needs Chromium"]
fn keys_select_and_the_view_follows_while_the_plots_record_the_selection() {
    let mut rig = Rig::with_scene(SCENE, &["--paused", "--as-fast-as-possible"], "");
    rig.settled();
    rig.tab.type_into("#inspect", "2, 1");
    rig.tab.wait("viewer.selected.length === 2 && viewer.selected[0].speed === 0");
    assert!(
        rig.tab
            .evaluate("document.querySelector('#distance').textContent")
            .as_str()
            .unwrap()
            .starts_with("Distance1.06")
    );
    let titles = rig.tab.evaluate("viewer.plots.map(({ title }) => title)");
    assert_eq!(
        titles,
        json!([
            "Height",
            "Stretch",
            "Energy",
            "Torn",
            "Height of particle",
            "Speed of particle",
            "Distance",
            "Solve time",
            "Wake-up delay"
        ])
    );
    rig.tab.evaluate("document.querySelector('#picture-canvas').focus()");
    rig.tab.named_key("Tab");
    assert_eq!(selected(&rig.tab), json!([["particle", 2]]));
    rig.tab.key('t');
    for _ in 0..12 {
        rig.step(10);
        rig.settled();
    }
    // Half a second of free fall.
    rig.tab.wait("Math.abs(viewer.selected[0].speed - 4.905) < 1e-3");
    let target = rig.tab.number("viewer.camera.target[1] - viewer.position(2)[1]");
    assert!(target.abs() < 1e-5, "{target}");
    let csv = rig.tab.evaluate("viewer.csv");
    let lines: Vec<_> = csv.as_str().unwrap().lines().collect();
    let column = lines[0].split(',').position(|name| name == "Speed of particle 2 (m/s)").unwrap();
    let last = lines.iter().rev().find(|line| line.starts_with("0.5,120,")).unwrap();
    let speed: f64 = last.split(',').nth(column).unwrap().parse().unwrap();
    assert!((speed - 4.905).abs() < 1e-3, "{last}");

    // A cursor shows the values of that time in all plots.
    rig.tab.evaluate("document.querySelector('#plots-title').scrollIntoView()");
    rig.tab.move_to(rig.tab.pixel("#plots canvas", 0.99));
    rig.tab.wait("viewer.plotCursor !== null");
    rig.tab.wait("document.querySelector('#plot-axis').textContent.includes('step')");
    // Held plots do not change with further steps.
    rig.tab.click("#plot-hold");
    let held = rig.tab.evaluate("viewer.csv");
    rig.step(10);
    rig.settled();
    assert_eq!(rig.tab.evaluate("viewer.csv"), held);
    rig.tab.named_key("Escape");
    assert_eq!(selected(&rig.tab), json!([]));
}

#[test]
#[ignore = "needs Chromium"]
fn a_command_by_hand_is_sent_and_answered() {
    let mut rig = Rig::with_scene(SCENE, &["--paused", "--as-fast-as-possible"], "");
    rig.settled();
    let tab = &rig.tab;
    tab.evaluate(
        "void document.querySelector('#command-form').closest('details').setAttribute('open', '')",
    );
    let give = |command: &str, fields: &[&str]| {
        let fields = json!(fields);
        tab.evaluate(&format!(
            "void (() => {{ \
                const choice = document.querySelector('#command'); \
                choice.value = '{command}'; \
                choice.dispatchEvent(new Event('change')); \
                const inputs = document.querySelectorAll('#command-fields input'); \
                {fields}.forEach((text, index) => {{ inputs[index].value = text; }}); \
                document.querySelector('#command-send').click(); \
            }})()"
        ));
    };
    let answers = |start: &str| {
        tab.wait(&format!(
            "document.querySelector('#command-answer').textContent.startsWith({start:?})"
        ));
    };
    give("push", &["1 0 0", "0.1", "0 0.25 0"]);
    answers("Applied in step ");
    give("pin", &["1"]);
    answers("Applied in step ");
    give("pin", &["99"]);
    answers("The scene has no such particle");
    give("drive_body", &["3", "0 1 0"]);
    answers("The scene has no such collider");
    give("pin", &["4294967296"]);
    answers("particle: \"4294967296\" is not a whole number");
    give("cut_radius", &["0 0", "1"]);
    answers("center: \"0 0\" is not 3 numbers");
    rig.step(1);
    rig.tab.wait("viewer.pins.some(([particle]) => particle === 1)");
    let pushed = rig.wait_for_state("the push", |state| state.particles[2].velocity[1] > 0.0);
    assert!(pushed.particles[2].velocity[0].abs() < 1e-6);
}
