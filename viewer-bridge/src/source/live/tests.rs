//! A link and an owner in one process. The owner publishes in the order of each test.

mod carrying;
mod undo;

use std::sync::{Arc, Mutex};
use std::time::Duration;

use axum::extract::ws::Message;
use serde_json::{Value, json};
use sim_contract::testing::TestDomain;
use sim_contract::{
    Action, COMMANDS_BUFFERED, ColliderState, CollidersHeader, Command as Sent, ConstraintState,
    ForceRow, ForcesHeader, Load as OwnerLoad, LoadHeader, NodeStatus, Outcome, Owner, Parameter,
    ParameterValues, ParticleState, SnapshotHeader, TearsHeader, TornConstraint,
};

use super::link::{Link, LinkEnd};
use crate::message::{Choice, Command, CommandKind, Mode};
use crate::pages::connection::{Connection, NextFrame};
use crate::pages::hub::Hub;
use crate::request::{ClientId, Request, RequestKind, Requests, requests};
use crate::sink::{Demand, Sink, Sinks, Update};
use crate::source::shown_state::ShownState;
use crate::wire_decoder::{Message as Wire, decode};

const RUN_ID: u64 = 7;
const PAGE: ClientId = ClientId::Page(1);
const TARGET: [f32; 3] = [1.0, 2.0, 3.0];

/// An owner, a link to it, and a page. The domain is dropped last.
struct Fixture {
    link: Link,
    shown: ShownState,
    sinks: Sinks,
    requests: Requests,
    hub: Arc<Hub>,
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
        bends: &[],
        triangles: &[],
        collider_count: 1,
        keyframe_size_bytes_max: 4096,
        parameters: ParameterValues::default(),
    }
}

impl Fixture {
    /// Shows the first load.
    fn start() -> Self {
        let domain = TestDomain::new();
        let owner = Owner::create(&domain.endpoint(), &load(0, 0)).unwrap();
        let link = Link::attach(&domain.endpoint(), &Arc::default()).unwrap();
        let (sender, requests) = requests();
        let hub = Arc::new(Hub::new(Mode::Live, Vec::new(), sender));
        let page = hub.join(Choice::F32);
        let (shown, mut sinks) = (ShownState::default(), Sinks::default());
        sinks.add(Arc::<Hub>::clone(&hub));
        let outcome_count = 0;
        let mut fixture =
            Self { link, shown, sinks, requests, hub, page, owner, outcome_count, _domain: domain };
        fixture.owner.refresh();
        fixture.publish(0, 0, 2);
        fixture.read();
        assert_eq!(fixture.shown.epoch(), 1);
        fixture
    }

    /// Publishes a state with `particle_count` particles.
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
        self.link.read(&mut self.shown, &self.sinks).unwrap();
        self.link.next_frame_ns = 0;
        self.link.show(&self.shown, &self.sinks);
    }

    /// The newest message with parameters in the queue of the page.
    fn page_parameters(&mut self) -> Value {
        newest_text(&mut self.page, "parameters").unwrap()
    }

    /// The radii of the colliders in the newest frame.
    fn radii(&self) -> Vec<f32> {
        let frame = self.page.frames.borrow();
        let Some(set) = &frame.colliders else { return Vec::new() };
        let Ok(Wire::Colliders(all)) = decode(&set.bytes) else { panic!("not COLLIDERS") };
        all.colliders.iter().map(|collider| collider.radius).collect()
    }

    /// Publishes the forces of a step, and then its state.
    fn publish_forces(&self, step: u64, rows: &[ForceRow]) {
        let header = ForcesHeader { run_id: RUN_ID, step, rate_hz: 60, count: 0 };
        self.owner.publish_forces(header, rows).unwrap();
        self.publish(step, 0, 2);
    }

    /// Follows the subscriptions of the pages.
    fn exchange(&mut self) {
        self.link.exchange(&mut self.shown, &self.sinks, &self.requests).unwrap();
        self.owner.refresh();
    }

    /// Messages that a page receives with the newest frame.
    fn received(page: &mut Connection) -> Vec<Wire> {
        let NextFrame::Frame(messages) = page.next_frame() else { panic!("no frame") };
        page.acknowledge(u32::MAX);
        messages.iter().map(|bytes| decode(bytes).unwrap()).collect()
    }

    fn command(&mut self, kind: impl Into<CommandKind>) {
        self.request(RequestKind::Command(Command::new(kind)));
    }

    fn request(&mut self, kind: RequestKind) {
        self.link.handle(Request { client: PAGE, kind }, &self.shown, &self.sinks);
        self.link.dispatch.flush(&mut self.link.client, &self.sinks);
    }

    /// Commands that have arrived at the owner.
    fn arrived(&self) -> Vec<Sent> {
        let mut arrived = Vec::new();
        self.owner.receive_commands(&mut arrived);
        arrived.iter().map(|received| received.command).collect()
    }

    /// Publishes that a command was applied.
    fn answer(&mut self, command: Sent) {
        let outcome = Outcome::new(self.outcome_count, 1, command, Ok(()));
        self.outcome_count += 1;
        self.owner.publish_outcome(&outcome).unwrap();
    }

    /// Publishes that the reset of another client was applied.
    fn reset(&mut self) {
        self.answer(Sent::new(1, 1, Action::Reset));
    }
}

/// Empties the queue of a page, and returns the newest text of a type.
fn newest_text(page: &mut Connection, kind: &str) -> Option<Value> {
    let texts = std::iter::from_fn(|| page.queue.try_recv().ok());
    let texts = texts.filter_map(|message| match message {
        Message::Text(text) => serde_json::from_str::<Value>(&text).ok(),
        _ => None,
    });
    texts.filter(|text| text["type"] == kind).last()
}

/// A sink that keeps the steps of the outcomes and status messages.
#[derive(Debug, Default)]
struct RowLog(Mutex<Vec<(&'static str, u64)>>);

impl Sink for RowLog {
    fn has_demand(&self, _: Demand) -> bool {
        false
    }

    fn publish(&self, update: &Update<'_>) {
        let row = match update {
            Update::Outcome(row) => ("outcome", row.step),
            Update::Status(row) => ("status", row.step),
            _ => return,
        };
        self.0.lock().unwrap().push(row);
    }
}

fn actions(commands: &[Sent]) -> Vec<Action> {
    commands.iter().map(Sent::action).collect()
}

const GRAB: Action = Action::Grab { particle: 1, target: TARGET, over_s: 0.0 };
const MOVE: Action = Action::Move { particle: 1, target: TARGET, over_s: 0.0 };
const RELEASE: Action = Action::Release { particle: 1, force: false };

#[test]
fn colliders_that_arrive_before_the_first_state_of_their_load_are_shown_with_it() {
    let mut fixture = Fixture::start();
    let collider = ColliderState { shape: 2, radius: 0.5, ..ColliderState::default() };
    fixture.owner.load(&load(1, 1)).unwrap();
    let header = CollidersHeader { run_id: RUN_ID, step: 1, ..CollidersHeader::default() };
    fixture.owner.publish_colliders(header, &[collider]).unwrap();
    fixture.read();
    assert_eq!((fixture.shown.epoch(), fixture.radii()), (1, vec![]));
    fixture.publish(1, 1, 2);
    fixture.read();
    assert_eq!((fixture.shown.epoch(), fixture.radii()), (2, vec![0.5]));
}

#[test]
fn tears_are_shown_with_their_state() {
    let mut fixture = Fixture::start();
    let header = TearsHeader { run_id: RUN_ID, step: 2, new_count: 1, ..TearsHeader::default() };
    fixture.owner.publish_tears(header, &[TornConstraint::new(0, None)]).unwrap();
    fixture.publish(1, 0, 2);
    fixture.read();
    assert!(fixture.shown.torn().is_empty());
    fixture.publish(2, 0, 2);
    fixture.read();
    let torn: Vec<_> = fixture.shown.torn().iter().map(|torn| torn.constraint).collect();
    assert_eq!(torn, [0]);
}

#[test]
fn published_parameters_take_effect_at_once_and_keep_the_initial_values() {
    let mut fixture = Fixture::start();
    let parameters = fixture.page_parameters();
    assert_eq!(parameters["values"]["damping"], 0.0);
    let values = ParameterValues::default().with(Parameter::Damping, 1.5);
    fixture.owner.publish_parameters(RUN_ID, 1, &values).unwrap();
    fixture.read();
    let parameters = fixture.page_parameters();
    assert_eq!(parameters["values"]["damping"], 1.5);
    assert_eq!(
        (&parameters["initial"]["damping"], &parameters["is_complete"]),
        (&json!(0.0), &json!(true))
    );
}

#[test]
fn a_state_of_another_size_is_neither_shown_nor_measured() {
    let mut fixture = Fixture::start();
    let status = NodeStatus { run_id: RUN_ID, rate_hz: 60, time_scale: 1.0, ..Default::default() };
    fixture.owner.publish_status(&status).unwrap();
    fixture.publish(1, 0, 1);
    fixture.read();
    fixture.link.publish_statistics(&fixture.shown, &fixture.sinks);
    assert_eq!(fixture.page.frames.borrow().properties.particle_count, 2);
    // It does not begin a load either.
    fixture.owner.load(&load(2, 1)).unwrap();
    fixture.publish(2, 1, 1);
    fixture.read();
    assert_eq!(fixture.shown.epoch(), 1);
    fixture.publish(3, 1, 2);
    fixture.read();
    assert_eq!(fixture.shown.epoch(), 2);
}

#[test]
fn a_grab_that_the_node_applies_after_a_reset_still_belongs_to_the_page() {
    let mut fixture = Fixture::start();
    fixture.command(GRAB);
    fixture.command(MOVE);
    let sent = fixture.arrived();
    assert_eq!(sent.len(), 2);
    fixture.reset();
    fixture.read();
    fixture.command(MOVE);
    assert_eq!(actions(&fixture.arrived()), [MOVE]);
    fixture.answer(sent[0]);
    fixture.read();
    fixture.command(MOVE);
    assert_eq!(actions(&fixture.arrived()), [MOVE]);
    fixture.request(RequestKind::Left);
    assert_eq!(actions(&fixture.arrived()), [RELEASE]);
}

#[test]
fn a_grab_that_the_node_applied_before_a_reset_has_ended() {
    let mut fixture = Fixture::start();
    fixture.command(GRAB);
    let sent = fixture.arrived();
    fixture.answer(sent[0]);
    fixture.reset();
    fixture.read();
    fixture.command(MOVE);
    fixture.request(RequestKind::Left);
    assert!(fixture.arrived().is_empty());
}

#[test]
fn a_grab_that_another_client_has_released_by_force_has_ended() {
    let mut fixture = Fixture::start();
    fixture.command(GRAB);
    let sent = fixture.arrived();
    fixture.answer(sent[0]);
    fixture.answer(Sent::new(1, 1, Action::Release { particle: 1, force: true }));
    fixture.read();
    fixture.command(MOVE);
    fixture.request(RequestKind::Left);
    assert!(fixture.arrived().is_empty());
}

#[test]
fn a_grab_of_a_page_that_leaves_before_the_reset_is_answered_is_released() {
    let mut fixture = Fixture::start();
    fixture.command(GRAB);
    fixture.reset();
    fixture.read();
    fixture.request(RequestKind::Left);
    let sent = fixture.arrived();
    assert_eq!(actions(&sent)[1..], [RELEASE]);
}

#[test]
fn a_release_waits_for_room_at_the_node_and_is_sent_without_another_request() {
    let mut fixture = Fixture::start();
    fixture.command(GRAB);
    let sent = fixture.arrived();
    fixture.answer(sent[0]);
    fixture.read();
    for _ in 0..COMMANDS_BUFFERED {
        fixture.command(MOVE);
    }
    fixture.command(MOVE);
    fixture.command(RELEASE);
    fixture.link.dispatch.expire(&fixture.sinks, u64::MAX);
    assert_eq!(actions(&fixture.arrived()), vec![MOVE; COMMANDS_BUFFERED]);
    while fixture.requests.next(Duration::ZERO).is_some() {}
    fixture.link.exchange(&mut fixture.shown, &fixture.sinks, &fixture.requests).unwrap();
    assert_eq!(actions(&fixture.arrived()), [RELEASE]);
}

#[test]
fn the_last_answers_and_the_last_status_of_a_run_are_published_before_the_next_run() {
    let mut fixture = Fixture::start();
    let log = Arc::new(RowLog::default());
    fixture.sinks.add(Arc::<RowLog>::clone(&log));
    let command = Command { id: Some(9), ..Command::new(Action::Pin { particle: 1 }) };
    fixture.request(RequestKind::Command(command));
    let sent = fixture.arrived();
    fixture.answer(sent[0]);
    let status = |run_id, step| NodeStatus { run_id, step, ..NodeStatus::default() };
    fixture.owner.publish_status(&status(RUN_ID, 5)).unwrap();
    let mut next = load(0, 0);
    next.header.run_id = RUN_ID + 1;
    fixture.owner.load(&next).unwrap();
    fixture.owner.publish_status(&status(RUN_ID + 1, 0)).unwrap();
    let end = fixture.link.read(&mut fixture.shown, &fixture.sinks);
    assert_eq!(end, Err(LinkEnd::NewRun));
    let answer = newest_text(&mut fixture.page, "outcome").unwrap();
    assert_eq!((&answer["id"], &answer["status"]), (&json!(9), &json!("applied")));
    assert_eq!(*log.0.lock().unwrap(), [("outcome", 1), ("status", 5)]);
}

#[test]
fn a_page_that_joins_later_reads_why_the_newest_load_is_not_shown() {
    let mut fixture = Fixture::start();
    let outside = ConstraintState { a: 0, b: 9, ..ConstraintState::default() };
    fixture.owner.load(&OwnerLoad { constraints: &[outside], ..load(1, 1) }).unwrap();
    fixture.publish(1, 1, 2);
    fixture.read();
    let notice = newest_text(&mut fixture.page, "notice").unwrap();
    assert_eq!(notice["level"], "error");
    let mut late = fixture.hub.join(Choice::F32);
    assert_eq!(newest_text(&mut late, "notice"), Some(notice));
    fixture.owner.load(&load(2, 2)).unwrap();
    fixture.publish(2, 2, 2);
    fixture.read();
    let mut latest = fixture.hub.join(Choice::F32);
    assert_eq!(newest_text(&mut latest, "notice"), None);
}

#[test]
fn forces_are_read_while_a_page_wants_them_and_sent_to_that_page_with_their_frame() {
    let mut fixture = Fixture::start();
    let mut other = fixture.hub.join(Choice::F32);
    fixture.exchange();
    assert_eq!(fixture.owner.forces_reader_count(), 0);
    fixture.page.change_subscription(|subscription| subscription.forces = true);
    fixture.exchange();
    assert_eq!(fixture.owner.forces_reader_count(), 1);
    let row = |step: f32| ForceRow { kind: 2, impulse: [0.0, step, 0.0], ..ForceRow::default() };
    // The forces of a later step have arrived as well, but not its state.
    fixture.publish_forces(1, &[row(1.0)]);
    let header = ForcesHeader { run_id: RUN_ID, step: 2, rate_hz: 60, count: 0 };
    fixture.owner.publish_forces(header, &[row(2.0)]).unwrap();
    fixture.read();
    let [Wire::Forces(forces), Wire::Frame(frame)] = &Fixture::received(&mut fixture.page)[..]
    else {
        panic!("not FORCES and FRAME")
    };
    assert_eq!((forces.stamp, forces.rate_hz), (frame.head.stamp, 60));
    assert_eq!((forces.stamp.step, &forces.rows), (1, &vec![row(1.0)]));
    assert!(matches!(Fixture::received(&mut other)[..], [Wire::Frame(_)]), "it asked for none");

    // A step without forces.
    fixture.publish(3, 0, 2);
    fixture.read();
    assert!(matches!(Fixture::received(&mut fixture.page)[..], [Wire::Frame(_)]));
    other.change_subscription(|subscription| subscription.forces = true);
    fixture.page.change_subscription(|subscription| subscription.forces = false);
    fixture.exchange();
    assert_eq!(fixture.owner.forces_reader_count(), 1, "another page wants them");
    fixture.hub.leave(other.client);
    fixture.exchange();
    assert_eq!(fixture.owner.forces_reader_count(), 0);
}

#[test]
fn a_page_receives_the_speeds_and_the_exact_particles_that_it_asks_for_with_their_frame() {
    let mut fixture = Fixture::start();
    let mut other = fixture.hub.join(Choice::F32);
    fixture.page.change_subscription(|subscription| subscription.speeds = true);
    other.change_subscription(|subscription| subscription.particles = vec![1, 9]);
    fixture.publish(1, 0, 2);
    fixture.read();
    let [Wire::Speeds(speeds), Wire::Frame(frame)] = &Fixture::received(&mut fixture.page)[..]
    else {
        panic!("not SPEEDS and FRAME")
    };
    assert_eq!((speeds.stamp, speeds.speeds.len()), (frame.head.stamp, 2));
    let [Wire::Inspected(inspected), Wire::Frame(frame)] = &Fixture::received(&mut other)[..]
    else {
        panic!("not INSPECTED and FRAME")
    };
    let particles: Vec<_> = inspected.particles.iter().map(|one| one.particle).collect();
    assert_eq!(particles, [1], "the load has no particle 9");
    assert_eq!(inspected.stamp, frame.head.stamp);
    assert_eq!(inspected.particles[0].position, frame.positions[1]);

    fixture.page.change_subscription(|subscription| subscription.speeds = false);
    other.change_subscription(|subscription| subscription.particles.clear());
    fixture.publish(2, 0, 2);
    fixture.read();
    for page in [&mut fixture.page, &mut other] {
        assert!(matches!(Fixture::received(page)[..], [Wire::Frame(_)]));
    }
}
