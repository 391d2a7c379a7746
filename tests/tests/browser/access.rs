//! Small screens, forced colours, and a browser without WebGL2.

use serde_json::json;

use crate::browser::support::{Area, Button, Rig};

/// Counts the controls that are visible and match a condition on `one` and its rectangle `box`.
fn controls(rig: &Rig, condition: &str) -> f64 {
    rig.tab.number(&format!(
        "[...document.querySelectorAll('button, select, input')].filter(one => {{ \
             const box = one.getBoundingClientRect(); \
             return one.checkVisibility() && {condition}; }}).length"
    ))
}

#[test]
#[ignore = "needs Chromium"]
fn a_phone_can_fit_the_view_and_hit_every_button() {
    let rig = Rig::new(&["curtain", "--paused"], "");
    let phone = json!({ "width": 390, "height": 800, "deviceScaleFactor": 1, "mobile": true });
    rig.tab.call("Emulation.setDeviceMetricsOverride", phone);
    rig.tab.wait("innerWidth === 390");
    rig.tab.click("#more");
    assert_eq!(controls(&rig, "one.id === 'frame' && box.right <= innerWidth"), 1.0);
    assert!(controls(&rig, "one.type === 'checkbox'") > 3.0);
    assert_eq!(controls(&rig, "Math.min(box.width, box.height) < 24"), 0.0);
}

#[test]
#[ignore = "needs Chromium"]
fn the_picture_has_most_of_a_small_window_and_nothing_scrolls_out_of_it() {
    let rig = Rig::new(&["curtain", "--paused"], "");
    for [width, height] in [[844, 390], [667, 320], [360, 640], [1366, 480], [1366, 768]] {
        let window =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        rig.tab.call("Emulation.setDeviceMetricsOverride", window);
        rig.tab.wait(&format!("innerWidth === {width} && innerHeight === {height}"));
        let stage = "document.querySelector('#stage').getBoundingClientRect().height";
        let share = rig.tab.number(&format!("{stage} / innerHeight"));
        assert!(share > 0.65, "{share} of {width} x {height}");
        // A document that is taller than the window would scroll when a control in the panel gets the focus.
        rig.tab.evaluate("document.querySelector('#solver').scrollIntoView()");
        let top = "document.querySelector('.bar').getBoundingClientRect().top";
        assert_eq!(rig.tab.number(top), 0.0);
        assert_eq!(
            rig.tab.number("document.documentElement.scrollHeight - innerHeight"),
            0.0,
            "{width} x {height}"
        );
    }
    // What is folded unfolds over the picture, and folds when the picture is pressed.
    rig.tab.call(
        "Emulation.setDeviceMetricsOverride",
        json!({ "width": 360, "height": 640, "deviceScaleFactor": 1, "mobile": false }),
    );
    rig.tab.wait("innerWidth === 360");
    let is_shown = "document.querySelector('#frame').checkVisibility()";
    assert_eq!(rig.tab.evaluate(is_shown), false);
    rig.tab.click("#more");
    rig.tab.wait(is_shown);
    // Below the unfolded controls, and above the panel.
    let free = "[...Array(innerHeight).keys()].findLast((y) => \
         document.elementFromPoint(20, y)?.matches('#stage canvas'))";
    let at = [20.0, rig.tab.number(free)];
    rig.tab.press(at, Button::Left);
    rig.tab.release(at);
    rig.tab.wait(&format!("!{is_shown}"));
}

/// Shows every message over the picture at once, and returns the rectangles of the messages and of the stage.
const MESSAGES: &str = "(() => {
    const show = (id, text) => {
        const one = document.querySelector(`#${id}`);
        one.hidden = false;
        if (text !== undefined) one.textContent = text;
    };
    show('recording');
    show('recording-text', 'Recorded 0:06 · 1.9 MB · nothing lost');
    show('recording-open');
    show('video-line');
    show('video-text', 'Video 0:04 · 2.1 MB');
    show('question');
    show('question-text', 'Others have changed the simulation since. Undo that too?');
    show('question-yes', 'Undo all');
    show('question-no', 'Keep');
    show('banner', 'You are looking at an earlier state. The simulation went on: the present is 12.4 s later.');
    for (const text of ['Undid the drag.', 'The node has kept only an earlier state, 0.3 s before the one on show.'])
        document.querySelector('#notices').append(Object.assign(document.createElement('li'), { textContent: text }));
    const rectangle = one => (({ left, top, right, bottom }) => [left, top, right, bottom])(one.getBoundingClientRect());
    return ['#stage', '#recording', '#video-line', '#question', '#banner', '#notices li', '#notices li + li']
        .map(one => rectangle(document.querySelector(one)));
})()";

#[test]
#[ignore = "needs Chromium"]
fn no_message_hides_another_one_in_a_small_window() {
    for [width, height] in [[390, 780], [900, 600], [1600, 900]] {
        let rig = Rig::new(&["curtain", "--paused"], "");
        let window =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        rig.tab.call("Emulation.setDeviceMetricsOverride", window);
        rig.tab.wait(&format!("innerWidth === {width}"));
        let rectangles: Vec<[f64; 4]> = serde_json::from_value(rig.tab.evaluate(MESSAGES)).unwrap();
        let (stage, messages) = rectangles.split_first().unwrap();
        for (index, one) in messages.iter().enumerate() {
            let is_inside = one[0] >= stage[0] && one[2] <= stage[2] && one[3] <= stage[3];
            assert!(is_inside && one[3] - one[1] > 20.0, "{width} px: {one:?} in {stage:?}");
            for other in &messages[index + 1..] {
                let is_apart = one[3] <= other[1]
                    || other[3] <= one[1]
                    || one[2] <= other[0]
                    || other[2] <= one[0];
                assert!(is_apart, "{width} px: {one:?} and {other:?}");
            }
        }
    }
}

#[test]
#[ignore = "needs Chromium"]
fn screen_readers_hear_values_and_no_plots_or_clocks() {
    let rig = Rig::new(&["curtain", "--paused"], "");
    let sliders = "[...document.querySelectorAll('#parameters input[type=range]')]";
    rig.tab.wait(&format!("{sliders}.length > 10"));
    // Gravity along y, and a parameter that is off.
    let text = |index: &str| rig.tab.evaluate(&format!("{index}.getAttribute('aria-valuetext')"));
    assert_eq!(text(&format!("{sliders}[1]")), "-9.81 m/s²");
    assert_eq!(text("document.querySelector('#set-tear_force')"), "off N");
    assert_eq!(rig.tab.number(&format!("{sliders}.filter(one => !one.ariaValueText).length")), 0.0);
    // A live region speaks at each change. An output is one unless it is turned off. Those that say what is
    // selected, what the cursor is at and what the node answered change only when the user acts, and that of a
    // recording only at its start and its end.
    let regions = "[...document.querySelectorAll('output, [aria-live], [role=status]')]        .filter(one => one.ariaLive !== 'off').map(one => one.id).join()";
    assert_eq!(
        rig.tab.evaluate(regions),
        "banner,recording-said,notices,inspect-said,command-answer,plot-said,hashes"
    );
    assert!(rig.tab.number("document.querySelectorAll('#plots output').length") > 3.0);
}

#[test]
#[ignore = "needs Chromium"]
fn forced_colours_show_what_is_pressed() {
    let rig = Rig::new(&["curtain", "--paused"], "");
    let forced = json!([{ "name": "forced-colors", "value": "active" }]);
    rig.tab.call("Emulation.setEmulatedMedia", json!({ "features": forced }));
    rig.tab.wait("matchMedia('(forced-colors: active)').matches");
    let background = |mode: &str| {
        rig.tab.evaluate(&format!(
            "getComputedStyle(document.querySelector('[data-mode={mode}]')).backgroundColor"
        ))
    };
    assert_ne!(background("grab"), background("cut"));
    // Sliders and checkboxes differ from their background.
    for selector in ["#parameters input[type=range]", "#parameters input[type=checkbox]"] {
        rig.tab.evaluate(&format!("document.querySelector({selector:?}).scrollIntoView()"));
        let at = rig.tab.pixel(selector, 0.5);
        let colors = rig.tab.screenshot().colors(&Area::around(at, 12.0));
        assert!(colors.len() > 1, "{selector} has the colour of its background");
    }
}

#[test]
#[ignore = "needs Chromium"]
fn without_webgl2_only_the_reason_is_shown() {
    let rig = Rig::new(&["curtain", "--paused"], "");
    let source = "HTMLCanvasElement.prototype.getContext = () => null";
    rig.tab.call("Page.addScriptToEvaluateOnNewDocument", json!({ "source": source }));
    rig.tab.call("Page.reload", json!({}));
    rig.tab.wait(
        "window.viewer === undefined && document.querySelector('#banner')?.textContent.includes('WebGL2')",
    );
    assert_eq!(rig.tab.evaluate("document.querySelector('#banner').checkVisibility()"), true);
    assert_eq!(controls(&rig, "true"), 0.0);
}
