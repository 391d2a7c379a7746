//! The button that records the simulation, and the page of the recording.

use integration_tests::{Process, Program, Signal};

use crate::browser::support::{Button, Rig, Tab};

/// Waits for a condition on the element with an id.
fn wait_for(tab: &Tab, id: &str, condition: &str) {
    tab.wait(&format!("(it => {condition})(document.querySelector('#{id}'))"));
}

#[test]
#[ignore = "needs Chromium"]
fn a_button_records_shows_time_size_and_losses_on_every_page_and_opens_the_recording() {
    let rig = Rig::new(&["curtain"], "");
    let other = rig.another_tab("");
    wait_for(&rig.tab, "recording", "!it.checkVisibility()");
    rig.tab.click("#record");
    let numbers = r"/^0:\d\d · [\d.]+ [kM]B · nothing lost$/";
    for tab in [&rig.tab, &other] {
        wait_for(
            tab,
            "recording-text",
            &format!("it.checkVisibility() && {numbers}.test(it.textContent)"),
        );
        wait_for(tab, "record", "it.ariaPressed === 'true' && it.title === 'Stop the recording'");
        wait_for(tab, "recording-open", "!it.checkVisibility()");
    }
    // A grab is part of the recording.
    let at = rig.tab.camera().project([0.0, 0.4, 0.0]);
    rig.tab.press(at, Button::Left);
    rig.tab.stroke(at, [at[0] + 60.0, at[1] + 20.0], 6);
    rig.tab.release([at[0] + 60.0, at[1] + 20.0]);
    // Any page ends it.
    other.click("#record");
    for tab in [&rig.tab, &other] {
        wait_for(tab, "recording-open", "it.checkVisibility() && it.target === '_blank'");
        wait_for(tab, "record", "it.ariaPressed === 'false' && it.textContent.trim() === 'Record'");
        wait_for(tab, "recording-text", "it.textContent.startsWith('Recorded 0:')");
    }
    let path = rig.tab.evaluate("document.querySelector('#recording').title");
    let args = ["verify", path.as_str().unwrap()];
    let verified = Process::run(Program::Recorder, &rig.sandbox, &args).success();
    assert!(verified.contains("bit-identical"), "{verified}");

    let link = rig.tab.evaluate("document.querySelector('#recording-open').getAttribute('href')");
    let replay = rig.tab_at(link.as_str().unwrap());
    assert_eq!(replay.evaluate("viewer.mode"), "replay");
    replay.wait("document.querySelector('#hashes').textContent.includes('verified')");
    replay.key(' ');
    replay.wait("!viewer.paused && viewer.step > 0");
    wait_for(&replay, "record", "it.disabled && it.title.includes('already')");
    // The live page has gone on meanwhile. The line can be closed, and comes back with the next one.
    rig.tab.click("#recording-close");
    wait_for(&rig.tab, "recording", "!it.checkVisibility()");
    rig.tab.click("#record");
    wait_for(&rig.tab, "recording", "it.checkVisibility()");
}

#[test]
#[ignore = "needs Chromium"]
fn a_recording_that_ends_by_itself_or_fails_says_why_and_a_lost_bridge_shows_nothing_stale() {
    let rig = Rig::new(&["curtain"], "");
    rig.tab.click("#record");
    wait_for(&rig.tab, "recording-text", "it.textContent.includes('B ·')");
    rig.tab.key(']');
    let said = "the recording ended because another scene was loaded";
    wait_for(
        &rig.tab,
        "recording-text",
        &format!("it.textContent.toLowerCase().includes({said:?})"),
    );
    wait_for(
        &rig.tab,
        "recording-said",
        &format!("it.role === 'status' && it.textContent.toLowerCase().includes({said:?})"),
    );
    wait_for(&rig.tab, "recording-open", "it.checkVisibility()");

    rig.bridge.limit_file_size(100_000);
    rig.tab.click("#record");
    wait_for(
        &rig.tab,
        "recording",
        "it.dataset.state === 'failed' && it.textContent.includes('--recordings DIR')",
    );
    wait_for(&rig.tab, "recording-open", "!it.checkVisibility()");

    rig.node.signal(Signal::KILL);
    wait_for(&rig.tab, "record", "it.disabled && it.title === 'No node is running.'");
    rig.bridge.signal(Signal::KILL);
    rig.tab.expect_error("ERR_CONNECTION_REFUSED");
    wait_for(&rig.tab, "record", "it.disabled && it.title.includes('no connection')");
    wait_for(&rig.tab, "recording", "!it.checkVisibility()");
}
