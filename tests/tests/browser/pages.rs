//! The rest of a page: its sliders, its links, and other pages beside it.

use crate::support::{Button, Stage};

/// Particle of the curtain that is held: row 6, column 6.
const HELD: usize = 90;

#[test]
#[ignore = "needs Chromium"]
fn a_slider_sets_a_parameter_of_the_node() {
    let mut stage = Stage::new(&["curtain"], "");
    let corner = stage.state().particles.len() - 1;
    let z = stage.state().particles[corner].position[2];
    // The greatest wind from behind; the air gets a drag, because without one nothing would blow.
    stage.tab.click_within("input[aria-label='Wind z']", 0.97);
    stage.wait_for_state("the curtain to be blown", |state| {
        state.particles[corner].position[2] > z + 0.2
    });
    stage.tab.wait("document.querySelector('input[aria-label=\"Wind drag: on\"]').checked");
    stage.tab.click("button[aria-label='Wind as in the scene']");
    stage.wait_for_state("the curtain to hang again", |state| {
        state.particles[corner].position[2] < z + 0.05
    });
}

#[test]
#[ignore = "needs Chromium"]
fn a_link_leads_to_its_scene_and_view() {
    let mut stage = Stage::new(&["curtain"], "scene=rope&camera=0,1,0,5,0.25,0.5&show.particles=0");
    stage.wait_for_state("the rope in the node", |state| state.particles.len() == 41);
    stage.tab.wait("viewer.scene === 'rope' && viewer.frame >= 0 && viewer.camera.distance === 5");
    let view = stage.tab.ask("[viewer.camera.yaw, viewer.camera.pitch, viewer.toggles.particles]");
    assert_eq!(view, serde_json::json!([0.25, 0.5, false]));
    // What the page itself makes of a view leads there, too.
    stage.tab.click("#link");
    stage.tab.wait("location.hash.includes('camera=0,1,0,5,0.25,0.5')");
    assert_eq!(stage.tab.ask("location.hash.includes('scene=rope')"), true);
}

#[test]
#[ignore = "needs Chromium"]
fn two_pages_share_one_simulation() {
    let mut stage = Stage::new(&["curtain"], "");
    let other = stage.another_tab("");
    let at = stage.tab.camera().project(stage.state().particles[HELD].position);
    stage.tab.press(at, Button::Left);
    let is_held =
        format!("viewer.pins.some(([one, flags]) => one === {HELD} && (flags & 2) !== 0)");
    other.wait(&is_held);
    // What one holds, the other cannot move, and is told so.
    other.press(at, Button::Left);
    other.wait("viewer.notices.length > 0");
    other.release(at);
    stage.tab.wait(&is_held);
    stage.tab.release(at);
    other.wait(&format!("!{is_held}"));
    other.key('2');
    stage.tab.wait("viewer.scene === 'rope' && viewer.frame >= 0");
}
