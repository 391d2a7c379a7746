//! Carrying: the moves that the bridge sends, and their order among other commands.

use sim_contract::{Action, ColliderState, CollidersHeader, Load as OwnerLoad, Text};

use super::{Fixture, PAGE, RUN_ID, actions, load, newest_text};
use crate::message::{Command, CommandKind, ObjectKind};
use crate::request::{ClientId, Request, RequestKind};

/// A scene whose collider is where the node shows it.
const BALL: &[u8] =
    b"version = 1\n[[collider]]\nshape = 'sphere'\ncenter = [0, 0, 0]\nradius = 0.5\n";

/// A fixture in which the page has thrown the ball, and the node has the first move.
fn thrown() -> Fixture {
    let mut fixture = Fixture::start();
    fixture.owner.load(&OwnerLoad { scene: BALL, ..load(1, 1) }).unwrap();
    let collider = ColliderState { shape: 2, radius: 0.5, ..ColliderState::default() };
    let header = CollidersHeader { run_id: RUN_ID, step: 1, ..CollidersHeader::default() };
    fixture.owner.publish_colliders(header, &[collider]).unwrap();
    fixture.publish(1, 1, 2);
    fixture.read();
    let epoch = fixture.shown.epoch();
    let (object, index) = (ObjectKind::Collider, 0);
    fixture.command(CommandKind::Lift { epoch, object, index });
    fixture.command(CommandKind::Throw { object, index, velocity: [1.0, 0.0, 0.0] });
    assert!(matches!(actions(&fixture.arrived())[..], [Action::MoveCollider { .. }]));
    fixture
}

/// The node goes on, and the bridge reads its state.
fn next(fixture: &mut Fixture, step: u64) -> Vec<Action> {
    fixture.publish(step, 1, 2);
    fixture.read();
    fixture.link.move_carried(&fixture.sinks);
    actions(&fixture.arrived())
}

#[test]
fn no_move_follows_a_reset_in_the_queue_of_the_node() {
    let mut fixture = thrown();
    assert!(matches!(next(&mut fixture, 2)[..], [Action::MoveCollider { .. }]));
    fixture.command(Action::Reset);
    // The node has not applied it yet.
    assert_eq!(next(&mut fixture, 3), [Action::Reset]);
    assert_eq!(next(&mut fixture, 4), []);
}

#[test]
fn an_undo_leads_to_the_state_before_the_object_was_lifted_and_ends_its_motion() {
    let mut fixture = thrown();
    assert!(matches!(next(&mut fixture, 2)[..], [Action::MoveCollider { .. }]));
    assert_eq!(newest_text(&mut fixture.page, "undoable").unwrap()["what"], "carry");
    fixture.command(CommandKind::Undo { takes_others: false });
    let to_step = Some(1);
    assert_eq!(next(&mut fixture, 3), [Action::Rewind { to_step, back_steps: None }]);
    assert_eq!(next(&mut fixture, 4), []);
}

#[test]
fn what_is_refused_at_once_ends_no_motion() {
    let nothing_to_undo = (ClientId::Page(2), CommandKind::Undo { takes_others: false });
    let unknown_scene = (PAGE, Action::Load { scene: Text::cut("no such scene") }.into());
    for (client, kind) in [nothing_to_undo, unknown_scene] {
        let mut fixture = thrown();
        let kind = RequestKind::Command(Command::new(kind));
        fixture.link.handle(Request { client, kind }, &fixture.shown, &fixture.sinks);
        assert!(matches!(next(&mut fixture, 2)[..], [Action::MoveCollider { .. }]));
    }
}
