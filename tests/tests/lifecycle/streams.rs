//! Output streams that do not accept everything. A result that cannot be written is an error; a reader
//! that has gone wants no more; a message that cannot be written is dropped.

use std::fs;

use integration_tests::{Finished, Process, Program, Sandbox, Stream, Streams, ctl, wait_for};

const REFUSING: [Stream; 3] = [Stream::Closed, Stream::ClosedPipe, Stream::Full];

/// A command that ends by itself, with its exit code if both streams accept everything.
struct Case {
    program: Program,
    args: Vec<String>,
    code: i32,
}

fn case(program: Program, line: &str, code: i32) -> Case {
    Case { program, args: line.split(' ').map(ToOwned::to_owned).collect(), code }
}

impl Case {
    fn run(&self, sandbox: &Sandbox, streams: Streams) -> Finished {
        let args: Vec<_> = self.args.iter().map(String::as_str).collect();
        let finished = Process::start_with(streams, self.program, sandbox, &args).wait();
        let Self { program, args, .. } = self;
        assert!(!finished.stderr.contains("panicked"), "{program:?} {args:?}: {}", finished.stderr);
        finished
    }
}

/// Every command that ends by itself, of all programs. A paused node runs in the sandbox.
fn cases(sandbox: &Sandbox) -> Vec<Case> {
    let mesh = sandbox.write("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let file = sandbox.path("run.mcap");
    let pictures = sandbox.path("pictures");
    let lines = ["simulate", "rope", "--steps", "2", "-o", &file];
    Process::run(Program::Recorder, sandbox, &lines).success();
    let node = |line: &str, code| case(Program::SimNode, line, code);
    let recorder = |line: &str, code| case(Program::Recorder, line, code);
    let bridge = |line: &str, code| case(Program::ViewerBridge, line, code);
    vec![
        node("show curtain", 0),
        node("show ./none.toml", 1),
        node("scenes", 0),
        node("scenes --json", 0),
        node("check curtain", 0),
        node("check curtain --json", 0),
        node("ps", 0),
        node("ps --json", 0),
        node("doctor --iox2-config", 0),
        node("lesson", 0),
        node("lesson euler", 0),
        node("lesson euler --json", 0),
        node(&format!("import {mesh}"), 0),
        node("run rope --name other --steps 1 --as-fast-as-possible", 0),
        node("run rope --name other --steps 1 --as-fast-as-possible --json", 0),
        node("ctl status", 0),
        node("ctl status --json", 0),
        node("ctl watch --count 1", 0),
        node("ctl get", 0),
        node("ctl hash", 0),
        node("ctl particles 3", 0),
        node("ctl nearest 0 0 0", 0),
        node("ctl pin 90", 0),
        node("ctl release 3", 4),
        node("ctl status --name none", 1),
        node("--help", 0),
        node("ctl --help", 0),
        node("--version", 0),
        node("--none", 2),
        recorder("simulate rope --steps 2", 0),
        recorder("simulate rope --steps 2 --json", 0),
        recorder(&format!("info {file}"), 0),
        recorder(&format!("info {file} --json"), 0),
        recorder(&format!("scene {file}"), 0),
        recorder(&format!("verify {file}"), 0),
        recorder(&format!("verify {file} --json"), 0),
        recorder(&format!("export {file} --png {pictures} --frames 1 --overwrite"), 0),
        recorder(&format!("play {file} --name played"), 0),
        recorder("verify ./none.mcap", 1),
        recorder("--help", 0),
        recorder("--version", 0),
        recorder("--none", 2),
        bridge("--help", 0),
        bridge("--version", 0),
        bridge("--none", 2),
        bridge("--replay ./none.mcap", 1),
        case(Program::Demo, "--help", 0),
    ]
}

#[test]
fn no_command_panics_or_hides_a_lost_result_when_a_stream_refuses_its_output() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain", "--paused"]);
    for case in cases(&sandbox) {
        let what = format!("{:?} {}", case.program, case.args.join(" "));
        let normal = case.run(&sandbox, Streams::default());
        assert_eq!(normal.code, Some(case.code), "{what}: {}", normal.stderr);
        for stream in REFUSING {
            let stdout = Streams { stdout: stream, ..Streams::default() };
            let finished = case.run(&sandbox, stdout);
            let is_lost = stream == Stream::Full && !normal.stdout.is_empty();
            let code = if is_lost { 1 } else { case.code };
            assert_eq!(finished.code, Some(code), "{what}, stdout {stream:?}: {}", finished.stderr);
            let error = "cannot write to stdout: No space left on device";
            let has_error = finished.stderr.contains(error);
            assert_eq!(has_error, is_lost, "{what}, stdout {stream:?}: {}", finished.stderr);

            let stderr = Streams { stderr: stream, ..Streams::default() };
            let finished = case.run(&sandbox, stderr);
            assert_eq!(finished.code, Some(case.code), "{what}, stderr {stream:?}");
            assert_eq!(finished.stdout.is_empty(), normal.stdout.is_empty(), "{what}: {stream:?}");
        }
    }
}

#[test]
fn long_running_programs_go_on_when_their_streams_refuse_their_output() {
    for stream in REFUSING {
        let sandbox = Sandbox::new();
        let file = sandbox.path("run.mcap");
        let streams = Streams { stdout: stream, stderr: stream };
        let start = |program, args: &[&str]| Process::start_with(streams, program, &sandbox, args);
        let node = start(Program::SimNode, &["run", "curtain"]);
        wait_for("the node", || {
            let status = Process::run(Program::SimNode, &sandbox, &["ctl", "status"]);
            (status.code == Some(0)).then_some(())
        });
        let bridge = start(Program::ViewerBridge, &["--listen", "127.0.0.1:0"]);
        wait_for("the bridge", || {
            (ctl(&sandbox, &["status"])["readers"].as_u64() > Some(0)).then_some(())
        });
        let recorder = start(Program::Recorder, &["record", "-o", &file]);
        wait_for("a recording", || {
            let part = fs::metadata(format!("{file}.part")).ok()?;
            (part.len() > 50_000).then_some(())
        });
        // The recorder cannot print its report, but its file is complete.
        let is_lost = stream == Stream::Full;
        assert_eq!(recorder.interrupt().code, Some(i32::from(is_lost)), "{stream:?}");
        for process in [bridge, node] {
            assert_eq!(process.interrupt().code, Some(0), "{stream:?}");
        }
        Process::run(Program::Recorder, &sandbox, &["verify", &file]).success();
    }
}
