//! Time and connection: pause, step, reset, another scene, a node that is killed and comes back, a
//! page that is slow.

use integration_tests::{Signal, wait_for};

use crate::support::{Stage, is_cloth};

#[test]
#[ignore = "needs Chromium"]
fn pause_freezes_the_picture_step_makes_one_and_reset_restores() {
    let mut stage = Stage::new(&["flag", "--paused"], "");
    stage.settled();
    let start = stage.state().clone();
    let first_picture = stage.tab.hash();
    stage.tab.key(' ');
    stage.tab.wait("!viewer.paused && viewer.step > 60");
    let paused = stage.pause();
    let frozen = stage.tab.hash();
    assert_ne!(frozen, first_picture);
    // Measurements still come, and pictures may be drawn: of the same step, the same to the bit.
    stage.tab.pass_animation_frames(40);
    assert_eq!(stage.tab.hash(), frozen);
    assert_eq!(stage.state().step, paused.step);

    stage.tab.key('.');
    stage.wait_for_state("one step", |state| state.step == paused.step + 1);
    stage.tab.wait(&format!("viewer.step === {}", paused.step + 1));
    assert_ne!(stage.tab.hash(), frozen);

    stage.tab.key('r');
    let positions = |state: &crate::support::State| {
        state.particles.iter().map(|one| one.position).collect::<Vec<_>>()
    };
    let wanted = positions(&start);
    stage.wait_for_state("the first positions", |state| positions(state) == wanted);
    stage.settled();
    assert_eq!(stage.tab.hash(), first_picture);
}

#[test]
#[ignore = "needs Chromium"]
fn another_scene_is_loaded_and_shown() {
    let mut stage = Stage::new(&["curtain"], "");
    let area = stage.tab.camera().area();
    assert!(stage.tab.screenshot().count(&area, is_cloth) > 1000);
    // The keys of digits take the scenes in the order of the picker.
    stage.tab.key('2');
    stage.wait_for_state("the rope in the node", |state| state.particles.len() == 41);
    stage.tab.wait("viewer.scene === 'rope' && viewer.particleCount === 41 && viewer.frame >= 0");
    stage.tab.wait("document.title.startsWith('rope')");
    stage.tab.wait("document.querySelector('#scene').value === 'rope'");
    wait_for("a picture without cloth", || {
        (stage.tab.screenshot().count(&area, is_cloth) < 100).then_some(())
    });
    stage.tab.key('1');
    stage.wait_for_state("the curtain in the node", |state| state.particles.len() == 168);
    wait_for("a picture of cloth", || {
        (stage.tab.screenshot().count(&area, is_cloth) > 1000).then_some(())
    });
}

#[test]
#[ignore = "needs Chromium"]
fn the_page_says_that_the_node_is_gone_and_goes_on_when_it_is_back() {
    let mut stage = Stage::new(&["curtain"], "");
    assert_eq!(stage.tab.ask("viewer.banner"), "");
    let epoch = stage.tab.ask("viewer.epoch");
    stage.node.signal(Signal::KILL);
    stage.tab.wait("viewer.node === 'lost' && viewer.banner !== ''");
    assert_eq!(stage.tab.ask("document.querySelector('#banner').checkVisibility()"), true);
    // The last picture stays.
    let area = stage.tab.camera().area();
    assert!(stage.tab.screenshot().count(&area, is_cloth) > 1000);

    stage.restart_node(&["curtain"]);
    stage.tab.wait("viewer.node === 'alive' && viewer.banner === ''");
    assert_eq!(stage.tab.ask("document.querySelector('#banner').checkVisibility()"), false);
    stage.tab.wait(&format!("viewer.epoch !== {epoch} && viewer.step > 10"));
    // And commands reach the new one.
    stage.pause();
    assert!(stage.bridge.is_running());
}

#[test]
#[ignore = "needs Chromium"]
fn the_page_comes_back_to_a_bridge_that_was_killed() {
    let mut stage = Stage::new(&["curtain"], "");
    stage.bridge.signal(Signal::KILL);
    stage.tab.wait("viewer.connection !== 'open' && viewer.banner !== ''");
    // The browser itself says so in the console, each time that the page tries in vain.
    stage.tab.expect_error("ERR_CONNECTION_REFUSED");
    let step = stage.state().step;
    stage.restart_bridge();
    stage.tab.wait(&format!(
        "viewer.connection === 'open' && viewer.banner === '' && viewer.step > {step}"
    ));
    stage.pause();
}

/// Steps that the node makes while a page draws nothing: some two seconds.
const STEPS_MISSED: u64 = 480;
/// Pictures that may be old when it draws again: two that it had not acknowledged, and one that the
/// server made before it knew that these were on their way.
const PICTURES_OLD_MAX: usize = 3;
/// Frames that the server may make meanwhile: a busy machine tells it later of those on their way.
/// Without acknowledgements it would make 60 a second.
const FRAMES_MADE_MAX: u64 = 10;

/// What a page draws that drew nothing between the picture of that number and that step of the node.
fn assert_only_owed_pictures_are_old(stage: &Stage, last_number: u64, newest: u64) {
    let pictures = stage.tab.pictures_until(last_number, newest);
    let old_count = pictures.iter().take_while(|[_, step]| *step < newest).count();
    assert!(old_count <= PICTURES_OLD_MAX, "before step {newest}: {pictures:?}");
    let made_count = pictures[old_count][0] - last_number - 1;
    assert!(made_count <= FRAMES_MADE_MAX, "after number {last_number}: {pictures:?}");
}

#[test]
#[ignore = "needs Chromium"]
fn a_page_that_stood_still_is_at_most_three_frames_behind() {
    let mut stage = Stage::new(&["curtain"], "");
    stage.tab.note_pictures();
    let last_number = stage.tab.stand_still();
    let begin = stage.state().step;
    let newest =
        stage.wait_for_state("later steps", |state| state.step > begin + STEPS_MISSED).step;
    stage.tab.go_on();
    assert_only_owed_pictures_are_old(&stage, last_number, newest);
}

#[test]
#[ignore = "needs Chromium"]
fn a_hidden_tab_gets_no_frames_and_shows_the_newest_when_it_is_seen_again() {
    let mut stage = Stage::new(&["curtain"], "");
    stage.tab.note_pictures();
    let last_number = stage.tab.hide();
    let begin = stage.state().step;
    let newest =
        stage.wait_for_state("later steps", |state| state.step > begin + STEPS_MISSED).step;
    assert_eq!(stage.tab.ask("viewer.frame"), last_number, "it drew while it was hidden");
    stage.tab.show();
    assert_only_owed_pictures_are_old(&stage, last_number, newest);
    let area = stage.tab.camera().area();
    assert!(stage.tab.screenshot().count(&area, is_cloth) > 1000);
}
