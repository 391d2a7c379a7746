//! A link and an owner in one process: the owner says things in the order of each test.

use sim_contract::testing::TestDomain;
use sim_contract::{
    COMMANDS_BUFFERED, CollidersHeader, Command as Sent, ConstraintState, Load as OwnerLoad,
    LoadHeader, Outcome, Owner, ParticleState, SnapshotHeader, TearsHeader,
};

use super::*;
use crate::message::{Choice, Command, Mode};
use crate::pages::hub::Connection;
use crate::wire::{Message as Wire, decode};

const RUN_ID: u64 = 7;
const PAGE: u32 = 1;
const TARGET: [f32; 3] = [1.0, 2.0, 3.0];

/// An owner, a link to it, and a page. The domain goes last.
struct Site {
    link: Link,
    stage: Stage,
    hub: Hub,
    requests: Requests,
    page: Connection,
    owner: Owner,
    outcome_count: u64,
    _domain: TestDomain,
}

/// Two particles that a constraint joins, and a collider.
fn load(step: u64, topology_revision: u32) -> OwnerLoad<'static> {
    const STRUT: ConstraintState =
        ConstraintState { a: 0, b: 1, rest_length: 1.0, compliance: 0.0, kind: 0 };
    OwnerLoad {
        header: LoadHeader {
            run_id: RUN_ID,
            step,
            topology_revision,
            particle_count: 2,
            rate_hz: 60,
            ..LoadHeader::default()
        },
        scene: b"version = 1",
        constraints: &[STRUT],
        triangles: &[],
        collider_count: 1,
        keyframe_size_bytes_max: 8,
        parameters: sim_contract::ParameterValues::default(),
    }
}

impl Site {
    /// The first load is on show.
    fn start() -> Self {
        let domain = TestDomain::new();
        let owner = Owner::create(&domain.endpoint(), &load(0, 0)).unwrap();
        let link = Link::attach(&domain.endpoint()).unwrap();
        let (hub, requests) = Hub::new(Mode::Live);
        let page = hub.join(Choice::F32);
        let stage = Stage::default();
        let mut site =
            Self { link, stage, hub, requests, page, owner, outcome_count: 0, _domain: domain };
        site.owner.refresh();
        site.publish(0, 0, 2);
        site.read();
        assert_eq!(site.stage.epoch(), 1);
        site
    }

    /// Publishes a state of that load, of so many particles.
    fn publish(&self, step: u64, topology_revision: u32, particle_count: u32) {
        let header = SnapshotHeader {
            run_id: RUN_ID,
            step,
            topology_revision,
            particle_count,
            ..SnapshotHeader::default()
        };
        self.owner.publish_particles(&header, |_| ParticleState::default()).unwrap();
    }

    fn read(&mut self) {
        self.link.read(&mut self.stage, &self.hub).unwrap();
        self.link.due_ns = 0;
        self.link.show(&mut self.stage, &self.hub);
    }

    /// The radii of the colliders in the newest frame.
    fn radii(&self) -> Vec<f32> {
        let frame = self.page.frames.borrow();
        let Some(set) = &frame.colliders else { return Vec::new() };
        let Ok(Wire::Colliders(all)) = decode(&set.bytes) else { panic!("no colliders") };
        all.colliders.iter().map(|collider| collider.radius).collect()
    }

    fn command(&mut self, command: Command) {
        self.ask(Ask::Command { id: None, command });
    }

    fn ask(&mut self, ask: Ask) {
        self.link.take(Request { client: PAGE, ask }, &self.stage, &self.hub);
        self.link.dispatch.flush(&mut self.link.client, &self.hub);
    }

    /// What has arrived at the owner.
    fn arrived(&self) -> Vec<Sent> {
        let mut arrived = Vec::new();
        self.owner.receive_commands(&mut arrived);
        arrived
    }

    /// Answers that a command was applied.
    fn answer(&mut self, command: Sent) {
        let outcome = Outcome::new(self.outcome_count, 1, command, Ok(()));
        self.outcome_count += 1;
        self.owner.publish_outcome(&outcome).unwrap();
    }

    /// Answers a reset of somebody else.
    fn reset(&mut self) {
        self.answer(Sent::new(1, 1, Action::Reset));
    }
}

fn grab() -> Command {
    Command::DragBegin { particle: 1, target: TARGET, over_s: 0.0 }
}

fn pull() -> Command {
    Command::DragMove { particle: 1, target: TARGET, over_s: 0.0 }
}

fn actions(commands: &[Sent]) -> Vec<Action> {
    commands.iter().map(Sent::action).collect()
}

const MOVE: Action = Action::Move { particle: 1, target: TARGET, over_s: 0.0 };
const RELEASE: Action = Action::Release { particle: 1 };

#[test]
fn colliders_that_come_before_the_first_state_of_their_load_are_shown_with_it() {
    let mut site = Site::start();
    let collider = ColliderState { shape: 2, radius: 0.5, ..ColliderState::default() };
    site.owner.load(&load(1, 1)).unwrap();
    let header = CollidersHeader { run_id: RUN_ID, step: 1, ..CollidersHeader::default() };
    site.owner.publish_colliders(header, &[collider]).unwrap();
    site.read();
    assert_eq!((site.stage.epoch(), site.radii()), (1, vec![]));
    site.publish(1, 1, 2);
    site.read();
    assert_eq!((site.stage.epoch(), site.radii()), (2, vec![0.5]));
}

#[test]
fn tears_are_shown_with_the_state_that_they_are_of() {
    let mut site = Site::start();
    let header = TearsHeader { run_id: RUN_ID, step: 2, new_count: 1, ..TearsHeader::default() };
    site.owner
        .publish_tears(header, &[sim_contract::TornConstraint { constraint: 0, cause: 3 }])
        .unwrap();
    site.publish(1, 0, 2);
    site.read();
    assert!(site.stage.torn().is_empty());
    site.publish(2, 0, 2);
    site.read();
    assert_eq!(site.stage.torn(), [0]);
}

#[test]
fn a_state_of_another_size_is_not_shown_nor_measured() {
    let mut site = Site::start();
    let status = NodeStatus { run_id: RUN_ID, rate_hz: 60, time_scale: 1.0, ..Default::default() };
    site.owner.publish_status(&status).unwrap();
    site.publish(1, 0, 1);
    site.read();
    site.link.tell_statistics(&mut site.stage, &site.hub);
    assert_eq!(site.page.frames.borrow().particle_count, 2);
    // Nor does it begin a load.
    site.owner.load(&load(2, 1)).unwrap();
    site.publish(2, 1, 1);
    site.read();
    assert_eq!(site.stage.epoch(), 1);
    site.publish(3, 1, 2);
    site.read();
    assert_eq!(site.stage.epoch(), 2);
}

#[test]
fn a_grab_that_the_node_applies_after_a_reset_is_still_the_pages() {
    let mut site = Site::start();
    site.command(grab());
    site.command(pull());
    let sent = site.arrived();
    assert_eq!(sent.len(), 2);
    site.reset();
    site.read();
    site.command(pull());
    assert_eq!(actions(&site.arrived()), [MOVE]);
    site.answer(sent[0]);
    site.read();
    site.command(pull());
    assert_eq!(actions(&site.arrived()), [MOVE]);
    site.ask(Ask::Left);
    assert_eq!(actions(&site.arrived()), [RELEASE]);
}

#[test]
fn a_grab_that_the_node_applied_before_a_reset_has_ended() {
    let mut site = Site::start();
    site.command(grab());
    let sent = site.arrived();
    site.answer(sent[0]);
    site.reset();
    site.read();
    site.command(pull());
    site.ask(Ask::Left);
    assert!(site.arrived().is_empty());
}

#[test]
fn a_grab_of_a_page_that_left_before_a_reset_was_answered_is_let_go() {
    let mut site = Site::start();
    site.command(grab());
    site.reset();
    site.read();
    site.ask(Ask::Left);
    let sent = site.arrived();
    assert_eq!(actions(&sent)[1..], [RELEASE]);
}

#[test]
fn what_lets_go_is_sent_however_long_the_node_has_no_room_and_without_another_request() {
    let mut site = Site::start();
    site.command(grab());
    let sent = site.arrived();
    site.answer(sent[0]);
    site.read();
    for _ in 0..COMMANDS_BUFFERED {
        site.command(pull());
    }
    site.command(pull());
    site.command(Command::DragEnd { particle: 1 });
    site.link.dispatch.expire(&site.hub, u64::MAX);
    assert_eq!(actions(&site.arrived()), vec![MOVE; COMMANDS_BUFFERED]);
    while site.requests.next(Duration::ZERO).is_some() {}
    site.link.round(&mut site.stage, &site.hub, &site.requests).unwrap();
    assert_eq!(actions(&site.arrived()), [RELEASE]);
}
