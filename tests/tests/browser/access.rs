//! Small screens, forced colours, and a browser without WebGL2.

use serde_json::json;

use crate::support::Rig;

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
    assert_eq!(
        controls(&rig, "one.tagName === 'BUTTON' && Math.min(box.width, box.height) < 24"),
        0.0
    );
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
