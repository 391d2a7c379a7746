//! Velocities after contacts: bounces, friction, moving surfaces, corners.

mod bodies;
mod cloths;
mod crossings;
mod mesh;
mod meshes;
mod particles;
mod scenes;
mod solid_meshes;
mod surfaces;

use proptest::prelude::*;
use sim_solver::{Pose, Solver};

use super::{
    FLOOR, assert_at_most, assert_close, assert_near, position, rates, solver, step, stepped,
    velocity,
};

/// Steps the solver until a condition holds.
fn step_until(solver: &mut Solver, condition: impl Fn(&Solver) -> bool) {
    for _ in 0..10_000 {
        if condition(solver) {
            return;
        }
        step(solver, 1);
    }
    panic!("10,000 steps, and it has not come");
}

/// Returns the highest point between the next two contacts with the floor.
fn next_apex(solver: &mut Solver) -> f64 {
    step_until(solver, |solver| velocity(solver, 0)[1] > 0.0);
    let mut apex = position(solver, 0)[1];
    for _ in 0..10_000 {
        if velocity(solver, 0)[1] <= 0.0 {
            break;
        }
        step(solver, 1);
        apex = f64::max(apex, position(solver, 0)[1]);
    }
    apex
}

/// Returns a particle at rest on a plane inclined by `angle`.
fn slope(angle: f64, friction: f64, substeps: u32) -> String {
    rates(60, substeps)
        + "[[particle]]\nposition = [0, 0, 0]\n"
        + &format!(
            "[[collider]]\nshape = \"plane\"\nnormal = [{}, {}, 0]\noffset = 0\nfriction = {friction}\n",
            angle.sin(),
            angle.cos()
        )
}

#[test]
fn the_nth_bounce_reaches_e_to_the_2n_of_the_height_at_60_and_61_hz() {
    for restitution in [0.3, 0.5, 0.8] {
        for rate in [60, 61] {
            let text = rates(rate, 20)
                + "[[particle]]\nposition = [0, 1, 0]\n"
                + FLOOR
                + &format!("restitution = {restitution}\n");
            let mut solver = solver(&text);
            let mut expected = 1.0;
            for bounce in 1..=3 {
                expected *= restitution * restitution;
                if expected < 0.02 {
                    // The bounce is too short for a snapshot at 60 Hz to show its apex.
                    break;
                }
                let what = format!("bounce {bounce}, e {restitution}, {rate} Hz");
                // A snapshot misses the apex by at most g dt^2 / 8.
                let unseen = 9.81 / 3600.0 / 8.0;
                assert_near(&what, expected, next_apex(&mut solver), 0.03 * expected + unseen);
            }
        }
    }
}

/// The part of a substep below the floor would cost 10.6 % in 50 bounces.
#[test]
fn fifty_bounces_without_loss_keep_their_height_and_gain_none() {
    for (rate, substeps) in [(60, 20), (61, 20), (240, 4), (1000, 1)] {
        let text = rates(rate, substeps)
            + "[[particle]]\nposition = [0, 1, 0]\n"
            + FLOOR
            + "restitution = 1\n";
        let mut solver = solver(&text);
        // A snapshot misses the apex by at most g dt^2 / 8.
        let unseen = 9.81 / f64::from(rate * rate) / 8.0;
        for bounce in 1..=50 {
            let apex = next_apex(&mut solver);
            let what = format!("bounce {bounce}, {rate} Hz x {substeps}");
            assert_near(&what, 1.0, apex, 1e-3 + unseen);
            assert_at_most(&what, 1.0 + 1e-4, apex);
        }
    }
}

#[test]
fn a_particle_on_the_floor_comes_to_rest_after_its_bounces() {
    // sqrt(2 h / g) (1 + e) / (1 - e) seconds.
    let text =
        rates(60, 20) + "[[particle]]\nposition = [0, 1, 0]\n" + FLOOR + "restitution = 0.5\n";
    let rest_s = (2.0 / 9.81_f64).sqrt() * 1.5 / 0.5;
    let mut solver = stepped(&text, 60 * 2);
    assert!(rest_s < 2.0);
    for _ in 0..600 {
        step(&mut solver, 1);
        assert_near("height", 0.0, position(&solver, 0)[1], 1e-9);
        assert_near("speed", 0.0, velocity(&solver, 0)[1], 1e-6);
    }
}

#[test]
fn an_approach_of_up_to_2_g_h_ends_at_rest_and_a_faster_one_bounces() {
    for substeps in [1, 4] {
        let h = 1.0 / 60.0 / f64::from(substeps);
        for (share, bounces) in [(0.995, false), (1.005, true)] {
            // The predicted speed: the particle's own, plus the gain by gravity in a substep.
            let speed = share * 9.81 * h;
            let text = rates(60 * substeps, 1)
                + &format!("[[particle]]\nposition = [0, 0, 0]\nvelocity = [0, {}, 0]\n", -speed)
                + FLOOR
                + "restitution = 0.5\n";
            let expected = if bounces { 0.5 * (speed + 9.81 * h) } else { 0.0 };
            assert_near("speed up", expected, velocity(&stepped(&text, 1), 0)[1], 1e-6);
        }
    }
}

#[test]
fn a_particle_rests_on_a_slope_below_the_angle_of_friction() {
    for substeps in [1, 4, 20] {
        for (friction, share) in [(0.3_f64, 0.95), (0.5, 0.95), (1.0, 0.9)] {
            let angle = friction.atan() * share;
            let mut solver = stepped(&slope(angle, friction, substeps), 60);
            let start = position(&solver, 0);
            step(&mut solver, 600);
            let end = position(&solver, 0);
            let drift = ((end[0] - start[0]).powi(2) + (end[1] - start[1]).powi(2)).sqrt();
            assert_at_most(
                &format!("drift in 10 s, mu {friction}, {substeps} substeps"),
                1e-3,
                drift,
            );
            assert_at_most("drift since the start", 1e-3, start[0].abs());
        }
    }
}

#[test]
fn a_particle_slides_down_a_slope_above_the_angle_of_friction() {
    // s = g (sin - mu cos) t^2 / 2, with the same sum over m substeps as in free fall.
    for substeps in [1, 4, 20] {
        for (friction, share) in [(0.3_f64, 1.3), (0.5, 1.5), (0.0, 0.0)] {
            let angle = if friction == 0.0 { 0.3 } else { friction.atan() * share };
            let solver = stepped(&slope(angle, friction, substeps), 60);
            let [x, y, _] = position(&solver, 0);
            let h = 1.0 / 60.0 / f64::from(substeps);
            let m = 60.0 * f64::from(substeps);
            let expected =
                9.81 * (angle.sin() - friction * angle.cos()) * h * h * m * (m + 1.0) / 2.0;
            let found = (x * x + y * y).sqrt();
            assert_close(
                &format!("slide, mu {friction}, {substeps} substeps"),
                expected,
                found,
                0.03,
            );
        }
    }
}

#[test]
fn friction_is_the_same_far_from_the_origin_and_in_many_substeps() {
    // A slope of 30 degrees with friction 0.5: g (sin - mu cos), from the 1st to the 2nd second.
    let angle = std::f64::consts::FRAC_PI_6;
    let expected = 9.81 * (angle.sin() - 0.5 * angle.cos());
    for along in [0.0, 10.0, 30.0] {
        for substeps in [1, 4, 20] {
            let (x, y) = (along * angle.cos(), -along * angle.sin());
            let text = rates(60, substeps)
                + &format!("[[particle]]\nposition = [{x}, {y}, 0]\n")
                + &format!(
                    "[[collider]]\nshape = \"plane\"\nnormal = [{}, {}, 0]\noffset = 0\nfriction = 0.5\n",
                    angle.sin(),
                    angle.cos()
                );
            let mut solver = stepped(&text, 60);
            let before = velocity(&solver, 0)[0];
            step(&mut solver, 60);
            let gained = (velocity(&solver, 0)[0] - before) / angle.cos();
            assert_close(&format!("{along} m away, {substeps} substeps"), expected, gained, 0.05);
        }
    }
}

#[test]
fn friction_stops_a_slide_after_v2_over_2_mu_g() {
    let text = rates(240, 4)
        + "[[particle]]\nposition = [0, 0, 0]\nvelocity = [2, 0, 0]\n"
        + FLOOR
        + "friction = 0.4\n";
    let solver = stepped(&text, 480);
    assert_close("distance", 4.0 / (2.0 * 0.4 * 9.81), position(&solver, 0)[0], 0.03);
    assert_near("speed", 0.0, velocity(&solver, 0)[0], 1e-6);
}

#[test]
fn a_moving_floor_carries_and_lifts_the_particles_on_it() {
    let text = rates(240, 4)
        + "[[particle]]\nposition = [0, 0, 0]\n"
        + FLOOR
        + "friction = 0.9\nvelocity = [0.5, 0.25, 0]\n";
    let solver = stepped(&text, 240);
    assert_close("speed along", 0.5, velocity(&solver, 0)[0], 1e-3);
    assert_close("speed up", 0.25, velocity(&solver, 0)[1], 1e-3);
    assert_near("height after 1 s", 0.25, position(&solver, 0)[1], 1e-5);
}

#[test]
fn a_moving_wall_adds_its_own_speed_to_the_bounce() {
    // A wall at 3 m/s hits a particle at rest. With e = 1 the particle leaves at 6 m/s.
    let text = "gravity = [0, 0, 0]\n".to_owned()
        + &rates(240, 4)
        + "[[particle]]\nposition = [0.1, 0, 0]\n[[collider]]\nshape = \"plane\"\nnormal = [1, 0, 0]\noffset = 0\n\
           restitution = 1\nvelocity = [3, 0, 0]\n";
    assert_close("speed", 6.0, velocity(&stepped(&text, 60), 0)[0], 1e-3);
}

#[test]
fn a_rotating_box_carries_particles_along_by_friction() {
    // On top of a box that rotates about y, friction gives a particle the local speed omega r.
    let text = rates(240, 4)
        + "[[particle]]\nposition = [0.5, 0.2, 0]\n[[collider]]\nshape = \"box\"\ncenter = [0, 0, 0]\n\
           half_extents = [2, 0.2, 2]\nfriction = 1\nangular_velocity = [0, 0.8, 0]\n";
    let solver = stepped(&text, 120);
    let [vx, _, vz] = velocity(&solver, 0);
    assert_close("speed", 0.8 * 0.5, (vx * vx + vz * vz).sqrt(), 5e-3);
    assert_near("height", 0.2, position(&solver, 0)[1], 1e-6);
}

#[test]
fn a_rotating_plane_leaves_a_particle_at_its_pivot_in_place() {
    // A plane rotates about its point nearest to the origin, which moves with it.
    for (offset, sideways) in [(0.0, 10.0), (5.0, 0.0), (2.0, -3.0)] {
        let text = "gravity = [0, 0, 0]\n".to_owned()
            + &rates(240, 4)
            + &format!(
                "[[particle]]\nposition = [{sideways}, {offset}, 0]\n[[collider]]\nshape = \"plane\"\n\
                 normal = [0, 1, 0]\noffset = {offset}\nfriction = 1\n"
            );
        let mut solver = solver(&text);
        let pose =
            |turn: f32| Pose { translation: [sideways, 0.0, 0.0], rotation: [0.0, 0.0, turn, 1.0] };
        for turn in [0.0, 0.0, 0.01, 0.02, 0.03] {
            solver.move_collider(0, pose(turn)).unwrap();
            step(&mut solver, 1);
        }
        for axis in velocity(&solver, 0) {
            assert_near("speed", 0.0, axis, 1e-2);
        }
    }
}

#[test]
fn a_bounce_on_the_floor_causes_no_friction_on_the_wall() {
    let text = rates(240, 1)
        + "[[particle]]\nposition = [0.004, 0.004, 0]\nvelocity = [-5, -5, 0]\n"
        + FLOOR
        + "restitution = 1\n[[collider]]\nshape = \"plane\"\nnormal = [1, 0, 0]\noffset = 0\nfriction = 1\n";
    let mut solver = stepped(&text, 1);
    let [x, y, _] = position(&solver, 0);
    assert_eq!((x, y), (0.0, 0.0));
    // With the energy at the depth that it would have reached: y^2 / 2 - g h y / 2 + g x.
    let (g, h) = (9.81_f64, 1.0_f64 / 240.0);
    let approach = 5.0 + g * h;
    let depth = approach * h - 0.004;
    let up = g * h / 2.0 + ((approach + g * h / 2.0).powi(2) - 2.0 * g * depth).sqrt();
    assert_close("up again", up, velocity(&solver, 0)[1], 1e-5);
    for _ in 0..240 {
        step(&mut solver, 1);
        let [x, y, _] = position(&solver, 0);
        assert!(x >= 0.0 && y >= 0.0, "{x} {y}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn nothing_leaves_bounds_however_it_bounces_and_rubs_in_the_corners(
        velocity in prop::array::uniform3(-10.0_f64..10.0),
        at in prop::array::uniform3(0.01_f64..0.99),
        restitution in 0.0_f64..1.0,
        friction in 0.0_f64..2.0,
    ) {
        let text = format!(
            "[[particle]]\nposition = {at:?}\nvelocity = {velocity:?}\n[[collider]]\nshape = \"bounds\"\n\
             min = [0, 0, 0]\nmax = [1, 1, 1]\nrestitution = {restitution}\nfriction = {friction}\n"
        );
        let mut solver = solver(&text);
        for _ in 0..480 {
            step(&mut solver, 1);
            for axis in position(&solver, 0) {
                prop_assert!((0.0..=1.0).contains(&axis), "{axis}");
            }
        }
    }
}
