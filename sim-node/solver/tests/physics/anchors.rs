//! Anchors: particles that follow a moving frame, and their interplay with pins and grabs.

use sim_solver::{Grab, ParticleFlags, Pose, Reason};

use super::{assert_close, assert_near, bits, position, solver, step, velocity};

const NO_TURN: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// Two particles on a frame. It moves 1 m along x in the first second, waits, and rotates by 90
/// degrees about z around (0, 1, 0) in the third.
const CARRIED: &str = "[solver]\nrate_hz = 100\nsubsteps = 2\n\
     [[particle]]\nposition = [0, 1, 0]\n[[particle]]\nposition = [1, 1, 0]\n\
     [[particle]]\nposition = [0, 0.5, 0]\n[[constraint]]\nparticles = [0, 2]\n\
     [[anchor]]\nparticles = [0, 1]\norigin = [0, 1, 0]\npath = [\n  { time = 0 },\n\
       { time = 1, translation = [1, 0, 0] },\n  { time = 2, translation = [1, 0, 0] },\n\
       { time = 3, translation = [1, 0, 0], rotation = [0, 0, 1, 1] },\n]\n";

#[test]
fn a_frame_carries_its_particles_along_its_path() {
    let mut solver = solver(CARRIED);
    assert_eq!(
        (solver.particle(0).flags, solver.particle(0).inverse_mass),
        (ParticleFlags::ANCHORED, 0.0)
    );
    for _ in 0..5 {
        step(&mut solver, 10);
    }
    assert_near("halfway", 0.5, position(&solver, 0)[0], 1e-6);
    assert_close("speed", 1.0, velocity(&solver, 0)[0], 1e-4);
    step(&mut solver, 50);
    assert_near("end of the translation", 1.0, position(&solver, 0)[0], 1e-6);
    step(&mut solver, 100);
    assert_eq!((position(&solver, 1), velocity(&solver, 1)), ([2.0, 1.0, 0.0], [0.0; 3]));
    step(&mut solver, 100);
    // The frame rotates about its origin, which has moved with the translation.
    assert_near("x after the rotation", 1.0, position(&solver, 1)[0], 1e-5);
    assert_near("y after the rotation", 2.0, position(&solver, 1)[1], 1e-5);
    step(&mut solver, 300);
    assert_near("the frame stands still after its path", 2.0, position(&solver, 1)[1], 1e-5);
    assert_eq!(velocity(&solver, 1), [0.0; 3]);
}

#[test]
fn a_repeated_path_starts_again_when_it_ends() {
    let text = "[solver]\nrate_hz = 100\n[[particle]]\nposition = [0, 0, 0]\n\
         [[anchor]]\nparticles = [0]\nrepeat = true\npath = [{ time = 0 }, { time = 1, translation = [0, 2, 0] },\n\
         { time = 2 }]\n";
    let mut solver = solver(text);
    for (steps, expected) in [(50, 1.0), (50, 2.0), (50, 1.0), (50, 0.0), (50, 1.0), (550, 0.0)] {
        step(&mut solver, steps);
        assert_near("height", expected, position(&solver, 0)[1], 1e-5);
    }
}

#[test]
fn a_frame_moved_by_a_client_stands_still_until_a_reset_restores_its_path() {
    let mut solver = solver(CARRIED);
    step(&mut solver, 50);
    let pose = Pose { translation: [0.0, 0.5, 0.0], rotation: NO_TURN };
    solver.move_anchor(0, pose).unwrap();
    step(&mut solver, 1);
    assert_eq!(position(&solver, 1), [1.0, 1.5, 0.0]);
    assert_close("speed up", 50.0, velocity(&solver, 1)[1], 1e-3);
    step(&mut solver, 100);
    assert_eq!((position(&solver, 1), velocity(&solver, 1)), ([1.0, 1.5, 0.0], [0.0; 3]));
    solver.reset();
    step(&mut solver, 51);
    assert_near("back on its path", 0.5, position(&solver, 0)[0], 1e-6);
    assert_eq!(solver.move_anchor(1, pose), Err(Reason::UnknownAnchor));
    let wrong = Pose { rotation: [0.0; 4], ..pose };
    assert_eq!(solver.move_anchor(0, wrong), Err(Reason::OutOfRange));
    let wrong = Pose { translation: [f32::NAN, 0.0, 0.0], ..pose };
    assert_eq!(solver.move_anchor(0, wrong), Err(Reason::NonFinite));
}

#[test]
fn an_anchor_overrides_a_pin_of_the_scene_and_a_client_can_pin_and_grab_its_particles() {
    let text =
        CARRIED.replacen("position = [0, 1, 0]\n", "position = [0, 1, 0]\npinned = true\n", 1);
    let mut solver = solver(&text);
    step(&mut solver, 50);
    assert_near("follows its frame", 0.5, position(&solver, 0)[0], 1e-6);
    solver.pin(0).unwrap();
    let held = solver.particle(0).position;
    step(&mut solver, 20);
    assert_eq!(solver.particle(0).position, held);
    assert_eq!(solver.particle(0).velocity, [0.0; 3]);
    solver.unpin(0).unwrap();
    solver.grab(5, Grab { particle: 0, target: [0.5, 1.2, 0.0], over_s: 0.1 }).unwrap();
    step(&mut solver, 10);
    assert_near("grabbed", 1.2, position(&solver, 0)[1], 1e-6);
    solver.release(5, 0).unwrap();
    step(&mut solver, 20);
    assert_near("back on its frame", 1.0, position(&solver, 0)[0], 1e-6);
}

#[test]
fn a_state_with_anchors_continues_bit_for_bit_from_a_keyframe() {
    let scene = format!(
        "version = 1\n{CARRIED}[[collider]]\nshape = \"box\"\ncenter = [0, 0, 0]\nhalf_extents = [0.2, 0.2, 0.2]\n\
         velocity = [0.1, 0, 0]\nangular_velocity = [0, 0.3, 1]\n[[collider]]\nshape = \"sphere\"\ncenter = [0, 0, 0]\nradius = 0.3\n"
    );
    let scene = sim_solver::Scene::from_toml(&scene, "test").unwrap();
    let mut solver = sim_solver::Solver::new(&scene);
    step(&mut solver, 70);
    solver
        .move_anchor(0, Pose { translation: [0.1, 0.2, 0.3], rotation: [0.1, 0.2, 0.3, 0.4] })
        .unwrap();
    solver.move_collider(1, Pose { translation: [0.1, -0.2, 0.0], rotation: NO_TURN }).unwrap();
    step(&mut solver, 7);
    let particles: Vec<_> = super::particles(&solver).collect();
    let keyframe = sim_solver::Keyframe::decode(&solver.keyframe().encode()).unwrap();
    let mut again = sim_solver::Solver::new(&scene);
    again.restore(&particles, &keyframe).unwrap();
    assert!(again.colliders().eq(solver.colliders()));
    for _ in 0..300 {
        step(&mut solver, 1);
        step(&mut again, 1);
        assert_eq!(bits(&solver), bits(&again));
    }
}
