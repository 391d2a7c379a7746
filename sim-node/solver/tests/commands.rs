//! Effects of commands on the state. A rejected command changes no bit.

use sim_solver::{Grab, Particle, ParticleFlags, Reason, Scene, Solver, builtin};
use sim_types::{Action, CLIENT_ID_END};

const CLIENT: u64 = 7;

fn curtain() -> Solver {
    Solver::new(&Scene::from_toml(builtin::text("curtain").unwrap(), "curtain").unwrap())
}

fn one_particle(extra: &str) -> Solver {
    let text = format!(
        "version = 1\n{extra}\n[[particle]]\nposition = [0, 0, 0]\nmass = 2\n[solver]\nrate_hz = 240\n"
    );
    Solver::new(&Scene::from_toml(&text, "test").unwrap())
}

fn grab(particle: u32, target: [f32; 3]) -> Grab {
    Grab { particle, target, over_s: 1.0 / 60.0 }
}

fn step(solver: &mut Solver, steps: u32) {
    for _ in 0..steps {
        solver.step();
    }
}

fn bits(solver: &Solver) -> Vec<u8> {
    let particles: Vec<Particle> =
        (0..solver.particle_count()).map(|index| solver.particle(index)).collect();
    bytemuck::cast_slice(&particles).to_vec()
}

#[test]
fn a_pinned_particle_stays_bit_for_bit_and_falls_from_rest_when_unpinned() {
    let mut solver = curtain();
    step(&mut solver, 60);
    let before = solver.particle(90);
    solver.pin(90).unwrap();
    step(&mut solver, 100);
    let pinned = solver.particle(90);
    assert_eq!(pinned.position, before.position);
    assert_eq!(
        (pinned.velocity, pinned.inverse_mass, pinned.flags),
        ([0.0; 3], 0.0, ParticleFlags::PINNED)
    );
    solver.unpin(90).unwrap();
    assert_eq!(solver.particle(90).velocity, [0.0; 3]);
    assert_eq!(solver.particle(90).inverse_mass, before.inverse_mass);
}

#[test]
fn a_grabbed_particle_reaches_its_target_in_a_straight_line_after_whole_steps() {
    let mut solver = one_particle("");
    solver.grab(CLIENT, grab(0, [0.4, -0.8, 1.2])).unwrap();
    for quarter in 1..=4 {
        solver.step();
        let share = quarter as f32 / 4.0;
        let [x, y, z] = solver.particle(0).position;
        for (actual, expected) in [(x, 0.4 * share), (y, -0.8 * share), (z, 1.2 * share)] {
            assert!((actual - expected).abs() < 1e-5, "quarter {quarter}: {actual}");
        }
    }
    assert_eq!(solver.particle(0).position, [0.4, -0.8, 1.2]);
    assert_eq!(solver.particle(0).flags, ParticleFlags::GRABBED);
    step(&mut solver, 10);
    assert_eq!(solver.particle(0).position, [0.4, -0.8, 1.2]);
    assert_eq!(solver.particle(0).velocity, [0.0; 3]);
}

#[test]
fn a_release_keeps_the_velocity_of_the_grab_at_each_phase_of_its_moves() {
    // Moves of 0.05 m at 60 Hz on a node of 240 Hz are 3 m/s, at each of the four steps.
    for phase in 1..=4 {
        let mut solver = one_particle("gravity = [0, 0, 0]");
        solver.grab(CLIENT, grab(0, [0.05, 0.0, 0.0])).unwrap();
        step(&mut solver, 4);
        for tick in 2..=5_u8 {
            solver.move_grabbed(CLIENT, grab(0, [0.05 * f32::from(tick), 0.0, 0.0])).unwrap();
            step(&mut solver, if tick == 5 { phase } else { 4 });
        }
        solver.release(CLIENT, 0).unwrap();
        step(&mut solver, 1);
        let released = solver.particle(0);
        assert!((released.velocity[0] - 3.0).abs() < 1e-3, "phase {phase}: {released:?}");
        assert_eq!((released.flags, released.inverse_mass), (0, 0.5));
    }
}

#[test]
fn a_distant_target_is_followed_at_max_speed() {
    let mut solver = one_particle("");
    solver.grab(CLIENT, grab(0, [1e6, 0.0, 0.0])).unwrap();
    step(&mut solver, 24);
    let [x, ..] = solver.particle(0).position;
    assert!((x - 1000.0).abs() < 0.1, "0.1 s at 10,000 m/s: {x}");
}

#[test]
fn a_pinned_particle_can_be_grabbed_and_stays_where_it_is_released() {
    let mut solver = curtain();
    solver.grab(CLIENT, grab(0, [-0.6, 1.2, 0.1])).unwrap();
    step(&mut solver, 8);
    assert_eq!(solver.particle(0).flags, ParticleFlags::PINNED | ParticleFlags::GRABBED);
    solver.release(CLIENT, 0).unwrap();
    step(&mut solver, 50);
    assert_eq!(solver.particle(0).position, [-0.6, 1.2, 0.1]);
    assert_eq!(solver.particle(0).flags, ParticleFlags::PINNED);
}

#[test]
fn only_the_client_that_grabbed_a_particle_moves_and_releases_it() {
    let mut solver = curtain();
    assert_eq!(solver.release(CLIENT, 5), Err(Reason::NotGrabbed));
    assert_eq!(solver.move_grabbed(CLIENT, grab(5, [0.0; 3])), Err(Reason::NotGrabbed));
    solver.grab(CLIENT, grab(5, [0.0; 3])).unwrap();
    for other in [
        solver.grab(8, grab(5, [0.0; 3])),
        solver.move_grabbed(8, grab(5, [0.0; 3])),
        solver.release(8, 5),
    ] {
        assert_eq!(other, Err(Reason::GrabbedByOther));
    }
    solver.release(CLIENT, 5).unwrap();
}

#[test]
fn a_rejected_command_changes_no_bit_of_the_future() {
    let mut solver = curtain();
    solver.grab(CLIENT, grab(90, [0.1, 0.2, 0.3])).unwrap();
    step(&mut solver, 3);
    let mut untouched = solver.clone();
    let long = Grab { over_s: 3601.0, ..grab(9, [0.0; 3]) };
    let backwards = Grab { over_s: -0.1, ..long };
    let timeless = Grab { over_s: f32::NAN, ..long };
    let rejected = [
        (solver.pin(168), Reason::UnknownParticle),
        (solver.unpin(u32::MAX), Reason::UnknownParticle),
        (solver.grab(CLIENT, grab(168, [0.0; 3])), Reason::UnknownParticle),
        (solver.grab(CLIENT, grab(9, [f32::NAN, 0.0, 0.0])), Reason::NonFinite),
        (solver.grab(CLIENT, grab(9, [0.0, f32::INFINITY, 0.0])), Reason::NonFinite),
        (solver.grab(CLIENT, grab(9, [0.0, 0.0, 1.1e7])), Reason::OutOfRange),
        (solver.grab(CLIENT, long), Reason::OutOfRange),
        (solver.grab(CLIENT, backwards), Reason::OutOfRange),
        (solver.grab(CLIENT, timeless), Reason::NonFinite),
        (solver.move_grabbed(CLIENT, grab(90, [f32::NAN; 3])), Reason::NonFinite),
        (solver.release(CLIENT, 91), Reason::NotGrabbed),
    ];
    for (result, reason) in rejected {
        assert_eq!(result, Err(reason));
    }
    assert_eq!(solver.keyframe(), untouched.keyframe());
    step(&mut solver, 10);
    step(&mut untouched, 10);
    assert_eq!(bits(&solver), bits(&untouched));
}

#[test]
fn in_two_dimensions_a_target_off_the_plane_is_out_of_range() {
    let mut solver = one_particle("dimensions = 2");
    assert_eq!(solver.grab(CLIENT, grab(0, [0.0, 0.0, 0.1])), Err(Reason::OutOfRange));
}

#[test]
fn a_reset_shows_the_initial_state_in_its_own_step_and_then_repeats_the_run() {
    let mut fresh = curtain();
    let initial = bits(&fresh);
    let mut solver = curtain();
    solver.grab(CLIENT, grab(90, [0.3, 0.2, 0.1])).unwrap();
    solver.pin(80).unwrap();
    step(&mut solver, 50);
    solver.reset();
    solver.step();
    assert_eq!((solver.scene_step(), bits(&solver)), (0, initial));
    assert_eq!(solver.state_hash(), fresh.state_hash());
    step(&mut solver, 30);
    step(&mut fresh, 30);
    assert_eq!((solver.scene_step(), solver.state_hash()), (30, fresh.state_hash()));
}

#[test]
fn a_particle_that_overflows_freezes_at_its_last_position() {
    // A stick joins two particles at the end of the range, and the squared distance overflows.
    let text = "version = 1\norigin = [0, 0, 0]\n[solver]\nmax_speed = 3e38\n\
         [[particle]]\nposition = [0, 0, 0]\nvelocity = [1e7, 0, 0]\n\
         [[particle]]\nposition = [1, 0, 0]\n[[constraint]]\nparticles = [0, 1]\nrest_length = 1e30\n";
    let mut solver = Solver::new(&Scene::from_toml(text, "test").unwrap());
    step(&mut solver, 20);
    for index in 0..2 {
        let particle = solver.particle(index);
        assert!(particle.position.iter().chain(&particle.velocity).all(|one| one.is_finite()));
    }
    assert_eq!(solver.particle(1).flags, ParticleFlags::FROZEN);
    assert_eq!(solver.pin(1), Err(Reason::NoEffectHere));
    assert!(solver.frozen_count() > 0);
}

#[test]
fn fixed_particles_survive_a_neighbour_that_blows_up_and_the_state_can_be_restored() {
    // Particle 1 overflows between a pinned and a grabbed one.
    let text = "version = 1\n[solver]\nmax_speed = 3e38\n[[particle]]\nposition = [0, 0, 0]\npinned = true\n\
         [[particle]]\nposition = [1, 0, 0]\n[[particle]]\nposition = [2, 0, 0]\n\
         [[constraint]]\nparticles = [0, 1]\nrest_length = 1e30\n\
         [[constraint]]\nparticles = [1, 2]\nrest_length = 1e30\n";
    let mut solver = Solver::new(&Scene::from_toml(text, "test").unwrap());
    solver.grab(CLIENT, grab(2, [2.0, 1.0, 0.0])).unwrap();
    step(&mut solver, 20);
    assert_eq!(solver.particle(1).flags, ParticleFlags::FROZEN);
    assert_eq!(
        (solver.particle(0).flags, solver.particle(0).position),
        (ParticleFlags::PINNED, [0.0; 3])
    );
    assert_eq!(solver.particle(2).position, [2.0, 1.0, 0.0]);
    let particles: Vec<Particle> = (0..3).map(|index| solver.particle(index)).collect();
    let keyframe = solver.keyframe();
    solver.restore(&particles, &keyframe).unwrap();
    solver.release(CLIENT, 2).unwrap();
}

#[test]
fn a_client_id_that_json_cannot_hold_is_rejected_and_changes_nothing() {
    let mut solver = curtain();
    let before = bits(&solver);
    let action = Action::Grab { particle: 90, target: [0.5, 0.2, 0.3], over_s: 0.1 };
    assert_eq!(solver.apply(CLIENT_ID_END, &action), Err(Reason::OutOfRange));
    assert_eq!(bits(&solver), before);
    solver.apply(CLIENT_ID_END - 1, &action).unwrap();
}
