//! Replay in the page: scrubbing the timeline shows the recorded positions.

use std::path::Path;

use integration_tests::{Process, Program, Sandbox, ctl, record, wait_for};
use recording::{FrameReader, LogReader};

use crate::browser::picture::{ERROR_MAX, NAMED, SWINGING, errors};
use crate::browser::support::{Area, Button, ReplayRig, is_cloth, is_ghost};

/// A view in which the swinging sheet stays within the picture.
const VIEW: &str = "show.particles=1&camera=0.5,-0.35,0,3,0.42,0.16";
/// Positions on the timeline, as fractions of its length.
const FRACTIONS: [f64; 3] = [0.8, 0.25, 0.55];

/// Reads the positions of each step of a recording.
fn recorded(file: &str) -> Vec<Vec<[f32; 3]>> {
    let mut frames = FrameReader::new(LogReader::open(Path::new(file)).unwrap());
    let mut positions = Vec::new();
    while let Some(frame) = frames.next_frame().unwrap() {
        assert_eq!(frame.row.step, positions.len() as u64);
        positions.push(frame.payload().iter().map(|one| one.position).collect());
    }
    positions
}

#[test]
#[ignore = "needs Chromium"]
fn scrubbing_a_recording_shows_the_recorded_positions() {
    let sandbox = Sandbox::new();
    let scene = sandbox.write("swinging.toml", SWINGING);
    let file = sandbox.path("run.mcap");
    let args = ["simulate", &scene, "--steps", "240", "-o", &file];
    Process::run(Program::Recorder, &sandbox, &args).success();
    let recorded = recorded(&file);

    let replay = ReplayRig::open(sandbox, &file, VIEW);
    let tab = &replay.tab;
    let mut from = tab.pixel("#seek", 0.1);
    for fraction in FRACTIONS {
        let to = tab.pixel("#seek", fraction);
        tab.press(from, Button::Left);
        tab.stroke(from, to, 8);
        tab.release(to);
        from = to;
        let step = tab.evaluate("document.querySelector('#seek').valueAsNumber");
        let step: usize = serde_json::from_value(step).unwrap();
        assert!(
            (step as f64 / 240.0 - fraction).abs() < 0.03,
            "step {step} at {fraction} of the timeline"
        );
        tab.wait(&format!("viewer.paused && viewer.step === {step}"));
        let (camera, picture) = (tab.camera(), tab.screenshot());
        let positions = &recorded[step];
        for (at, error) in NAMED.iter().zip(errors(&picture, &camera, positions)) {
            assert!(error <= ERROR_MAX, "{at:?} is {error} px from its recorded position");
        }
        let earlier = errors(&picture, &camera, &recorded[step - 20]);
        assert!(
            earlier.iter().any(|error| *error > ERROR_MAX),
            "an error of 20 steps would go unnoticed"
        );
    }
}

#[test]
#[ignore = "needs Chromium"]
fn the_clock_of_a_timeline_starts_at_zero_with_its_file() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let wait_for_step = |step: u64| {
        wait_for("a later step", || {
            (ctl(&sandbox, &["status"])["step"].as_u64() > Some(step)).then_some(())
        });
    };
    wait_for_step(240);
    let recording = record(&sandbox, &file);
    let begun = ctl(&sandbox, &["status"])["step"].as_u64().unwrap();
    wait_for_step(begun + 240);
    recording.interrupt().success();
    node.interrupt();
    let replay = ReplayRig::open(sandbox, &file, "");
    replay.tab.wait("document.querySelector('#clock').textContent.startsWith('0:00.000 / ')");
    let first = replay.tab.number("viewer.step");
    assert!(first > 240.0);
    replay.tab.key('.');
    replay.tab.wait(&format!("viewer.step === {first} + 1"));
    replay.tab.wait("document.querySelector('#clock').textContent.startsWith('0:00.004')");
    replay.tab.wait(&format!(
        "document.querySelector('#clock').title.startsWith('Step {},')",
        first + 1.0
    ));
}

/// Commands beside a mark with a text.
const MARKED: &str = r#"{"step":100,"kind":"pin","particle":100}
{"step":300,"kind":"mark","text":"slips"}
{"step":340,"kind":"cut","constraint":300}
"#;

#[test]
#[ignore = "needs Chromium"]
fn a_timeline_goes_from_mark_to_mark_zooms_and_repeats_a_part() {
    let sandbox = Sandbox::new();
    let (commands, file) = (sandbox.write("commands.jsonl", MARKED), sandbox.path("run.mcap"));
    let args = ["simulate", "curtain", "--steps", "960", "--commands", &commands, "-o", &file];
    Process::run(Program::Recorder, &sandbox, &args).success();
    let [pinned, marked, cut] = [100, 300, 340];
    let replay = ReplayRig::open(sandbox, &file, "");
    let tab = &replay.tab;
    tab.wait("document.querySelector('#mark-legend').textContent === 'torn 1pins 1commands 2'");
    for step in [pinned, marked] {
        tab.key('>');
        tab.wait(&format!("viewer.step === {step}"));
    }
    tab.click("#next-mark");
    tab.wait(&format!("viewer.step === {cut}"));
    tab.key('<');
    tab.wait(&format!("viewer.step === {marked}"));
    // Zoomed, the mark on show is where the slider is; pointing at it names the command.
    tab.evaluate("void (document.querySelector('#zoom').value = '0.5', document.querySelector('#zoom').dispatchEvent(new Event('change')))");
    tab.wait("document.querySelector('#seek').max - document.querySelector('#seek').min === 120");
    let points_at = |step: u64, text: &str| {
        let place = tab.number(
            "(slider => (slider.value - slider.min) / (slider.max - slider.min))(document.querySelector('#seek'))",
        );
        tab.move_to(tab.pixel("#marks", place));
        tab.wait(&format!(
            "document.querySelector('#marks').title.includes('step {step}: {text}')"
        ));
    };
    points_at(marked, "mark: slips");
    // A jump beyond the zoomed part moves it.
    tab.key('<');
    tab.wait(&format!(
        "viewer.step === {pinned} && document.querySelector('#seek').max < {marked}"
    ));
    points_at(pinned, "pin");
    tab.key('>');
    tab.wait(&format!(
        "viewer.step === {marked} && document.querySelector('#seek').max > {marked}"
    ));
    points_at(marked, "mark: slips");
    for (turn, length) in [(100, 480), (-100, 120)] {
        tab.evaluate(&format!("void document.querySelector('#track').dispatchEvent(new WheelEvent('wheel', {{ deltaY: {turn}, bubbles: true, cancelable: true }}))"));
        tab.wait(&format!(
            "{length} === document.querySelector('#seek').max - document.querySelector('#seek').min"
        ));
    }

    // The part between A and B is repeated: a place that passes B comes back to A.
    tab.click("#loop-start");
    tab.key('>');
    tab.wait(&format!("viewer.step === {cut}"));
    tab.click("#loop-end");
    tab.wait("document.querySelectorAll('#loop-start[aria-pressed=true], #loop-end[aria-pressed=true]').length === 2");
    tab.evaluate("void (window.steps = [], setInterval(() => window.steps.push(viewer.step), 5))");
    tab.click("#play");
    tab.wait("steps.some((step, index) => index > 0 && step < steps[index - 1])");
    let within = tab.evaluate(&format!("steps.every(step => step >= {marked} && step <= {cut})"));
    assert_eq!(within, true);
    tab.click("#loop");
    tab.wait("document.querySelectorAll('#loop-start[aria-pressed=true], #loop-end[aria-pressed=true]').length === 0");
    tab.wait(&format!("viewer.step > {cut}"));
}

#[test]
#[ignore = "needs Chromium"]
fn a_page_opens_the_other_recordings_of_a_folder() {
    let sandbox = Sandbox::new();
    let folder = sandbox.path("runs");
    std::fs::create_dir(&folder).unwrap();
    for scene in ["rope", "flag"] {
        let file = format!("{folder}/the {scene}.mcap");
        let args = ["simulate", scene, "--steps", "24", "-o", &file];
        Process::run(Program::Recorder, &sandbox, &args).success();
    }
    let replay = ReplayRig::open(sandbox, &folder, "");
    replay
        .tab
        .wait("viewer.scene === 'flag' && document.querySelector('#file').value === 'the flag'");
    for scene in ["rope", "flag"] {
        replay.tab.evaluate(&format!(
            "void (file => {{ file.value = 'the {scene}'; file.dispatchEvent(new Event('change')); }})(document.querySelector('#file'))"
        ));
        replay.tab.wait(&format!(
            "viewer.scene === '{scene}' && document.querySelector('#file').value === 'the {scene}' && viewer.frame >= 0"
        ));
    }
}

#[test]
#[ignore = "needs Chromium"]
fn the_page_says_that_a_recording_is_truncated_until_a_live_bridge_takes_its_address() {
    let sandbox = Sandbox::new();
    let whole = sandbox.path("whole.mcap");
    let args = ["simulate", "curtain", "--steps", "960", "-o", &whole];
    Process::run(Program::Recorder, &sandbox, &args).success();
    let bytes = std::fs::read(&whole).unwrap();
    let file = sandbox.path("run.mcap");
    std::fs::write(&file, &bytes[..bytes.len() * 6 / 10]).unwrap();
    let mut replay = ReplayRig::open(sandbox, &file, "");
    replay.tab.wait(
        "/^The recording is truncated after byte \\d+; shown up to step \\d+\\. \
         `recorder repair run\\.mcap OUT\\.mcap` copies what is intact\\.$/.test(viewer.banner)",
    );
    replay.tab.wait("document.querySelector('#banner').checkVisibility()");
    replay.end();
    replay.go_live("curtain");
    replay.tab.wait("viewer.mode === 'live' && viewer.step > 0 && viewer.banner === ''");
}

#[test]
#[ignore = "needs Chromium"]
fn a_live_bridge_at_the_address_of_a_replay_shows_its_own_timeline() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let args = ["simulate", "rope", "--steps", "24", "-o", &file];
    Process::run(Program::Recorder, &sandbox, &args).success();
    let mut replay = ReplayRig::open(sandbox, &file, "");
    let playback = "document.querySelector('#play').checkVisibility()";
    replay.tab.wait(playback);
    let enabled = "[...document.querySelectorAll('#timeline :is(button, input, select)')]\
        .filter(one => one.checkVisibility() && !one.disabled).length";
    assert_eq!(replay.tab.number(enabled), 9.0);
    replay.end();
    assert_eq!(replay.tab.number(enabled), 0.0);
    replay.go_live("curtain");
    replay.tab.wait("viewer.connection === 'open' && viewer.scene === 'curtain'");
    replay.tab.wait(&format!("!{playback} && viewer.step > 0 && viewer.mode === 'live'"));
}

#[test]
#[ignore = "needs Chromium"]
fn another_recording_is_drawn_as_a_ghost_where_its_particles_are() {
    let sandbox = Sandbox::new();
    let folder = sandbox.path("runs");
    std::fs::create_dir(&folder).unwrap();
    // The sideways gravity swings the second rope far away from the first.
    let commands = sandbox.write(
        "commands.jsonl",
        r#"{"step":10,"kind":"set","parameter":"gravity","value":[6,-9.81,0]}"#,
    );
    let simulate = |name: &str, more: &[&str]| {
        let file = format!("{folder}/{name}.mcap");
        let args = ["simulate", "rope", "--steps", "120", "-o", &file];
        Process::run(Program::Recorder, &sandbox, &[&args, more].concat()).success();
        file
    };
    let changed = simulate("changed", &["--commands", &commands]);
    simulate("plain", &[]);
    let end = *recorded(&changed)[120].last().unwrap();

    let replay = ReplayRig::open(sandbox, &folder, "");
    let tab = &replay.tab;
    tab.wait("document.querySelector('#file').value === 'plain' && viewer.frame >= 0");
    let choose = |name: &str| {
        tab.evaluate(&format!(
            "void (ghost => {{ ghost.value = '{name}'; ghost.dispatchEvent(new Event('change')); }})(document.querySelector('#ghost'))"
        ));
    };
    let ghost_pixels = || {
        let area = Area::around(tab.camera().project(end), 12.0);
        tab.drawn(area).count(&area, is_ghost)
    };
    choose("changed");
    tab.wait("document.querySelector('#ghost-note').textContent.startsWith('changed differs from step 10')");
    // The mark of the first difference, and then the end.
    tab.key('>');
    tab.wait("viewer.step === 10");
    tab.evaluate("void (seek => { seek.value = 120; seek.dispatchEvent(new Event('input')); })(document.querySelector('#seek'))");
    tab.wait(
        "viewer.step === 120 && document.querySelector('#hud').textContent.includes('ghost up to')",
    );
    tab.key('f');
    let drawn = ghost_pixels();
    assert!(drawn > 20, "{drawn} pixels of the ghost at its end");
    choose("");
    tab.wait("document.querySelector('#ghost-note').textContent === ''");
    tab.wait("!document.querySelector('#hud').textContent.includes('ghost')");
    assert_eq!(ghost_pixels(), 0);
}

/// A stick that a box hides from the eye, and one beside it.
const HIDDEN_STICK: &str = "
version = 1
gravity = [0, 0, 0]
[[particle]]
position = [-0.2, 0, -1]
[[particle]]
position = [0.2, 0, -1]
[[particle]]
position = [0.8, 0, -1]
[[particle]]
position = [1.2, 0, -1]
[[constraint]]
particles = [0, 1]
[[constraint]]
particles = [2, 3]
[[collider]]
shape = 'box'
center = [0, 0, 0]
half_extents = [0.4, 0.4, 0.1]
";

#[test]
#[ignore = "needs Chromium"]
fn a_ghost_is_faint_behind_a_solid() {
    let sandbox = Sandbox::new();
    let scene = sandbox.write("hidden.toml", HIDDEN_STICK);
    let folder = sandbox.path("runs");
    std::fs::create_dir(&folder).unwrap();
    for name in ["other", "shown"] {
        let file = format!("{folder}/{name}.mcap");
        let args = ["simulate", &scene, "--steps", "2", "-o", &file];
        Process::run(Program::Recorder, &sandbox, &args).success();
    }
    let replay =
        ReplayRig::open(sandbox, &folder, "camera=0,0,0,4,0,0&show.particles=0&show.sticks=0");
    let tab = &replay.tab;
    tab.wait("document.querySelector('#file').value === 'shown' && viewer.frame >= 0");
    tab.evaluate("void (ghost => { ghost.value = 'other'; ghost.dispatchEvent(new Event('change')); })(document.querySelector('#ghost'))");
    tab.wait("document.querySelector('#hud').textContent.includes('ghost at the same place')");
    let pixels = |x: f32| {
        let area = Area::around(tab.camera().project([x, 0.0, -1.0]), 10.0);
        tab.drawn(area).count(&area, is_ghost)
    };
    assert!(pixels(1.0) > 10, "{} pixels beside the box", pixels(1.0));
    assert_eq!(pixels(0.0), 0, "behind the box");
}

#[test]
#[ignore = "needs Chromium"]
fn a_ghost_that_moves_leaves_the_sheet_where_its_own_recording_has_it() {
    let sandbox = Sandbox::new();
    let folder = sandbox.path("runs");
    std::fs::create_dir(&folder).unwrap();
    let blown = SWINGING.replace("gravity = [3, -9.81, 4]", "gravity = [-9, -9.81, -4]");
    let file = |name: &str| format!("{folder}/{name}.mcap");
    for (name, scene) in [("blown", blown.as_str()), ("shown", SWINGING)] {
        let scene = sandbox.write(&format!("{name}.toml"), scene);
        let args = ["simulate", &scene, "--steps", "120", "-o", &file(name)];
        Process::run(Program::Recorder, &sandbox, &args).success();
    }
    let [own, others] = ["shown", "blown"].map(|name| recorded(&file(name)));

    let replay = ReplayRig::open(sandbox, &folder, VIEW);
    let tab = &replay.tab;
    tab.wait("document.querySelector('#file').value === 'shown' && viewer.frame >= 0");
    tab.evaluate("void (ghost => { ghost.value = 'blown'; ghost.dispatchEvent(new Event('change')); })(document.querySelector('#ghost'))");
    for step in [60, 120] {
        tab.evaluate(&format!("void (seek => {{ seek.value = {step}; seek.dispatchEvent(new Event('input')); }})(document.querySelector('#seek'))"));
        tab.wait(&format!("viewer.paused && viewer.step === {step} && document.querySelector('#hud').textContent.includes('ghost up to')"));
        // The picture of the frame, not a later one of the same state.
        let (camera, picture) = (tab.camera(), tab.screenshot());
        for error in errors(&picture, &camera, &own[step]) {
            assert!(error <= ERROR_MAX, "step {step}: a particle is {error} px away");
        }
        let from_ghost = errors(&picture, &camera, &others[step]);
        assert!(from_ghost.iter().any(|error| *error > ERROR_MAX), "the sheets coincide");
        // The surface, at its lower right corner: the ghost has swung to the left.
        let area = Area::around(camera.project(own[step][69]), 12.0);
        let cloth = picture.count(&area, is_cloth);
        assert!(cloth > 100, "step {step}: {cloth} px of the surface");
    }
}
