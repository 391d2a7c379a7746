//! Forces are published while a client reads them: the newest, those of a snapshot, and those of the states of a
//! tap.

use std::time::Duration;

use sim_contract::testing::TestDomain;
use sim_contract::{
    Change, Client, ForceKind, ForceRow, Forces, ForcesHeader, Owner, SnapshotHeader, Tap, Update,
};

use crate::support::{DEADLINE, MOMENT, RUN_ID, create_owner, publish_step};

const RATE_HZ: u32 = 240;

/// Returns the rows of a step: a collider, an anchor and as many particles as there are.
fn rows(step: u64, particle_count: u32) -> Vec<ForceRow> {
    let row = |kind: ForceKind, index| ForceRow {
        kind: kind as u32,
        index,
        impulse: [step as f32, index as f32, 0.25],
        angular_impulse: [0.0, 0.5, step as f32],
        contacts: 3,
        spare: 0,
    };
    let particles = (0..particle_count).map(|index| row(ForceKind::Particle, 10 * index));
    [row(ForceKind::Collider, 0), row(ForceKind::Anchor, 0)].into_iter().chain(particles).collect()
}

fn publish_forces(owner: &Owner, step: u64, particle_count: u32) {
    let header = ForcesHeader { run_id: RUN_ID, step, rate_hz: RATE_HZ, count: 0 };
    owner.publish_forces(header, &rows(step, particle_count)).unwrap();
}

fn publish(owner: &Owner, step: u64) {
    publish_forces(owner, step, 2);
    publish_step(owner, step);
}

#[test]
fn forces_have_readers_only_while_a_client_reads_them() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let mut tap = Tap::attach(&domain.endpoint()).unwrap();
    let mut other = Client::attach(&domain.endpoint()).unwrap();
    other.status(MOMENT).unwrap();
    assert_eq!(owner.forces_reader_count(), 0, "nobody has asked for them");

    let mut client = Client::attach(&domain.endpoint()).unwrap();
    assert_eq!(client.forces(Duration::ZERO).unwrap(), None);
    assert!(owner.forces_reader_count() == 1 && owner.has_living_forces_reader());
    tap.read_forces().unwrap();
    assert_eq!(owner.forces_reader_count(), 2);
    drop((tap, client));
    assert!(owner.forces_reader_count() == 0 && !owner.has_living_forces_reader());
}

#[test]
fn a_client_reads_the_newest_forces_of_as_many_particles_as_are_fixed() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    assert_eq!(client.forces(Duration::ZERO).unwrap(), None);
    // More rows than before need another writer.
    for (step, particle_count) in [(1, 0), (2, 1), (3, 100), (4, 3), (5, 101)] {
        publish_forces(&owner, step - 1, particle_count);
        publish_forces(&owner, step, particle_count);
        let forces = client.forces(DEADLINE).unwrap().unwrap();
        let header =
            ForcesHeader { run_id: RUN_ID, step, count: particle_count + 2, rate_hz: RATE_HZ };
        assert_eq!(forces, Forces { header, rows: rows(step, particle_count) });
    }
    let forces = client.forces(Duration::ZERO).unwrap().unwrap();
    assert_eq!(forces.header.step, 5, "the newest stay");
    assert_eq!(forces.of_kind(ForceKind::Anchor).count(), 1);
    assert_eq!(forces.row(ForceKind::Particle, 11), None);
    let row = forces.row(ForceKind::Particle, 40).unwrap();
    assert_eq!(forces.force(row), [5.0 * 240.0, 40.0 * 240.0, 0.25 * 240.0]);
    assert_eq!(forces.torque(row), [0.0, 120.0, 5.0 * 240.0]);
}

#[test]
fn a_late_reader_receives_no_forces_of_an_earlier_one() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    assert_eq!(client.forces(Duration::ZERO).unwrap(), None);
    publish(&owner, 1);
    // While it reads, another one receives the latest.
    let mut second = Client::attach(&domain.endpoint()).unwrap();
    assert_eq!(second.forces(Duration::ZERO).unwrap(), None);
    owner.refresh();
    assert_eq!(second.forces(DEADLINE).unwrap().map(|forces| forces.header.step), Some(1));
    drop((client, second));
    owner.refresh();
    let mut late = Client::attach(&domain.endpoint()).unwrap();
    assert_eq!(late.forces(Duration::ZERO).unwrap(), None);
    owner.refresh();
    assert_eq!(late.forces(MOMENT).unwrap(), None);
}

fn step_of_forces(client: &mut Client, header: &SnapshotHeader) -> Option<u64> {
    client.forces_of(header, DEADLINE).unwrap().map(|forces| forces.header.step)
}

#[test]
fn a_snapshot_has_the_forces_of_its_step() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    assert!(client.next_snapshot(Duration::ZERO).unwrap().is_none());
    owner.refresh();
    publish_step(&owner, 0);
    let before = *client.next_snapshot(DEADLINE).unwrap().unwrap().header();
    assert_eq!(client.forces_of(&before, Duration::ZERO).unwrap(), None);
    for step in 1..=9 {
        publish(&owner, step);
    }
    // Forces of later steps have arrived, so this one does not wait.
    assert_eq!(client.forces_of(&before, DEADLINE).unwrap(), None);
    for step in 1..=3 {
        let header = *client.next_snapshot(DEADLINE).unwrap().unwrap().header();
        assert_eq!(step_of_forces(&mut client, &header), Some(step));
        assert_eq!(step_of_forces(&mut client, &header), Some(step), "as often as wanted");
    }
    let newest = *client.latest_snapshot(DEADLINE).unwrap().unwrap().header();
    assert_eq!((newest.step, step_of_forces(&mut client, &newest)), (9, Some(9)));
    let passed = SnapshotHeader { step: 4, ..newest };
    assert_eq!(step_of_forces(&mut client, &passed), None);
}

#[test]
fn the_states_of_a_tap_have_the_forces_of_their_steps_if_it_reads_them() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let (mut reader, mut other) =
        (Tap::attach(&domain.endpoint()).unwrap(), Tap::attach(&domain.endpoint()).unwrap());
    reader.read_forces().unwrap();
    owner.refresh();
    publish_step(&owner, 0);
    for step in 1..=3 {
        publish(&owner, step);
    }
    let steps_of = |tap: &mut Tap| {
        let mut steps = Vec::new();
        let mut message_count = 0;
        let count = |update: &Update<'_>| match update {
            Update::Forces(..) => 1,
            _ => 0,
        };
        while let Some(state) = tap.next_state(|update| message_count += count(update)) {
            let forces = state.changes.iter().filter_map(|change| match change {
                Change::Forces(header, rows) => Some((header.step, rows.len())),
                _ => None,
            });
            steps.push((state.header.step, forces.collect::<Vec<_>>()));
        }
        (message_count, steps)
    };
    let with_forces = (1..=3).map(|step| (step, vec![(step, 4)]));
    let expected: Vec<_> = [(0, vec![])].into_iter().chain(with_forces).collect();
    assert_eq!(steps_of(&mut reader), (3, expected));
    assert_eq!(steps_of(&mut other), (0, (0..=3).map(|step| (step, vec![])).collect()));
}
