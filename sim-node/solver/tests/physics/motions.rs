//! Motions of colliders, anchors and grabbed particles against their closed form: linear between points in time.

use sim_solver::{
    Action, Grab, Keyframe, MOTION_POINTS_MAX, OVER_S_MAX, Particle, Pose, Reason, Scene, Solver,
};
use sim_types::{MovedObject, PathPart, PathPoint};

use super::{assert_close, assert_near, bits, position, solver, step, velocity};

const NO_TURN: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// A free particle, two on an anchor, a sphere far away, and bounds.
const SCENE: &str = "gravity = [0, 0, 0]\n[solver]\nrate_hz = 240\nsubsteps = 2\n\
    [[particle]]\nposition = [0.5, 0, 0]\n[[particle]]\nposition = [0, 1, 0]\n\
    [[particle]]\nposition = [1, 1, 0]\n[[anchor]]\nparticles = [1, 2]\norigin = [0, 1, 0]\n\
    [[collider]]\nshape = \"sphere\"\ncenter = [0, 9, 0]\nradius = 0.1\n\
    [[collider]]\nshape = \"bounds\"\nmin = [-50, -50, -50]\nmax = [50, 50, 50]\n";

fn pose(x: f32) -> Pose {
    Pose { translation: [x, 0.0, 0.0], rotation: NO_TURN }
}

/// The center of the sphere, along x.
fn center(solver: &Solver) -> f64 {
    solver.colliders().next().unwrap().shape.fields().center[0].into()
}

fn point(time: f64, x: f32) -> PathPoint {
    PathPoint { time, translation: [x, 0.0, 0.0], rotation: NO_TURN }
}

fn follow(
    solver: &mut Solver,
    object: MovedObject,
    index: u32,
    points: &[PathPoint],
) -> Result<(), Reason> {
    follow_as(solver, object, index, (points, false))
}

fn follow_as(
    solver: &mut Solver,
    object: MovedObject,
    index: u32,
    (points, append): (&[PathPoint], bool),
) -> Result<(), Reason> {
    let actions = match PathPart::new(points) {
        // Also a wrong path, which `Action::follow` refuses.
        Some(path) => vec![Action::Follow { object, object_index: index, path, append }],
        None => Action::follow(object, index, points, append).unwrap(),
    };
    actions.iter().try_for_each(|action| solver.apply(7, action).map(|_| ()))
}

#[test]
fn a_collider_follows_its_path_in_the_scene() {
    let path = "repeat = true\npath = [{ time = 0.5 }, { time = 1, translation = [0.25, 0, 0] }, \
                { time = 1.5, translation = [0, 0, 0], rotation = [0, 0, 1, 0] }]\n";
    let text = SCENE.replace("radius = 0.1\n", &format!("radius = 0.1\n{path}"));
    let scene = Scene::from_toml(&format!("version = 1\n{text}"), "test").unwrap();
    assert_eq!(Scene::from_toml(&scene.to_toml(), "test").unwrap().colliders, scene.colliders);
    let mut moving = Solver::new(&scene);
    for (steps, expected, speed) in [
        (60, 0.0, 0.0),
        (120, 0.125, 0.5),
        (60, 0.25, 0.5),
        (60, 0.125, -0.5),
        (60, 0.0, -0.5),
        (60, 0.125, 0.5),
    ] {
        step(&mut moving, steps);
        assert_near("place", expected, center(&moving), 1e-6);
        let velocity = moving.colliders().next().unwrap().velocity[0];
        assert_close("speed", speed, velocity.into(), 1e-3);
    }
    // A client replaces the path until a reset.
    moving.move_collider(0, pose(0.75)).unwrap();
    step(&mut moving, 9);
    assert_near("moved", 0.75, center(&moving), 1e-6);
    moving.reset();
    step(&mut moving, 181);
    assert_near("after a reset", 0.125, center(&moving), 1e-6);
    // The first point is where it is at load.
    let text = text.replace("{ time = 0.5 }", "{ time = 0.5, translation = [-1, 0, 0] }");
    assert_near("at load", -1.0, center(&solver(&text)), 1e-6);
}

#[test]
fn a_move_over_a_time_is_linear_and_ends_at_the_pose() {
    let mut moving = solver(SCENE);
    moving.move_collider_over(0, pose(1.0), 0.5).unwrap();
    moving.move_anchor_over(0, pose(-1.0), 0.5).unwrap();
    moving.grab(7, Grab { particle: 0, target: [1.5, 0.0, 0.0], over_s: 0.5 }).unwrap();
    for steps in 1..=120_u16 {
        step(&mut moving, 1);
        let share = f64::from(steps) / 120.0;
        assert_near("collider", share, center(&moving), 1e-6);
        assert_near("anchored particle", 1.0 - share, position(&moving, 2)[0], 1e-6);
        assert_near("grabbed particle", 0.5 + share, position(&moving, 0)[0], 1e-6);
        let speed = moving.colliders().next().unwrap().velocity[0];
        assert_close("speed of the collider", 2.0, speed.into(), 1e-4);
        assert_close("speed of the particle", 2.0, velocity(&moving, 0)[0], 1e-4);
    }
    step(&mut moving, 1);
    assert_eq!((center(&moving), position(&moving, 0)[0]), (1.0, 1.5));
    assert_eq!(velocity(&moving, 0), [0.0; 3]);
    assert!(!moving.has_moving_colliders());
}

/// The share of a substep is below the rounding of the position, so that the particle is up to 60 roundings behind.
#[test]
fn a_slow_motion_is_as_linear_as_a_fast_one() {
    let mut moving = solver(SCENE);
    let over_s = OVER_S_MAX;
    moving.grab(7, Grab { particle: 0, target: [0.51, 0.0, 0.0], over_s }).unwrap();
    moving.move_collider_over(0, pose(0.01), over_s).unwrap();
    for tens in 1..=9_u16 {
        step(&mut moving, 2400);
        let way = 0.01 * f64::from(tens) * 10.0 / 3600.0;
        assert_near("particle", 0.5 + way, position(&moving, 0)[0], 4e-6);
        assert_near("collider", way, center(&moving), 1e-7);
    }
}

#[test]
fn objects_pass_the_points_of_a_path_at_their_times() {
    // The corner at 0.101 s lies within a step.
    let points =
        [point(0.05, 1.0), point(0.101, 0.0), point(0.2, 2.0), point(0.25, 2.0), point(0.3, 1.0)];
    let at = |time: f64| {
        let next = points.partition_point(|point| point.time <= time);
        if next == points.len() {
            return 1.0;
        }
        let from = next.checked_sub(1).map_or(point(0.0, 0.0), |before| points[before]);
        let share = (time - from.time) / (points[next].time - from.time);
        f64::from(from.translation[0]) * (1.0 - share)
            + f64::from(points[next].translation[0]) * share
    };
    let mut moving = solver(SCENE);
    moving.grab(7, Grab { particle: 0, target: [0.0; 3], over_s: 0.0 }).unwrap();
    step(&mut moving, 1);
    for (object, index) in
        [(MovedObject::Particle, 0), (MovedObject::Anchor, 0), (MovedObject::Collider, 0)]
    {
        follow(&mut moving, object, index, &points).unwrap();
    }
    for steps in 1..=90_u16 {
        step(&mut moving, 1);
        let expected = at(f64::from(steps) / 240.0);
        assert_near("particle", expected, position(&moving, 0)[0], 2e-6);
        assert_near("anchored particle", expected, position(&moving, 1)[0], 2e-6);
        assert_near("collider", expected, center(&moving), 2e-6);
    }
}

#[test]
fn appended_points_go_on_with_the_times_of_the_motion() {
    let mut moving = solver(SCENE);
    let object = MovedObject::Collider;
    let first = [point(0.1, 1.0)];
    assert_eq!(follow_as(&mut moving, object, 0, (&first, true)), Err(Reason::NoEffectHere));
    follow(&mut moving, object, 0, &first).unwrap();
    step(&mut moving, 12);
    follow_as(&mut moving, object, 0, (&[point(0.2, 3.0)], true)).unwrap();
    step(&mut moving, 24);
    assert_near("between", 2.0, center(&moving), 1e-6);
    // It has come to an end, and goes on where it is at that time.
    step(&mut moving, 24);
    assert_near("end", 3.0, center(&moving), 1e-6);
    follow_as(&mut moving, object, 0, (&[point(0.5, 0.0)], true)).unwrap();
    step(&mut moving, 24);
    assert_near("after the end", 3.0 * (0.5 - 0.35) / 0.25, center(&moving), 1e-6);
    let early = follow_as(&mut moving, object, 0, (&[point(0.5, 0.0)], true));
    assert_eq!(early, Err(Reason::OutOfRange));
    step(&mut moving, 72);
    // The motion has ended, and this time is over.
    let late = follow_as(&mut moving, object, 0, (&[point(0.6, 0.0)], true));
    assert_eq!(late, Err(Reason::OutOfRange));
}

/// A state in the middle of motions continues bit for bit in another solver, and steps say when they change more of it
/// than their number.
#[test]
fn motions_are_part_of_a_keyframe() {
    let scene = Scene::from_toml(&format!("version = 1\n{SCENE}"), "test").unwrap();
    let mut whole = Solver::new(&scene);
    step(&mut whole, 7);
    whole.grab(7, Grab { particle: 0, target: [0.9, 0.3, 0.1], over_s: 2.0 }).unwrap();
    whole.move_anchor_over(0, pose(0.3), 1.0).unwrap();
    let turned = PathPoint { rotation: [0.0, 0.6, 0.0, 0.8], ..point(0.7, 1.0) };
    follow(&mut whole, MovedObject::Collider, 0, &[point(0.1, 0.4), turned, point(1.5, 0.0)])
        .unwrap();
    let places = |solver: &Solver| {
        let fields = solver.colliders().map(|one| (one.shape.fields(), one.velocity));
        (bits(solver), fields.collect::<Vec<_>>())
    };
    for steps in [0, 1, 30, 170, 400] {
        step(&mut whole, steps);
        let bytes = whole.keyframe().encode();
        assert!(bytes.len() <= whole.keyframe_size_bytes_max());
        let keyframe = Keyframe::decode(&bytes).unwrap();
        assert_eq!(keyframe, whole.keyframe());
        let particles: Vec<Particle> = whole.particles().to_vec();
        let mut copy = Solver::new(&scene);
        copy.restore(&particles, &keyframe).unwrap();
        let mut original = whole.clone();
        for _ in 0..250 {
            let before = original.keyframe();
            copy.step();
            original.step();
            assert_eq!(places(&copy), places(&original));
            let after = original.keyframe();
            assert_eq!(copy.keyframe(), after);
            assert_eq!(original.changes_without_commands(), before.changes_without_commands());
            let is_same = before.at_scene_step(original.scene_step()) == after;
            assert!(is_same || original.changes_without_commands(), "{steps}");
        }
    }
    whole.reset();
    step(&mut whole, 30);
    assert_eq!((center(&whole), position(&whole, 0)[0]), (0.0, 0.5));
}

#[test]
fn wrong_motions_are_refused_and_change_nothing() {
    let mut moving = solver(SCENE);
    moving.grab(7, Grab { particle: 0, target: [0.0; 3], over_s: 0.0 }).unwrap();
    let before = moving.keyframe();
    let (particle, collider) = (MovedObject::Particle, MovedObject::Collider);
    let turned = PathPoint { rotation: [0.0, 0.6, 0.0, 0.8], ..point(1.0, 0.0) };
    let many: Vec<_> = (1..=4).map(|time| point(time.into(), 0.0)).collect();
    for (object, index, points, reason) in [
        (collider, 0, &[point(1.0, 0.0), point(1.0, 1.0)][..], Reason::OutOfRange),
        (collider, 0, &[point(-0.1, 0.0)], Reason::OutOfRange),
        (collider, 0, &[point(3601.0, 0.0)], Reason::OutOfRange),
        (collider, 0, &[point(f64::NAN, 0.0)], Reason::NonFinite),
        (collider, 0, &[point(1.0, f32::INFINITY)], Reason::NonFinite),
        (collider, 0, &[point(1.0, 2e7)], Reason::OutOfRange),
        (collider, 1, &[turned], Reason::OutOfRange),
        (collider, 2, &many, Reason::UnknownCollider),
        (MovedObject::Anchor, 1, &many, Reason::UnknownAnchor),
        (particle, 3, &many, Reason::UnknownParticle),
        (particle, 0, &[turned], Reason::OutOfRange),
    ] {
        assert_eq!(follow(&mut moving, object, index, points), Err(reason), "{points:?}");
    }
    let action = Action::follow(particle, 0, &many, false).unwrap()[0];
    assert_eq!(moving.apply(8, &action), Err(Reason::GrabbedByOther));
    assert_eq!(moving.move_collider_over(0, pose(0.0), 3601.0), Err(Reason::OutOfRange));
    assert_eq!(moving.move_anchor_over(0, pose(0.0), f32::NAN), Err(Reason::NonFinite));
    assert_eq!(moving.keyframe(), before);
    // One point is where the motion begins.
    let points: Vec<_> =
        (1..=MOTION_POINTS_MAX).map(|index| point(index as f64 * 0.01, 0.0)).collect();
    assert_eq!(follow(&mut moving, collider, 0, &points), Err(Reason::OutOfRange));
    moving.reset();
    follow(&mut moving, collider, 0, &points[1..]).unwrap();
    assert!(moving.keyframe().encode().len() <= moving.keyframe_size_bytes_max());
    assert_eq!(moving.move_anchor_over(0, pose(0.0), 1.0), Err(Reason::OutOfRange));
    // Points that were passed make room.
    step(&mut moving, 24);
    moving.move_anchor_over(0, pose(0.0), 1.0).unwrap();
}
