//! Mistakes of users, and scenes that blow up: the state stays finite, and the run continues.

use sim_solver::{Grab, ParticleFlags, Scene, Solver};

use super::{
    assert_at_most, assert_near, bits, distance, particles, position, solver, step, stepped,
    velocity,
};

fn assert_finite(solver: &Solver) {
    for (index, one) in particles(solver).enumerate() {
        let numbers = one.position.iter().chain(&one.velocity);
        assert!(numbers.into_iter().all(|number| number.is_finite()), "particle {index}: {one:?}");
    }
}

/// A rigid stick with a rest length of 1e30 m gives its ends a speed beyond f32. An ordinary stick
/// joins one of them to a third particle.
const BLOWS_UP: &str = "gravity = [0, 0, 0]\n[[particle]]\nposition = [0, 0, 0]\n[[particle]]\nposition = [1, 0, 0]\n\
     [[particle]]\nposition = [0, 1, 0]\n[[constraint]]\nparticles = [0, 1]\nrest_length = 1e30\n\
     [[constraint]]\nparticles = [0, 2]\nrest_length = 0.5\n";

#[test]
fn particles_that_blow_up_freeze_at_their_last_position_and_the_others_continue() {
    let mut solver = stepped(BLOWS_UP, 1);
    assert_eq!(solver.frozen_count(), 2);
    for (index, start) in [(0, [0.0, 0.0, 0.0]), (1, [1.0, 0.0, 0.0])] {
        let one = solver.particle(index);
        assert_eq!((one.position, one.velocity), (start, [0.0; 3]));
        assert_eq!((one.flags, one.inverse_mass), (ParticleFlags::FROZEN, 0.0));
    }
    // The third particle hangs on a stick to a frozen particle.
    step(&mut solver, 300);
    assert_near("length", 0.5, distance(&solver, 0, 2), 1e-5);
    assert_eq!((solver.particle(2).flags, solver.frozen_count()), (0, 2));
}

#[test]
fn a_frozen_particle_refuses_commands_until_a_reset() {
    let mut solver = stepped(BLOWS_UP, 1);
    let before = bits(&solver);
    let grab = Grab { particle: 0, target: [0.0; 3], over_s: 0.0 };
    for refused in [solver.pin(0), solver.unpin(0), solver.grab(1, grab), solver.release(1, 0)] {
        assert_eq!(refused, Err(sim_solver::Reason::NoEffectHere));
    }
    assert_eq!(bits(&solver), before);
    solver.reset();
    step(&mut solver, 1);
    assert_eq!((solver.particle(0).flags, solver.particle(0).inverse_mass), (0, 1.0));
    assert_eq!(solver.frozen_count(), 0);
    step(&mut solver, 1);
    assert_eq!(solver.frozen_count(), 2);
}

#[test]
fn a_restored_state_has_its_own_number_of_frozen_particles() {
    let mut solver = stepped(BLOWS_UP, 0);
    let before = (solver.particles().to_vec(), solver.keyframe());
    step(&mut solver, 1);
    let after = (solver.particles().to_vec(), solver.keyframe());
    for ((particles, keyframe), frozen_count) in [(&before, 0), (&after, 2), (&before, 0)] {
        solver.restore(particles, keyframe).unwrap();
        assert_eq!(solver.frozen_count(), frozen_count);
    }
}

#[test]
fn a_state_with_frozen_particles_continues_bit_for_bit_from_a_keyframe() {
    let scene = Scene::from_toml(&format!("version = 1\n{BLOWS_UP}"), "test").unwrap();
    let mut solver = Solver::new(&scene);
    step(&mut solver, 3);
    let state: Vec<_> = particles(&solver).collect();
    let mut again = Solver::new(&scene);
    again.restore(&state, &solver.keyframe()).unwrap();
    step(&mut solver, 50);
    step(&mut again, 50);
    assert_eq!(bits(&solver), bits(&again));
}

#[test]
fn scenes_with_few_or_no_particles_and_constraints_run() {
    for text in [
        "",
        "[[particle]]\nposition = [0, 0, 0]\n",
        "[[particle]]\nposition = [0, 0, 0]\npinned = true\n[[particle]]\nposition = [1, 0, 0]\npinned = true\n[[constraint]]\nparticles = [0, 1]\nrest_length = 3\n",
    ] {
        let mut solver = solver(text);
        step(&mut solver, 100);
        assert_finite(&solver);
    }
    let pinned = "[[generate]]\nshape = \"rope\"\ncount = 3\nfrom = [0, 0, 0]\nto = [1, 0, 0]\npinned = [0, 1, 2]\n";
    assert_eq!(stepped(pinned, 50).state_hash(), solver(pinned).state_hash());
}

#[test]
fn mass_ratios_of_a_million_gain_no_energy() {
    for masses in [(1e6, 1.0), (1.0, 1e6)] {
        let text = format!(
            "[solver]\nrate_hz = 60\nsubsteps = 4\n[[particle]]\nposition = [0, 0, 0]\npinned = true\n\
             [[particle]]\nposition = [1, 0, 0]\nmass = {}\n[[particle]]\nposition = [2, 0, 0]\nmass = {}\n\
             [[constraint]]\nparticles = [0, 1]\n[[constraint]]\nparticles = [1, 2]\n",
            masses.0, masses.1
        );
        let mut solver = solver(&text);
        let weight = [0.0, masses.0, masses.1];
        let energy = |solver: &Solver| -> f64 {
            (1..3)
                .map(|index| {
                    let squared: f64 = velocity(solver, index).iter().map(|axis| axis * axis).sum();
                    weight[index] * (squared / 2.0 + 9.81 * position(solver, index)[1])
                })
                .sum()
        };
        for _ in 0..1200 {
            step(&mut solver, 1);
            assert_finite(&solver);
            let found = energy(&solver);
            assert!(found <= 1e-3 * 1e6 * 9.81 * 2.0, "{masses:?}: {found} J");
        }
    }
}

#[test]
fn a_hub_of_ten_thousand_spokes_runs_and_holds() {
    let mut text = "version = 1\n[solver]\nrate_hz = 60\nsubsteps = 2\n[[particle]]\nposition = [0, 0, 0]\npinned = true\n".to_owned();
    for spoke in 1..=10_000_u32 {
        let (x, z) = (f64::from(spoke % 100) * 0.01 - 0.5, f64::from(spoke / 100) * 0.01 - 0.5);
        text += &format!(
            "[[particle]]\nposition = [{x}, -1, {z}]\n[[constraint]]\nparticles = [0, {spoke}]\n"
        );
    }
    let mut solver = Solver::new(&Scene::from_toml(&text, "hub").unwrap());
    let lengths: Vec<_> = solver.constraints().map(|one| f64::from(one.rest_length)).collect();
    step(&mut solver, 60);
    assert_finite(&solver);
    for (spoke, length) in lengths.iter().enumerate() {
        let found = distance(&solver, 0, spoke + 1);
        assert!((found - length).abs() < 1e-3, "spoke {spoke}: {found}, not {length}");
    }
}

#[test]
fn duplicates_and_coincident_particles_stay_finite_and_hold() {
    let text = "[solver]\nrate_hz = 60\nsubsteps = 4\n[[particle]]\nposition = [0, 0, 0]\npinned = true\n\
         [[particle]]\nposition = [0, -1, 0]\n[[particle]]\nposition = [0, -1, 0]\n\
         [[constraint]]\nparticles = [0, 1]\n[[constraint]]\nparticles = [0, 1]\n[[constraint]]\nparticles = [1, 0]\n\
         [[constraint]]\nparticles = [1, 2]\nrest_length = 0\n[[constraint]]\nparticles = [0, 2]\n";
    let solver = stepped(text, 600);
    assert_finite(&solver);
    assert_near("length", 1.0, distance(&solver, 0, 1), 1e-3);
}

#[test]
fn a_step_of_a_second_stays_finite() {
    for method in ["xpbd", "pbd"] {
        let text = format!(
            "[solver]\nrate_hz = 1\nsubsteps = 1\nmethod = \"{method}\"\n[[generate]]\nshape = \"cloth\"\n\
             columns = 12\nrows = 10\nspacing = 0.1\n"
        );
        let mut solver = solver(&text);
        for _ in 0..600 {
            step(&mut solver, 1);
            assert_finite(&solver);
        }
        assert_eq!(solver.frozen_count(), 0);
    }
}

#[test]
fn a_grab_follows_a_target_a_million_metres_away_at_max_speed_and_stays_finite() {
    let mut solver = solver(
        "[solver]\nmax_speed = 1000\n[[generate]]\nshape = \"cloth\"\ncolumns = 10\nrows = 10\nspacing = 0.1\n",
    );
    solver.grab(1, Grab { particle: 55, target: [1e6, 0.0, 0.0], over_s: 0.01 }).unwrap();
    for _ in 0..240 {
        step(&mut solver, 1);
        assert_finite(&solver);
        let speed = velocity(&solver, 55).iter().map(|axis| axis * axis).sum::<f64>().sqrt();
        assert_at_most("speed of the grabbed particle", 1000.0 * 1.001, speed);
    }
    solver.release(1, 55).unwrap();
    step(&mut solver, 240);
    assert_finite(&solver);
}

#[test]
fn a_thousand_tears_in_one_step_are_complete_and_in_order() {
    let text = "[solver]\nrate_hz = 60\n[[generate]]\nshape = \"cloth\"\ncolumns = 60\nrows = 60\n\
         spacing = 0.1\ncompliance = { structural = 1, shear = 1 }\n";
    let mut solver = solver(text);
    // The cloth hangs and is stretched. Then a limit forbids almost any stretch.
    step(&mut solver, 60);
    solver.set("tear_distance", sim_solver::ParameterValue::Number(0.0), None).unwrap();
    let mut seen = 0;
    for _ in 0..60 {
        let before = solver.torn().to_vec();
        step(&mut solver, 1);
        let torn = solver.torn();
        assert_eq!(torn[..before.len()], before);
        assert_eq!(torn.len() - before.len(), solver.new_torn_count());
        assert!(torn[before.len()..].is_sorted());
        seen += solver.new_torn_count();
        assert_finite(&solver);
    }
    assert!(seen > 1000, "{seen}");
    let mut all = solver.torn().to_vec();
    all.sort_unstable();
    all.dedup();
    assert_eq!(all.len(), seen);
}

#[test]
fn a_particle_unpinned_after_a_long_time_falls_from_rest() {
    let mut solver = solver(
        "[solver]\nrate_hz = 60\nsubsteps = 1\n[[particle]]\nposition = [0, 0, 0]\nvelocity = [3, 3, 3]\n",
    );
    step(&mut solver, 10);
    solver.pin(0).unwrap();
    let held = solver.particle(0).position;
    for _ in 0..6000 {
        step(&mut solver, 1);
        assert_eq!(solver.particle(0).position, held);
    }
    solver.unpin(0).unwrap();
    step(&mut solver, 1);
    assert_near("sideways", 0.0, velocity(&solver, 0)[0], 1e-9);
    assert_near("down", -9.81 / 60.0, velocity(&solver, 0)[1], 1e-5);
}

#[test]
fn huge_coordinates_within_the_limit_run() {
    let text = "[[particle]]\nposition = [1e7, -1e7, 1e7]\n[[particle]]\nposition = [-1e7, 1e7, -1e7]\n\
         [[constraint]]\nparticles = [0, 1]\n[[constraint]]\nparticles = [0, 1]\nrest_length = 0\n\
         [[collider]]\nshape = \"sphere\"\ncenter = [1e7, -1e7, 1e7]\nradius = 1e7\n";
    let mut solver = solver(text);
    for _ in 0..100 {
        step(&mut solver, 1);
        assert_finite(&solver);
    }
}

#[test]
fn a_million_random_stiff_steps_stay_finite_and_bounded() {
    // A ring of sticks with a few diagonals and stiffnesses from 0 to 1.
    let mut text =
        "[solver]\nrate_hz = 60\nsubsteps = 1\nmethod = \"pbd\"\ndamping = 0.1\n".to_owned();
    for corner in 0..8 {
        let angle = f64::from(corner) * std::f64::consts::TAU / 8.0;
        text += &format!(
            "[[particle]]\nposition = [{}, {}, 0]\npinned = {}\n",
            angle.sin(),
            angle.cos(),
            corner == 0
        );
    }
    for corner in 0..8_u32 {
        for (reach, stiffness) in
            [(1, 0.37 * f64::from(corner) % 1.0), (3, 0.71 * f64::from(corner) % 1.0)]
        {
            text += &format!(
                "[[constraint]]\nparticles = [{corner}, {}]\nstiffness = {stiffness}\n",
                (corner + reach) % 8
            );
        }
    }
    let mut solver = solver(&text);
    for _ in 0..1000 {
        step(&mut solver, 1000);
        assert_finite(&solver);
        for index in 0..8 {
            assert_at_most("distance from the pin", 20.0, distance(&solver, 0, index));
        }
    }
}
