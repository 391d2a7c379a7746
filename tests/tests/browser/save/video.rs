//! Videos that the page saves: their content, their end, and browsers that write none.

use serde_json::json;

use super::files::{KEEP_FILES, LOOK, RAMP, coloured, size};
use crate::browser::support::Rig;

#[test]
#[ignore = "needs Chromium"]
fn a_video_of_a_paused_scene_shows_the_time_and_has_the_picture_with_its_changes_and_the_legend() {
    let rig = coloured("");
    // The policy of the page plays no video. It does not need to: only this test does.
    rig.tab.call("Page.setBypassCSP", json!({ "enabled": true }));
    rig.tab.call("Page.reload", json!({}));
    rig.tab.wait("window.saved === undefined && window.viewer?.frame >= 0");
    rig.tab.evaluate(KEEP_FILES);
    rig.tab.key('h');
    rig.tab.wait("viewer.coloring.max > 0");
    rig.tab.click("#video");
    rig.tab.wait("document.querySelector('#video').ariaPressed === 'true'");
    rig.tab.wait("document.querySelector('#video-text').textContent >= 'Video 0:02'");
    // The browser asks before it leaves the page.
    let leaves = "dispatchEvent(new Event('beforeunload', { cancelable: true }))";
    assert_eq!(rig.tab.evaluate(leaves), false);
    // Without colours there is no legend.
    rig.tab.key('h');
    rig.tab.wait("document.querySelector('#video-text').textContent >= 'Video 0:04'");
    rig.tab.click("#video");
    rig.tab.wait(
        "saved[0]?.name !== undefined && !document.querySelector('#video-line').checkVisibility()",
    );
    let names =
        "[`curtain-${viewer.step}.mp4`, `curtain-${viewer.step}.webm`].includes(saved[0].name)";
    assert_eq!(rig.tab.evaluate(names), true);
    let [from, to] = RAMP;
    // Of a picture: the numbers of pixels at both ends of the ramp, and of red ones, which are those of the cloth.
    let look = format!(
        "new Promise((done, fail) => {{ {LOOK} const video = document.createElement('video'); \
            const counts = () => {{ const picture = look(video, video.videoWidth, video.videoHeight, 40); \
                const ends = [{from:?}, {to:?}].map((hex) => picture.find(hex).filter(([left, up]) => left < 210 && up < 200).length); \
                return [...ends, picture.data.filter((red, at) => at % 4 === 0 && red > picture.data[at + 1] + 60).length]; }}; \
            let first; video.requestVideoFrameCallback(() => {{ first = counts(); }}); \
            video.muted = true; video.onerror = () => fail(video.error.message); \
            video.onended = () => done([[video.videoWidth, video.videoHeight, 0], first, counts()]); \
            document.body.append(video); \
            video.src = URL.createObjectURL(saved[0].blob); video.play(); }})"
    );
    let [width, height] = size(&rig.tab).map(|side| 2.0 * (side / 2.0).floor());
    let found: [[f64; 3]; 3] = serde_json::from_value(rig.tab.evaluate(&look)).unwrap();
    let [size, first, last] = found;
    assert_eq!(size, [width, height, 0.0]);
    assert!(first[0] > 20.0 && first[1] > 20.0, "the ramp of the legend: {first:?}");
    assert_eq!(last[..2], [0.0; 2], "the ramp after the colours were turned off");
    assert!(last[2] > 0.05 * width * height, "the cloth: {last:?}");
    assert_eq!(rig.tab.evaluate("viewer.paused"), true);
    assert_eq!(rig.tab.evaluate(leaves), true);
}

#[test]
#[ignore = "needs Chromium"]
fn a_video_that_a_browser_writes_as_a_stream_has_its_duration() {
    let rig = Rig::new(&["curtain"], "");
    let script = json!({ "source": "window.isWebmOnly = true; const isSupported = MediaRecorder.isTypeSupported; \
        MediaRecorder.isTypeSupported = (type) => type.startsWith('video/webm') && isSupported.call(MediaRecorder, type)" });
    rig.tab.call("Page.addScriptToEvaluateOnNewDocument", script);
    // The policy of the page forbids it to play a video.
    rig.tab.call("Page.setBypassCSP", json!({ "enabled": true }));
    rig.tab.call("Page.reload", json!({}));
    rig.tab.wait("window.isWebmOnly && window.viewer?.frame >= 0");
    rig.tab.evaluate(KEEP_FILES);
    rig.tab.click("#video");
    rig.tab.wait("document.querySelector('#video-text').textContent >= 'Video 0:02'");
    rig.tab.click("#video");
    rig.tab.wait("saved[0]?.name?.endsWith('.webm')");
    let times = "new Promise((done, fail) => { const video = document.createElement('video'); \
        let duration; video.muted = true; video.onerror = () => fail(video.error.message); \
        video.onloadedmetadata = () => { duration = video.duration; video.currentTime = 1.5; }; \
        video.onseeked = () => { video.onseeked = null; const at = video.currentTime; \
            video.onended = () => done([duration, at, video.currentTime]); video.play(); }; \
        video.src = URL.createObjectURL(saved[0].blob); })";
    let [duration, sought, end]: [f64; 3] =
        serde_json::from_value(rig.tab.evaluate(times)).unwrap();
    assert!(duration >= 2.0 && (duration - end).abs() < 0.5, "{duration} s, played to {end} s");
    assert!((sought - 1.5).abs() < 0.01, "{sought} s");
}

#[test]
#[ignore = "needs Chromium"]
fn a_browser_that_writes_no_video_says_so() {
    let rig = Rig::new(&["curtain"], "");
    let script = json!({ "source": "MediaRecorder.isTypeSupported = () => false" });
    rig.tab.call("Page.addScriptToEvaluateOnNewDocument", script);
    rig.tab.call("Page.reload", json!({}));
    rig.tab.wait(
        "(it => it.disabled && it.title.includes('cannot record video') && it.title.includes('recorder export'))\
         (document.querySelector('#video'))",
    );
}

/// Replaces the encoder by one that calls back as the test tells it.
const FAKE_ENCODER: &str = "window.MediaRecorder = class { \
    static isTypeSupported() { return true; } \
    constructor(stream) { this.stream = stream; this.state = 'inactive'; window.encoder = this; } \
    start() { if (window.refuses) throw new Error('no encoder is free'); this.state = 'recording'; } \
    stop() { this.state = 'inactive'; this.onstop(); } \
    give(size) { this.ondataavailable({ data: { size } }); } };";

#[test]
#[ignore = "needs Chromium"]
fn a_video_that_grows_too_large_or_fails_ends_and_says_why() {
    let rig = Rig::new(&["curtain"], "");
    let script = json!({ "source": FAKE_ENCODER });
    rig.tab.call("Page.addScriptToEvaluateOnNewDocument", script);
    rig.tab.call("Page.reload", json!({}));
    rig.tab.wait("'give' in MediaRecorder.prototype && window.viewer?.frame >= 0");
    rig.tab.evaluate(KEEP_FILES);
    let said =
        |part: &str| rig.tab.wait(&format!("viewer.notices.some(one => one.includes({part:?}))"));
    let is_over = "document.querySelector('#video').ariaPressed === 'false' && !document.querySelector('#video-line').checkVisibility()";

    // What was encoded before the limit is saved.
    rig.tab.click("#video");
    rig.tab.evaluate("encoder.give(300e6)");
    assert_eq!(rig.tab.evaluate("encoder.state"), "recording");
    rig.tab.evaluate("encoder.give(300e6)");
    said("ended at its greatest size, 512 MB");
    rig.tab.wait(is_over);
    rig.tab.wait("saved.length === 1 && saved[0].name.endsWith('.mp4')");

    rig.tab.click("#video");
    rig.tab.evaluate("encoder.onerror({ error: new Error('the encoder is gone') })");
    rig.tab.evaluate("encoder.stop()");
    said("the encoder is gone");
    said("no picture");
    rig.tab.wait(is_over);

    rig.tab.evaluate("void (window.refuses = true)");
    rig.tab.click("#video");
    said("no encoder is free");
    rig.tab.wait(is_over);
    assert_eq!(rig.tab.number("saved.length"), 1.0);
}
