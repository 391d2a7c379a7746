//! Recorders that are killed or find a full disk where one file ends and the next begins: everything that
//! was flushed is there, and every file verifies alone.

use std::env;
use std::path::Path;
use std::process::Command;

use integration_tests::{DEADLINE, Finished, Process, Program, Sandbox, Signal, wait_for};
use recording::{LogReader, Message};
use sim_contract::{Action, Client};

/// Kills at different moments.
const ROUNDS: usize = 6;
/// Steps between two commands with a keyframe. Fewer than a reader buffers.
const STEPS: u32 = 20;

fn recorder(sandbox: &Sandbox, args: &[&str]) -> Finished {
    Process::run(Program::Recorder, sandbox, args)
}

fn steps(file: &str) -> Vec<u64> {
    let Ok(mut log) = LogReader::open(Path::new(file)) else { return Vec::new() };
    let rows = std::iter::from_fn(|| log.next_message().ok().flatten());
    rows.filter_map(|row| match row.message {
        Message::Step(row) => Some(row.step),
        _ => None,
    })
    .collect()
}

/// A paused node that takes steps on request, and a recorder that divides them into files.
struct Session {
    client: Client,
    steps: u64,
    _node: Process,
    sandbox: Sandbox,
}

impl Session {
    fn new() -> Self {
        let sandbox = Sandbox::new();
        let node =
            Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain", "--paused"]);
        let client = Client::attach(&sandbox.endpoint()).unwrap();
        Self { sandbox, _node: node, client, steps: 0 }
    }

    /// Begins a recording in files of 64 KiB.
    fn record(&self, folder: &str) -> Process {
        std::fs::create_dir_all(self.sandbox.path(folder)).unwrap();
        let output = self.sandbox.path(&format!("{folder}/run.mcap"));
        let args = ["record", "-o", &output, "--split-size", "64KiB", "--compression", "none"];
        let args: Vec<_> = args.into_iter().chain(["--flush-interval", "100ms"]).collect();
        let mut recording = Process::start_ready(Program::Recorder, &self.sandbox, &args);
        recording.wait_for_line("recording from step");
        recording
    }

    /// Publishes steps, the first with a keyframe.
    fn advance(&mut self) {
        self.client.request(Action::Pin { particle: 40 }, DEADLINE).unwrap();
        self.client.request(Action::Step { count: STEPS }, DEADLINE).unwrap();
        self.steps += u64::from(STEPS);
        let (client, last) = (&mut self.client, self.steps);
        wait_for("the steps", || {
            let snapshot = client.latest_snapshot(DEADLINE).unwrap()?;
            (snapshot.header().step >= last).then_some(())
        });
    }

    fn file(&self, folder: &str, number: usize) -> String {
        self.sandbox.path(&format!("{folder}/run_{number:04}.mcap"))
    }

    /// Checks what a killed recorder has left: whole files, and at most one unfinished one.
    fn check(&self, folder: &str, first_step: u64) -> Left {
        let mut next = first_step;
        for number in 0.. {
            let file = self.file(folder, number);
            let part = format!("{file}.part");
            let is_whole = Path::new(&file).exists();
            assert!(!(is_whole && Path::new(&part).exists()), "{file}: two files");
            if is_whole {
                let verified = recorder(&self.sandbox, &["verify", "--json", &file]).json();
                assert_eq!(verified["verdict"], "identical", "{file}: {verified}");
            }
            for step in steps(if is_whole { &file } else { &part }) {
                assert_eq!(step, next, "{file}");
                next += 1;
            }
            if !is_whole {
                let later = self.file(folder, number + 1);
                assert!(!Path::new(&later).exists() && !Path::new(&(later + ".part")).exists());
                return Left { whole_count: number, last_step: next - 1 };
            }
        }
        unreachable!("the files have an end")
    }
}

/// The files that a killed recorder has left.
struct Left {
    whole_count: usize,
    last_step: u64,
}

#[test]
fn a_recorder_killed_where_a_file_begins_leaves_every_file_before_it_complete() {
    let mut session = Session::new();
    for round in 0..ROUNDS {
        let (folder, first_step) = (format!("round{round}"), session.steps);
        let mut recording = session.record(&folder);
        // The curtain has hundreds of particles, so a few steps fill a file.
        let number = 1 + round % 3;
        let begun = session.file(&folder, number) + ".part";
        while !Path::new(&begun).exists() && recording.is_running() {
            session.advance();
        }
        recording.signal(Signal::KILL);
        recording.wait();
        let left = session.check(&folder, first_step);
        assert!(left.whole_count >= number, "{} whole files", left.whole_count);
    }
}

#[test]
fn a_recorder_killed_while_it_finishes_leaves_every_flushed_step() {
    let mut session = Session::new();
    for round in 0..ROUNDS {
        let (folder, first_step) = (format!("round{round}"), session.steps);
        let mut recording = session.record(&folder);
        for _ in 0..3 {
            session.advance();
        }
        let newest = (0..).take_while(|number| {
            let file = session.file(&folder, *number);
            Path::new(&file).exists() || Path::new(&format!("{file}.part")).exists()
        });
        let file = session.file(&folder, newest.last().unwrap());
        let part = format!("{file}.part");
        // The recorder may finish the file at any time.
        let last_step = |file: &str| steps(file).last().copied();
        let flushed = wait_for("a flush", || last_step(&part).or_else(|| last_step(&file)));
        recording.signal(Signal::INT);
        if round % 2 == 0 {
            wait_for("the end", || (!Path::new(&part).exists()).then_some(()));
        }
        if recording.is_running() {
            recording.signal(Signal::KILL);
        }
        recording.wait();
        let last = session.check(&folder, first_step).last_step;
        assert!(last >= flushed, "{last}, but {flushed} was flushed");
    }
}

/// Set inside the namespace of the test below: the folder of the small disk.
const INSIDE: &str = "CATENARY_TEST_FULL_DISK";

#[test]
#[ignore = "needs the right to mount a file system"]
#[allow(clippy::disallowed_methods, reason = "starts this test again")]
fn a_disk_that_is_full_at_a_split_ends_the_recording_and_keeps_the_files_before() {
    if let Some(folder) = env::var_os(INSIDE) {
        return fill_the_disk(folder.to_str().unwrap());
    }
    let sandbox = Sandbox::new();
    let folder = sandbox.path("disk");
    std::fs::create_dir(&folder).unwrap();
    let mount = "mount -t tmpfs -o size=2m tmpfs \"$0\" && exec \"$@\"";
    let inner = Command::new("unshare")
        .args(["--mount", "sh", "-c", mount, &folder])
        .arg(env::current_exe().unwrap())
        .args(["--ignored", "--exact", "--nocapture"])
        .arg("recording::files::kills::a_disk_that_is_full_at_a_split_ends_the_recording_and_keeps_the_files_before")
        .env(INSIDE, &folder)
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    let (stdout, stderr) = (text(&inner.stdout), text(&inner.stderr));
    // A test that is not found succeeds as well.
    let has_passed = inner.status.success() && stdout.contains("1 passed");
    assert!(has_passed, "{}\n{stdout}\n{stderr}", inner.status);
}

fn fill_the_disk(disk: &str) {
    let mut session = Session::new();
    let output = format!("{disk}/run.mcap");
    let args = ["record", "-o", &output, "--split-size", "64KiB", "--compression", "none"];
    let args: Vec<_> = args.into_iter().chain(["--flush-interval", "100ms"]).collect();
    let mut recording = Process::start_ready(Program::Recorder, &session.sandbox, &args);
    recording.wait_for_line("recording from step");
    while recording.is_running() {
        session.advance();
        // The next command finds a file that has reached its size.
        wait_for("the flushed steps", || {
            let is_flushed =
                (0..).map(|number| format!("{disk}/run_{number:04}.mcap")).find_map(|file| {
                    let part = format!("{file}.part");
                    let is_part = Path::new(&part).exists();
                    let is_whole = Path::new(&file).exists();
                    let found =
                        || steps(if is_part { &part } else { &file }).contains(&session.steps);
                    if is_part || is_whole { found().then_some(true) } else { Some(false) }
                });
            (is_flushed == Some(true) || !recording.is_running()).then_some(())
        });
    }
    let finished = recording.wait();
    assert_eq!(finished.code, Some(1), "{finished:?}");
    for words in ["No space left on device", "run_", ".mcap.part"] {
        assert!(finished.stderr.contains(words), "no \"{words}\" in {}", finished.stderr);
    }
    let mut next = 0;
    for number in 0.. {
        let file = format!("{disk}/run_{number:04}.mcap");
        if !Path::new(&file).exists() {
            assert!(number > 2, "{number} files");
            let part = format!("{file}.part");
            assert!(steps(&part).iter().zip(next..).all(|(found, step)| *found == step));
            break;
        }
        let verified = recorder(&session.sandbox, &["verify", "--json", &file]).json();
        assert_eq!(verified["verdict"], "identical", "{file}: {verified}");
        for step in steps(&file) {
            assert_eq!(step, next, "{file}");
            next += 1;
        }
    }
    assert!(next > 0);
}
