//! Live history: looking back while the simulation goes on, and going on from an earlier state.

use integration_tests::ctl;

use crate::browser::support::{Button, Rig, State, Tab};

/// Shows the last kept state at or before a step, as the slider of the timeline does.
fn look(tab: &Tab, step: u64) {
    tab.evaluate(&format!(
        "(slider => {{ slider.value = {step}; slider.dispatchEvent(new Event('input')); slider.dispatchEvent(new Event('change')); }})(document.querySelector('#seek'))"
    ));
}

/// The positions that the page draws.
fn drawn(tab: &Tab, count: usize) -> Vec<[f32; 3]> {
    let all =
        tab.evaluate(&format!("Array.from({{ length: {count} }}, (_, i) => viewer.position(i))"));
    serde_json::from_value(all).unwrap()
}

fn positions(state: &State) -> Vec<[f32; 3]> {
    state.particles.iter().map(|one| one.position).collect()
}

#[test]
#[ignore = "needs Chromium"]
fn looking_back_disturbs_nobody_and_the_simulation_goes_on_from_exactly_the_state_on_show() {
    let mut rig = Rig::new(&["curtain"], "");
    let other = rig.another_tab("");
    let early = rig.pause();
    rig.tab.key(' ');
    rig.tab.wait(&format!("!viewer.paused && viewer.step > {}", early.step + 240));

    look(&rig.tab, early.step);
    rig.tab.wait(&format!("viewer.past === {} && viewer.step === viewer.past", early.step));
    assert_eq!(drawn(&rig.tab, early.particles.len()), positions(&early));
    assert!(rig.tab.evaluate("viewer.banner").as_str().unwrap().contains("earlier state"));
    // The node, the other page and the present of this page go on.
    let now = rig.state().step;
    rig.wait_for_state("later steps", |state| state.step > now + 120);
    other.wait(&format!("viewer.past === null && viewer.step > {}", now + 120));
    rig.tab.wait(&format!("viewer.present > {} && viewer.past === {}", now + 120, early.step));
    // Nothing can be changed in a picture of the past.
    let enabled = "[...document.querySelectorAll('#step, #reset, #scene, #undo, #modes button')].filter(one => !one.disabled).length";
    assert_eq!(rig.tab.evaluate(enabled), 0);

    // A pause of the node leaves the past on show.
    rig.tab.pause();
    assert_eq!(rig.tab.number("viewer.past"), early.step as f64);
    rig.tab.wait("viewer.pages === 2");
    rig.tab.click("#go-on");
    rig.tab.click("#question-yes");
    let gone_on = rig.wait_for_state("the state that was on show", |state| {
        state.step > early.step && state.particles == early.particles
    });
    rig.tab.wait(&format!("viewer.past === null && viewer.step === {}", gone_on.step));
    other.wait(&format!("viewer.step === {}", gone_on.step));
    rig.tab.wait("viewer.notices.some(text => text.startsWith('The simulation goes on from'))");
    // It does so, and the jump can be undone.
    rig.tab.key(' ');
    rig.wait_for_state("further steps", |state| state.step > gone_on.step + 60);
    rig.tab.ctrl_key('z');
    rig.tab.wait("viewer.notices.includes('Undid the jump to an earlier state.')");
}

#[test]
#[ignore = "needs Chromium"]
fn the_timeline_is_scrubbed_and_stepped_and_returns_to_the_present() {
    let rig = Rig::new(&["curtain"], "");
    rig.tab.wait("document.querySelector('#timeline').checkVisibility() && viewer.step > 480");
    let [from, to] = [0.97, 0.5].map(|fraction| rig.tab.pixel("#seek", fraction));
    rig.tab.press(from, Button::Left);
    rig.tab.stroke(from, to, 6);
    rig.tab.release(to);
    rig.tab.wait("viewer.past !== null && viewer.past < viewer.present - 60");
    rig.tab.wait("document.querySelector('#clock').textContent.includes('−')");
    // Steps go from one kept state to the next.
    let settled =
        "viewer.unanswered === 0 && document.querySelector('#seek').valueAsNumber === viewer.past";
    rig.tab.wait(settled);
    let middle = rig.tab.number("viewer.past");
    rig.tab.named_key("ArrowLeft");
    rig.tab.wait(&format!("viewer.past < {middle} && {settled}"));
    rig.tab.named_key("ArrowRight");
    rig.tab.wait(&format!("viewer.past === {middle}"));
    rig.tab.named_key("Escape");
    rig.tab.wait("viewer.past === null && viewer.step === viewer.present && viewer.banner === ''");
    // The comma looks back from the present, and the end of the timeline is the present.
    rig.tab.key(',');
    rig.tab.wait("viewer.past !== null && viewer.unanswered === 0");
    look(&rig.tab, 1 << 40);
    rig.tab.wait("viewer.past === null");
}

#[test]
#[ignore = "needs Chromium"]
fn a_load_of_another_scene_ends_the_look_and_begins_the_history_anew() {
    let rig = Rig::new(&["curtain"], "");
    rig.tab.wait("viewer.step > 240");
    rig.tab.key(',');
    rig.tab.wait("viewer.past !== null");
    ctl(&rig.sandbox, &["load", "rope"]);
    rig.tab.wait("viewer.scene === 'rope' && viewer.past === null && viewer.banner === ''");
    rig.tab.wait("viewer.history.first_step !== null && viewer.history.first_step > 240");
    let range =
        "[document.querySelector('#seek').min, document.querySelector('#seek').max].map(Number)";
    rig.tab.wait(&format!("{range}[0] >= viewer.history.first_step && {range}[1] >= {range}[0]"));
    // The end of the node leaves the past to look at, but nothing to go on.
    rig.node.signal(integration_tests::Signal::KILL);
    rig.tab.wait("viewer.node === 'lost'");
    rig.tab.key(',');
    rig.tab.wait("viewer.past !== null && document.querySelector('#go-on').disabled");
}
