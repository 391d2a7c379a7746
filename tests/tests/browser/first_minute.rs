//! The first minute of a new user: a scene that moves, a hint, the menu of scenes, keys after clicks, and
//! typed values.

use integration_tests::{DEADLINE, wait_for};
use serde_json::json;
use sim_contract::Parameter;
use viewer_bridge::scene::catalog::Catalog;

use crate::browser::picture::SWINGING;
use crate::browser::support::{Button, Rig};

/// Particle of the drape near a corner of its hem, which sways by 11 cm with each gust.
const HEM: usize = 23 * 49 + 47;

#[test]
#[ignore = "needs Chromium"]
fn the_page_opens_on_something_that_moves_with_a_hint_until_it_is_touched() {
    let mut rig = Rig::new(&[], "");
    rig.tab.wait("viewer.scene === 'drape' && document.querySelector('#hint').checkVisibility()");
    assert_eq!(
        rig.tab.evaluate("document.querySelector('#hint').textContent"),
        "Drag the cloth. Right-drag cuts it."
    );
    rig.tab.key('b');
    rig.tab.wait(
        "document.querySelector('#hint').textContent.startsWith('Drag over the cloth to push it.')",
    );
    rig.tab.key('g');
    // Wherever the hem is, it comes at least half of its way from there within a period of the gusts.
    let first = rig.state().particles[HEM].position[2];
    rig.wait_for_state("the hem to sway", |state| {
        (state.particles[HEM].position[2] - first).abs() > 0.04
    });
    // Turning the view is no touch.
    let camera = rig.tab.camera();
    let area = camera.area();
    let outside = [area.x + 8.0, area.y + area.height / 2.0];
    rig.tab.press(outside, Button::Left);
    rig.tab.release(outside);
    assert_eq!(rig.tab.evaluate("document.querySelector('#hint').checkVisibility()"), true);
    rig.pause();
    let at = camera.project(rig.state().particles[90].position);
    rig.tab.press(at, Button::Left);
    rig.tab.wait("!document.querySelector('#hint').checkVisibility()");
    rig.tab.release(at);
}

#[test]
#[ignore = "needs Chromium"]
fn a_large_scene_arrives_over_a_slow_line_and_the_page_says_how_far() {
    // 20,164 particles without a pattern: the bridge compresses what is generated.
    let mut text = "version = 1\n".to_owned();
    for index in 0_u32..20_164 {
        let [x, y, z] = [1, 2, 3].map(|axis| (index * axis).wrapping_mul(2_654_435_761) >> 8);
        text += &format!("[[particle]]\nposition = [{x}e-7, {y}e-7, {z}e-7]\npinned = true\n");
    }
    let rig = Rig::with_scene(&text, &["--paused"], "");
    // 1 Mbit/s.
    let page = rig.tab_over_slow_line(125_000);
    page.evaluate(
        "window.texts = new Set(); new MutationObserver(() => texts.add(viewer.banner)).observe(document.querySelector('#banner'), { childList: true, characterData: true, subtree: true })",
    );
    page.wait("viewer.scene === 'scene' && viewer.frame >= 0");
    let texts = page.evaluate("[...texts]");
    let shares = texts.as_array().unwrap().iter().filter_map(|text| {
        let share = text.as_str()?.strip_prefix("Receiving the scene: ")?.strip_suffix(" %.")?;
        share.parse::<u32>().ok()
    });
    let shares: Vec<_> = shares.collect();
    assert!(shares.len() > 1 && shares.is_sorted(), "{texts}");
    page.wait("document.querySelector('#banner').hidden");
}

#[test]
#[ignore = "needs Chromium"]
fn every_scene_is_loaded_by_keys_and_from_the_menu_at_its_own_rate() {
    let mut rig = Rig::new(&["drape"], "");
    let catalog = Catalog::default();
    let scenes = catalog.entries();
    let shown = |name: &str| format!("viewer.scene === '{name}' && viewer.frame >= 0");
    for scene in scenes.iter().skip(1).chain(scenes.first()) {
        rig.tab.key(']');
        rig.tab.wait(&shown(&scene.name));
        let status = rig.client().status(DEADLINE).unwrap().unwrap();
        assert_eq!(
            (status.scene_name().as_str(), status.rate_hz),
            (scene.name.as_str(), scene.rate_hz)
        );
    }
    rig.tab.key('[');
    rig.tab.wait(&shown(&scenes.last().unwrap().name));

    rig.tab.key('m');
    rig.tab.wait(
        "[...document.querySelectorAll('#scenes img')].every(one => one.naturalWidth === 320)",
    );
    let texts = rig.tab.evaluate(
        "[...document.querySelectorAll('#scenes button')].map(one => one.querySelector('span').textContent)",
    );
    assert_eq!(texts, json!(scenes.iter().map(|one| &one.text).collect::<Vec<_>>()));
    // The card of the scene on show has the focus, and an arrow goes to the one before it.
    rig.tab.named_key("ArrowLeft");
    let before = &scenes[scenes.len() - 2].name;
    assert_eq!(rig.tab.evaluate("document.activeElement.dataset.scene"), json!(before));
    let card = "#scenes button[data-scene=ragdoll]";
    rig.tab.evaluate(&format!("document.querySelector('{card}').scrollIntoView()"));
    rig.tab.click(card);
    rig.tab.wait(&shown("ragdoll"));
    assert_eq!(rig.tab.evaluate("viewer.notices"), json!([]));
}

#[test]
#[ignore = "needs Chromium"]
fn quick_presses_of_the_key_for_the_next_scene_end_at_the_last_one_without_a_complaint() {
    let rig = Rig::new(&["drape"], "");
    let catalog = Catalog::default();
    // Some of the scenes before it have another rate, so that their loads begin other runs.
    let last = &catalog.entries()[6].name;
    for _ in 0..6 {
        rig.tab.key(']');
    }
    rig.tab.wait(&format!(
        "viewer.scene === '{last}' && viewer.frame >= 0 && viewer.unanswered === 0"
    ));
    assert_eq!(rig.tab.evaluate("viewer.notices"), json!([]));
}

#[test]
#[ignore = "needs Chromium"]
fn the_menu_shows_a_plain_card_for_a_scene_from_a_file() {
    let rig = Rig::with_scene_in_menu(&SWINGING.replace("version", "name = \"mine\"\nversion"));
    rig.tab.key('m');
    // A request for a picture would be an error of the page, and fail this test.
    rig.tab.wait("document.querySelectorAll('#scenes .picture').length === document.querySelectorAll('#scenes button').length");
    let card = "#scenes button[data-scene=mine]";
    let plain = format!("{card} i.picture");
    rig.tab.evaluate(&format!("document.querySelector('{card}').scrollIntoView()"));
    rig.tab.wait(
        "[...document.querySelectorAll('#scenes img')].every(one => one.naturalWidth === 320)",
    );
    let sizes = format!(
        "['{plain}', '#scenes img'].map(one => document.querySelector(one).getBoundingClientRect())\
         .map(({{ width, height }}) => [Math.round(width), Math.round(height)])"
    );
    let sizes = rig.tab.evaluate(&sizes);
    assert_eq!(sizes[0], sizes[1]);
    rig.tab.click(card);
    rig.tab.wait("viewer.scene === 'mine' && viewer.frame >= 0");
}

#[test]
#[ignore = "needs Chromium"]
fn keys_do_what_they_say_after_any_click() {
    let mut rig = Rig::new(&["curtain"], "");
    let paused = |rig: &Rig, is_paused: bool| {
        rig.tab.wait(&format!("viewer.paused === {is_paused} && viewer.unanswered === 0"));
    };
    rig.tab.click("button[data-toggle=heat]");
    rig.tab.key(' ');
    paused(&rig, true);
    assert_eq!(rig.tab.evaluate("viewer.toggles.heat"), true);
    // A slider, then the button that the key stands for.
    rig.tab.click_at("#set-damping", 0.5);
    rig.tab.key(' ');
    paused(&rig, false);
    rig.tab.click("#pause");
    paused(&rig, true);
    rig.tab.key(' ');
    paused(&rig, false);
    // A list that has the focus, as after Tab.
    rig.tab.evaluate("document.querySelector('#heat-range').focus()");
    rig.tab.key(' ');
    paused(&rig, true);
    let before = rig.settled().step;
    rig.tab.evaluate("document.querySelector('select').focus()");
    rig.tab.key('r');
    rig.wait_for_state("the reset", |state| state.step == before + 1);
    assert_eq!(rig.tab.evaluate("document.querySelector('#heat-range').value"), "auto");
}

#[test]
#[ignore = "needs Chromium"]
fn values_are_typed_beside_their_sliders_and_reset_parameters_restores_them() {
    let mut rig = Rig::new(&["curtain"], "");
    let initial = rig.client().parameters(DEADLINE).unwrap().unwrap().values;
    rig.tab.type_into("input[aria-label='Damping in 1/s']", "2.125");
    rig.tab.type_into("input[aria-label='Gravity y in m/s²']", "-1,62");
    rig.tab.type_into("input[aria-label='Tear force in N']", "5e3");
    wait_for("the typed values in the node", || {
        let values = rig.client().parameters(DEADLINE).unwrap().unwrap().values;
        let is_set = values.number(Parameter::Damping) == 2.125
            && values.vector(Parameter::Gravity) == [0.0, -1.62, 0.0]
            && values.optional(Parameter::TearForce) == Some(5e3);
        is_set.then_some(())
    });
    rig.tab.wait(
        "document.querySelector('#set-damping').getAttribute('aria-valuetext') === '2.125 1/s'",
    );
    // A value that the node refuses is named with its range, and the page goes back to the old one.
    rig.tab.type_into("input[aria-label='Damping in 1/s']", "-1");
    rig.tab.wait("viewer.notices.some(text => text.includes('damping accepts'))");
    rig.tab
        .wait("document.querySelector(\"input[aria-label='Damping in 1/s']\").value === '2.125'");
    rig.tab.type_into("input[aria-label='Damping in 1/s']", "fast");
    rig.tab.wait("viewer.notices.some(text => text.includes('“fast” is not a number'))");

    rig.tab.click("#parameters-reset");
    wait_for("the values of the scene in the node", || {
        (rig.client().parameters(DEADLINE).unwrap().unwrap().values == initial).then_some(())
    });
    rig.tab.wait("document.querySelector('#parameters-reset').disabled");
}

#[test]
#[ignore = "needs Chromium"]
fn controls_have_the_names_that_people_know() {
    let rig = Rig::new(&["curtain", "--paused"], "");
    rig.tab.wait("document.querySelector('#pause').innerText.trim() === 'Resume'");
    for (selector, name) in [
        ("[data-toggle=sticks]", "Edges"),
        ("#frame", "Fit view"),
        ("#help", "Controls"),
        ("label[for=set-time_scale]", "Speed"),
        ("#parameters-reset", "Reset parameters"),
    ] {
        let found = rig.tab.evaluate(&format!(
            "(one => one.getAttribute('aria-label') ?? one.innerText.trim())(document.querySelector('{selector}'))"
        ));
        assert_eq!(found, name, "{selector}");
    }
}
