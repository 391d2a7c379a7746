//! Time and connection: pause, step, reset, another scene, a node that is killed and comes back, a
//! page that is slow.

use integration_tests::{Signal, wait_for};
use serde_json::json;

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

#[test]
#[ignore = "needs Chromium"]
fn a_page_that_stood_still_is_at_most_three_frames_behind() {
    let mut stage = Stage::new(&["curtain"], "");
    // Keeps the page busy for a while, then notes the steps of the next pictures.
    stage.tab.ask(
        "void (window.seen = new Promise(done => setTimeout(() => { \
            const end = performance.now() + 2500; \
            while (performance.now() < end); \
            const steps = []; \
            const look = () => { \
                if (viewer.step !== steps.at(-1)) steps.push(viewer.step); \
                if (steps.length < 5) requestAnimationFrame(look); else done(steps); \
            }; \
            requestAnimationFrame(look); })))",
    );
    let begin = stage.state().step;
    // While it stands still, the node goes on: some two seconds.
    let newest = stage.wait_for_state("later steps", |state| state.step > begin + 480).step;
    let steps: Vec<u64> = serde_json::from_value(stage.tab.ask("window.seen")).unwrap();
    // The picture before, and at most three that were on their way; then the newest.
    assert!(steps[0] < newest, "the page did not stand still: {steps:?}");
    assert!(steps[4] >= newest, "pictures of {steps:?}, though the node was at {newest}");
}

#[test]
#[ignore = "needs Chromium"]
fn a_hidden_tab_gets_no_frames_and_shows_the_newest_when_it_is_seen_again() {
    let mut stage = Stage::new(&["curtain"], "");
    stage.tab.call("Page.setWebLifecycleState", json!({ "state": "frozen" }));
    let begin = stage.state().step;
    let newest = stage.wait_for_state("later steps", |state| state.step > begin + 480).step;
    stage.tab.call("Page.setWebLifecycleState", json!({ "state": "active" }));
    stage.tab.wait(&format!("viewer.step >= {newest}"));
    let area = stage.tab.camera().area();
    assert!(stage.tab.screenshot().count(&area, is_cloth) > 1000);
}
