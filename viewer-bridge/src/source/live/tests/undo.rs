//! Undoing: what the bridge sends to the node, and what it answers.

use serde_json::Value;
use sim_contract::{
    Action, KeyframeHeader, Load as OwnerLoad, Outcome, Parameter, ParticleState, Reason,
    ReceivedState, RestoreContents, SnapshotHeader, Text,
};
use sim_solver::{Pose, Scene, Solver, builtin};

use super::{Fixture, RELEASE, RUN_ID, Sent, load, newest_text};
use crate::limits::UNDO_MAX;
use crate::message::{Brush, Command, CommandKind};
use crate::request::{ClientId, RequestKind};

/// A program beside the bridge.
const OTHER: u64 = 1;
const RESET: Action = Action::Reset;

fn load_rope() -> Action {
    Action::Load { scene: Text::cut("rope") }
}

fn rewind(to_step: u64) -> Action {
    Action::Rewind { to_step: Some(to_step), back_steps: None }
}

fn cut(stroke: u32) -> Command {
    let kind = CommandKind::CutConstraints { epoch: 1, constraints: vec![0] };
    Command { stroke: Some(stroke), ..Command::new(kind) }
}

/// A load with a scene that the catalog has.
fn named(name: &str, step: u64, topology_revision: u32) -> OwnerLoad<'static> {
    let scene: &[u8] = match name {
        "rope" => b"version = 1\nname = \"rope\"",
        _ => b"version = 1\nname = \"curtain\"",
    };
    OwnerLoad { scene, ..load(step, topology_revision) }
}

fn keyframe() -> Vec<u8> {
    let scene = Scene::from_toml(builtin::text("pendulum").unwrap(), "pendulum").unwrap();
    Solver::new(&scene).keyframe().encode()
}

/// A keyframe of step 1, in which a collider is on its way for a minute.
fn keyframe_in_motion() -> Vec<u8> {
    let scene = Scene::from_toml(builtin::text("drape").unwrap(), "drape").unwrap();
    let mut solver = Solver::new(&scene);
    let pose = Pose { translation: [0.0, 0.1, 0.0], rotation: [0.0, 0.0, 0.0, 1.0] };
    solver.move_collider_over(0, pose, 60.0).unwrap();
    solver.step();
    solver.keyframe().encode()
}

impl Fixture {
    /// Shows a load of a named scene, whose step has a keyframe.
    fn begin(&mut self, name: &str, step: u64, topology_revision: u32) {
        self.begin_with(name, step, topology_revision, &keyframe());
    }

    fn begin_with(&mut self, name: &str, step: u64, topology_revision: u32, keyframe: &[u8]) {
        self.owner.load(&named(name, step, topology_revision)).unwrap();
        let header = KeyframeHeader { run_id: RUN_ID, step, ..KeyframeHeader::default() };
        self.owner.publish_keyframe(header, keyframe).unwrap();
        self.publish_kept(step, topology_revision, step);
        self.read();
    }

    /// Publishes a state whose newest keyframe is that of `keyframe_step`.
    fn publish_kept(&self, step: u64, topology_revision: u32, keyframe_step: u64) {
        let header = SnapshotHeader {
            run_id: RUN_ID,
            step,
            scene_step: step,
            topology_revision,
            keyframe_step,
            particle_count: 2,
            ..SnapshotHeader::default()
        };
        let at = |index: usize| ParticleState {
            position: [step as f32, index as f32, 0.0],
            ..ParticleState::default()
        };
        self.owner.publish_particles(&header, at).unwrap();
    }

    fn ask(&mut self, id: u32, command: Command) {
        self.request(RequestKind::Command(Command { id: Some(id), ..command }));
    }

    fn undo(&mut self, takes_others: bool) {
        self.ask(99, Command::new(CommandKind::Undo { takes_others }));
    }

    /// Publishes an outcome.
    fn outcome(&mut self, step: u64, command: Sent, result: Result<(), Reason>) {
        let outcome = Outcome::new(self.outcome_count, step, command, result);
        self.outcome_count += 1;
        self.owner.publish_outcome(&outcome).unwrap();
        self.read();
    }

    /// An action of the page is applied at a step.
    fn act(&mut self, action: Action, step: u64) {
        self.change(Command::new(action), step);
    }

    /// The page does something that is applied at a step.
    fn change(&mut self, command: Command, step: u64) {
        self.ask(1, command);
        let sent = self.arrived();
        assert_eq!(sent.len(), 1);
        self.outcome(step, sent[0], Ok(()));
    }

    /// Another program does something.
    fn change_of_other(&mut self, action: Action, step: u64) {
        self.outcome(step, Sent::new(OTHER, 1, action), Ok(()));
    }

    /// Answers the only command that has arrived.
    fn answer_undo(&mut self, expected: Action, step: u64, result: Result<(), Reason>) {
        let sent = self.arrived();
        assert_eq!(sent.iter().map(Sent::action).collect::<Vec<_>>(), [expected]);
        self.outcome(step, sent[0], result);
    }

    /// The state that the bridge gives to the node. It is applied.
    fn given_state(&mut self, step: u64) -> ReceivedState {
        let mut states = Vec::new();
        self.owner.receive_states(&mut states);
        assert_eq!(states.len(), 1);
        let (received, state) = states.pop().unwrap();
        let Sent { client_id, sequence, .. } = received.command;
        let action = Action::Restore { contents: RestoreContents::State, state_hash: 5 };
        self.outcome(step, Sent::new(client_id, sequence, action), Ok(()));
        state.unwrap()
    }

    /// The answer to the last undo.
    fn answer_of_undo(&mut self) -> Value {
        let answer = newest_text(&mut self.page, "outcome").unwrap();
        assert_eq!((&answer["kind"], &answer["id"]), (&"undo".into(), &99.into()));
        answer
    }

    /// The refusal of the last undo.
    fn refusal(&mut self) -> String {
        let answer = self.answer_of_undo();
        assert_eq!(answer["status"], "rejected");
        answer["reason"].as_str().unwrap().to_owned()
    }

    fn undoable(&mut self) -> Value {
        newest_text(&mut self.page, "undoable").unwrap()["what"].clone()
    }
}

#[test]
fn a_cut_is_undone_by_a_rewind_to_the_last_step_without_it() {
    let mut fixture = Fixture::start();
    fixture.change(cut(1), 500);
    assert_eq!(fixture.undoable(), "cut");
    fixture.undo(false);
    fixture.answer_undo(rewind(499), 620, Ok(()));
    let answer = fixture.answer_of_undo();
    assert_eq!((&answer["status"], &answer["text"]), (&"applied".into(), &"Undid the cut.".into()));
    assert_eq!((&answer["step"], &answer["state_step"]), (&620.into(), &499.into()));
    fixture.undo(false);
    assert_eq!(fixture.refusal(), "nothing_to_undo");
}

#[test]
fn the_cuts_of_a_stroke_are_undone_together_and_several_changes_one_after_another() {
    let mut fixture = Fixture::start();
    fixture.act(RESET, 100);
    for step in [200, 204, 209] {
        fixture.change(cut(1), step);
    }
    fixture.change(cut(2), 300);
    for (to_step, step, left) in [(299, 400, "cut"), (199, 401, "reset")] {
        fixture.undo(false);
        fixture.answer_undo(rewind(to_step), step, Ok(()));
        assert_eq!(fixture.undoable(), left);
    }
    fixture.undo(false);
    fixture.answer_undo(rewind(99), 402, Ok(()));
    assert_eq!(fixture.undoable(), Value::Null);
}

#[test]
fn drags_and_pins_are_undone_one_after_another() {
    let mut fixture = Fixture::start();
    let target = [0.0; 3];
    fixture.act(load_rope(), 90);
    fixture.act(Action::Grab { particle: 1, target, over_s: 0.1 }, 100);
    fixture.act(Action::Move { particle: 1, target, over_s: 0.1 }, 110);
    fixture.act(RELEASE, 120);
    fixture.act(Action::Pin { particle: 0 }, 200);
    fixture.act(Action::Unpin { particle: 0 }, 300);
    for (to_step, left) in [(299, "pin"), (199, "drag"), (99, "load")] {
        fixture.undo(false);
        fixture.answer_undo(rewind(to_step), 400, Ok(()));
        assert_eq!(fixture.undoable(), left);
    }
}

#[test]
fn the_motion_of_a_slider_is_undone_as_a_whole_but_never_the_pace() {
    let mut fixture = Fixture::start();
    let set = |parameter: Parameter, value: f32, stroke| {
        let set = Action::set(parameter.name(), value);
        Command { stroke: Some(stroke), ..Command::new(set) }
    };
    fixture.act(RESET, 100);
    for (step, damping) in [(200, 0.2), (204, 0.3), (209, 0.4)] {
        fixture.change(set(Parameter::Damping, damping, 2), step);
    }
    fixture.change(set(Parameter::TimeScale, 0.5, 3), 300);
    assert_eq!(fixture.undoable(), "set");
    fixture.undo(false);
    fixture.answer_undo(rewind(199), 400, Ok(()));
    assert_eq!(fixture.undoable(), "reset");
}

#[test]
fn a_stroke_of_the_brush_is_undone_as_a_whole_and_apart_from_a_cut() {
    let mut fixture = Fixture::start();
    let brush = Brush {
        eye: [0.0, 0.0, 5.0],
        ray: [0.0, 0.0, -1.0],
        radius: 1.0,
        delta: [0.1, 0.0, 0.0],
        over_s: 0.1,
        cap: None,
    };
    let brush =
        |stroke| Command { stroke: Some(stroke), ..Command::new(CommandKind::Brush(brush)) };
    fixture.change(brush(1), 100);
    fixture.change(brush(1), 105);
    fixture.change(cut(1), 200);
    fixture.change(brush(1), 300);
    for (to_step, left) in [(299, "cut"), (199, "brush")] {
        fixture.undo(false);
        fixture.answer_undo(rewind(to_step), 400, Ok(()));
        assert_eq!(fixture.undoable(), left);
    }
    fixture.undo(false);
    fixture.answer_undo(rewind(99), 401, Ok(()));
    assert_eq!(fixture.undoable(), Value::Null);
}

#[test]
fn a_state_of_another_step_and_changes_of_the_same_pause_are_named() {
    let mut fixture = Fixture::start();
    fixture.act(Action::Pin { particle: 1 }, 50);
    fixture.change(cut(1), 50);
    fixture.undo(false);
    let sent = fixture.arrived();
    // The node keeps an earlier step, and names it.
    let Sent { client_id, sequence, .. } = sent[0];
    fixture.outcome(51, Sent::new(client_id, sequence, rewind(48)), Ok(()));
    let text = fixture.answer_of_undo()["text"].as_str().unwrap().to_owned();
    assert!(text.contains("1 earlier change of the same pause"), "{text}");
    assert!(text.contains("no longer keeps step 49") && text.contains("step 48"), "{text}");
}

#[test]
fn what_others_have_changed_since_is_not_taken_back_unasked() {
    let mut fixture = Fixture::start();
    fixture.change(cut(1), 100);
    // A pause changes nothing.
    fixture.change_of_other(Action::Pause, 110);
    fixture.change_of_other(Action::Pin { particle: 0 }, 120);
    fixture.undo(false);
    let answer = fixture.answer_of_undo();
    assert_eq!(answer["reason"], "changed_by_others");
    assert!(answer["text"].as_str().unwrap().contains("1 change since"));
    assert!(fixture.arrived().is_empty());
    fixture.undo(true);
    fixture.answer_undo(rewind(99), 130, Ok(()));
    assert_eq!(fixture.answer_of_undo()["status"], "applied");
}

#[test]
fn a_page_undoes_its_own_changes_only_and_loses_them_with_its_connection() {
    let mut fixture = Fixture::start();
    fixture.change_of_other(RESET, 10);
    fixture.undo(false);
    assert_eq!(fixture.refusal(), "nothing_to_undo");
    fixture.act(RESET, 20);
    let reader = RequestKind::Command(Command {
        id: Some(3),
        ..Command::new(CommandKind::Undo { takes_others: true })
    });
    let request = crate::request::Request { client: ClientId::Page(2), kind: reader };
    fixture.link.handle(request, &fixture.shown, &fixture.sinks);
    assert!(fixture.arrived().is_empty());
    fixture.request(RequestKind::Left);
    fixture.undo(true);
    assert_eq!(fixture.refusal(), "nothing_to_undo");
}

#[test]
fn a_load_is_undone_by_the_former_scene_and_its_state() {
    let mut fixture = Fixture::start();
    fixture.begin("curtain", 10, 1);
    // Between two keyframes only the step of the scene changes.
    fixture.publish_kept(25, 1, 10);
    fixture.read();
    fixture.act(load_rope(), 30);
    fixture.begin("rope", 30, 2);
    fixture.undo(false);
    let scene = Text::new("curtain").unwrap();
    fixture.answer_undo(Action::Load { scene }, 40, Ok(()));
    fixture.begin("curtain", 40, 3);
    let state = fixture.given_state(41);
    assert_eq!(state.particles[1].position, [25.0, 1.0, 0.0]);
    let given = sim_solver::Keyframe::decode(&state.keyframe.unwrap()).unwrap();
    let read = sim_solver::Keyframe::decode(&keyframe()).unwrap();
    assert_eq!(given.encode(), read.at_scene_step(25).encode());
    assert_eq!(fixture.answer_of_undo()["text"], "Undid the load of another scene.");
}

#[test]
fn a_state_on_the_way_of_a_collider_is_not_completed_by_an_earlier_keyframe() {
    let mut fixture = Fixture::start();
    fixture.begin_with("curtain", 1, 1, &keyframe_in_motion());
    fixture.publish_kept(25, 1, 1);
    fixture.read();
    fixture.act(load_rope(), 30);
    fixture.begin("rope", 30, 2);
    fixture.undo(false);
    assert!(fixture.arrived().is_empty(), "the collider would be elsewhere");
}

#[test]
fn changes_before_a_load_are_undone_after_it_although_the_node_forgot_them() {
    let mut fixture = Fixture::start();
    fixture.begin("curtain", 10, 1);
    let epoch = fixture.shown.epoch();
    let kind = CommandKind::CutConstraints { epoch, constraints: vec![0] };
    fixture.change(Command { stroke: Some(1), ..Command::new(kind) }, 11);
    fixture.publish_kept(12, 1, 10);
    fixture.read();
    fixture.act(load_rope(), 13);
    fixture.begin("rope", 13, 2);
    fixture.undo(false);
    fixture.answer_undo(Action::Load { scene: Text::new("curtain").unwrap() }, 14, Ok(()));
    fixture.begin("curtain", 14, 3);
    assert_eq!(fixture.given_state(15).particles[0].position[0], 12.0);
    // The scene of the cut runs again: its state needs no load.
    fixture.undo(false);
    assert!(fixture.arrived().is_empty());
    assert_eq!(fixture.given_state(16).particles[0].position[0], 10.0);
    assert_eq!(fixture.answer_of_undo()["text"], "Undid the cut.");
}

#[test]
fn a_step_that_the_node_does_not_keep_is_restored_from_the_bridge() {
    let mut fixture = Fixture::start();
    fixture.begin("curtain", 10, 1);
    fixture.act(RESET, 11);
    fixture.undo(false);
    fixture.answer_undo(rewind(10), 12, Err(Reason::UnknownStep));
    assert_eq!(fixture.given_state(13).particles[0].position[0], 10.0);
    assert_eq!(fixture.answer_of_undo()["status"], "applied");
}

#[test]
fn an_undo_that_cannot_be_exact_is_refused_with_the_cure() {
    // Without a keyframe, the state is not complete.
    let mut fixture = Fixture::start();
    fixture.act(RESET, 11);
    fixture.undo(false);
    fixture.answer_undo(rewind(10), 12, Err(Reason::NoEffectHere));
    let answer = fixture.answer_of_undo();
    assert_eq!(answer["reason"], "state_not_kept");
    assert!(answer["text"].as_str().unwrap().contains("--history"));

    // The first scene of the fixture has no name.
    let mut fixture = Fixture::start();
    let header = KeyframeHeader { run_id: RUN_ID, step: 0, ..KeyframeHeader::default() };
    fixture.owner.publish_keyframe(header, &keyframe()).unwrap();
    fixture.publish(1, 0, 2);
    fixture.read();
    fixture.act(load_rope(), 2);
    fixture.begin("rope", 2, 1);
    fixture.undo(false);
    assert_eq!(fixture.refusal(), "scene_not_known");

    // The file of the scene has another content by now.
    let mut fixture = Fixture::start();
    fixture.begin("curtain", 10, 1);
    fixture.act(load_rope(), 11);
    fixture.begin("rope", 11, 2);
    fixture.undo(false);
    fixture.answer_undo(Action::Load { scene: Text::new("curtain").unwrap() }, 12, Ok(()));
    fixture.begin("rope", 12, 3);
    assert_eq!(fixture.refusal(), "scene_changed");
}

#[test]
fn the_number_of_changes_is_bounded() {
    let mut fixture = Fixture::start();
    let count = UNDO_MAX as u64 + 5;
    for step in 1..=count {
        fixture.act(RESET, step);
    }
    for undone in 0..UNDO_MAX as u64 {
        fixture.undo(false);
        fixture.answer_undo(rewind(count - undone - 1), 1000 + undone, Ok(()));
        assert_eq!(fixture.answer_of_undo()["status"], "applied");
    }
    fixture.undo(false);
    assert_eq!(fixture.refusal(), "nothing_to_undo");
}

#[test]
fn a_grabbed_particle_leaves_no_grab_behind() {
    let mut fixture = Fixture::start();
    fixture.begin("curtain", 10, 1);
    let mut solver =
        Solver::new(&Scene::from_toml(builtin::text("pendulum").unwrap(), "pendulum").unwrap());
    let grab = Action::Grab { particle: 1, target: [0.0; 3], over_s: 0.1 };
    solver.apply(3, &grab).unwrap();
    solver.finish_boundary();
    solver.step();
    let header = KeyframeHeader { run_id: RUN_ID, step: 11, ..KeyframeHeader::default() };
    fixture.owner.publish_keyframe(header, &solver.keyframe().encode()).unwrap();
    fixture.publish_kept(11, 1, 11);
    fixture.read();
    fixture.act(load_rope(), 12);
    fixture.begin("rope", 12, 2);
    fixture.undo(false);
    assert_eq!(fixture.refusal(), "state_not_kept");
}
