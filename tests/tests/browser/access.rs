//! Small screens, forced colours, and a browser without WebGL2.

use serde_json::json;

use crate::support::{Area, Rig};

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
    assert_eq!(controls(&rig, "one.id === 'frame' && box.right <= innerWidth"), 1.0);
    assert!(controls(&rig, "one.type === 'checkbox'") > 3.0);
    assert_eq!(controls(&rig, "Math.min(box.width, box.height) < 24"), 0.0);
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
        "banner,notices,recording-said,inspect-said,command-answer,plot-said,hashes"
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
