//! Poses of colliders and anchors, from what a node publishes.

use glam::Vec3;
use sim_solver::scene::ScenePoses;
use sim_solver::{Pose, Scene, Solver};
use sim_types::{ColliderFields, ColliderShape};

const SCENE: &str = "
    version = 1
    [[particle]]
    position = [0, 0, 0]
    [[generate]]
    shape = 'cloth'
    columns = 3
    rows = 3
    spacing = 0.25
    [[anchor]]
    particles = [1, 3, 7, 8]
    origin = [0.5, 0.25, 0]
    path = [{ time = 0 }, { time = 2, translation = [0, 1, 0], rotation = [0.5, 0.5, 0.5, 0.5] }]
    [[anchor]]
    particles = [4, 5]
    [[collider]]
    shape = 'box'
    center = [1, 2, 3]
    half_extents = [0.1, 0.2, 0.3]
    rotation = [0, 0, 0.6, 0.8]
    angular_velocity = [1, 2, 0]
    velocity = [0.5, 0, 0]
    [[collider]]
    shape = 'capsule'
    a = [0, -3, 0]
    b = [1, -3, 0]
    radius = 0.1
    [[collider]]
    shape = 'plane'
    normal = [0, 1, 0]
    offset = -9
    [[collider]]
    shape = 'bounds'
    min = [-50, -50, -50]
    max = [50, 50, 50]
    ";

/// A pose that is given back to the node leaves everything where it is.
#[test]
fn the_pose_of_a_state_puts_it_where_it_is() {
    let scene = Scene::from_toml(SCENE, "").unwrap();
    let poses = ScenePoses::new(&scene);
    let mut solver = Solver::new(&scene);
    let moves = [
        (1, Pose { translation: [0.5, 0.25, -1.0], rotation: [0.0, 0.6, 0.0, 0.8] }),
        (2, Pose { translation: [0.0, -0.5, 0.0], rotation: [0.1, 0.0, 0.0, 1.0] }),
        (3, Pose { translation: [0.0, 1.0, 2.0], rotation: [0.0, 0.0, 0.0, 1.0] }),
    ];
    for (collider, pose) in moves {
        solver.move_collider(collider, pose).unwrap();
    }
    for _ in 0..50 {
        solver.step();
    }
    let colliders: Vec<_> = solver.colliders().map(|one| one.shape.fields()).collect();
    let particles: Vec<_> = (0..10).map(|particle| solver.particle(particle).position).collect();
    for (index, fields) in (0..).zip(&colliders) {
        solver.move_collider(index, poses.collider(index, fields).unwrap()).unwrap();
    }
    for anchor in [0, 1] {
        let pose = poses.anchor(anchor, |one| particles.get(one as usize).copied()).unwrap();
        solver.move_anchor(anchor, pose).unwrap();
    }
    solver.step();
    for (before, after) in colliders.iter().zip(solver.colliders()) {
        let after = after.shape.fields();
        let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4);
        let is_near = near(before.center, after.center)
            && near(before.normal, after.normal)
            && near(before.a, after.a)
            && near(before.b, after.b)
            && (before.offset - after.offset).abs() < 1e-4;
        assert!(is_near, "{before:?} {after:?}");
        let dot: f32 = before.rotation.iter().zip(after.rotation).map(|(a, b)| a * b).sum();
        assert!(before.rotation == [0.0; 4] || dot.abs() > 1.0 - 1e-6, "{before:?} {after:?}");
    }
    for particle in [1, 3, 7, 8, 4, 5] {
        let (before, after) = (particles[particle], solver.particle(particle).position);
        let distance = Vec3::from_array(before).distance(Vec3::from_array(after));
        assert!(distance < 1e-5, "particle {particle}: {before:?} {after:?}");
    }
}

#[test]
fn unknown_and_undriven_things_have_no_pose() {
    let poses = ScenePoses::new(&Scene::from_toml(SCENE, "").unwrap());
    let fields = ColliderFields::new(ColliderShape::Sphere);
    assert_eq!(poses.collider(4, &fields), None);
    assert_eq!(poses.anchor(2, |_| Some([0.0; 3])), None);
    assert_eq!(poses.anchor(0, |_| None), None);
    assert_eq!(poses.anchored().collect::<Vec<_>>(), [vec![1, 3, 7, 8], vec![4, 5]]);
}
