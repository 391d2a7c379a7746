//! `recorder play` on a terminal obeys keys, and restores the terminal at every end and stop.

use integration_tests::{DEADLINE, Process, Program, Sandbox, Signal, wait_for};
use rustix::process::{Pid, kill_process};
use sim_contract::{Client, NodeStatus};

/// Steps of the recording, at 240 Hz: 10 s.
const STEPS: &str = "2400";

fn recording(sandbox: &Sandbox) -> String {
    let file = sandbox.path("run.mcap");
    let args = ["simulate", "rope", "--steps", STEPS, "-o", &file];
    Process::run(Program::Recorder, sandbox, &args).success();
    file
}

/// Plays a recording on a terminal, within a script, until the services are there.
fn play(sandbox: &Sandbox, script: &str, more: &[&str]) -> (Process, Client) {
    let file = recording(sandbox);
    let args: Vec<_> = ["play", &file].iter().chain(more).copied().collect();
    let player = Process::start_on_terminal(script, Program::Recorder, sandbox, &args);
    wait_for("the replay", || player.has_written_part("ready playing").then_some(()));
    (player, Client::attach(&sandbox.endpoint()).unwrap())
}

/// Waits for a status.
fn status(client: &mut Client, what: &str, matches: impl Fn(&NodeStatus) -> bool) {
    wait_for(what, || {
        client.status(DEADLINE).unwrap().filter(|status| matches(status)).map(|_| ())
    });
}

/// Sends a signal to the replay, which is a child of the shell.
fn send(client: &mut Client, signal: Signal) {
    let id = client.status(DEADLINE).unwrap().unwrap().process_id;
    kill_process(Pid::from_raw(id.cast_signed()).unwrap(), signal).unwrap();
}

/// Returns the modes that the script has printed with `stty -g`, perhaps behind the line of the replay.
fn modes(output: &str) -> Vec<&str> {
    let lines = output.lines().filter_map(|line| line.trim().rsplit_once("modes "));
    lines.map(|(_, modes)| modes).collect()
}

#[test]
fn keys_pause_step_jump_and_change_the_rate() {
    let sandbox = Sandbox::new();
    let script = r#"echo modes $(stty -g); "$0" "$@"; echo code $?; echo modes $(stty -g)"#;
    let (mut player, mut client) = play(&sandbox, script, &["--paused"]);
    for (keys, step) in [
        ("5", 1200),
        (".", 1201),
        (",", 1200),
        (",", 1199),
        // Arrows, in the two forms that terminals send: 1 s.
        ("\x1b[C", 1439),
        ("\x1bOD", 1199),
        ("0", 0),
        // Before the first snapshot is nothing.
        (",", 0),
        ("9..", 2162),
        ("\x1b[C", 2400),
    ] {
        player.press(keys);
        let what = format!("step {step} after {keys:?}");
        status(&mut client, &what, |status| status.step == step && status.is_paused());
    }
    player.press("\x1b[A");
    status(&mut client, "twice the rate", |status| status.time_scale == 2.0);
    player.press("\x1b[B\x1b[B");
    status(&mut client, "half the rate", |status| status.time_scale == 0.5);
    player.press("0 ");
    status(&mut client, "a moving replay", |status| !status.is_paused() && status.step > 0);
    player.press(" ");
    status(&mut client, "a pause", NodeStatus::is_paused);
    player.press("q");
    let output = player.wait().stderr;
    assert!(output.contains("code 0"), "{output}");
    assert!(output.contains(" s of 10.00 s, step 2400, rate 0.5, paused"), "{output}");
    let modes = modes(&output);
    assert_eq!((modes.len(), modes.first()), (2, modes.last()), "{output}");
}

#[test]
fn every_end_restores_the_terminal() {
    // Ctrl-C sends its signal as in any program.
    for signal in [None, Some(Signal::TERM), Some(Signal::HUP)] {
        let sandbox = Sandbox::new();
        let script = r#"echo modes $(stty -g); "$0" "$@"; echo code $?; echo modes $(stty -g)"#;
        let (mut player, mut client) = play(&sandbox, script, &["--loop"]);
        match signal {
            None => player.press("\x03"),
            Some(signal) => send(&mut client, signal),
        }
        let output = player.wait().stderr;
        assert!(output.contains("code 0"), "{signal:?}: {output}");
        let modes = modes(&output);
        assert_eq!((modes.len(), modes.first()), (2, modes.last()), "{signal:?}: {output}");
    }
}

#[test]
fn ctrl_z_stops_with_a_restored_terminal_and_the_keys_work_again_afterwards() {
    let sandbox = Sandbox::new();
    let script =
        r#"echo modes $(stty -g); "$0" "$@"; echo modes $(stty -g); fg; echo modes $(stty -g)"#;
    let (mut player, mut client) = play(&sandbox, script, &["--paused"]);
    player.press("\x1a");
    wait_for("the restored modes", || {
        // After those before the start.
        (player.text().matches("modes ").count() > 1).then_some(())
    });
    wait_for("the keys", || {
        player.press("5");
        let status = client.status(DEADLINE).unwrap()?;
        (status.step == 1200).then_some(())
    });
    player.press("q");
    let output = player.wait().stderr;
    let modes = modes(&output);
    assert_eq!(modes.len(), 3, "{output}");
    assert!(modes.iter().all(|one| *one == modes[0]), "{output}");
}

#[test]
fn a_replay_in_the_background_leaves_the_terminal_alone_and_plays_on() {
    let sandbox = Sandbox::new();
    let script = r#"echo modes $(stty -g); "$0" "$@" & echo modes $(stty -g); wait; echo code $?"#;
    let (mut player, mut client) = play(&sandbox, script, &["--loop"]);
    status(&mut client, "a later step", |status| status.step > 100);
    // A key goes to the shell, which does not read.
    player.press(" ");
    let first = client.next_snapshot(DEADLINE).unwrap().unwrap().header().step;
    wait_for("another step", || {
        (client.next_snapshot(DEADLINE).unwrap()?.header().step != first).then_some(())
    });
    send(&mut client, Signal::INT);
    let output = player.wait().stderr;
    let modes = modes(&output);
    assert_eq!((modes.len(), modes.first()), (2, modes.last()), "{output}");
    assert!(output.contains("code 0"), "{output}");
}
