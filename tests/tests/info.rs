//! `recorder info` on a live and on a simulated recording: its numbers follow from the recorded rows.

use std::fs;
use std::path::Path;

use integration_tests::{Finished, Process, Program, Sandbox, ctl, record};
use recording::{LogReader, LoggedMessage, Message, StepRow};
use roxmltree::{Document, Node};
use serde_json::{Value, json};

/// Steps of the live recording.
const STEPS: u64 = 240;

fn recorder(sandbox: &Sandbox, args: &[&str]) -> Finished {
    Process::run(Program::Recorder, sandbox, args)
}

/// Returns the output about a recording, which may have losses: a busy machine delays the recorder.
fn output(finished: Finished) -> String {
    assert!(matches!(finished.code, Some(0 | 3)), "{finished:?}");
    finished.stdout
}

/// Records a running rope from its first step to its last.
fn live(sandbox: &Sandbox) -> String {
    let file = sandbox.path("live.mcap");
    let args = ["run", "rope", "--rate", "480", "--steps", &STEPS.to_string(), "--paused"];
    let node = Process::start_ready(Program::SimNode, sandbox, &args);
    let recording = record(sandbox, &file);
    ctl(sandbox, &["cut", "2"]);
    ctl(sandbox, &["resume"]);
    node.wait().success();
    output(recording.wait());
    file
}

fn messages(file: &str) -> Vec<LoggedMessage> {
    let mut log = LogReader::open(Path::new(file)).unwrap();
    std::iter::from_fn(|| log.next_message().unwrap()).collect()
}

fn rows(messages: &[LoggedMessage]) -> Vec<StepRow> {
    let rows = messages.iter().filter_map(|logged| match &logged.message {
        Message::Step(row) => Some(*row),
        _ => None,
    });
    rows.collect()
}

/// Asserts that a distribution is that of these times, in ns.
fn assert_distribution(summary: &Value, mut times_ns: Vec<u64>) {
    times_ns.sort_unstable();
    let count = times_ns.len();
    for (key, rank) in [("p50_us", count.div_ceil(2)), ("p99_us", (count * 99).div_ceil(100))] {
        let (stated, expected) = (summary[key].as_f64().unwrap(), times_ns[rank - 1] as f64 / 1e3);
        assert!((stated - expected).abs() <= expected * 2e-3, "{key}: {stated}, not {expected}");
    }
    assert_eq!(summary["max_us"], json!(times_ns[count - 1] as f64 / 1e3));
    let mut binned = 0;
    for bin in summary["bins"].as_array().unwrap() {
        let from_ns = bin["from_us"].as_u64().unwrap() * 1000;
        let to_ns = bin["to_us"].as_u64().map_or(u64::MAX, |to_us| to_us * 1000);
        let within = times_ns.iter().filter(|time_ns| (from_ns..to_ns).contains(time_ns)).count();
        assert_eq!(bin["count"], within as u64, "{bin}");
        binned += within;
    }
    assert_eq!(binned, count, "{summary}");
}

#[test]
fn the_page_of_a_live_recording_agrees_with_its_rows() {
    let sandbox = Sandbox::new();
    let file = live(&sandbox);
    let messages = messages(&file);
    let rows = rows(&messages);
    let info = output(recorder(&sandbox, &["info", "--json", &file]));
    let info: Value = serde_json::from_str(&info).unwrap();

    let measured: Vec<_> = rows.iter().filter(|row| row.solve_ns > 0).collect();
    let timing = &info["timing"];
    assert!((1..=STEPS).contains(&(measured.len() as u64)));
    assert_eq!(timing["measured_steps"], measured.len());
    let late = measured.iter().filter(|row| row.wake_late_ns > 1_000_000_000 / 480).count();
    assert_eq!(timing["late_steps"], late as u64);
    assert_distribution(
        &timing["wake_late"],
        measured.iter().map(|row| row.wake_late_ns).collect(),
    );
    assert_distribution(&timing["solve"], measured.iter().map(|row| row.solve_ns).collect());

    let [first, last] = [&rows[0], &rows[rows.len() - 1]];
    assert_eq!(info["last_state_hash"], format!("{:016x}", last.state_hash));
    let torn = [&info["torn_count_first"], &info["torn_count_last"]];
    assert_eq!(torn, [&json!(first.torn_count), &json!(last.torn_count)]);
    assert_eq!(last.torn_count, 1, "a constraint was cut");
    let received_ns = |index: usize| messages[index].log_time_ns;
    let wall_clock_s = (received_ns(messages.len() - 1) - received_ns(0)) as f64 / 1e9;
    assert_eq!(info["wall_clock_s"], json!(wall_clock_s));
    let rate_hz = rows.len() as f64 * 480.0 / (last.step - first.step + 1) as f64;
    let stated_hz = info["messages_per_s"]["/steps"].as_f64().unwrap();
    assert!((stated_hz - rate_hz).abs() < 1e-9 * rate_hz, "{stated_hz}, not {rate_hz}");

    let page = output(recorder(&sandbox, &["info", &file]));
    for line in [
        format!("last hash   {:016x}", last.state_hash),
        format!("torn        {} in the first snapshot, 1 in the last one", first.torn_count),
        format!("late        {late} of {} measured steps woke up", measured.len()),
    ] {
        assert!(page.contains(&line), "no \"{line}\" in: {page}");
    }
    assert!(page.contains("#\n"), "no bar in: {page}");
}

#[test]
fn the_page_of_a_simulated_recording_says_that_no_time_was_measured() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    recorder(&sandbox, &["simulate", "rope", "--steps", "60", "-o", &file]).success();
    let info = recorder(&sandbox, &["info", "--json", &file]).json();
    assert_eq!((&info["timing"], &info["wall_clock_s"]), (&Value::Null, &Value::Null));
    assert_eq!((&info["simulated"], &info["duration_s"]), (&json!(true), &json!(0.25)));
    let last = rows(&messages(&file))[60];
    assert_eq!(info["last_state_hash"], format!("{:016x}", last.state_hash));
    let page = recorder(&sandbox, &["info", &file]).success();
    assert!(page.contains("timing      none (simulated, so no time was measured)"), "{page}");
}

/// An attribute of an element as a number.
fn number(node: &Node<'_, '_>, name: &str) -> f64 {
    node.attribute(name).unwrap().parse().unwrap()
}

/// The elements with a name, in the order of the file.
fn elements<'a>(svg: &'a Document<'_>, name: &str) -> Vec<Node<'a, 'a>> {
    svg.descendants().filter(|node| node.has_tag_name(name)).collect()
}

/// A horizontal line of the scale of a panel.
#[derive(Clone, Copy)]
struct Mark {
    y: f64,
    time_ns: f64,
}

/// The marks of the panel below `top`, downwards: the lines over the whole width, and beside each a time.
fn marks(svg: &Document<'_>, panel: [f64; 2]) -> Vec<Mark> {
    let within = |y: f64| y > panel[0] && y < panel[1];
    let mut times = Vec::new();
    for text in elements(svg, "text") {
        let words: Vec<_> = text.text().unwrap().split(' ').collect();
        let [count, unit] = words[..] else { continue };
        let units = [("ns", 1.0), ("µs", 1e3), ("ms", 1e6), ("s", 1e9)];
        let unit = units.into_iter().find(|(name, _)| *name == unit);
        if let (Ok(count), Some((_, unit))) = (count.parse::<f64>(), unit)
            && within(number(&text, "y"))
        {
            times.push((number(&text, "y"), count * unit));
        }
    }
    let lines = elements(svg, "line").into_iter().filter(|line| {
        let [x1, x2, y1, y2] = ["x1", "x2", "y1", "y2"].map(|name| number(line, name));
        x2 - x1 > 800.0 && y1 == y2 && within(y1) && line.attribute("stroke-dasharray").is_none()
    });
    let mut lines: Vec<_> = lines.map(|line| number(&line, "y1")).collect();
    lines.sort_by(f64::total_cmp);
    times.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert_eq!(lines.len(), times.len());
    assert!(lines.len() >= 2);
    lines.into_iter().zip(times).map(|(y, (_, time_ns))| Mark { y, time_ns }).collect()
}

/// Reads a height off the scale of a panel.
fn time_ns(marks: &[Mark], y: f64) -> f64 {
    let [upper, lower] = [marks[0], marks[marks.len() - 1]];
    let share = (lower.y - y) / (lower.y - upper.y);
    lower.time_ns * (upper.time_ns / lower.time_ns).powf(share)
}

#[test]
fn the_graph_of_a_live_recording_is_xml_whose_band_reaches_the_recorded_times() {
    let sandbox = Sandbox::new();
    let file = live(&sandbox);
    let graph = sandbox.path("timing.svg");
    let args = ["info", &file, "--timing", "--svg", &graph];
    let page = output(recorder(&sandbox, &args));
    assert!(page.starts_with("late        "), "{page}");

    let text = fs::read_to_string(&graph).unwrap();
    let svg = Document::parse(&text).unwrap();
    assert!(svg.root_element().has_tag_name(("http://www.w3.org/2000/svg", "svg")));
    let texts: Vec<_> = svg.descendants().filter_map(|node| node.text()).collect();
    for expected in ["live.mcap: rope, 480 Hz", "wake-up lateness", "solver time", "step"] {
        assert!(texts.contains(&expected), "no \"{expected}\" in {texts:?}");
    }
    let measured: Vec<_> =
        rows(&messages(&file)).into_iter().filter(|row| row.solve_ns > 0).collect();
    let times = [
        measured.iter().map(|row| row.wake_late_ns).collect::<Vec<_>>(),
        measured.iter().map(|row| row.solve_ns).collect(),
    ];
    // A gap of the recording divides a band into several polygons.
    let bands = elements(&svg, "polygon");
    let corners = bands.iter().flat_map(|band| band.attribute("points").unwrap().split(' '));
    let heights: Vec<f64> =
        corners.map(|corner| corner.split_once(',').unwrap().1.parse().unwrap()).collect();
    for (panel, times) in [[60.0, 320.0], [320.0, 600.0]].into_iter().zip(times) {
        let marks = marks(&svg, panel);
        let within = |y: &f64| *y > panel[0] && *y < panel[1];
        let heights: Vec<f64> = heights.iter().copied().filter(within).collect();
        // Times below the lowest mark lie on it.
        let least = times.iter().min().copied().unwrap() as f64;
        let least = least.max(marks[marks.len() - 1].time_ns);
        let greatest = times.iter().max().copied().unwrap() as f64;
        let drawn = [f64::max, f64::min].map(|choose| {
            let y = heights.iter().copied().reduce(choose).unwrap();
            time_ns(&marks, y)
        });
        for (drawn, expected) in drawn.into_iter().zip([least, greatest]) {
            assert!((drawn / expected - 1.0).abs() < 0.01, "{drawn} ns, not {expected} ns");
        }
    }
}

#[test]
fn a_graph_replaces_a_file_only_if_told_to_and_never_the_recording() {
    let sandbox = Sandbox::new();
    let (file, graph) = (live(&sandbox), sandbox.write("timing.svg", "mine"));
    let refused = recorder(&sandbox, &["info", &file, "--timing", "--svg", &graph]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("--overwrite"), "{refused:?}");
    assert_eq!(fs::read_to_string(&graph).unwrap(), "mine");
    let recording = fs::read(&file).unwrap();
    let refused = recorder(&sandbox, &["info", &file, "--timing", "--svg", &file, "--overwrite"]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("is the recording itself"), "{refused:?}");
    assert!(fs::read(&file).unwrap() == recording);
    output(recorder(&sandbox, &["info", &file, "--timing", "--svg", &graph, "--overwrite"]));
    assert!(Document::parse(&fs::read_to_string(&graph).unwrap()).is_ok());
    // A graph alone would hide the page.
    let refused = recorder(&sandbox, &["info", &file, "--svg", &graph]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(refused.stderr.contains("--timing"), "{refused:?}");
}

#[test]
fn a_recording_without_measured_times_is_refused_with_the_reason() {
    let sandbox = Sandbox::new();
    let (file, graph) = (sandbox.path("run.mcap"), sandbox.path("timing.svg"));
    recorder(&sandbox, &["simulate", "rope", "--steps", "10", "-o", &file]).success();
    let refused = recorder(&sandbox, &["info", &file, "--timing", "--svg", &graph]);
    let expected = format!(
        "error: {file}: has no measured times (simulated, so no time was measured); `recorder \
         record` records those of a running node\n"
    );
    assert_eq!((refused.code, refused.stderr), (Some(1), expected));
    assert!(!Path::new(&graph).exists());
}

#[test]
fn a_truncated_recording_of_commands_is_shown_as_far_as_it_goes() {
    let sandbox = Sandbox::new();
    let (file, graph) = (sandbox.path("run.mcap"), sandbox.path("timing.svg"));
    let node = Process::start_ready(
        Program::SimNode,
        &sandbox,
        &["run", "rope", "--rate", "480", "--steps", "960", "--paused"],
    );
    let args = ["record", "-o", &file, "--only-commands", "--flush-interval", "100ms"];
    let mut recording = Process::start_ready(Program::Recorder, &sandbox, &args);
    recording.wait_for_line("recording from step ");
    ctl(&sandbox, &["resume"]);
    node.wait().success();
    output(recording.wait());
    let bytes = fs::read(&file).unwrap();
    fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();

    let rows = rows(&messages(&file));
    let measured = rows.iter().filter(|row| row.solve_ns > 0).count();
    assert!((1..960).contains(&measured), "{measured} steps are left");
    let info = recorder(&sandbox, &["info", "--json", &file]);
    assert_eq!(info.code, Some(3), "{info:?}");
    let info: Value = serde_json::from_str(&info.stdout).unwrap();
    assert_eq!(info["timing"]["measured_steps"], measured as u64);
    let last = rows[rows.len() - 1];
    assert_eq!(info["last_state_hash"], format!("{:016x}", last.state_hash));
    let drawn = recorder(&sandbox, &["info", &file, "--timing", "--svg", &graph]);
    assert_eq!(drawn.code, Some(3), "{drawn:?}");
    assert!(Document::parse(&fs::read_to_string(&graph).unwrap()).is_ok());
}
