//! Commands that change every constraint of a large scene, or the distance of its contacts. They are prepared beside the loop, and their
//! recording verifies.

use integration_tests::{DEADLINE, Process, Program, Sandbox, ctl, record, wait_for};
use sim_contract::{Action, Client, ParameterValue};

/// Keys of `[solver]` for a scene whose paths change with the compliance.
const TETHERS: &str = "tethers = true";
/// Keys for a scene whose particles touch each other.
const CONTACTS: &str = "[contact]\nmode = \"particles\"";

fn large_scene(sandbox: &Sandbox, columns: u32, keys: &str) -> String {
    let text = format!(
        "version = 1\n[solver]\nrate_hz = 240\n{keys}\n[[generate]]\nshape = \"cloth\"\n\
         columns = {columns}\nrows = {columns}\nspacing = 0.01\nmass = 0.01\n"
    );
    sandbox.write("large.toml", &text)
}

fn set(parameter: &str, value: f32) -> Action {
    let value = ParameterValue::Number(value);
    Action::set(parameter, value)
}

#[test]
fn a_set_of_a_large_scene_is_prepared_beside_the_loop_and_only_its_client_waits() {
    assert_is_prepared(TETHERS, "compliance", 1e-6);
    assert_is_prepared(CONTACTS, "contact.thickness", 5e-3);
}

/// Sets a parameter of a large scene with these keys, again and again, beginning with a value, until another client
/// has had answers meanwhile.
fn assert_is_prepared(keys: &str, parameter: &str, first: f32) {
    let sandbox = Sandbox::new();
    let scene = large_scene(&sandbox, 200, keys);
    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", &scene]);
    let mut setter = Client::attach_as(&sandbox.endpoint(), 7).unwrap();
    let mut other = Client::attach_as(&sandbox.endpoint(), 8).unwrap();
    let mut value = first;
    // Two answers, because one could be of the poll that received the command. The work may also end
    // before they come.
    wait_for("two answers during the work", || {
        value = if value < 3.0 * first { 1.1 * value } else { first };
        setter.send(set(parameter, value)).unwrap();
        setter.send(Action::Pin { particle: 1 }).unwrap();
        let answers =
            [0; 3].map(|_| other.request(Action::Pin { particle: 20 }, DEADLINE).unwrap().index);
        let set = setter.next_outcome(DEADLINE).unwrap().unwrap();
        let pin = setter.next_outcome(DEADLINE).unwrap().unwrap();
        assert!(set.is_applied() && pin.is_applied(), "{set:?} {pin:?}");
        assert!(set.index < pin.index, "the commands of a client keep their order");
        let shown = &ctl(&sandbox, &["get"])[parameter];
        let shown = shown.as_f64().or(shown["structural"].as_f64()).unwrap();
        assert!((shown - f64::from(value)).abs() < 1e-9, "{shown} {value}");
        (answers[1] < set.index).then_some(())
    });
    node.interrupt().success();
}

#[test]
fn a_recording_of_prepared_commands_verifies() {
    assert_verifies(TETHERS, "compliance", 1e-6);
    assert_verifies(CONTACTS, "contact.thickness", 1e-3);
}

/// Records settings of a parameter, multiples of a unit, in a scene with these keys.
fn assert_verifies(keys: &str, parameter: &str, unit: f32) {
    let sandbox = Sandbox::new();
    let (scene, file) = (large_scene(&sandbox, 50, keys), sandbox.path("prepared.mcap"));
    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", &scene]);
    let recording = record(&sandbox, &file);
    let mut clients = [3, 4].map(|id| Client::attach_as(&sandbox.endpoint(), id).unwrap());
    let state = sandbox.path("state.mcap");
    for round in 0_u16..12 {
        // Both are under way at once, with cuts and pins between a plan and its command.
        let [first, second] = &mut clients;
        first.send(set(parameter, unit * f32::from(round))).unwrap();
        first.send(Action::Pin { particle: u32::from(round) * 31 }).unwrap();
        second.send(set(parameter, unit / 2.0 * f32::from(round))).unwrap();
        second.send(Action::CutRadius { center: [0.2, -0.2, 0.0], radius: 0.05 }).unwrap();
        if round % 3 == 1 {
            first.send(Action::Rewind { to_step: None, back_steps: Some(20) }).unwrap();
            second.send(Action::Reset).unwrap();
        }
        if round == 4 {
            Process::run(Program::Recorder, &sandbox, &["state", "-o", &state]).success();
        }
        if round % 4 == 3 && round > 4 {
            Process::run(Program::Recorder, &sandbox, &["restore", &state]).success();
        }
        let count = if round % 3 == 1 { 3 } else { 2 };
        for client in &mut clients {
            for _ in 0..count {
                client.next_outcome(DEADLINE).unwrap().unwrap();
            }
        }
    }
    recording.interrupt().recorded();
    node.interrupt().success();
    let verified = Process::run(Program::Recorder, &sandbox, &["verify", &file]).success();
    assert!(verified.contains("bit-identical"), "{verified}");
}
