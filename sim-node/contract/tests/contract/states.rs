//! A tap assembles states: each snapshot comes with the load, tears, colliders, parameters and
//! outcomes up to it. The owner acts in the test's own thread, so all messages have arrived when the
//! tap reads them.

use sim_contract::testing::TestDomain;
use sim_contract::{Action, Change, Command, Outcome, Tap, TearCause, TornConstraint, Update};

use crate::support::{
    PARTICLE_COUNT, RUN_ID, SCENE, bends, colliders, constraints, create_owner, parameters,
    particle, publish_everything, publish_step, triangles,
};

const CUT: TornConstraint = TornConstraint { constraint: 2, cause: TearCause::Cut as u32 };

#[test]
fn a_state_contains_all_messages_up_to_it() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let mut tap = Tap::attach(&domain.endpoint()).unwrap();
    owner.refresh();
    publish_step(&owner, 0);
    let command = Command::new(3, 0, Action::Pin { particle: 1 });
    let outcome = Outcome { run_id: RUN_ID, ..Outcome::new(0, 5, command, Ok(())) };
    owner.publish_outcome(&outcome).unwrap();
    publish_everything(&owner, 5);

    let first = tap.next_state(|_| {}).unwrap();
    assert_eq!((first.header.step, first.particles.len()), (0, PARTICLE_COUNT as usize));
    assert_eq!(first.load.scene, SCENE.as_bytes());
    assert_eq!(first.load.constraints, constraints());
    assert_eq!(first.load.bends, bends());
    assert_eq!(first.load.triangles, triangles());
    assert!(first.torn.constraints.is_empty() && first.colliders.colliders.is_empty());
    assert_eq!(first.parameters.values, parameters(0));
    assert_eq!(first.changes[0], Change::Load);

    let second = tap.next_state(|_| {}).unwrap();
    assert_eq!((second.header.step, second.particles[3]), (5, particle(5, 3)));
    assert_eq!(second.torn.constraints, [CUT]);
    assert_eq!(
        (second.colliders.header.step, &second.colliders.colliders[..]),
        (5, &colliders(5)[..])
    );
    assert_eq!(
        (second.parameters.header.step, second.parameters.values.clone()),
        (5, parameters(5))
    );
    assert!(second.changes.contains(&Change::Outcome(outcome)));
    assert!(tap.next_state(|_| {}).is_none());
    assert!(tap.drain_errors().is_empty());
}

#[test]
fn outcomes_of_a_paused_node_arrive_at_once_and_belong_to_its_next_state() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let mut tap = Tap::attach(&domain.endpoint()).unwrap();
    owner.refresh();
    let command = Command::new(3, 0, Action::Pause);
    let outcome = Outcome { run_id: RUN_ID, ..Outcome::new(0, 1, command, Ok(())) };
    owner.publish_outcome(&outcome).unwrap();
    let mut outcomes = Vec::new();
    let state = tap.next_state(|message| {
        if let Update::Outcome(outcome) = message {
            outcomes.push(**outcome);
        }
    });
    assert!(state.is_none());
    assert_eq!(outcomes, [outcome]);
    publish_step(&owner, 1);
    let state = tap.latest_state(|_| {}).unwrap();
    assert!(state.changes.contains(&Change::Outcome(outcome)));
}

#[test]
fn the_newest_state_contains_the_changes_of_skipped_states() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let mut tap = Tap::attach(&domain.endpoint()).unwrap();
    owner.refresh();
    let publish = |step| {
        owner.publish_parameters(RUN_ID, step, &parameters(step)).unwrap();
        publish_step(&owner, step);
    };
    (1..=3).for_each(publish);
    let state = tap.latest_state(|_| {}).unwrap();
    assert_eq!((state.header.step, state.parameters.values.clone()), (3, parameters(3)));
    let steps = state.changes.iter().filter_map(|change| match change {
        Change::Parameters(header, _) => Some(header.step),
        _ => None,
    });
    assert_eq!(steps.collect::<Vec<_>>(), [0, 1, 2, 3]);
}
