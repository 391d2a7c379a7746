//! Pictures that the page saves: their size, their content, and their legend.

use serde_json::{Value, json};

use crate::browser::support::{Rig, Tab};

/// Keeps what the page saves instead of downloading it.
pub(super) const KEEP_FILES: &str = "void (() => { window.saved = []; const make = URL.createObjectURL; \
    URL.createObjectURL = (blob) => { saved.push({ blob }); return make.call(URL, blob); }; \
    HTMLAnchorElement.prototype.click = function () { saved.at(-1).name = this.download; }; })()";

/// Decodes an image: its size, and functions that count and find colours in it, in pixels from its lower right
/// corner.
pub(super) const LOOK: &str = "const look = (image, width, height, near) => { \
    const canvas = new OffscreenCanvas(width, height); \
    const context = canvas.getContext('2d'); \
    context.drawImage(image, 0, 0, width, height); \
    const { data } = context.getImageData(0, 0, width, height); \
    const isNear = (at, hex) => [1, 3, 5].every((from, channel) => Math.abs(data[at + channel] - parseInt(hex.slice(from, from + 2), 16)) <= near); \
    const find = (hex) => { const found = []; \
        for (let at = 0; at < data.length; at += 4) if (isNear(at, hex)) found.push([width - (at / 4) % width, height - Math.floor(at / 4 / width)]); \
        return found; }; \
    return { width, height, data, find }; };";

/// The colours at both ends of the ramp.
pub(super) const RAMP: [&str; 2] = ["#0b2f6b", "#fde737"];

/// The picture that the page has saved.
struct Saved {
    width: f64,
    height: f64,
    name: String,
    /// Distances of the ends of the ramp from the right edge.
    ramp: [f64; 2],
    /// Number of pixels in the colour of the box.
    box_count: f64,
    /// Number of pixels in the colour of the text, within the box.
    text_count: f64,
    /// Hashes of the upper half, in the file and as drawn.
    halves: [Value; 2],
}

/// Shows the colours of a paused curtain.
pub(super) fn coloured(fragment: &str) -> Rig {
    let mut rig = Rig::new(&["curtain"], fragment);
    rig.tab.wait("viewer.step > 60");
    rig.pause();
    rig.tab.key('h');
    rig.tab.wait(
        "viewer.coloring.max > 0 && document.querySelector('#heat-extremes').textContent !== ''",
    );
    rig.tab.evaluate(KEEP_FILES);
    rig
}

/// Saves a picture with the key, and looks at the file.
fn save(tab: &Tab, [surface, text]: [&str; 2]) -> Saved {
    tab.key('s');
    tab.wait("saved[0]?.name !== undefined");
    let [from, to] = RAMP;
    let look = format!(
        "(async () => {{ {LOOK} const {{ blob, name }} = saved.pop(); \
            const image = await createImageBitmap(blob); \
            const picture = look(image, image.width, image.height, 3); \
            const hash = (data, wide, high, stride) => {{ let sum = 0; \
                for (let y = 0; y < high >> 1; y++) for (let x = 0; x < 4 * wide; x++) sum = Math.imul(sum ^ data[y * stride + x], 16777619); \
                return sum; }}; \
            const {{ x, y, width, height }} = document.querySelector('#picture-canvas').getBoundingClientRect(); \
            const drawn = viewer.pixels(x, y, width, height); \
            const end = (hex) => picture.find(hex).filter(([, up]) => up < 200 * devicePixelRatio).map(([left]) => left); \
            return {{ name, width: picture.width, height: picture.height, \
                from: Math.max(...end({from:?})), to: Math.min(...end({to:?})), \
                box: picture.find({surface:?}).length, text: picture.find({text:?}).length, \
                saved: hash(picture.data, picture.width, picture.height, 4 * picture.width), \
                drawn: hash(drawn.data, drawn.width, drawn.height, 4 * drawn.width) }}; }})()"
    );
    let mut found = tab.evaluate(&look);
    let number = |field: &str| found[field].as_f64().unwrap();
    Saved {
        width: number("width"),
        height: number("height"),
        name: found["name"].as_str().unwrap().to_owned(),
        ramp: [number("from"), number("to")],
        box_count: number("box"),
        text_count: number("text"),
        halves: [found["saved"].take(), found["drawn"].take()],
    }
}

pub(super) fn size(tab: &Tab) -> [f64; 2] {
    ["width", "height"].map(|side| {
        tab.number(&format!(
            "document.querySelector('#picture-canvas').getBoundingClientRect().{side}"
        ))
    })
}

#[test]
#[ignore = "needs Chromium"]
fn a_picture_of_a_paused_scene_has_the_legend_at_any_pixel_ratio_and_in_both_themes() {
    let rig = coloured("");
    let light = ["#fffdfa", "#23272e"];
    let dark = ["#1b2028", "#e8ebef"];
    for (ratio, theme, colors) in [(1.0, "light", light), (2.0, "dark", dark)] {
        let metrics =
            json!({ "width": 800, "height": 600, "deviceScaleFactor": ratio, "mobile": false });
        rig.tab.call("Emulation.setDeviceMetricsOverride", metrics);
        let features = json!({ "features": [{ "name": "prefers-color-scheme", "value": theme }] });
        rig.tab.call("Emulation.setEmulatedMedia", features);
        rig.tab.wait(&format!("devicePixelRatio === {ratio}"));
        rig.tab.pass_animation_frames(3);
        let picture = save(&rig.tab, colors);
        let [width, height] = size(&rig.tab);
        assert_eq!([picture.width, picture.height], [width * ratio, height * ratio]);
        let step = rig.tab.number("viewer.step");
        assert_eq!(picture.name, format!("curtain-{step}.png"));
        // 12 + 10 pixels from the right edge to the ramp, which is 180 wide.
        let [from, to] = picture.ramp.map(|pixels| pixels / ratio);
        assert!((from - 202.0).abs() < 2.0 && (to - 22.0).abs() < 8.0, "{theme}: {from} {to}");
        let area = ratio * ratio;
        assert!(picture.box_count > 5000.0 * area, "{theme}: {}", picture.box_count);
        assert!(picture.text_count > 50.0 * area, "{theme}: {}", picture.text_count);
        assert_eq!(picture.halves[0], picture.halves[1], "{theme}: the picture itself");
    }
    // Without colours there is no legend.
    rig.tab.key('h');
    rig.tab.pass_animation_frames(3);
    rig.tab.key('s');
    rig.tab.wait("saved[0]?.name !== undefined");
    let dark_blue = format!(
        "(async () => {{ {LOOK} const image = await createImageBitmap(saved.pop().blob); \
            return look(image, image.width, image.height, 3).find({:?}).length; }})()",
        RAMP[0]
    );
    assert_eq!(rig.tab.number(&dark_blue), 0.0);
}

#[test]
#[ignore = "needs Chromium"]
fn a_picture_has_the_kinds_of_constraints_and_the_scale_of_the_forces() {
    let rig = coloured("");
    let choose = "(it => { it.value = 'kind'; it.dispatchEvent(new Event('change')); })(document.querySelector('#colour'))";
    rig.tab.evaluate(choose);
    rig.tab.key('n');
    rig.tab.wait(
        "document.querySelector('#heat-kinds').checkVisibility() && document.querySelector('#force-legend').checkVisibility()",
    );
    // A paused node publishes forces with its next step.
    rig.tab.key('.');
    rig.tab.wait("viewer.arrows.length > 0 && parseFloat(document.querySelector('#force-arrow').style.width) > 0");
    rig.tab.pass_animation_frames(3);
    rig.tab.key('s');
    rig.tab.wait("saved[0]?.name !== undefined");
    let look = format!(
        "(async () => {{ {LOOK} const image = await createImageBitmap(saved.pop().blob); \
            const picture = look(image, image.width, image.height, 3); \
            const count = (hex, from, to) => picture.find(hex).filter(([left, up]) => left <= 203 && up > from && up < to).length; \
            return [count('#009c8c', 12, 60), count('#0072b2', 60, 160)]; }})()"
    );
    let [arrow, swatch]: [f64; 2] = serde_json::from_value(rig.tab.evaluate(&look)).unwrap();
    let length = rig.tab.number("parseFloat(document.querySelector('#force-arrow').style.width)");
    // A shaft of 3 pixels, and a head that is a triangle of 9 by 11.
    assert!((arrow / (3.0 * (length - 9.0) + 49.5) - 1.0).abs() < 0.25, "{arrow} for {length}");
    assert!(swatch >= 60.0, "{swatch}");
}
