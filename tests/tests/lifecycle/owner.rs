//! The name of a node after kills, cleaners and other users.

use std::fs::{self, File, Permissions};
use std::os::unix::fs::PermissionsExt;

use integration_tests::{DEADLINE, Process, Program, Sandbox, Signal, ctl, record, wait_for};
use sim_contract::Client;

/// A node creates this many services, each with a file.
const SERVICE_COUNT: usize = 12;

fn service_count(sandbox: &Sandbox) -> usize {
    fs::read_dir(sandbox.root().join("services")).into_iter().flatten().count()
}

/// A node killed while it creates its services leaves some of them unfinished, and which of them
/// depends on the moment. So there are several rounds, and each kills in another phase.
#[test]
fn a_node_starts_after_another_one_was_killed_in_any_phase_of_its_start() {
    let sandbox = Sandbox::new();
    for phase in 0..=2 * SERVICE_COUNT {
        let mut killed = Process::start(Program::SimNode, &sandbox, &["run", "curtain"]);
        let phase_count = phase % (SERVICE_COUNT + 1);
        wait_for("the services", || {
            let has_reached = service_count(&sandbox) >= phase_count;
            (has_reached || !killed.is_running()).then_some(())
        });
        killed.signal(Signal::KILL);
        killed.wait();
        let node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
        assert_eq!(ctl(&sandbox, &["status"])["scene"], "curtain", "phase {phase}");
        assert_eq!(node.interrupt().code, Some(0));
        assert_eq!(service_count(&sandbox), 0, "phase {phase}");
    }
}

#[test]
fn a_client_finds_no_node_after_one_was_killed_in_any_phase_of_its_start() {
    let sandbox = Sandbox::new();
    for phase in 0..=SERVICE_COUNT {
        let mut killed = Process::start(Program::SimNode, &sandbox, &["run", "curtain"]);
        wait_for("the services", || {
            (service_count(&sandbox) >= phase || !killed.is_running()).then_some(())
        });
        killed.signal(Signal::KILL);
        killed.wait();
        let finished = Process::run(Program::SimNode, &sandbox, &["ctl", "status"]);
        assert_eq!(finished.code, Some(1));
        assert!(finished.stderr.contains("no node runs as"), "phase {phase}: {}", finished.stderr);
    }
}

#[test]
fn a_client_names_the_killed_node_and_the_command_that_starts_one() {
    let sandbox = Sandbox::new();
    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let id = node.id();
    node.signal(Signal::KILL);
    node.wait();
    let (domain, killed) = (sandbox.domain(), format!("the last one, process {id}, was killed"));
    for args in [["ctl", "status"], ["ctl", "watch"]] {
        let finished = Process::run(Program::SimNode, &sandbox, &args);
        let expected = format!(
            "error: no node runs as 'sim' in domain '{domain}': {killed}; start one with `sim-node run \
             --domain {domain}`, or name a running one with --domain and --name\n"
        );
        assert_eq!((finished.code, finished.stderr), (Some(1), expected));
    }
    let next = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    next.interrupt().success();
    let finished = Process::run(Program::SimNode, &sandbox, &["ctl", "status"]);
    assert!(!finished.stderr.contains("killed"), "{}", finished.stderr);
}

/// Replaces a connection of a killed client by one that it was killed in the middle of creating: an
/// empty file that nobody may read.
fn unfinish_a_connection(sandbox: &Sandbox) {
    let prefix = format!("{}_", sandbox.domain());
    let connection = wait_for("a connection", || {
        fs::read_dir("/dev/shm").unwrap().flatten().map(|entry| entry.path()).find(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name.starts_with(&prefix) && name.ends_with(".connection")
        })
    });
    // The node still maps the other file.
    fs::remove_file(&connection).unwrap();
    File::create_new(&connection).unwrap();
    fs::set_permissions(&connection, Permissions::from_mode(0o200)).unwrap();
}

#[test]
fn a_client_killed_while_it_connects_keeps_nobody_from_joining_or_leaving() {
    let sandbox = Sandbox::new();
    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let leaving = Client::attach(&sandbox.endpoint()).unwrap();
    for ends_by_joining in [true, false] {
        let killed = Process::start_ready(Program::Grabber, &sandbox, &["7", "90"]);
        killed.signal(Signal::KILL);
        killed.wait();
        unfinish_a_connection(&sandbox);
        if ends_by_joining {
            assert_eq!(ctl(&sandbox, &["status"])["scene"], "curtain");
        }
    }
    drop(leaving);
    assert_eq!(node.interrupt().code, Some(0));
}

#[test]
fn a_cleaner_that_removes_the_files_of_a_node_is_noticed_and_frees_no_name() {
    let sandbox = Sandbox::new();
    let mut node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let step = client.next_snapshot(DEADLINE).unwrap().unwrap().header().step;
    let file = sandbox.path("cleaned.mcap");
    let recorder = record(&sandbox, &file);
    for entry in fs::read_dir(sandbox.root()).unwrap().flatten() {
        let _ = fs::remove_dir_all(entry.path()).or_else(|_| fs::remove_file(entry.path()));
    }
    let warning = node.wait_for_line("warning: ");
    assert!(warning.contains("removed by a cleaner of /tmp"), "{warning}");
    let late = Process::run(Program::SimNode, &sandbox, &["ctl", "status"]);
    assert_eq!(late.code, Some(1));
    let expected = "runs as 'sim' in domain ";
    assert!(late.stderr.contains(expected) && late.stderr.contains("restart it"), "{late:?}");

    let second = Process::run(Program::SimNode, &sandbox, &["run", "curtain"]);
    assert_eq!(second.code, Some(1));
    assert!(second.stderr.contains("is already running, as process"), "{}", second.stderr);
    // The connected client still receives new states.
    wait_for("a later step", || {
        let snapshot = client.next_snapshot(DEADLINE).unwrap().unwrap();
        (snapshot.header().step > step + 10).then_some(())
    });
    // So does a recorder, until the node ends.
    let before = fs::metadata(format!("{file}.part")).unwrap().len();
    wait_for("a longer recording", || {
        let part = fs::metadata(format!("{file}.part")).unwrap();
        (part.len() > before + 100_000).then_some(())
    });
    assert_eq!(node.interrupt().code, Some(0));
    let recorded = recorder.wait();
    assert_eq!(recorded.code, Some(0), "{}", recorded.stderr);
    assert!(recorded.stdout.contains("lost        none"), "{recorded:?}");
    let third = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    assert_eq!(ctl(&sandbox, &["status"])["scene"], "curtain");
    assert_eq!(third.interrupt().code, Some(0));
}

#[test]
fn a_name_stays_usable_when_a_process_is_killed_while_it_cleans_up_after_a_killed_node() {
    let sandbox = Sandbox::new();
    let nodes = sandbox.root().join("nodes");
    let folders = || {
        let entries = fs::read_dir(&nodes).into_iter().flatten().flatten();
        entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect::<Vec<_>>()
    };
    let start = || Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let mut node = start();
    let of_node = folders();
    // It keeps the services, and the lists of their ports. A service has three publishers at most.
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let mut run_id = client.next_snapshot(DEADLINE).unwrap().unwrap().header().run_id;
    let of_client: Vec<_> =
        folders().into_iter().filter(|folder| !of_node.contains(folder)).collect();
    for _ in 0..4 {
        node.signal(Signal::KILL);
        node.wait();
        // iceoryx2 removes the tag of a port first, and then the port.
        for folder in folders().iter().filter(|folder| !of_client.contains(folder)) {
            for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
                if path.extension().is_some_and(|extension| extension == "port_tag") {
                    fs::remove_file(path).unwrap();
                }
            }
        }
        node = start();
        run_id = wait_for("a snapshot of the next node", || {
            let next = client.next_snapshot(DEADLINE).unwrap()?.header().run_id;
            (next != run_id).then_some(next)
        });
    }
    assert_eq!(node.interrupt().code, Some(0));
}

#[test]
fn a_node_warns_when_files_of_its_own_are_removed() {
    for folder in ["nodes", "services"] {
        let sandbox = Sandbox::new();
        let mut node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
        fs::remove_dir_all(sandbox.root().join(folder)).unwrap();
        let warning = node.wait_for_line("warning: ");
        assert!(warning.contains(&format!("/{folder}/")), "{warning}");
        let second = Process::run(Program::SimNode, &sandbox, &["run", "curtain"]);
        assert!(second.stderr.contains("is already running, as process"), "{}", second.stderr);
        assert_eq!(node.interrupt().code, Some(0));
    }
    // Its lock in shared memory, which keeps the name taken if the root is removed.
    let sandbox = Sandbox::new();
    let mut node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let user = rustix::process::geteuid().as_raw();
    let lock = format!("/dev/shm/{}_{user}_sim.owner", sandbox.domain());
    fs::remove_file(&lock).unwrap();
    assert!(node.wait_for_line("warning: ").contains(&lock));
    assert_eq!(node.interrupt().code, Some(0));
}

#[test]
fn programs_refuse_a_domain_whose_files_others_could_change() {
    let sandbox = Sandbox::new();
    let root = sandbox.root();
    fs::create_dir(&root).unwrap();
    fs::set_permissions(&root, Permissions::from_mode(0o777)).unwrap();
    let expected = format!("other users can write to {} (mode 777)", root.display());
    for (program, args) in [
        (Program::SimNode, &["run", "curtain"][..]),
        (Program::SimNode, &["ctl", "status"]),
        (Program::Recorder, &["record", "-o", &sandbox.path("run.mcap")]),
    ] {
        let finished = Process::run(program, &sandbox, args);
        assert_eq!(finished.code, Some(1));
        assert!(finished.stderr.contains(&expected), "{}", finished.stderr);
    }
    // The bridge waits until its node can be reached, and says why it cannot.
    let args = ["--listen", "127.0.0.1:0"];
    let mut bridge = Process::start_ready(Program::ViewerBridge, &sandbox, &args);
    assert!(bridge.wait_for_line("warning: ").contains(&expected));
    assert_eq!(bridge.interrupt().code, Some(0));
}
