//! Objects that are lifted, carried, put down and thrown.

use sim_contract::{LoadHeader, ParticleState, SnapshotHeader};
use sim_solver::{Scene, Solver};

use super::*;
use crate::scene::load::Load;
use crate::scene::summary::SceneSummary;

const SCENE: &str = "
    version = 1
    [[particle]]
    position = [0, 1, 0]
    [[anchor]]
    particles = [0]
    [[collider]]
    shape = 'sphere'
    center = [1, 0, 0]
    radius = 0.5
    velocity = [0, 2, 0]";
const BALL: Object = Object::Collider(0);
const RATE_HZ: u32 = 100;
const ADA: ClientId = ClientId::Page(1);
const BEN: ClientId = ClientId::Page(2);

/// A scene whose ball has moved by its own velocity up to a step.
struct Stage {
    load: Load,
    header: SnapshotHeader,
    particles: Vec<ParticleState>,
    colliders: Vec<ColliderState>,
}

impl Stage {
    fn new(text: &str, steps: u32) -> Self {
        let scene = Scene::from_toml(text, "").unwrap();
        let mut solver = Solver::new(&scene);
        for _ in 0..steps {
            solver.step();
        }
        let position = solver.particle(0).position;
        Self {
            load: Load {
                header: LoadHeader { rate_hz: RATE_HZ, ..LoadHeader::default() },
                summary: SceneSummary::from_toml(text).unwrap(),
                constraints: Vec::new(),
                bends: Vec::new(),
                triangles: Vec::new(),
            },
            header: SnapshotHeader { step: u64::from(steps), ..SnapshotHeader::default() },
            particles: vec![ParticleState { position, ..ParticleState::default() }],
            colliders: solver.colliders().map(|one| one.shape.fields().into()).collect(),
        }
    }

    fn state(&self) -> LoadedState<'_> {
        LoadedState {
            load: &self.load,
            header: &self.header,
            particles: &self.particles,
            forces: None,
        }
    }

    fn lift(&self, carrier: &mut Carrier, client: ClientId, object: Object) -> Result<(), Refusal> {
        carrier.lift(client, object, LiftState { state: &self.state(), colliders: &self.colliders })
    }

    /// Makes the steps that follow, one by one, and returns the translation of each move.
    fn moves(&mut self, carrier: &mut Carrier, steps: u32) -> Vec<[f32; 3]> {
        let translation = |action: &Action| match *action {
            Action::MoveCollider { translation, .. } | Action::MoveAnchor { translation, .. } => {
                translation
            }
            _ => panic!("{action:?}"),
        };
        let mut moves = Vec::new();
        for _ in 0..steps {
            self.header.step += 1;
            moves.extend(carrier.advance(&self.state()).iter().map(translation));
        }
        moves
    }
}

fn near(a: [f32; 3], b: [f32; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5)
}

#[test]
fn a_carried_object_covers_the_way_in_equal_parts_from_where_it_is() {
    // The rate of the scene is 240 Hz, so the ball has risen by 1 m.
    let mut stage = Stage::new(SCENE, 120);
    let mut carrier = Carrier::default();
    stage.lift(&mut carrier, ADA, BALL).unwrap();
    assert!(!carrier.is_moving());
    carrier.carry(ADA, BALL, [0.4, 0.0, 0.0], 4.0).unwrap();
    let moves = stage.moves(&mut carrier, 6);
    let expected = [0.1, 0.2, 0.3, 0.4].map(|x| [x, 1.0, 0.0]);
    assert_eq!(moves.len(), 4, "{moves:?}");
    assert!(moves.iter().zip(expected).all(|(a, b)| near(*a, b)), "{moves:?}");
    assert!(!carrier.is_moving());
    // The next target is relative to the same beginning, and reached even if steps are missed.
    carrier.carry(ADA, BALL, [0.4, -0.4, 0.0], 4.0).unwrap();
    assert!(near(stage.moves(&mut carrier, 2)[1], [0.4, 0.8, 0.0]));
    stage.header.step += 1;
    assert!(near(stage.moves(&mut carrier, 1)[0], [0.4, 0.6, 0.0]));
    assert!(!carrier.is_moving());
    // However long it has rested, and however old the newest state is, the next motion begins with its first part.
    carrier.carry(ADA, BALL, [0.0, -0.4, 0.0], 4.0).unwrap();
    let at_once = carrier.advance(&stage.state());
    assert!(matches!(at_once[..], [Action::MoveCollider { .. }]), "{at_once:?}");
    assert!(carrier.advance(&stage.state()).is_empty());
    stage.header.step += 50;
    assert!(near(stage.moves(&mut carrier, 1)[0], [0.2, 0.6, 0.0]));
    // Without time it is there in the next step.
    carrier.carry(ADA, BALL, [0.0; 3], 0.0).unwrap();
    assert!(near(stage.moves(&mut carrier, 3)[0], [0.0, 1.0, 0.0]));
    // The same state again is no step.
    assert!(carrier.advance(&stage.state()).is_empty());
}

#[test]
fn a_thrown_object_slows_down_to_rest() {
    let mut stage = Stage::new(SCENE, 0);
    let mut carrier = Carrier::default();
    stage.lift(&mut carrier, ADA, BALL).unwrap();
    carrier.throw(ADA, BALL, [2.0, 0.0, -1.0]).unwrap();
    let moves = stage.moves(&mut carrier, 1000);
    let first = moves[0];
    assert!((first[0] - 0.02).abs() < 5e-4 && (first[2] + 0.01).abs() < 5e-4, "{first:?}");
    let ways: Vec<_> = moves.windows(2).map(|pair| pair[1][0] - pair[0][0]).collect();
    assert!(ways.windows(2).all(|pair| pair[1] <= pair[0] + 1e-6), "{ways:?}");
    let last = moves.last().unwrap();
    let whole = to_f32(GLIDE_S);
    assert!((last[0] - 2.0 * whole).abs() < 1e-3 && (last[2] + whole).abs() < 1e-3, "{last:?}");
    assert!(moves.len() < 300 && !carrier.is_moving());
    // It can be taken again, from where it is.
    assert!(carrier.objects.is_empty());
}

#[test]
fn an_object_that_is_put_down_still_reaches_its_target() {
    let mut stage = Stage::new(SCENE, 0);
    let mut carrier = Carrier::default();
    stage.lift(&mut carrier, ADA, BALL).unwrap();
    carrier.carry(ADA, BALL, [0.3, 0.0, 0.0], 3.0).unwrap();
    carrier.throw(ADA, BALL, [0.0; 3]).unwrap();
    let moves = stage.moves(&mut carrier, 9);
    assert_eq!(moves.len(), 3, "{moves:?}");
    assert!(near(moves[2], [0.3, 0.0, 0.0]), "{moves:?}");
    assert!(carrier.objects.is_empty());
    // Where it is already there, nothing is left to do.
    stage.lift(&mut carrier, ADA, BALL).unwrap();
    carrier.throw(ADA, BALL, [0.0; 3]).unwrap();
    assert!(carrier.objects.is_empty());
}

#[test]
fn only_one_client_carries_an_object() {
    let mut stage = Stage::new(SCENE, 0);
    let mut carrier = Carrier::default();
    let taken = Err(Refusal::Node(Reason::GrabbedByOther));
    let not_held = Err(Refusal::Node(Reason::NotGrabbed));
    // A target of before a reset moves nothing.
    assert_eq!(carrier.carry(ADA, BALL, [1.0; 3], 9.0), not_held);
    assert_eq!(carrier.throw(ADA, BALL, [0.0; 3]), not_held);
    stage.lift(&mut carrier, ADA, BALL).unwrap();
    assert_eq!(stage.lift(&mut carrier, BEN, BALL), taken);
    assert_eq!(carrier.carry(BEN, BALL, [1.0; 3], 9.0), not_held);
    assert_eq!(carrier.throw(BEN, BALL, [0.0; 3]), not_held);
    // A thrown object belongs to nobody, and glides on without the client.
    carrier.throw(ADA, BALL, [1.0; 3]).unwrap();
    carrier.remove_client(ADA);
    assert!(carrier.is_moving());
    stage.lift(&mut carrier, BEN, BALL).unwrap();
    assert_eq!(carrier.throw(ADA, BALL, [0.0; 3]), not_held);
    carrier.carry(BEN, BALL, [1.0; 3], 9.0).unwrap();
    carrier.remove_client(BEN);
    assert_eq!(stage.moves(&mut carrier, 3), Vec::<[f32; 3]>::new());
}

#[test]
fn the_number_of_objects_is_limited() {
    let collider = "[[collider]]\nshape = 'sphere'\ncenter = [0, 0, 0]\nradius = 1\n";
    let stage = Stage::new(&(SCENE.to_owned() + "\n" + &collider.repeat(CARRIED_MAX)), 0);
    let mut carrier = Carrier::default();
    let mut lift = |index: usize| {
        stage.lift(&mut carrier, ADA, Object::Collider(u32::try_from(index).unwrap()))
    };
    for index in 0..CARRIED_MAX {
        lift(index).unwrap();
    }
    assert_eq!(lift(CARRIED_MAX), Err(Refusal::Busy));
    assert_eq!(lift(0), Ok(()));
}

#[test]
fn an_anchor_is_carried_from_the_place_of_its_particles() {
    let mut stage = Stage::new(SCENE, 0);
    stage.particles[0].position = [0.0, 3.0, 0.5];
    let mut carrier = Carrier::default();
    let anchor = Object::Anchor(0);
    stage.lift(&mut carrier, ADA, anchor).unwrap();
    carrier.carry(ADA, anchor, [0.25, 0.0, 0.0], 0.0).unwrap();
    let refused = |object| stage.lift(&mut Carrier::default(), ADA, object).unwrap_err();
    assert_eq!(refused(Object::Anchor(1)), Refusal::Node(Reason::UnknownAnchor));
    assert_eq!(refused(Object::Collider(1)), Refusal::Node(Reason::UnknownCollider));
    assert!(near(stage.moves(&mut carrier, 1)[0], [0.25, 2.0, 0.5]));
    // A grabbed particle does not show the pose of its anchor.
    stage.particles[0].flags = ParticleFlags::GRABBED;
    let taken = Err(Refusal::Node(Reason::GrabbedByOther));
    assert_eq!(stage.lift(&mut Carrier::default(), BEN, anchor), taken);
}

#[test]
fn a_planar_scene_stays_in_its_plane() {
    let mut stage = Stage::new(&SCENE.replace("version = 1", "version = 1\ndimensions = 2"), 0);
    let mut carrier = Carrier::default();
    stage.lift(&mut carrier, ADA, BALL).unwrap();
    carrier.carry(ADA, BALL, [1.0, 0.0, 5.0], 0.0).unwrap();
    assert_eq!(stage.moves(&mut carrier, 1), [[1.0, 0.0, 0.0]]);
    carrier.throw(ADA, BALL, [1.0, 0.0, 5.0]).unwrap();
    assert!(stage.moves(&mut carrier, 9).iter().all(|at| at[2] == 0.0));
}
