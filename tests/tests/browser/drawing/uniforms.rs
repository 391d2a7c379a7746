//! Uniforms: where the browser reads the shared ones, and how much garbage a picture makes with them.

use serde_json::{Value, json};

use crate::browser::support::{Rig, Tab};

/// A sheet over a floor, with two pins to which forces belong.
const SHEET: &str = "
version = 1

[[collider]]
shape = \"plane\"
normal = [0, 1, 0]
offset = 0

[[generate]]
shape = \"cloth\"
columns = 9
rows = 9
spacing = 0.1
origin = [-0.4, 1.3, -0.4]
down = [0, 0, 1]
pinned = \"corners\"
";

/// Keeps every program of the page in `programs`.
const KEEP_PROGRAMS: &str = "window.programs = []; \
    const link = WebGL2RenderingContext.prototype.linkProgram; \
    WebGL2RenderingContext.prototype.linkProgram = function (program) { \
        programs.push(program); link.call(this, program); };";

/// Counts the uniforms in the block, and lists those that the browser places elsewhere than the page.
const MISPLACED: &str = "(async () => {
    const { SharedUniforms } = await import('/js/gl/uniforms.js');
    const { members } = new SharedUniforms(null);
    const gl = document.querySelector('#picture-canvas').getContext('webgl2');
    const found = { count: 0, misplaced: [] };
    for (const program of programs) {
        for (let k = 0; k < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); k++) {
            const [offset] = gl.getActiveUniforms(program, [k], gl.UNIFORM_OFFSET);
            // Plain uniforms have no offset.
            if (offset < 0) continue;
            const name = gl.getActiveUniform(program, k).name.replace('[0]', '');
            found.count++;
            if (members[name]?.byteOffset !== offset) found.misplaced.push([name, offset]);
        }
    }
    return found;
})()";

/// Draws a number of pictures at once, without the work of the graphics processor.
const DRAW: &str = "(count => {
    const context = WebGL2RenderingContext.prototype;
    const calls = ['drawArrays', 'drawElements', 'drawArraysInstanced', 'drawElementsInstanced', 'clear'];
    for (const name of calls) context[name] = () => {};
    for (let k = 0; k < count; k++) viewer.draw();
})";
/// Pictures whose garbage is measured.
const PICTURES: f64 = 1000.0;
/// Limit on the garbage of a picture. It was more than twice as much when each program had uniforms of its own.
const GARBAGE_BYTES_MAX: f64 = 6000.0;

/// Returns the bytes that the page allocates for a picture.
fn garbage_bytes(tab: &Tab) -> f64 {
    tab.call(
        "HeapProfiler.startSampling",
        json!({ "samplingInterval": 512, "includeObjectsCollectedByMajorGC": true,
            "includeObjectsCollectedByMinorGC": true }),
    );
    tab.evaluate(&format!("{DRAW}({PICTURES})"));
    let answer = tab.call("HeapProfiler.stopSampling", json!({}));
    allocated_bytes(&answer["profile"]["head"]) / PICTURES
}

/// Returns the bytes that a function and those that it calls have allocated.
fn allocated_bytes(node: &Value) -> f64 {
    let callees = node["children"].as_array().unwrap();
    node["selfSize"].as_f64().unwrap() + callees.iter().map(allocated_bytes).sum::<f64>()
}

#[test]
#[ignore = "needs Chromium"]
fn shared_uniforms_lie_where_the_browser_reads_them() {
    let rig = Rig::with_scene(SHEET, &["--paused"], "show.effects=1");
    let script = json!({ "source": KEEP_PROGRAMS });
    rig.tab.call("Page.addScriptToEvaluateOnNewDocument", script);
    rig.tab.call("Page.reload", json!({}));
    rig.tab.wait("window.programs?.length > 0 && window.viewer?.frame >= 0");
    let found = rig.tab.evaluate(MISPLACED);
    assert_eq!(found["misplaced"], json!([]));
    assert!(found["count"].as_u64().unwrap() > 50, "{found}");
}

#[test]
#[ignore = "needs Chromium"]
fn a_picture_makes_little_garbage() {
    let rig =
        Rig::with_scene(SHEET, &["--paused"], "show.effects=1&show.forces=1&show.particles=1");
    rig.tab.call("HeapProfiler.enable", json!({}));
    // Compiled code allocates less.
    rig.tab.evaluate(&format!("{DRAW}(2000)"));
    let bytes = garbage_bytes(&rig.tab);
    assert!(bytes > 500.0, "{bytes:.0} bytes: nothing was measured");
    assert!(bytes < GARBAGE_BYTES_MAX, "{bytes:.0} bytes");
}
