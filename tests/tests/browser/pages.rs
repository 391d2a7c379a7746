//! Sliders, links, and several pages of one simulation.

use serde_json::json;

use crate::browser::support::{Button, Rig};

/// Particle of the curtain that the tests grab: row 6, column 6.
const TARGET: usize = 90;

#[test]
#[ignore = "needs Chromium"]
fn a_slider_sets_a_parameter_of_the_node() {
    let mut rig = Rig::new(&["curtain"], "");
    let corner = rig.state().particles.len() - 1;
    let z = rig.state().particles[corner].position[2];
    // The strongest wind from behind. It also sets a wind drag, without which wind has no effect.
    rig.tab.click_at("input[aria-label='Wind z']", 0.97);
    rig.wait_for_state("the curtain in the wind", |state| {
        state.particles[corner].position[2] > z + 0.2
    });
    rig.tab.wait("document.querySelector('input[aria-label=\"Wind drag: on\"]').checked");
    rig.tab.click("button[aria-label='Reset Wind to the value of the scene']");
    rig.wait_for_state("the curtain at rest again", |state| {
        state.particles[corner].position[2] < z + 0.05
    });
}

#[test]
#[ignore = "needs Chromium"]
fn a_link_asks_before_it_loads_its_scene_and_then_shows_its_view() {
    let fragment = "scene=rope&camera=0,1,0,5,0.25,0.5&show.particles=0";
    let mut rig = Rig::new(&["curtain"], fragment);
    let other = rig.another_tab(fragment);
    for tab in [&rig.tab, &other] {
        tab.wait("document.querySelector('#question').checkVisibility()");
    }
    other.click("#question-no");
    other.wait("!document.querySelector('#question').checkVisibility()");
    // Neither opening the links nor the refusal has changed anything.
    assert_eq!(rig.state().particles.len(), 168);
    assert_eq!(rig.tab.evaluate("viewer.unanswered"), 0);
    rig.tab.click("#question-yes");
    rig.wait_for_state("the rope in the node", |state| state.particles.len() == 41);
    rig.tab.wait("viewer.scene === 'rope' && viewer.frame >= 0 && viewer.camera.distance === 5");
    let view =
        rig.tab.evaluate("[viewer.camera.yaw, viewer.camera.pitch, viewer.toggles.particles]");
    assert_eq!(view, json!([0.25, 0.5, false]));
    // The link that the page creates has the same view. It asks nothing where its scene is on show.
    rig.tab.click("#link");
    rig.tab.wait("location.hash.includes('camera=0,1,0,5,0.25,0.5')");
    assert_eq!(rig.tab.evaluate("location.hash.includes('scene=rope')"), true);
    let same = rig.another_tab(fragment);
    assert_eq!(same.number("viewer.camera.distance"), 5.0);
    assert_eq!(same.evaluate("document.querySelector('#question').checkVisibility()"), false);
}

#[test]
#[ignore = "needs Chromium"]
fn a_link_with_an_unknown_scene_says_so_at_once() {
    let rig = Rig::new(&["curtain"], "scene=nonsense");
    rig.tab.wait("viewer.notices.includes('This link shows the scene “nonsense”, which this viewer does not have.')");
    assert_eq!(rig.tab.evaluate("document.querySelector('#question').checkVisibility()"), false);
}

#[test]
#[ignore = "needs Chromium"]
fn two_pages_share_one_simulation() {
    let mut rig = Rig::new(&["curtain"], "");
    let other = rig.another_tab("");
    // The curtain swings. In a pause the press falls on the particle that the page shows there.
    let at = rig.tab.camera().project(rig.pause().particles[TARGET].position);
    rig.tab.press(at, Button::Left);
    rig.tab.key(' ');
    let is_grabbed =
        format!("viewer.pins.some(([one, flags]) => one === {TARGET} && (flags & 2) !== 0)");
    other.wait(&is_grabbed);
    // The other page cannot grab the same particle, and shows a notice. It frames the moving curtain as it
    // was when the page opened.
    let seen = other.camera().project(rig.state().particles[TARGET].position);
    other.press(seen, Button::Left);
    other.wait("viewer.notices.length > 0");
    other.release(seen);
    rig.tab.wait(&is_grabbed);
    rig.tab.release(at);
    other.wait(&format!("!{is_grabbed}"));
    // The page asks before it replaces or resets a scene that another page shows.
    other.wait("viewer.pages === 2");
    other.key('r');
    other.wait(
        "document.querySelector('#question-text').textContent.includes('A reset puts it back')",
    );
    other.click("#question-no");
    other.load_by_digit('3', "rope");
    other.wait("document.querySelector('#question-yes').checkVisibility()");
    assert_eq!(other.evaluate("[viewer.unanswered, viewer.scene]"), json!([0, "curtain"]));
    other.click("#question-yes");
    rig.tab.wait("viewer.scene === 'rope' && viewer.frame >= 0");
}
