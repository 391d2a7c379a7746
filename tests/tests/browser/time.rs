//! Time and connection: pause, step, reset, another scene, a killed and restarted node or bridge, and
//! a slow page.

use integration_tests::{Signal, wait_for};

use crate::browser::support::{Rig, is_cloth};

#[test]
#[ignore = "needs Chromium"]
fn pause_freezes_the_picture_step_advances_it_and_reset_restores_it() {
    let mut rig = Rig::new(&["flag", "--paused"], "");
    rig.settled();
    let start = rig.state().clone();
    let first_picture = rig.tab.hash();
    rig.tab.key(' ');
    rig.tab.wait("!viewer.paused && viewer.step > 60");
    let paused = rig.pause();
    let frozen = rig.tab.hash();
    assert_ne!(frozen, first_picture);
    // Statistics still arrive and the page may redraw: the picture of a step is always the same.
    rig.tab.pass_animation_frames(40);
    assert_eq!(rig.tab.hash(), frozen);
    assert_eq!(rig.state().step, paused.step);

    rig.tab.key('.');
    rig.wait_for_state("one step", |state| state.step == paused.step + 1);
    rig.tab.wait(&format!("viewer.step === {}", paused.step + 1));
    assert_ne!(rig.tab.hash(), frozen);

    rig.tab.key('r');
    let positions = |state: &crate::browser::support::State| {
        state.particles.iter().map(|one| one.position).collect::<Vec<_>>()
    };
    let wanted = positions(&start);
    rig.wait_for_state("the initial positions", |state| positions(state) == wanted);
    rig.settled();
    assert_eq!(rig.tab.hash(), first_picture);
}

#[test]
#[ignore = "needs Chromium"]
fn a_digit_key_goes_to_another_scene_in_the_menu() {
    let mut rig = Rig::new(&["curtain"], "");
    let area = rig.tab.camera().area();
    assert!(rig.tab.screenshot().count(&area, is_cloth) > 1000);
    // Digit keys go to the scenes in the order of the menu.
    rig.tab.load_by_digit('3', "rope");
    rig.wait_for_state("the rope in the node", |state| state.particles.len() == 41);
    rig.tab.wait("viewer.scene === 'rope' && viewer.particleCount === 41 && viewer.frame >= 0");
    rig.tab.wait("document.title.startsWith('rope')");
    rig.tab.wait("document.querySelector('#scene').value === 'rope'");
    wait_for("a picture without cloth", || {
        (rig.tab.screenshot().count(&area, is_cloth) < 100).then_some(())
    });
    rig.tab.load_by_digit('2', "curtain");
    rig.wait_for_state("the curtain in the node", |state| state.particles.len() == 168);
    wait_for("a picture of cloth", || {
        (rig.tab.screenshot().count(&area, is_cloth) > 1000).then_some(())
    });
}

#[test]
#[ignore = "needs Chromium"]
fn the_page_reports_a_lost_node_and_continues_when_it_is_back() {
    let mut rig = Rig::new(&["curtain"], "");
    assert_eq!(rig.tab.evaluate("viewer.banner"), "");
    let epoch = rig.tab.evaluate("viewer.epoch");
    rig.node.signal(Signal::KILL);
    rig.tab.wait("viewer.node === 'lost' && viewer.banner !== ''");
    rig.tab.wait("document.querySelector('#hud').textContent.includes('last state')");
    rig.tab.wait("document.querySelector('#pause').disabled && document.querySelector('#parameters fieldset').disabled");
    assert_eq!(rig.tab.evaluate("document.querySelector('#banner').checkVisibility()"), true);
    // The last picture stays visible.
    let area = rig.tab.camera().area();
    assert!(rig.tab.screenshot().count(&area, is_cloth) > 1000);

    rig.restart_node(&["curtain"]);
    rig.tab.wait("viewer.node === 'alive' && viewer.banner === ''");
    assert_eq!(rig.tab.evaluate("document.querySelector('#banner').checkVisibility()"), false);
    rig.tab.wait(&format!("viewer.epoch !== {epoch} && viewer.step > 10"));
    // Commands reach the new node.
    rig.pause();
    assert!(rig.bridge.is_running());
}

#[test]
#[ignore = "needs Chromium"]
fn the_page_reconnects_to_a_restarted_bridge() {
    let mut rig = Rig::new(&["curtain"], "");
    rig.bridge.signal(Signal::KILL);
    rig.tab.wait("viewer.connection !== 'open' && viewer.banner !== ''");
    // The browser logs an error for each failed attempt to connect.
    rig.tab.expect_error("ERR_CONNECTION_REFUSED");
    // Nothing can be pressed, and the figures of the past are gone.
    rig.tab.wait("document.querySelector('#hud').textContent.includes('last state')");
    let enabled = "[...document.querySelectorAll('#pause, #step, #reset, #scene, #modes button, #parameters fieldset, #parameters-reset')].filter(one => !one.disabled).length";
    assert_eq!(rig.tab.evaluate(enabled), 0);
    assert_eq!(rig.tab.evaluate("document.querySelector('#figures').textContent"), "");
    let values = "document.querySelector('#parameters').checkVisibility()";
    assert_eq!(rig.tab.evaluate(values), false);
    let step = rig.state().step;
    rig.restart_bridge();
    rig.tab.wait(&format!(
        "viewer.connection === 'open' && viewer.banner === '' && viewer.step > {step}"
    ));
    rig.tab.wait(values);
    rig.pause();
}

/// Steps that the node makes while a page draws nothing.
const STEPS_MISSED: u64 = 480;
/// Limit on old pictures when the page draws again: two that it had not acknowledged, and one that the
/// server encoded before it had sent these.
const PICTURES_OLD_MAX: usize = 3;
/// Limit on frames that the server encodes meanwhile: half of those it would encode for the missed steps
/// (one per four steps) without acknowledgements. It is generous, because on a busy machine the server
/// learns late that the credit of the page is used up.
const FRAMES_ENCODED_MAX: u64 = STEPS_MISSED / 4 / 2;

/// Checks the pictures of a page that drew nothing between picture `last_number` and step `newest`.
fn assert_only_owed_pictures_are_old(rig: &Rig, last_number: u64, newest: u64) {
    let pictures = rig.tab.pictures_until(last_number, newest);
    let old_count = pictures.iter().take_while(|[_, step]| *step < newest).count();
    assert!(old_count <= PICTURES_OLD_MAX, "before step {newest}: {pictures:?}");
    let encoded_count = pictures[old_count][0] - last_number - 1;
    assert!(encoded_count <= FRAMES_ENCODED_MAX, "after number {last_number}: {pictures:?}");
}

#[test]
#[ignore = "needs Chromium"]
fn a_blocked_page_is_at_most_three_frames_behind() {
    let mut rig = Rig::new(&["curtain"], "");
    rig.tab.log_pictures();
    let last_number = rig.tab.block_script();
    let begin = rig.state().step;
    let newest = rig.wait_for_state("later steps", |state| state.step > begin + STEPS_MISSED).step;
    rig.tab.unblock_script();
    assert_only_owed_pictures_are_old(&rig, last_number, newest);
}

#[test]
#[ignore = "needs Chromium"]
fn a_hidden_tab_receives_no_frames_and_shows_the_newest_when_visible_again() {
    let mut rig = Rig::new(&["curtain"], "");
    rig.tab.log_pictures();
    let last_number = rig.tab.hide();
    let begin = rig.state().step;
    let newest = rig.wait_for_state("later steps", |state| state.step > begin + STEPS_MISSED).step;
    assert_eq!(rig.tab.evaluate("viewer.frame"), last_number, "the page drew while hidden");
    rig.tab.show();
    assert_only_owed_pictures_are_old(&rig, last_number, newest);
    let area = rig.tab.camera().area();
    assert!(rig.tab.screenshot().count(&area, is_cloth) > 1000);
}
