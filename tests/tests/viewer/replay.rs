//! Replay in the viewer: pages see the recorded state of every step, and share one playback position.
//!
//! The recorder's library reads the expected states from the start of the file.

use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, SystemTime};

use integration_tests::{Process, Program, Sandbox, ctl, record};
use recording::{Frame, FrameReader, LogReader, Message as Logged, RunDescription};
use serde_json::{Value, json};
use sim_contract::ParticleFlags;
use sim_host::Stop;
use viewer_bridge::request::requests;
use viewer_bridge::sink::{Demand, Sink, Update};
use viewer_bridge::source::replay::{GhostChoice, InitialPlayback, Replay};
use viewer_bridge::wire::FlaggedParticle;
use viewer_bridge::wire::frame_flag::PAUSED;
use viewer_bridge::{Shutdown, Sinks, Source};

use super::page::{Bridge, Page};
use crate::wire_decoder::Message;

const STEPS: u64 = 960;
/// Cuts, pins and parameters before and after a reset. Two later commands share the step of a reset.
const COMMANDS: &str = r#"{"step":20,"kind":"pin","particle":100}
{"step":50,"kind":"cut","constraint":300}
{"step":51,"kind":"cut","constraint":20}
{"step":120,"kind":"set","parameter":"damping","value":2.5}
{"step":200,"kind":"unpin","particle":100}
{"step":333,"kind":"cut","constraint":301}
{"step":500,"kind":"reset"}
{"step":640,"kind":"cut","constraint":7}
{"step":700,"kind":"reset","client_id":1}
{"step":700,"kind":"cut","constraint":9,"client_id":2}
{"step":701,"kind":"cut","constraint":8}
"#;

/// A recorded state.
#[derive(Debug, Clone, PartialEq)]
struct State {
    step: u64,
    positions: Vec<[f32; 3]>,
    torn: Vec<u32>,
    /// Particle and flags.
    pins: Vec<FlaggedParticle>,
}

fn recording(sandbox: &Sandbox) -> String {
    let commands = sandbox.write("commands.jsonl", COMMANDS);
    let file = sandbox.path("run.mcap");
    let steps = STEPS.to_string();
    let args = ["simulate", "curtain", "--steps", &steps, "--commands", &commands, "-o", &file];
    Process::run(Program::Recorder, sandbox, &args).success();
    file
}

/// Reads all states of a recording, and the description of its run.
fn states(file: &str) -> (Vec<State>, RunDescription) {
    let mut frames = FrameReader::new(LogReader::open(Path::new(file)).unwrap());
    let mut torn = Vec::new();
    let mut states = Vec::new();
    while let Some(frame) = frames.next_frame().unwrap() {
        apply_tears(&mut torn, &frame);
        let pins = (0_u32..).zip(frame.payload()).filter(|(_, one)| one.flags != 0);
        states.push(State {
            step: frame.row.step,
            positions: frame.payload().iter().map(|one| one.position).collect(),
            torn: torn.clone(),
            pins: pins
                .map(|(particle, one)| FlaggedParticle { particle, flags: one.flags })
                .collect(),
        });
    }
    (states, frames.log().run().clone())
}

fn apply_tears(torn: &mut Vec<u32>, frame: &Frame) {
    for update in &frame.updates {
        if let Logged::Topology(row) = update {
            torn.clone_from(&row.torn);
        }
    }
    if frame.updates.iter().any(|update| update.replacement_step().is_some()) {
        torn.clear();
    }
    for update in &frame.updates {
        if let Logged::Tears(row) = update {
            torn.extend(&row.constraints);
        }
    }
}

/// A page that tracks tears and pins.
struct View {
    page: Page,
    torn: Vec<u32>,
    pins: Vec<FlaggedParticle>,
}

impl View {
    fn new(bridge: &Bridge) -> Self {
        Self { page: bridge.page(), torn: Vec::new(), pins: Vec::new() }
    }

    /// Waits for the next frame whose step matches, and returns the state that the page then shows.
    fn shown(&mut self, matches: impl Fn(u64) -> bool) -> State {
        let Self { page, torn, pins } = self;
        page.receive("a step", |message| match message {
            Message::Tear(tear) => {
                torn.truncate(tear.first as usize);
                torn.extend(tear.constraints());
                None
            }
            Message::Pins(message) => {
                *pins = message.particles;
                None
            }
            Message::Scene(_) => {
                (*torn, *pins) = (Vec::new(), Vec::new());
                None
            }
            Message::Frame(frame) if matches(frame.head.stamp.step) => {
                assert_eq!(frame.head.torn_count as usize, torn.len());
                Some(State {
                    step: frame.head.stamp.step,
                    positions: frame.positions,
                    torn: torn.clone(),
                    pins: pins.clone(),
                })
            }
            _ => None,
        })
    }

    /// Seeks to a step, and returns the state shown there.
    fn seek(&mut self, step: u64) -> State {
        self.page.send(&json!({ "kind": "seek", "step": step }));
        self.shown(|shown| shown == step)
    }
}

fn seek(step: u64) -> Value {
    json!({ "kind": "seek", "step": step })
}

#[test]
fn scrubbing_shows_the_recorded_state_of_each_step() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let (states, _) = states(&file);
    let bridge = Bridge::start_with(&sandbox, &["--replay", &file]);
    let mut view = View::new(&bridge);
    assert_eq!(view.shown(|_| true), states[0]);
    // Seeks forwards and backwards to the steps around each event, from near and from far.
    let steps = [
        19, 20, 21, 960, 51, 50, 49, 52, 640, 333, 332, 499, 500, 501, 334, 639, 641, 699, 700,
        701, 0, 702, 700, 199, 200, 959, 1, 700,
    ];
    for step in steps {
        assert_eq!(view.seek(step), states[usize::try_from(step).unwrap()], "at step {step}");
    }
    assert_eq!(states[700].torn, [9]);
    assert!(
        states[100].pins.contains(&FlaggedParticle { particle: 100, flags: ParticleFlags::PINNED })
    );
    // A page that connects now sees the same.
    assert_eq!(View::new(&bridge).shown(|_| true), states[700]);
}

#[test]
fn the_timeline_has_marks_and_the_result_of_the_hash_check() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let bridge = Bridge::start_with(&sandbox, &["--replay", &file]);
    let mut page = bridge.page();
    let timeline = page.text_with("timeline", "hashes", &json!("verified"));
    assert_eq!(timeline["hash_text"], "961 hashes verified");
    assert_eq!((&timeline["file"], &timeline["scene"]), (&json!("run.mcap"), &json!("curtain")));
    assert_eq!((&timeline["first_step"], &timeline["last_step"]), (&json!(0), &json!(STEPS)));
    assert_eq!((&timeline["rate_hz"], &timeline["last_time_s"]), (&json!(240), &json!(4.0)));
    assert_eq!(timeline["incomplete"], "");
    let tear = |step: u64| json!({ "kind": "tear", "step": step, "count": 1 });
    let commands = |kind: &str, step: u64, names: &[&str]| json!({ "kind": kind, "step": step, "count": names.len(), "commands": names });
    let marks = [
        commands("pin", 20, &["pin"]),
        tear(50),
        commands("command", 50, &["cut"]),
        tear(51),
        commands("command", 51, &["cut"]),
        commands("command", 120, &["set"]),
        commands("pin", 200, &["unpin"]),
        tear(333),
        commands("command", 333, &["cut"]),
        commands("command", 500, &["reset"]),
        tear(640),
        commands("command", 640, &["cut"]),
        tear(700),
        commands("command", 700, &["reset", "cut"]),
        tear(701),
        commands("command", 701, &["cut"]),
    ];
    assert_eq!(timeline["marks"], json!(marks));
    // The parameters are those of the shown step.
    page.send(&seek(120));
    page.text(|text| text["values"]["damping"] == 2.5 && text["is_complete"] == true);
    page.send(&seek(500));
    page.text(|text| text["type"] == "parameters" && text["values"]["damping"] != 2.5);
}

#[test]
fn a_changed_state_is_detected() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let changed = sandbox.path("changed.mcap");
    change_one_particle(&file, &changed, 321);
    let bridge = Bridge::start_with(&sandbox, &["--replay", &changed]);
    let timeline = bridge.page().text_with("timeline", "hashes", &json!("diverged"));
    assert_eq!(timeline["hash_text"], "1 of 961 hashes differ, first at step 321");
}

/// Copies a recording with a change in one state.
fn change_one_particle(from: &str, to: &str, changed_step: u64) {
    let mut log = LogReader::open(Path::new(from)).unwrap();
    let (run, scene) = (log.run().clone(), log.scene().to_vec());
    let out = std::fs::File::create(to).unwrap();
    let options = recording::LogOptions::default();
    let mut copy = recording::LogWriter::create(out, options, &run, &scene, 0).unwrap();
    while let Some(mut logged) = log.next_message().unwrap() {
        if let Logged::Particles { step, particles } = &mut logged.message
            && *step == changed_step
        {
            particles[90].velocity[1] += 0.25;
        }
        copy.write(&logged.message, logged.log_time_ns).unwrap();
    }
    copy.finish(&recording::Closing::default()).unwrap();
}

/// The kinds of texts that a source publishes, in order.
#[derive(Debug, Default)]
struct Kinds(Mutex<Vec<&'static str>>);

impl Sink for Kinds {
    fn has_demand(&self, _: Demand) -> bool {
        false
    }

    fn publish(&self, update: &Update<'_>) {
        self.0.lock().unwrap().push(match update {
            Update::Node(_) => "node",
            Update::Parameters(_) => "parameters",
            Update::Timeline(_) => "timeline",
            Update::Playback(_) => "playback",
            Update::Ghost(_) => "ghost",
            _ => return,
        });
    }
}

#[test]
fn a_page_receives_the_first_texts_in_one_order_whenever_it_arrives() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let bridge = Bridge::start_with(&sandbox, &["--replay", &file]);
    bridge.page().frame(|_| true);
    let mut late = bridge.page();
    let kind = |page: &mut Page| page.text(|_| true)["type"].as_str().unwrap().to_owned();
    let of_late_page: Vec<_> = (0..5).map(|_| kind(&mut late)).collect();

    // A page that was there before the source receives what the source publishes.
    let (ghosts, start) = (GhostChoice::default(), InitialPlayback::Paused);
    let path = Path::new(&file);
    let mut replay = Replay::open(path, start, ghosts, &Stop::default(), &mut |_| {}).unwrap();
    let (shutdown, kinds) = (Shutdown::default(), Arc::new(Kinds::default()));
    let mut sinks = Sinks::new(shutdown.clone());
    sinks.add(Arc::<Kinds>::clone(&kinds));
    shutdown.begin();
    replay.run(&sinks, &requests().1).unwrap();
    assert_eq!(*kinds.0.lock().unwrap(), of_late_page);
}

#[test]
fn pages_play_pause_step_and_loop_one_recording_together() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let bridge = Bridge::start_with(&sandbox, &["--replay", &file]);
    let (mut page, mut other) = (bridge.page(), bridge.page());
    assert_eq!(page.text_with("node", "state", &json!("alive"))["is_replay"], true);
    let playback = page.text(|text| text["type"] == "playback");
    assert_eq!((&playback["is_playing"], &playback["step"]), (&json!(false), &json!(0)));

    assert_eq!(page.applied(seek(100)), 100);
    other.frame(|frame| frame.head.stamp.step == 100);
    assert_eq!(other.applied(json!({ "kind": "step", "count": 1 })), 101);
    assert_eq!(other.applied(json!({ "kind": "step_back", "count": 3 })), 98);
    assert_eq!(other.applied(json!({ "kind": "step", "count": 40 })), 138);
    page.frame(|frame| frame.head.stamp.step == 138);
    assert_eq!(page.applied(seek(1 << 40)), STEPS);
    assert_eq!(page.applied(json!({ "kind": "step_back", "count": 10_000 })), 0);

    page.applied(json!({ "kind": "set", "parameter": "time_scale", "value": 10 }));
    other.text_with("playback", "rate", &json!(10.0));
    page.applied(json!({ "kind": "resume" }));
    other.text_with("playback", "is_playing", &json!(true));
    // It pauses at the end, and resuming there starts again at the beginning.
    other.frame(|frame| frame.head.stamp.step == STEPS);
    assert_eq!(other.text_with("playback", "is_playing", &json!(false))["step"], STEPS);
    page.applied(json!({ "kind": "loop", "is_on": true }));
    page.applied(json!({ "kind": "set", "parameter": "time_scale", "value": 0.1 }));
    page.applied(seek(STEPS - 2));
    page.applied(json!({ "kind": "resume" }));
    assert_eq!(page.rejected(json!({ "kind": "step", "count": 1 })), "no_effect_here");
    page.applied(json!({ "kind": "set", "parameter": "time_scale", "value": 5 }));
    page.frame(|frame| frame.head.stamp.step > STEPS / 2);
    page.frame(|frame| frame.head.stamp.step < STEPS / 2);
    let step = page.applied(json!({ "kind": "pause" }));
    other.frame(|frame| frame.head.stamp.step == step);
}

#[test]
fn a_paused_replay_shows_exactly_what_was_recorded_at_every_size() {
    let sandbox = Sandbox::new();
    // Large enough that pages receive rounded positions while it moves.
    let sheet = "version = 1\n[[generate]]\nshape = \"cloth\"\ncolumns = 80\nrows = 60\nspacing = 0.05\n\
        origin = [0, 3, 0]\nright = [1, 0, 0]\ndown = [0, -1, 0]\npinned = \"top\"\n";
    let (scene, file) = (sandbox.write("sheet.toml", sheet), sandbox.path("run.mcap"));
    let args = ["simulate", &scene, "--steps", "120", "-o", &file];
    Process::run(Program::Recorder, &sandbox, &args).success();
    let (states, _) = states(&file);
    let bridge = Bridge::start_with(&sandbox, &["--replay", &file]);
    let page = bridge.page_with("/socket", &json!({ "format": "auto" }));
    let mut view = View { page, torn: Vec::new(), pins: Vec::new() };
    assert_eq!(view.shown(|_| true), states[0]);
    assert_eq!(view.seek(60), states[60]);
    // While it plays, the positions are rounded. The state at which it stops is exact again.
    let mut page = view.page;
    page.send(&json!({ "kind": "loop", "is_on": true }));
    let playing =
        page.frame_after(json!({ "kind": "resume" }), |frame| frame.head.flags & PAUSED == 0);
    let place = usize::try_from(playing.head.stamp.step).unwrap();
    assert_ne!(playing.positions, states[place].positions);
    let stopped =
        page.frame_after(json!({ "kind": "pause" }), |frame| frame.head.flags & PAUSED != 0);
    let place = usize::try_from(stopped.head.stamp.step).unwrap();
    assert_eq!(stopped.positions, states[place].positions);
}

#[test]
fn a_recording_cannot_be_changed() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let bridge = Bridge::start_with(&sandbox, &["--replay", &file]);
    let mut page = bridge.page();
    let epoch = page.scene().stamp.epoch;
    for message in [
        json!({ "kind": "grab", "particle": 90, "target": [0, 0, 0] }),
        json!({ "kind": "release", "particle": 90 }),
        json!({ "kind": "pin", "particle": 90 }),
        json!({ "kind": "cut_constraints", "epoch": epoch, "constraints": [1] }),
        json!({ "kind": "cut_radius", "center": [0, 0, 0], "radius": 1 }),
        json!({ "kind": "set", "parameter": "damping", "value": 1 }),
        json!({ "kind": "reset" }),
        json!({ "kind": "load", "scene": "rope" }),
    ] {
        assert_eq!(page.rejected(message.clone()), "only_live", "{message}");
    }
    assert_eq!(
        page.rejected(json!({ "kind": "set", "parameter": "time_scale", "value": 11 })),
        "out_of_range"
    );
}

#[test]
fn a_recording_of_a_live_node_is_shown_as_recorded() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("live.mcap");
    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let recording = record(&sandbox, &file);
    let live = Bridge::start(&sandbox);
    let mut page = live.page();
    let epoch = page.scene().stamp.epoch;
    page.applied(
        json!({ "kind": "cut_constraints", "epoch": epoch, "constraints": [300, 301, 302] }),
    );
    page.applied(json!({ "kind": "pin", "particle": 100 }));
    let reset = page.applied(json!({ "kind": "reset" }));
    page.applied(json!({ "kind": "cut_constraints", "epoch": epoch, "constraints": [4] }));
    page.frame(|frame| frame.head.stamp.step > reset + 100);
    recording.interrupt();
    node.interrupt();
    let (states, run) = states(&file);
    let bridge = Bridge::start_with(&sandbox, &["--replay", &file]);
    let mut view = View::new(&bridge);
    let hex = json!(format!("{:016x}", run.run_id));
    assert_eq!(view.page.text_with("node", "run_id", &hex)["scene"], "curtain");
    let timeline = view.page.text_with("timeline", "hashes", &json!("verified"));
    assert_eq!(timeline["first_step"], states[0].step);
    // A new page, because waiting for the texts above dropped the first frame.
    let mut view = View::new(&bridge);
    assert_eq!(view.shown(|_| true), states[0]);
    let count = states.len();
    for place in [count - 1, 1, count / 2, count / 3, count / 3 * 2, 2] {
        assert_eq!(view.seek(states[place].step), states[place]);
    }
}

#[test]
fn a_page_of_a_node_follows_a_playback_to_any_step() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let (states, _) = states(&file);
    let args = ["play", file.as_str(), "--paused"];
    let _player = Process::start_ready(Program::Recorder, &sandbox, &args);
    let bridge = Bridge::start(&sandbox);
    let mut view = View::new(&bridge);
    assert_eq!(view.shown(|step| step == 0), states[0]);
    for step in [400, 60, 700, 20, 199, 960] {
        ctl(&sandbox, &["rewind", "--to-step", &step.to_string()]);
        assert_eq!(view.shown(|shown| shown == step), states[usize::try_from(step).unwrap()]);
    }
}

#[test]
fn a_truncated_recording_is_shown_as_far_as_it_goes() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let bytes = std::fs::read(&file).unwrap();
    let cut = sandbox.path("cut.mcap");
    std::fs::write(&cut, &bytes[..bytes.len() * 6 / 10]).unwrap();
    let (states, _) = states(&cut);
    let mut bridge = Bridge::start_with(&sandbox, &["--replay", &cut]);
    bridge.process.wait_for_line(&format!("{cut} has no index"));
    bridge.process.wait_for_line(&format!("warning: {cut} is truncated"));
    let mut view = View::new(&bridge);
    for place in [states.len() - 1, states.len() / 2, 1] {
        assert_eq!(view.seek(states[place].step), states[place]);
    }
    let timeline = bridge.page().text_with("timeline", "hashes", &json!("verified"));
    assert_eq!(timeline["last_step"], states.last().unwrap().step);
    let text = timeline["hash_text"].as_str().unwrap();
    assert!(text.contains("truncated"), "{text}");
    let incomplete = timeline["incomplete"].as_str().unwrap();
    let last = states.last().unwrap().step;
    assert!(incomplete.starts_with("truncated after byte "), "{incomplete}");
    assert!(incomplete.contains(&format!("; shown up to step {last}.")), "{incomplete}");
    // The page needs no paths of the host.
    assert!(incomplete.contains("`recorder repair cut.mcap OUT.mcap`"), "{incomplete}");
}

#[test]
fn a_damaged_part_is_skipped_and_reported() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let mut bytes = std::fs::read(&file).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    let damaged = sandbox.path("damaged.mcap");
    std::fs::write(&damaged, &bytes).unwrap();
    // Reading from the start ends before the damage.
    let (before, all) = (states(&damaged).0, states(&file).0);
    let bridge = Bridge::start_with(&sandbox, &["--replay", &damaged]);
    let mut view = View::new(&bridge);
    assert_eq!(view.seek(1), all[1]);
    assert_eq!(view.seek(STEPS), *all.last().unwrap());
    let last = before.last().unwrap();
    view.page.send(&seek(last.step + 1));
    assert_eq!(view.shown(|step| step != STEPS), *last);
    let notice = view.page.text(|text| text["type"] == "notice");
    assert!(notice["text"].as_str().unwrap().contains("is damaged"), "{notice}");
    let timeline = bridge.page().text(|text| {
        text["hash_text"].as_str().is_some_and(|text| text.contains("damaged chunks skipped: 1"))
    });
    assert_eq!(timeline["hashes"], "verified");
}

#[test]
fn a_file_that_is_not_a_recording_is_named_before_anything_is_served() {
    let sandbox = Sandbox::new();
    let whole = std::fs::read(recording(&sandbox)).unwrap();
    let head = sandbox.path("head.mcap");
    std::fs::write(&head, &whole[..300]).unwrap();
    let give = "give a file written by `recorder record` or `recorder simulate`";
    let again = "record again with `recorder record`";
    let folder = sandbox.path("empty");
    std::fs::create_dir(&folder).unwrap();
    let cases = [
        (sandbox.path("missing.mcap"), "no such file", give),
        (sandbox.write("empty.mcap", ""), "is empty", again),
        (
            sandbox.write("text.mcap", "this is not a recording, but long"),
            "is not an MCAP file",
            give,
        ),
        (folder, "has no recording (*.mcap)", give),
        (head, "has no readable header", again),
    ];
    for (file, cause, remedy) in cases {
        let args = ["--listen", "127.0.0.1:0", "--replay", &file];
        let ended = Process::run(Program::ViewerBridge, &sandbox, &args);
        assert_eq!((ended.code, ended.stdout.as_str()), (Some(1), ""), "{}", ended.stderr);
        let start = format!("error: {file}: ");
        assert!(ended.stderr.starts_with(&start), "{}", ended.stderr);
        assert!(ended.stderr.contains(cause) && ended.stderr.contains(remedy), "{}", ended.stderr);
    }
    let both = Process::run(Program::ViewerBridge, &sandbox, &["--replay", "a", "--name", "b"]);
    assert_eq!(both.code, Some(2), "{}", both.stderr);
}

#[test]
fn a_folder_shows_its_newest_recording_and_pages_open_the_others() {
    let sandbox = Sandbox::new();
    let folder = Path::new(&sandbox.path("runs")).to_owned();
    std::fs::create_dir(&folder).unwrap();
    for (age_s, (scene, file)) in
        [("rope", "new.mcap"), ("flag", "day 1.mcap"), ("ragdoll", "old.mcap")].iter().enumerate()
    {
        let path = folder.join(file);
        let args = ["simulate", scene, "--steps", "24", "-o", path.to_str().unwrap()];
        Process::run(Program::Recorder, &sandbox, &args).success();
        let modified = SystemTime::UNIX_EPOCH + Duration::from_secs(1_764_072_001 - age_s as u64);
        std::fs::File::options().append(true).open(&path).unwrap().set_modified(modified).unwrap();
    }
    let bridge = Bridge::start_with(&sandbox, &["--replay", folder.to_str().unwrap()]);
    let mut newest = bridge.page();
    assert_eq!(newest.hello["recordings"], json!(["new", "day 1", "old"]));
    assert_eq!(newest.scene().text.name, "rope");
    for (name, scene) in [("day%201", "flag"), ("old", "ragdoll"), ("new", "rope")] {
        let mut page = bridge.page_at(&format!("/replay/{name}/socket"));
        assert_eq!(page.hello["recordings"], newest.hello["recordings"]);
        assert_eq!(page.scene().text.name, scene);
    }
    let (_, reason) = bridge.refusal_at("/replay/..%2Fother/socket", &json!({}));
    assert_eq!(reason, "there is no such recording");
    // A recording of a file beside others has no list.
    let one = folder.join("old.mcap");
    let bridge = Bridge::start_with(&sandbox, &["--replay", one.to_str().unwrap()]);
    assert_eq!(bridge.page().hello["recordings"], Value::Null);
}

#[test]
fn ctrl_c_ends_a_playing_replay_cleanly() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let mut bridge = Bridge::start_with(&sandbox, &["--replay", &file]);
    let mut page = bridge.page();
    page.applied(json!({ "kind": "loop", "is_on": true }));
    page.applied(json!({ "kind": "resume" }));
    page.frame(|frame| frame.head.stamp.step > 10);
    assert!(bridge.process.is_running());
    let ended = bridge.process.interrupt();
    assert_eq!((ended.code, ended.stdout.as_str()), (Some(0), ""), "{}", ended.stderr);
}
