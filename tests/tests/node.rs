//! The node as other processes see it: late subscribers, commands, pauses, a second node, stubborn
//! readers, many short-lived clients.

use std::time::Duration;

use integration_tests::{DEADLINE, Process, Program, Sandbox, Signal, ctl, wait_for};
use sim_contract::{Action, Client, ParticleFlags, Snapshot};

fn node(sandbox: &Sandbox, args: &[&str]) -> Process {
    Process::start_ready(Program::SimNode, sandbox, args)
}

fn attach(sandbox: &Sandbox) -> Client {
    Client::attach(&sandbox.endpoint()).unwrap()
}

/// Waits for a snapshot of a step, or of a later one.
fn snapshot_from(client: &mut Client, step: u64) -> Snapshot {
    loop {
        let snapshot = client.next_snapshot(DEADLINE).unwrap().unwrap();
        if snapshot.header().step >= step {
            return snapshot;
        }
    }
}

#[test]
fn a_late_subscriber_receives_the_scene_and_the_last_snapshot_at_once() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain", "--paused"]);
    ctl(&sandbox, &["step", "7"]);
    // The node is paused: it published all of this before the reader attached.
    let mut client = attach(&sandbox);
    let snapshot = client.next_snapshot(DEADLINE).unwrap().unwrap();
    assert_eq!((snapshot.header().step, snapshot.particles().len()), (7, 168));
    assert_eq!(client.topology(DEADLINE).unwrap().unwrap().constraints.len(), 596);
    assert_eq!(client.surface(DEADLINE).unwrap().unwrap().triangles.len(), 286);
    assert!(client.scene(DEADLINE).unwrap().unwrap().contains("curtain"));
}

#[test]
fn a_grab_by_one_process_moves_the_particle_that_another_process_reads() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain", "--paused"]);
    let outcome = ctl(&sandbox, &["grab", "90", "0.5", "-0.2", "0.3", "--over", "0.1"]);
    assert_eq!((&outcome["status"], &outcome["step"]), (&"applied".into(), &1.into()));
    // 0.1 s is 24 steps at 240 Hz. The step of the outcome is the first.
    ctl(&sandbox, &["step", "23"]);
    let before = snapshot_from(&mut attach(&sandbox), 23).particles()[90];
    assert_ne!(before.position, [0.5, -0.2, 0.3]);
    ctl(&sandbox, &["step"]);
    let after = snapshot_from(&mut attach(&sandbox), 24).particles()[90];
    assert_eq!(after.position, [0.5, -0.2, 0.3]);
    assert_eq!(after.flags, ParticleFlags::GRABBED);
    // Each call of `ctl` is a process, but all of them share one client id.
    assert_eq!(ctl(&sandbox, &["release", "90"])["status"], "applied");
}

#[test]
fn a_paused_node_makes_exactly_the_requested_steps() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain", "--paused"]);
    assert_eq!(ctl(&sandbox, &["hash"])["step"], 0);
    assert_eq!(ctl(&sandbox, &["step", "13"])["step"], 1);
    assert_eq!(ctl(&sandbox, &["hash"])["step"], 13);
    assert_eq!(ctl(&sandbox, &["step"])["step"], 14);
    assert_eq!(ctl(&sandbox, &["status"])["step"], 14);
    // A reset makes one step, which shows it.
    assert_eq!(ctl(&sandbox, &["reset"])["step"], 15);
    let mut client = attach(&sandbox);
    let header = *snapshot_from(&mut client, 15).header();
    assert_eq!((header.step, header.scene_step), (15, 0));
    assert_eq!(ctl(&sandbox, &["hash"])["step"], 15);
    assert_eq!(ctl(&sandbox, &["resume"])["status"], "applied");
    snapshot_from(&mut client, 20);
}

#[test]
fn a_pause_publishes_the_last_step_although_most_steps_are_left_out() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain", "--every", "1000000"]);
    wait_for("a step", || ctl(&sandbox, &["status"])["step"].as_u64().filter(|step| *step > 0));
    let first_paused = ctl(&sandbox, &["pause"])["step"].as_u64().unwrap();
    assert_eq!(ctl(&sandbox, &["hash"])["step"], first_paused - 1);
    assert_eq!(ctl(&sandbox, &["step"])["step"], first_paused);
    assert_eq!(ctl(&sandbox, &["hash"])["step"], first_paused);
}

#[test]
fn the_last_step_before_a_pause_shows_no_command_that_came_before_the_pause() {
    let sandbox = Sandbox::new();
    // The next step is a second away, so a poll of the node can separate the two commands.
    let _node = node(&sandbox, &["run", "curtain", "--rate", "1", "--every", "1000000"]);
    wait_for("a step", || ctl(&sandbox, &["status"])["step"].as_u64().filter(|step| *step > 0));
    let mut client = attach(&sandbox);
    let pin = client.request(Action::Pin { particle: 90 }, DEADLINE).unwrap();
    let pause = client.request(Action::Pause, DEADLINE).unwrap();
    let snapshot = snapshot_from(&mut client, pause.step - 1);
    assert_eq!(snapshot.header().step, pause.step - 1);
    let is_shown = pin.step < pause.step;
    let flags = if is_shown { ParticleFlags::PINNED } else { 0 };
    assert_eq!(snapshot.particles()[90].flags, flags);
    assert_eq!(snapshot.header().outcome_count, u64::from(is_shown));
}

#[test]
fn a_paused_node_answers_commands_with_the_step_that_will_show_them() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain", "--paused"]);
    for index in 0..3 {
        let outcome = ctl(&sandbox, &["pin", "100"]);
        assert_eq!((outcome["step"].as_u64(), outcome["index"].as_u64()), (Some(1), Some(index)));
    }
    ctl(&sandbox, &["step"]);
    let snapshot = snapshot_from(&mut attach(&sandbox), 1);
    assert_eq!(snapshot.particles()[100].flags, ParticleFlags::PINNED);
    assert_eq!(snapshot.header().outcome_count, 4);
}

#[test]
fn rejected_commands_name_their_reason_and_change_no_bit() {
    let run = |commands: &[(&[&str], &str)]| {
        let sandbox = Sandbox::new();
        let node = node(&sandbox, &["run", "curtain", "--paused"]);
        for (command, reason) in commands {
            let outcome = ctl(&sandbox, command);
            assert_eq!(
                (&outcome["status"], &outcome["reason"]),
                (&"rejected".into(), &(*reason).into())
            );
        }
        ctl(&sandbox, &["step", "50"]);
        let hash = ctl(&sandbox, &["hash"]);
        node.interrupt().success();
        assert_eq!(hash["step"], 50);
        hash["state_hash"].clone()
    };
    let rejected: &[(&[&str], &str)] = &[
        (&["grab", "90", "nan", "0", "0"], "non_finite"),
        (&["grab", "90", "0", "inf", "0"], "non_finite"),
        (&["grab", "90", "0", "0", "2e7"], "out_of_range"),
        (&["grab", "168", "0", "0", "0"], "unknown_particle"),
        (&["pin", "4000000000"], "unknown_particle"),
        (&["move", "90", "0", "0", "0"], "not_grabbed"),
        (&["release", "90"], "not_grabbed"),
    ];
    assert_eq!(run(rejected), run(&[]));
}

#[test]
fn a_second_node_with_the_same_name_is_refused_and_told_the_process_id_of_the_first() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain"]);
    let process_id = ctl(&sandbox, &["status"])["process_id"].to_string();
    let second = Process::run(Program::SimNode, &sandbox, &["run", "rope"]);
    assert_eq!(second.code, Some(1));
    assert!(second.stderr.contains("already running"), "{}", second.stderr);
    assert!(second.stderr.contains(&process_id), "{}", second.stderr);
    // It runs beside the first under another name.
    let _other = node(&sandbox, &["run", "rope", "--name", "other"]);
    assert_eq!(ctl(&sandbox, &["status", "--name", "other"])["scene"], "rope");
    assert_eq!(ctl(&sandbox, &["status"])["scene"], "curtain");
}

#[test]
fn readers_of_a_killed_node_continue_with_its_replacement() {
    let sandbox = Sandbox::new();
    let first = node(&sandbox, &["run", "curtain"]);
    let mut client = attach(&sandbox);
    let run_id = snapshot_from(&mut client, 1).header().run_id;
    first.signal(Signal::KILL);
    assert_eq!(first.wait().code, None);
    let _second = node(&sandbox, &["run", "curtain"]);
    wait_for("a snapshot of the second run", || {
        let snapshot = client.next_snapshot(Duration::from_millis(100)).unwrap()?;
        (snapshot.header().run_id != run_id).then_some(())
    });
}

#[test]
fn stopped_readers_with_borrowed_samples_neither_change_nor_stop_the_node() {
    let run = |reader_count: usize| {
        let sandbox = Sandbox::new();
        let args =
            ["run", "curtain", "--paused", "--steps", "5000", "--as-fast-as-possible", "--json"];
        let node = node(&sandbox, &args);
        let mut readers: Vec<_> = (0..reader_count)
            .map(|_| Process::start(Program::StubbornReader, &sandbox, &[]))
            .collect();
        for reader in &mut readers {
            reader.wait_for_line("attached");
        }
        // They borrow all they may, and stop while their buffers fill up.
        ctl(&sandbox, &["step", "4"]);
        for reader in &mut readers {
            reader.wait_until_ready();
            reader.signal(Signal::STOP);
        }
        ctl(&sandbox, &["resume"]);
        node.wait().json()
    };
    let (alone, watched) = (run(0), run(2));
    assert_eq!(alone["steps"], 5000);
    assert_eq!(watched["state_hash"], alone["state_hash"]);
}

/// Starts 200 processes that each pin a different particle and end, and checks each outcome and pin.
fn pin_by_200_processes(rate: &str) {
    let sandbox = Sandbox::new();
    let cloth = "version = 1\n[[generate]]\nshape = \"cloth\"\ncolumns = 20\nrows = 20\nspacing = 0.1\npinned = \"none\"\n";
    let scene = sandbox.write("cloth.toml", cloth);
    let _node = node(&sandbox, &["run", &scene, "--rate", rate]);
    let mut last_step = 0;
    let mut indices = Vec::new();
    let particles: Vec<String> = (100..300).map(|particle: u32| particle.to_string()).collect();
    for batch in particles.chunks(8) {
        let start = |particle: &String| {
            Process::start(Program::SimNode, &sandbox, &["ctl", "--json", "pin", particle])
        };
        let processes: Vec<_> = batch.iter().map(start).collect();
        for process in processes {
            let outcome = process.wait().json();
            assert_eq!(outcome["status"], "applied");
            indices.push(outcome["index"].as_u64().unwrap());
            last_step = last_step.max(outcome["step"].as_u64().unwrap());
        }
    }
    indices.sort_unstable();
    assert_eq!(indices, (0..200).collect::<Vec<_>>());
    let snapshot = snapshot_from(&mut attach(&sandbox), last_step);
    let pinned = |range: std::ops::Range<usize>| {
        let flags = snapshot.particles()[range].iter().map(|one| one.flags);
        flags.filter(|flags| *flags == ParticleFlags::PINNED).count()
    };
    assert_eq!((pinned(0..100), pinned(100..300), pinned(300..400)), (0, 200, 0));
}

#[test]
fn two_hundred_short_lived_processes_pin_at_1_khz() {
    pin_by_200_processes("1000");
}

#[test]
fn two_hundred_short_lived_processes_pin_at_10_hz() {
    pin_by_200_processes("10");
}

#[test]
fn a_client_cannot_release_a_particle_that_ctl_grabbed() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain"]);
    ctl(&sandbox, &["grab", "90", "0", "0", "0"]);
    let mut client = attach(&sandbox);
    let outcome = client.request(Action::Release { particle: 90, force: false }, DEADLINE).unwrap();
    assert_eq!(outcome.reason_name(), "grabbed_by_other");
}

#[test]
fn a_run_with_a_duration_ends_and_reports_in_json() {
    let sandbox = Sandbox::new();
    let args =
        ["run", "rope", "--rate", "500", "--duration", "0.2s", "--as-fast-as-possible", "--json"];
    let summary = Process::run(Program::SimNode, &sandbox, &args).json();
    assert_eq!((summary["steps"].as_u64(), summary["rate_hz"].as_u64()), (Some(100), Some(500)));
    for key in [
        "threads",
        "real_time_factor",
        "late_steps",
        "solve_ns_p50",
        "solve_ns_p99",
        "wake_late_ns_p50",
    ] {
        assert!(summary[key].is_number(), "{key} in {summary}");
    }
    assert_eq!(summary["state_hash"].as_str().unwrap().len(), 16);
}

#[test]
fn ctrl_c_and_sigterm_end_a_node_cleanly() {
    for signal in [Signal::INT, Signal::TERM] {
        let sandbox = Sandbox::new();
        let mut node = node(&sandbox, &["run", "curtain"]);
        // It ends with the node.
        node.wait_for_thread("wake");
        node.signal(signal);
        let finished = node.wait();
        assert_eq!(finished.code, Some(0), "{}", finished.stderr);
        assert!(finished.stderr.contains("done: "), "{}", finished.stderr);
        let gone = Process::run(Program::SimNode, &sandbox, &["ctl", "status"]);
        assert_eq!(gone.code, Some(1));
    }
}
