//! Cloths that fall on themselves, and measures of how well they hold.

use sim_solver::{Scene, Solver};

use super::super::step;
use super::crossings::{dot, minus};

pub(super) const SPACING: f64 = 0.02;

pub(super) fn positions(solver: &Solver) -> Vec<[f64; 3]> {
    solver.particles().iter().map(|one| one.position.map(f64::from)).collect()
}

/// Returns the number of structural constraints that pierce a triangle without sharing a vertex with it: a
/// measure of tangling.
pub(super) fn crossings(solver: &Solver) -> usize {
    let structural = solver.constraints().filter(|one| one.kind as u32 == 0);
    let edges: Vec<_> = structural.map(|one| [one.a, one.b]).collect();
    super::crossings::count(&positions(solver), &edges, solver.triangles())
}

/// Returns the smallest distance of two particles that no constraint of their body keeps close: those that
/// were at least 1.6 contact distances apart at load.
pub(super) fn nearest(solver: &Solver, at_load: &[[f64; 3]], thickness: f64) -> f64 {
    let at = positions(solver);
    let mut order: Vec<_> = (0..at.len()).collect();
    order.sort_by(|a, b| at[*a][0].total_cmp(&at[*b][0]));
    let mut nearest = f64::INFINITY;
    for (place, &a) in order.iter().enumerate() {
        for &b in order[place + 1..].iter().take_while(|b| at[**b][0] - at[a][0] < thickness) {
            let apart = minus(at_load[b], at_load[a]);
            if dot(apart, apart).sqrt() >= 1.6 * thickness {
                let now = minus(at[b], at[a]);
                nearest = nearest.min(dot(now, now).sqrt());
            }
        }
    }
    nearest
}

/// Mean energy of a particle, in J/kg.
pub(super) fn energy(solver: &Solver) -> f64 {
    let of_each = solver.particles().iter().map(|one| {
        let velocity = one.velocity.map(f64::from);
        0.5 * dot(velocity, velocity) + 9.81 * f64::from(one.position[1])
    });
    of_each.sum::<f64>() / solver.particle_count() as f64
}

pub(super) fn rms_speed(solver: &Solver) -> f64 {
    let squares = solver.particles().iter().map(|one| {
        let velocity = one.velocity.map(f64::from);
        dot(velocity, velocity)
    });
    (squares.sum::<f64>() / solver.particle_count() as f64).sqrt()
}

/// A square sheet of `count` x `count` particles.
pub(super) fn sheet(count: u32, origin: [f64; 3], [right, down]: [&str; 2]) -> String {
    format!(
        "[[generate]]\nshape = \"mesh\"\ncolumns = {count}\nrows = {count}\nspacing = {SPACING}\n\
         mass = 0.001\ncompliance = {{ bend = 1e-3 }}\norigin = {origin:?}\nright = {right}\n\
         down = {down}\n"
    )
}

/// A floor on which particles rest half of the contact distance above y = 0.
pub(super) const GROUND: &str =
    "[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0.01\nfriction = 0.3\n";

/// A sheet that falls on its edge and folds.
pub(super) fn heap(count: u32) -> String {
    let height = f64::from(count - 1) * SPACING + 0.01;
    sheet(count, [0.0, height, 0.0], ["[1, 0, 0.01]", "[0.02, -1, 0.01]"]) + GROUND
}

/// A sheet that falls on a ball on the ground.
pub(super) fn on_a_ball(count: u32) -> String {
    let half = f64::from(count - 1) * SPACING / 2.0;
    sheet(count, [-half, 0.5, -half], ["[1, 0, 0]", "[0, 0, 1]"])
        + "[[collider]]\nshape = \"sphere\"\ncenter = [0, 0.15, 0]\nradius = 0.16\nfriction = 0.3\n"
        + GROUND
}

/// Restores every seventeenth step of a scene from its keyframe, and checks that the copy continues with the same bits.
pub(super) fn assert_continues_from_keyframes(text: &str) {
    let scene = Scene::from_toml(&format!("version = 1\n{text}"), "test").unwrap();
    let mut solver = Solver::new(&scene);
    for _ in 0..12 {
        step(&mut solver, 17);
        let mut copy = Solver::new(&scene);
        copy.restore(solver.particles(), &solver.keyframe()).unwrap();
        let mut original = solver.clone();
        step(&mut original, 20);
        step(&mut copy, 20);
        assert_eq!(copy.state_hash(), original.state_hash());
    }
}
