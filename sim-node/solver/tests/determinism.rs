//! The same scene and commands give the same bits, in one piece or restored in the middle from a
//! snapshot and a keyframe.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use proptest::prelude::*;
use sim_solver::{Grip, Keyframe, Particle, RestoreError, Scene, Solver, builtin, flag};

#[derive(Debug, Clone)]
enum Wish {
    Pin(u32),
    Unpin(u32),
    Grab(u32, [f32; 3]),
    Move(u32, [f32; 3]),
    Release(u32),
    Reset,
}

fn wish() -> impl Strategy<Value = Wish> {
    // A few particles only, so that pins, grabs and releases meet.
    let particle = 80..90_u32;
    let target = prop::array::uniform3(-1.0..1.0_f32);
    prop_oneof![
        4 => particle.clone().prop_map(Wish::Pin),
        4 => particle.clone().prop_map(Wish::Unpin),
        6 => (particle.clone(), target.clone()).prop_map(|(one, to)| Wish::Grab(one, to)),
        6 => (particle.clone(), target).prop_map(|(one, to)| Wish::Move(one, to)),
        4 => particle.prop_map(Wish::Release),
        1 => Just(Wish::Reset),
    ]
}

/// Applies a wish; a rejection is as good an outcome as any.
fn apply(solver: &mut Solver, wish: &Wish) {
    let grip = |particle, target| Grip { particle, target, over_s: 0.05 };
    let _outcome = match *wish {
        Wish::Pin(particle) => solver.pin(particle),
        Wish::Unpin(particle) => solver.unpin(particle),
        Wish::Grab(particle, target) => solver.grab(1, grip(particle, target)),
        Wish::Move(particle, target) => solver.move_grabbed(1, grip(particle, target)),
        Wish::Release(particle) => solver.release(1, particle),
        Wish::Reset => {
            solver.reset();
            Ok(())
        }
    };
}

fn scene() -> Scene {
    Scene::from_toml(builtin::text("curtain").unwrap(), "curtain").unwrap()
}

fn particles(solver: &Solver) -> Vec<Particle> {
    (0..solver.particle_count()).map(|index| solver.particle(index)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_snapshot_and_its_keyframe_are_the_complete_state(
        steps in prop::collection::vec(prop::collection::vec(wish(), 0..3), 1..60),
        cut in 0..60_usize,
    ) {
        let mut whole = Solver::new(&scene());
        let mut restored = None;
        for (index, wishes) in steps.iter().enumerate() {
            if index == cut.min(steps.len() - 1) {
                let bytes = whole.keyframe().encode();
                prop_assert!(bytes.len() <= whole.keyframe_size_bytes_max());
                let keyframe = Keyframe::decode(&bytes).unwrap();
                let mut solver = Solver::new(&scene());
                solver.restore(&particles(&whole), &keyframe).unwrap();
                prop_assert_eq!(solver.state_hash(), whole.state_hash());
                restored = Some(solver);
            }
            for solver in std::iter::once(&mut whole).chain(&mut restored) {
                for wish in wishes {
                    apply(solver, wish);
                }
                solver.step();
            }
        }
        let restored = restored.unwrap();
        prop_assert_eq!(restored.state_hash(), whole.state_hash());
        prop_assert_eq!(restored.scene_step(), whole.scene_step());
        prop_assert_eq!(restored.keyframe(), whole.keyframe());
    }
}

#[test]
fn the_hash_is_that_of_the_published_bytes() {
    let mut solver = Solver::new(&scene());
    for _ in 0..100 {
        solver.step();
    }
    let particles = particles(&solver);
    let expected = xxhash_rust::xxh3::xxh3_64(bytemuck::cast_slice(&particles));
    assert_eq!(solver.state_hash(), expected);
}

#[test]
fn a_pinned_scene_keeps_its_hash() {
    let text = "version = 1\n[[particle]]\nposition = [0, 0, 0]\npinned = true\n";
    let mut solver = Solver::new(&Scene::from_toml(text, "test").unwrap());
    let hash = solver.state_hash();
    for _ in 0..10 {
        solver.step();
        assert_eq!(solver.state_hash(), hash);
    }
}

#[test]
fn no_published_number_is_minus_zero() {
    let text = "version = 1\ngravity = [-0.0, -9.81, 0]\n[[particle]]\nposition = [-0.0, 0, -0.0]\nvelocity = [-0.0, 0, 0]\n";
    let mut solver = Solver::new(&Scene::from_toml(text, "test").unwrap());
    for _ in 0..3 {
        let particle = solver.particle(0);
        for number in particle.position.iter().chain(&particle.velocity) {
            assert!(*number != 0.0 || number.is_sign_positive());
        }
        solver.step();
    }
}

#[test]
fn a_state_that_is_none_is_refused_and_changes_nothing() {
    let mut solver = Solver::new(&scene());
    solver.grab(1, Grip { particle: 90, target: [0.0; 3], over_s: 0.0 }).unwrap();
    solver.step();
    let (keyframe, good) = (solver.keyframe(), particles(&solver));
    let hash = solver.state_hash();
    let changed = |change: fn(&mut Particle)| {
        let mut particles = good.clone();
        change(&mut particles[90]);
        particles
    };
    let cases = [
        changed(|one| one.position[0] = f32::NAN),
        changed(|one| one.flags = 1 << 9),
        changed(|one| one.flags = 0),
        changed(|one| (one.flags, one.inverse_mass) = (0, 1.0)),
        changed(|one| one.flags = flag::PINNED),
        good[1..].to_vec(),
    ];
    for particles in cases {
        let error = solver.restore(&particles, &keyframe).unwrap_err();
        assert!(!matches!(error, RestoreError::Particle { particle, .. } if particle != 90));
        assert_eq!(solver.state_hash(), hash);
    }
    assert!(solver.restore(&good, &keyframe).is_ok());
}

#[test]
fn damaged_keyframes_are_refused() {
    let bytes = Solver::new(&scene()).keyframe().encode();
    let mut other_version = bytes.clone();
    other_version[0] = 99;
    for damaged in [&[][..], &bytes[..3], &bytes[..bytes.len() - 1], &other_version] {
        assert!(Keyframe::decode(damaged).is_err());
    }
}
