//! The same scene and commands give the same bits, in one run or restored in the middle from a
//! snapshot and a keyframe.

use proptest::prelude::*;
use sim_solver::{
    Grab, Keyframe, MOTION_POINTS_MAX, ParameterValue, Part, Particle, ParticleFlags, Pose, Push,
    RestoreError, Scene, Solver, Sphere, Sweep, builtin,
};

#[derive(Debug, Clone)]
enum RandomCommand {
    Pin(u32),
    Unpin(u32),
    Grab(u32, [f32; 3]),
    Move(u32, [f32; 3]),
    Release(u32),
    Push([f32; 3]),
    Cut(u32),
    CutRadius([f32; 3]),
    CutSegment([f32; 3], [f32; 3]),
    MoveAnchor([f32; 3]),
    MoveCollider(u32, [f32; 3]),
    Set(usize, f32),
    SetBlock(u32, f32),
    Reset,
}

/// Parameters with a number. Each has the range to which 0 to 1 is mapped.
const SETTINGS: [(&str, f32, f32); 12] = [
    ("damping", 0.0, 5.0),
    ("wind.drag", 0.0, 2.0),
    ("relaxation", 0.5, 1.5),
    ("max_stretch", 1.05, 2.0),
    ("tear_stretch", 1.1, 3.0),
    ("tear_distance", 0.01, 0.5),
    ("tear_force", 1.0, 1000.0),
    ("compliance", 0.0, 1e-3),
    ("stiffness", 0.1, 1.0),
    ("bending", 0.0, 0.1),
    ("friction", 0.0, 2.0),
    ("restitution", -0.5, 1.0),
];

fn random_command() -> impl Strategy<Value = RandomCommand> {
    // Few particles, so that pins, grabs and releases coincide.
    let particle = 80..90_u32;
    let target = prop::array::uniform3(-1.0..1.0_f32);
    let point = target.clone();
    prop_oneof![
        4 => particle.clone().prop_map(RandomCommand::Pin),
        4 => particle.clone().prop_map(RandomCommand::Unpin),
        6 => (particle.clone(), target.clone()).prop_map(|(one, to)| RandomCommand::Grab(one, to)),
        6 => (particle.clone(), target).prop_map(|(one, to)| RandomCommand::Move(one, to)),
        4 => particle.prop_map(RandomCommand::Release),
        2 => point.clone().prop_map(RandomCommand::Push),
        2 => (0..400_u32).prop_map(RandomCommand::Cut),
        1 => point.clone().prop_map(RandomCommand::CutRadius),
        1 => (point.clone(), point.clone()).prop_map(|(from, to)| RandomCommand::CutSegment(from, to)),
        1 => point.clone().prop_map(RandomCommand::MoveAnchor),
        1 => (0..5_u32, point).prop_map(|(index, to)| RandomCommand::MoveCollider(index, to)),
        3 => (0..SETTINGS.len(), 0.0..1.0_f32).prop_map(|(which, value)| RandomCommand::Set(which, value)),
        2 => (0..6_u32, 0.0..0.1_f32).prop_map(|(block, value)| RandomCommand::SetBlock(block, value)),
        3 => Just(RandomCommand::Reset),
    ]
}

/// Applies a command. A rejection is a valid outcome, too.
fn apply(solver: &mut Solver, command: &RandomCommand) {
    // Long and short motions.
    let over_s = |[x, ..]: [f32; 3]| 0.6 * x.abs();
    let grab = |particle, target| Grab { particle, target, over_s: over_s(target) };
    let _outcome = match *command {
        RandomCommand::Pin(particle) => solver.pin(particle),
        RandomCommand::Unpin(particle) => solver.unpin(particle),
        RandomCommand::Grab(particle, target) => solver.grab(1, grab(particle, target)),
        RandomCommand::Move(particle, target) => solver.move_grabbed(1, grab(particle, target)),
        RandomCommand::Release(particle) => solver.release(1, particle),
        RandomCommand::Push(center) => solver.push(Push {
            sphere: Sphere { center, radius: 0.4 },
            delta: center,
            limit: Some(0.01),
        }),
        RandomCommand::Cut(constraint) => solver.cut(constraint),
        RandomCommand::CutRadius(center) => solver.cut_radius(Sphere { center, radius: 0.1 }),
        RandomCommand::CutSegment(from, to) => {
            solver.cut_segment(Sweep { from, to, direction: [0.0, 0.0, 1.0] })
        }
        RandomCommand::MoveAnchor(translation) => {
            let pose = Pose { translation, rotation: [0.1, 0.0, 0.2, 1.0] };
            solver.move_anchor_over(0, pose, over_s(translation))
        }
        RandomCommand::MoveCollider(collider, translation) => {
            let pose = Pose { translation, rotation: [0.0, 0.0, 0.0, 1.0] };
            solver.move_collider_over(collider, pose, over_s(translation))
        }
        RandomCommand::Set(which, share) => {
            let (name, low, high) = SETTINGS[which];
            solver.set(name, ParameterValue::Number(low + share * (high - low)), None)
        }
        RandomCommand::SetBlock(block, value) => {
            solver.set_for("bending", ParameterValue::Number(value), Part::Block(block))
        }
        RandomCommand::Reset => {
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

/// Copies a state through its snapshot and keyframe only.
fn copy(solver: &Solver, scene: &Scene) -> Solver {
    let mut copy = Solver::new(scene);
    let keyframe = Keyframe::decode(&solver.keyframe().encode()).unwrap();
    copy.restore(&particles(solver), &keyframe).unwrap();
    copy
}

fn assert_continues_alike(mut solver: Solver, scene: &Scene) {
    let mut copy = copy(&solver, scene);
    for _ in 0..500 {
        solver.step();
        copy.step();
        assert_eq!(solver.state_hash(), copy.state_hash());
    }
}

#[test]
fn a_collider_moved_together_with_a_reset_has_its_new_pose_in_that_step() {
    let text = "version = 1\ngravity = [0, 0, 0]\n[[particle]]\nposition = [0, 0.1, 0]\n\
         [[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0\n";
    let scene = Scene::from_toml(text, "test").unwrap();
    let mut solver = Solver::new(&scene);
    solver.step();
    solver.reset();
    let pose = Pose { translation: [0.0, 0.5, 0.0], rotation: [0.0, 0.0, 0.0, 1.0] };
    solver.move_collider(0, pose).unwrap();
    solver.step();
    let shape = solver.colliders().next().unwrap().shape;
    assert!(matches!(shape, sim_solver::ColliderGeometry::Plane { offset: 0.5, .. }), "{shape:?}");
    assert_continues_alike(solver, &scene);
}

#[test]
fn cuts_and_a_pin_at_one_boundary_leave_the_same_tethers_in_a_copy() {
    // Particle 3 has two paths. Cut the short one, pin, and cut another with a lower index.
    let text = "version = 1\n[solver]\ntethers = true\n[[particle]]\nposition = [0, 0, 0]\npinned = true\n\
         [[particle]]\nposition = [1, 0, 0]\n[[particle]]\nposition = [0, 0, 1.5]\n\
         [[particle]]\nposition = [1, 0, 1.5]\n[[particle]]\nposition = [9, 0, 0]\n\
         [[particle]]\nposition = [9, 0, 1]\n[[constraint]]\nparticles = [4, 5]\n\
         [[constraint]]\nparticles = [0, 2]\n[[constraint]]\nparticles = [2, 3]\nrest_length = 3\n\
         [[constraint]]\nparticles = [0, 1]\n[[constraint]]\nparticles = [1, 3]\n";
    let scene = Scene::from_toml(text, "test").unwrap();
    let mut solver = Solver::new(&scene);
    solver.cut(4).unwrap();
    solver.pin(4).unwrap();
    solver.cut(0).unwrap();
    solver.step();
    assert_continues_alike(solver, &scene);
}

#[test]
fn keyframes_with_impossible_numbers_are_refused() {
    let scene = scene();
    let mut solver = Solver::new(&scene);
    solver.grab(1, Grab { particle: 90, target: [0.5; 3], over_s: 0.25 }).unwrap();
    solver.step();
    let bytes = solver.keyframe().encode();
    let restored = |bytes: &[u8]| {
        let keyframe = Keyframe::decode(bytes).unwrap();
        Solver::new(&scene).restore(&particles(&solver), &keyframe)
    };
    assert_eq!(restored(&bytes), Ok(()));
    // The version has four bytes and the pause flag one. The scene step follows as a varint.
    assert_eq!(bytes[5], 1);
    let ages = [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x01];
    let old = [&bytes[..5], &ages, &bytes[6..]].concat();
    assert!(restored(&old).unwrap_err().to_string().contains("scene step"));
    // 60 steps of a quarter of a second, minus the one already made.
    let place = bytes.iter().rposition(|byte| *byte == 59).unwrap();
    let slow = [&bytes[..place], &[0xff, 0xff, 0xff, 0xff, 0x0f], &bytes[place + 1..]].concat();
    assert!(restored(&slow).unwrap_err().to_string().contains("exceeds the longest duration"));
    let long = [&bytes[..], &[0]].concat();
    assert!(Keyframe::decode(&long).unwrap_err().to_string().contains("1 bytes follow"));
}

/// A built-in scene, and the scenes that use every mechanism.
fn texts() -> [&'static str; 7] {
    [
        builtin::text("curtain").unwrap(),
        include_str!("scenes/everything.toml"),
        include_str!("scenes/stiffness.toml"),
        include_str!("scenes/touching.toml"),
        include_str!("scenes/surfaces.toml"),
        include_str!("scenes/draped.toml"),
        include_str!("scenes/bends.toml"),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn a_snapshot_and_its_keyframe_are_the_complete_state(
        steps in prop::collection::vec(prop::collection::vec(random_command(), 0..5), 1..60),
        stop in 0..60_usize,
        text in 0..texts().len(),
        is_used in any::<bool>(),
    ) {
        let scene = Scene::from_toml(texts()[text], "test").unwrap();
        let mut whole = Solver::new(&scene);
        let mut restored = None;
        for (index, commands) in steps.iter().enumerate() {
            if index == stop.min(steps.len() - 1) {
                let bytes = whole.keyframe().encode();
                prop_assert!(bytes.len() <= whole.keyframe_size_bytes_max());
                let keyframe = Keyframe::decode(&bytes).unwrap();
                // Nothing of the earlier state may remain.
                let mut solver = if is_used { whole.clone() } else { Solver::new(&scene) };
                if is_used {
                    solver.cut(3).ok();
                    solver.set("substeps", ParameterValue::Number(7.0), None).unwrap();
                    solver.step();
                }
                solver.restore(&particles(&whole), &keyframe).unwrap();
                prop_assert_eq!(solver.state_hash(), whole.state_hash());
                restored = Some(solver);
            }
            for solver in std::iter::once(&mut whole).chain(&mut restored) {
                for command in commands {
                    apply(solver, command);
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
fn the_state_hash_is_the_hash_of_the_published_bytes() {
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
fn minus_zero_is_never_published() {
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
fn an_invalid_state_is_refused_and_changes_nothing() {
    let mut solver = Solver::new(&scene());
    solver.grab(1, Grab { particle: 90, target: [0.0; 3], over_s: 0.0 }).unwrap();
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
        changed(|one| one.flags = ParticleFlags::PINNED),
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
fn a_pinned_particle_with_a_velocity_is_refused() {
    let mut solver = Solver::new(&scene());
    let (keyframe, mut particles) = (solver.keyframe(), particles(&solver));
    assert_eq!(particles[0].flags, ParticleFlags::PINNED);
    particles[0].velocity = [1.0, 0.0, 0.0];
    let error = solver.restore(&particles, &keyframe).unwrap_err().to_string();
    assert!(error.contains("it is pinned or frozen, but has a velocity"), "{error}");
}

#[test]
fn a_zero_with_a_minus_sign_is_refused_because_no_step_publishes_one() {
    let mut solver = Solver::new(&scene());
    let (keyframe, good) = (solver.keyframe(), particles(&solver));
    for number in 0..7 {
        let mut wrong = good.clone();
        // A pinned particle, whose inverse mass is 0.
        let Particle { position, velocity, inverse_mass, .. } = &mut wrong[0];
        *position.iter_mut().chain(velocity).chain([inverse_mass]).nth(number).unwrap() = -0.0;
        let error = solver.restore(&wrong, &keyframe).unwrap_err().to_string();
        assert!(error.contains("a zero has a minus sign"), "{error}");
    }
    solver.restore(&good, &keyframe).unwrap();
}

#[test]
fn in_two_dimensions_a_keyframe_with_a_target_off_the_plane_is_refused() {
    let [mut plane, mut space] = [2, 3].map(|dimensions| {
        let text =
            format!("version = 1\ndimensions = {dimensions}\n[[particle]]\nposition = [0, 0, 0]\n");
        Solver::new(&Scene::from_toml(&text, "test").unwrap())
    });
    space.grab(1, Grab { particle: 0, target: [0.0, 0.0, 0.5], over_s: 0.1 }).unwrap();
    let error = plane.restore(&particles(&space), &space.keyframe()).unwrap_err().to_string();
    assert!(error.contains("a target lies outside of the plane"), "{error}");
}

#[test]
fn a_keyframe_with_tethers_is_refused_by_a_scene_without_them() {
    let [with, mut without] = [true, false].map(|tethers| {
        let text = format!(
            "version = 1\n[solver]\ntethers = {tethers}\n[[particle]]\nposition = [0, 0, 0]\n\
             pinned = true\n[[particle]]\nposition = [1, 0, 0]\n[[constraint]]\n\
             particles = [0, 1]\n"
        );
        Solver::new(&Scene::from_toml(&text, "test").unwrap())
    });
    let error = without.restore(&particles(&with), &with.keyframe()).unwrap_err().to_string();
    assert!(error.contains("its tethers belong to another scene"), "{error}");
}

#[test]
fn a_keyframe_whose_tethers_hang_on_a_free_particle_is_refused() {
    let text = "version = 1\n[solver]\ntethers = true\n[[particle]]\nposition = [0, 0, 0]\n\
                pinned = true\n[[particle]]\nposition = [1, 0, 0]\n[[constraint]]\n\
                particles = [0, 1]\n";
    let scene = Scene::from_toml(text, "test").unwrap();
    let mut solver = Solver::new(&scene);
    // The boundary is not finished, so the tethers are those of the pinned particle.
    solver.unpin(0).unwrap();
    let restored = Solver::new(&scene).restore(&particles(&solver), &solver.keyframe());
    let error = restored.unwrap_err().to_string();
    assert!(error.contains("a root of its tethers is not fixed"), "{error}");
    solver.finish_boundary();
    Solver::new(&scene).restore(&particles(&solver), &solver.keyframe()).unwrap();
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

/// Every particle is pinned and grabbed, one of them on a path of as many points as there can be, and every constraint
/// is torn, in a scene with tethers and in one without.
#[test]
fn the_largest_keyframe_of_a_scene_fits_into_the_announced_size() {
    for name in ["curtain", "tearable-cloth"] {
        let scene = Scene::from_toml(builtin::text(name).unwrap(), name).unwrap();
        let mut solver = Solver::new(&scene);
        let apply = |solver: &mut Solver, action: &sim_types::Action| {
            solver.apply(0, action).unwrap();
        };
        for particle in 0..u32::try_from(solver.particle_count()).unwrap() {
            apply(&mut solver, &sim_types::Action::Pin { particle });
            let target = [0.5, 0.5, 0.0];
            // Larger ids than commands may have: a restored keyframe can name them.
            solver.grab(u64::MAX, Grab { particle, target, over_s: 0.1 }).unwrap();
        }
        for constraint in 0..u32::try_from(solver.constraint_count()).unwrap() {
            apply(&mut solver, &sim_types::Action::Cut { constraint });
        }
        solver.release_of_any(0).unwrap();
        solver.grab(7, Grab { particle: 0, target: [0.5, 0.5, 0.0], over_s: 0.1 }).unwrap();
        let point = |index| sim_types::PathPoint {
            time: f64::from(index) * 0.1,
            ..sim_types::PathPoint::AT_LOAD
        };
        let points: Vec<_> = (1..u32::try_from(MOTION_POINTS_MAX).unwrap()).map(point).collect();
        let particle = sim_types::MovedObject::Particle;
        for action in sim_types::Action::follow(particle, 0, &points, false).unwrap() {
            solver.apply(7, &action).unwrap();
        }
        solver.finish_boundary();
        solver.step();
        let size_bytes = solver.keyframe().encode().len();
        let size_bytes_max = solver.keyframe_size_bytes_max();
        assert!(size_bytes <= size_bytes_max, "{name}: {size_bytes} > {size_bytes_max}");
        // The bound is not much larger: it decides how much shared memory a node takes.
        assert!(2 * size_bytes > size_bytes_max, "{name}: {size_bytes} of {size_bytes_max}");
    }
}

#[test]
fn the_state_of_an_empty_scene_has_the_hash_of_no_bytes() {
    let mut solver = Solver::new(&Scene::from_toml("version = 1\n", "nothing").unwrap());
    solver.step();
    assert_eq!(solver.state_hash(), xxhash_rust::xxh3::xxh3_64(&[]));
}
