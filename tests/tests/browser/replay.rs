//! Replay in the page: scrubbing the timeline shows the recorded positions.

use std::path::Path;

use integration_tests::{Process, Program, Sandbox};
use recorder::{FrameReader, LogReader};

use crate::picture::{ERROR_MAX, NAMED, SWINGING, errors};
use crate::support::{Button, ReplayRig};

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
    assert_eq!(replay.tab.number(enabled), 6.0);
    replay.end();
    assert_eq!(replay.tab.number(enabled), 0.0);
    replay.go_live("curtain");
    replay.tab.wait("viewer.connection === 'open' && viewer.scene === 'curtain'");
    replay.tab.wait(&format!("!{playback} && viewer.step > 0 && viewer.mode === 'live'"));
}
