//! Shared memory that others have filled. The test runs in a mount namespace with a `/dev/shm` of its
//! own, because filling the real one would disturb everything else on the host.

use std::env;
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::process::Command;

use integration_tests::{DEADLINE, Finished, Process, Program, Sandbox, ctl, record, wait_for};
use sim_contract::{Action, Client, NodeStatus, Text};

/// Set inside the namespace.
const INSIDE: &str = "CATENARY_TEST_FULL_MEMORY";
/// Shared memory in the namespace: enough for two scenes at a time, with their clients.
const SIZE: &str = "size=64m";
const FILLER: &str = "/dev/shm/filler";
/// Part of the error of everything that needs more.
const REFUSAL: &str = "MiB of shared memory are needed, but /dev/shm has only 0 MiB left";

#[test]
#[ignore = "needs the right to mount a file system"]
#[allow(clippy::disallowed_methods, reason = "starts this test again")]
fn no_program_ends_with_a_signal_when_shared_memory_is_full() {
    if env::var_os(INSIDE).is_some() {
        return run_with_full_memory();
    }
    let mount = "mount -t tmpfs -o \"$0\" tmpfs /dev/shm && exec \"$@\"";
    let inner = Command::new("unshare")
        .args(["--mount", "sh", "-c", mount, SIZE])
        .arg(env::current_exe().unwrap())
        .args(["--ignored", "--exact", "--nocapture"])
        .arg("lifecycle::full_memory::no_program_ends_with_a_signal_when_shared_memory_is_full")
        .env(INSIDE, "1")
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    let (stdout, stderr) = (text(&inner.stdout), text(&inner.stderr));
    // A test that is not found succeeds as well.
    let has_passed = inner.status.success() && stdout.contains("1 passed");
    assert!(has_passed, "{}\n{stdout}\n{stderr}", inner.status);
}

fn run_with_full_memory() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("full.mcap");
    let mut node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let mut late = Client::attach(&sandbox.endpoint()).unwrap();
    // Creates the ports of commands, outcomes and snapshots, while there is memory for them.
    step(&mut client);
    let outcome = client.request(Action::Pin { particle: 3 }, DEADLINE).unwrap();
    assert!(outcome.is_applied(), "{outcome:?}");
    let recorder = record(&sandbox, &file);
    let bridge =
        Process::start_ready(Program::ViewerBridge, &sandbox, &["--listen", "127.0.0.1:0"]);
    // A program that joins while the memory is being filled may end with a message.
    let are_connected = |status: NodeStatus| status.reader_count >= 3;
    wait_for("all readers", || {
        client.status(DEADLINE).unwrap().filter(|status| are_connected(*status))
    });

    fill_memory();
    // A connected client goes on. One that needs more ports learns the reason.
    let error = late.latest_snapshot(DEADLINE).unwrap_err().to_string();
    assert!(error.contains(REFUSAL), "{error}");
    let before = step(&mut client);
    for _ in 0..3 {
        let outcome = client.request(Action::Unpin { particle: 3 }, DEADLINE).unwrap();
        assert!(outcome.is_applied(), "{outcome:?}");
    }
    // A scene that needs more memory is refused, and the present one goes on.
    let scene = Text::new("flag").unwrap();
    let outcome = client.request(Action::Load { scene }, DEADLINE).unwrap();
    assert!(!outcome.is_applied(), "{outcome:?}");
    let warning = node.wait_for_line("warning: load flag: ");
    assert!(warning.contains(REFUSAL), "{warning}");
    node_goes_on(&mut client, before);
    // New programs end with the reason.
    for args in [&["ctl", "pin", "3"][..], &["run", "curtain", "--name", "second"]] {
        refuses(&Process::run(Program::SimNode, &sandbox, args));
    }
    let before = step(&mut client);
    node_goes_on(&mut client, before);

    fs::remove_file(FILLER).unwrap();
    assert_eq!(ctl(&sandbox, &["load", "flag"])["status"], "applied");
    assert_eq!(ctl(&sandbox, &["status"])["scene"], "flag");
    // The recorder ended with the run of the curtain.
    let recorded = recorder.wait();
    assert_eq!(recorded.code, Some(0), "{}", recorded.stderr);
    let verified = Process::run(Program::Recorder, &sandbox, &["verify", &file]);
    assert_eq!(verified.code, Some(0), "{}{}", verified.stdout, verified.stderr);
    let bridged = bridge.interrupt();
    assert_eq!(bridged.code, Some(0), "{}", bridged.stderr);
    assert_eq!(node.interrupt().code, Some(0));
}

/// Takes every free page of shared memory.
fn fill_memory() {
    let mut filler = File::create_new(FILLER).unwrap();
    let page = [1; 4096];
    let error = (0..).find_map(|_| filler.write_all(&page).err()).unwrap();
    assert_eq!(error.kind(), ErrorKind::StorageFull);
}

fn step(client: &mut Client) -> u64 {
    client.latest_snapshot(DEADLINE).unwrap().unwrap().header().step
}

fn node_goes_on(client: &mut Client, step_before: u64) {
    wait_for("a later step", || (step(client) > step_before + 10).then_some(()));
}

fn refuses(finished: &Finished) {
    assert_eq!(finished.code, Some(1), "{finished:?}");
    assert!(finished.stderr.contains(REFUSAL), "{}", finished.stderr);
}
