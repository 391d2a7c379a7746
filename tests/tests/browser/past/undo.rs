//! Undo: cuts, resets and loads by keys, by links and in another rate, and what others have done since.

use integration_tests::{DEADLINE, ctl, wait_for};
use serde_json::json;
use sim_contract::Parameter;

use crate::browser::support::{Button, Rig, State};

/// Checks that a later state has the same particles, bit for bit.
fn is_like(wanted: &State) -> impl Fn(&State) -> bool {
    move |state| state.step != wanted.step && state.particles == wanted.particles
}

fn notice(rig: &Rig, text: &str) {
    rig.tab.wait(&format!("viewer.notices.some(text => text.includes({text:?}))"));
}

/// Cuts with a stroke of the right button below the upper edge of the curtain.
fn cut(rig: &Rig) {
    let area = rig.tab.camera().area();
    let at = |x: f64| [area.x + x * area.width, area.y + 0.45 * area.height];
    rig.tab.press(at(0.15), Button::Right);
    rig.tab.stroke(at(0.15), at(0.85), 12);
    rig.tab.release(at(0.85));
}

#[test]
#[ignore = "needs Chromium"]
fn ctrl_z_undoes_a_stroke_of_cuts_and_a_reset_one_after_the_other() {
    let mut rig = Rig::new(&["curtain"], "");
    rig.tab.wait("viewer.step > 120 && document.querySelector('#undo').disabled");
    let whole = rig.pause();
    cut(&rig);
    rig.tab.wait("viewer.unanswered === 0 && !document.querySelector('#undo').disabled");
    rig.step(1);
    rig.tab.wait("viewer.torn > 5");
    let torn = rig.step(30);
    rig.settled();
    rig.tab.key('r');
    rig.wait_for_state("the reset", |state| state.step == torn.step + 1);
    rig.settled();
    assert_eq!(rig.tab.number("viewer.torn"), 0.0);

    rig.tab.ctrl_key('z');
    rig.wait_for_state("the torn curtain", is_like(&torn));
    notice(&rig, "Undid the reset.");
    rig.tab.wait("viewer.torn > 5");
    rig.tab.ctrl_key('z');
    rig.wait_for_state("the whole curtain", is_like(&whole));
    notice(&rig, "Undid the cut.");
    rig.tab.wait("viewer.torn === 0 && document.querySelector('#undo').disabled");

    // A text field undoes changes of values only.
    cut(&rig);
    rig.tab.wait("!document.querySelector('#undo').disabled && viewer.unanswered === 0");
    let count = rig.tab.number("viewer.notices.length");
    rig.tab.click("input[aria-label='Damping in 1/s']");
    rig.tab.ctrl_key('z');
    rig.tab.pass_animation_frames(3);
    assert_eq!(rig.tab.number("viewer.notices.length"), count);
    assert_eq!(rig.tab.evaluate("document.querySelector('#undo').disabled"), false);
}

#[test]
#[ignore = "needs Chromium"]
fn ctrl_z_in_the_field_of_a_parameter_undoes_typing_first_and_then_the_change_of_the_node() {
    let mut rig = Rig::new(&["curtain"], "");
    let initial = rig.client().parameters(DEADLINE).unwrap().unwrap().values;
    let initial = initial.number(Parameter::Damping);
    let field = "input[aria-label='Damping in 1/s']";
    let shows = |rig: &Rig, text: &str| {
        rig.tab.wait(&format!("document.querySelector(\"{field}\").value === '{text}'"));
    };
    rig.tab.type_into(field, "2.125");
    rig.tab.wait("viewer.unanswered === 0 && !document.querySelector('#undo').disabled");
    rig.tab.click(field);
    shows(&rig, "2.125");
    rig.tab.key('7');
    shows(&rig, "7");
    rig.tab.ctrl_key('z');
    shows(&rig, "2.125");
    rig.tab.ctrl_key('z');
    shows(&rig, &initial.to_string());
    wait_for("the value of the scene in the node", || {
        (rig.client().parameters(DEADLINE).unwrap().unwrap().values.number(Parameter::Damping)
            == initial)
            .then_some(())
    });
}

#[test]
#[ignore = "needs Chromium"]
fn a_drag_is_undone_and_not_the_load_before_it() {
    let mut rig = Rig::new(&["curtain"], "");
    rig.tab.key(']');
    rig.tab.wait("viewer.scene !== 'curtain' && viewer.step > 60");
    let scene = rig.tab.evaluate("viewer.scene");
    let before = rig.pause();
    let free = before.particles.len() - 1;
    let from = rig.tab.camera().project(before.particles[free].position);
    let to = [from[0] - 40.0, from[1] - 40.0];
    rig.tab.press(from, Button::Left);
    rig.tab.stroke(from, to, 6);
    rig.tab.wait("viewer.grabbed !== null && viewer.unanswered === 0");
    rig.step(20);
    rig.tab.release(to);
    rig.tab.wait("viewer.grabbed === null && viewer.unanswered === 0");
    let dragged = rig.settled();
    assert_ne!(dragged.particles[free].position, before.particles[free].position);

    rig.tab.ctrl_key('z');
    rig.wait_for_state("the state before the drag", is_like(&before));
    notice(&rig, "Undid the drag.");
    assert_eq!(rig.tab.evaluate("viewer.scene"), scene);
    assert_eq!(rig.tab.evaluate("document.querySelector('#undo').disabled"), false);
}

#[test]
#[ignore = "needs Chromium"]
fn loads_by_a_link_and_by_digit_keys_are_undone_at_any_rate() {
    let mut rig = Rig::new(&["curtain"], "scene=rope");
    rig.tab.wait("document.querySelector('#question').checkVisibility() && viewer.step > 120");
    // The question has the focus, so space would answer it.
    ctl(&rig.sandbox, &["pause"]);
    rig.tab.wait("viewer.paused");
    let curtain = rig.settled();
    rig.tab.click("#question-yes");
    rig.tab.wait("viewer.scene === 'rope' && viewer.frame >= 0");
    rig.tab.wait("!document.querySelector('#undo').disabled");
    rig.tab.ctrl_key('z');
    rig.wait_for_state("the curtain of before", is_like(&curtain));
    notice(&rig, "Undid the load of another scene.");
    rig.tab.wait("viewer.scene === 'curtain'");

    // A scene of 60 Hz begins another run.
    let digit = "String(1 + [...viewer.scenes].findIndex(one => one.rate_hz !== 240))";
    let digit = rig.tab.evaluate(digit);
    let [digit @ '1'..='9'] = digit.as_str().unwrap().chars().collect::<Vec<_>>()[..] else {
        panic!("no digit key loads it: {digit}")
    };
    let before = rig.settled();
    // The digit only goes to the card of the scene: a slip of the finger changes nothing for other pages.
    rig.tab.key(digit);
    let card = format!("viewer.scenes[{digit} - 1].name");
    rig.tab.wait(&format!("document.activeElement.dataset.scene === {card}"));
    assert_eq!(rig.tab.evaluate("[viewer.scene, viewer.unanswered]"), json!(["curtain", 0]));
    rig.tab.evaluate("document.activeElement.click()");
    rig.tab.wait("viewer.scene !== 'curtain' && viewer.frame >= 0");
    rig.tab.wait("!document.querySelector('#undo').disabled");
    rig.tab.click("#undo");
    rig.tab.wait("viewer.scene === 'curtain'");
    rig.wait_for_state("the curtain again", |state| state.particles == before.particles);
}

#[test]
#[ignore = "needs Chromium"]
fn what_another_program_has_changed_since_is_taken_back_only_after_a_question() {
    let mut rig = Rig::new(&["curtain"], "");
    rig.tab.wait("viewer.step > 120");
    let before = rig.pause();
    rig.tab.key('r');
    rig.wait_for_state("the reset", |state| state.step == before.step + 1);
    rig.tab.wait("!document.querySelector('#undo').disabled");
    ctl(&rig.sandbox, &["pin", "90"]);
    rig.tab.ctrl_key('z');
    let question = "document.querySelector('#question').checkVisibility()";
    rig.tab.wait(question);
    let text = rig.tab.evaluate("document.querySelector('#question-text').textContent");
    assert!(text.as_str().unwrap().contains("1 change since"), "{text}");
    rig.tab.click("#question-no");
    rig.tab.wait(&format!("!{question} && viewer.unanswered === 0"));
    assert_eq!(rig.state().step, before.step + 1);
    rig.tab.ctrl_key('z');
    rig.tab.wait(question);
    rig.tab.click("#question-yes");
    rig.wait_for_state("the state before the reset", is_like(&before));
    notice(&rig, "Undid the reset.");
}
