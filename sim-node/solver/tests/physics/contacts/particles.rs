//! Particles that touch each other: laws of a pair, cloths that fold, stacks, and misuse.

use std::fmt::Write;

use sim_solver::{ParameterValue, Scene, Solver};

use super::super::{assert_at_most, assert_near, rates, solver, step, stepped};

const CONTACT: &str = "[contact]\nmode = \"particles\"\n";
const SPACING: f64 = 0.02;

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| a[axis] - b[axis])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| a[axis] * b[axis]).sum()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Returns true if a segment pierces a triangle (Moeller, Trumbore 1997).
fn pierces([from, to]: [[f64; 3]; 2], [u, v, w]: [[f64; 3]; 3]) -> bool {
    let (along, first, second) = (minus(to, from), minus(v, u), minus(w, u));
    let normal = cross(along, second);
    let scale = dot(first, normal);
    let start = minus(from, u);
    let (b, c) = (dot(start, normal) / scale, dot(along, cross(start, first)) / scale);
    let at = dot(second, cross(start, first)) / scale;
    b >= 0.0 && c >= 0.0 && b + c <= 1.0 && at > 0.0 && at < 1.0
}

fn positions(solver: &Solver) -> Vec<[f64; 3]> {
    solver.particles().iter().map(|one| one.position.map(f64::from)).collect()
}

/// Returns the number of structural constraints that pierce a triangle without sharing a vertex with it: a
/// measure of tangling.
fn crossings(solver: &Solver) -> usize {
    let at = positions(solver);
    let corners = |indices: [u32; 3]| indices.map(|index| at[index as usize]);
    let bounds = |points: &[[f64; 3]]| {
        let side = |pick: fn(f64, f64) -> f64| {
            [0, 1, 2].map(|axis| points.iter().map(|point| point[axis]).reduce(pick).unwrap())
        };
        [side(f64::min), side(f64::max)]
    };
    let triangles: Vec<_> =
        solver.triangles().iter().map(|one| (*one, bounds(&corners(*one)))).collect();
    let structural = solver.constraints().filter(|one| one.kind as u32 == 0);
    let pierced = structural.map(|one| {
        let ends = [one.a, one.b].map(|end| at[end as usize]);
        let [min, max] = bounds(&ends);
        let near = triangles.iter().filter(|(indices, [low, high])| {
            (0..3).all(|axis| low[axis] <= max[axis] && min[axis] <= high[axis])
                && !indices.contains(&one.a)
                && !indices.contains(&one.b)
        });
        near.filter(|(indices, _)| pierces(ends, corners(*indices))).count()
    });
    pierced.sum()
}

/// Returns the smallest distance of two particles that no constraint of their body keeps close: those that
/// were at least 1.6 contact distances apart at load.
fn nearest(solver: &Solver, at_load: &[[f64; 3]], thickness: f64) -> f64 {
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
fn energy(solver: &Solver) -> f64 {
    let of_each = solver.particles().iter().map(|one| {
        let velocity = one.velocity.map(f64::from);
        0.5 * dot(velocity, velocity) + 9.81 * f64::from(one.position[1])
    });
    of_each.sum::<f64>() / solver.particle_count() as f64
}

fn rms_speed(solver: &Solver) -> f64 {
    let squares = solver.particles().iter().map(|one| {
        let velocity = one.velocity.map(f64::from);
        dot(velocity, velocity)
    });
    (squares.sum::<f64>() / solver.particle_count() as f64).sqrt()
}

/// A square sheet of `count` x `count` particles.
fn sheet(count: u32, origin: [f64; 3], [right, down]: [&str; 2]) -> String {
    format!(
        "[[generate]]\nshape = \"mesh\"\ncolumns = {count}\nrows = {count}\nspacing = {SPACING}\n\
         mass = 0.001\ncompliance = {{ bend = 1e-3 }}\norigin = {origin:?}\nright = {right}\n\
         down = {down}\n"
    )
}

/// A floor on which particles rest half of the contact distance above y = 0.
const GROUND: &str =
    "[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0.01\nfriction = 0.3\n";

/// A sheet that falls on its edge and folds.
fn heap(count: u32) -> String {
    let height = f64::from(count - 1) * SPACING + 0.01;
    sheet(count, [0.0, height, 0.0], ["[1, 0, 0.01]", "[0.02, -1, 0.01]"]) + GROUND
}

/// A sheet that falls on a ball on the ground.
fn on_a_ball(count: u32) -> String {
    let half = f64::from(count - 1) * SPACING / 2.0;
    sheet(count, [-half, 0.5, -half], ["[1, 0, 0]", "[0, 0, 1]"])
        + "[[collider]]\nshape = \"sphere\"\ncenter = [0, 0.15, 0]\nradius = 0.16\nfriction = 0.3\n"
        + GROUND
}

/// A rope that falls on its end and coils.
fn coil() -> String {
    "[[generate]]\nshape = \"rope\"\ncount = 61\nfrom = [0, 0.05, 0]\nto = [0.02, 1.25, 0.02]\n\
     mass = 0.001\npinned = \"none\"\n"
        .to_owned()
        + GROUND
}

/// Steps a falling body for two seconds. Checks ten times a second that it does not cross itself and has
/// not gained energy. Returns the least distance of two particles, in contact distances.
fn least_distance(name: &str, substeps: u32, body: &str) -> f64 {
    let mut falling = solver(&(rates(240, substeps) + CONTACT + body));
    let (at_load, start) = (positions(&falling), energy(&falling));
    let mut least = f64::INFINITY;
    for _ in 0..20 {
        step(&mut falling, 24);
        assert_eq!(crossings(&falling), 0, "{name}");
        assert_at_most(&format!("{name}: energy"), start, energy(&falling));
        least = least.min(nearest(&falling, &at_load, SPACING) / SPACING);
    }
    least
}

#[test]
fn folding_cloths_and_coiling_ropes_do_not_pass_through_themselves() {
    for (name, body) in [("heap", heap(32)), ("ball", on_a_ball(32)), ("coil", coil())] {
        // An impact squeezes them, the less the smaller the substeps are.
        let least = least_distance(name, 4, &body);
        assert_at_most(&format!("{name}, 960 substeps/s"), least, 0.7);
    }
    let least = least_distance("heap", 8, &heap(32));
    assert_at_most("heap, 1920 substeps/s", least, 0.9);
}

#[test]
fn without_contacts_the_same_cloth_tangles() {
    let mut passing = solver(&(rates(240, 4) + &heap(32)));
    let worst = (0..10).map(|_| {
        step(&mut passing, 24);
        crossings(&passing)
    });
    assert!(worst.max() > Some(50), "the other test would prove nothing");
}

#[test]
fn a_stack_of_sheets_comes_to_rest() {
    let sheets = (0..10).map(|layer| {
        sheet(12, [0.0, 0.01 + 0.0201 * f64::from(layer), 0.0], ["[1, 0, 0]", "[0, 0, 1]"])
    });
    let text = rates(240, 4) + CONTACT + &sheets.collect::<String>() + GROUND;
    let mut stack = solver(&text);
    let at_load = positions(&stack);
    step(&mut stack, 3 * 240);
    assert_at_most("rms speed", 0.001, rms_speed(&stack));
    assert_at_most("0.9 t", nearest(&stack, &at_load, SPACING), 0.9 * SPACING);
    let top = positions(&stack).iter().map(|one| one[1]).fold(0.0, f64::max);
    // Each sheet lies in the pockets of the one below.
    assert_at_most("the stack is not squeezed", top, 0.01 + 6.5 * SPACING);
}

/// Two particles that fly at each other along x.
fn two_balls([mass, other]: [f64; 2], speed: f64) -> String {
    format!(
        "gravity = [0, 0, 0]\n[contact]\nmode = \"particles\"\nthickness = 0.1\nfriction = 0\n\
         [[particle]]\nposition = [-1, 0, 0]\nmass = {mass}\nvelocity = [{speed}, 0, 0]\n\
         [[particle]]\nposition = [1, 0.00001, 0]\nmass = {other}\nvelocity = [{}, 0, 0]\n",
        -speed
    )
}

#[test]
fn balls_that_meet_head_on_go_on_with_their_common_velocity() {
    for masses in [[1.0, 1.0], [1.0, 3.0], [0.01, 1.0]] {
        let mut balls = solver(&two_balls(masses, 3.0));
        let momentum = |solver: &Solver| {
            let of_each = solver
                .particles()
                .iter()
                .map(|one| f64::from(one.velocity[0]) / f64::from(one.inverse_mass));
            of_each.sum::<f64>()
        };
        let before = momentum(&balls);
        for _ in 0..240 {
            step(&mut balls, 1);
            let apart = minus(positions(&balls)[1], positions(&balls)[0]);
            assert_at_most("the distance", dot(apart, apart).sqrt() + 1e-6, 0.1);
        }
        let total = masses[0] + masses[1];
        assert_near("momentum", before, momentum(&balls), 1e-6 * total * 3.0);
        for ball in balls.particles() {
            assert_near("velocity", before / total, f64::from(ball.velocity[0]), 1e-5);
        }
    }
}

#[test]
fn a_sheet_at_rest_has_the_bits_of_one_that_does_not_touch_itself() {
    let scene = |contact: &str| {
        rates(240, 4) + contact + &sheet(20, [0.0, 0.01, 0.0], ["[1, 0, 0]", "[0, 0, 1]"]) + GROUND
    };
    let [off, on] = ["", CONTACT].map(|contact| stepped(&scene(contact), 240).state_hash());
    assert_eq!(on, off);
}

#[test]
fn sheets_thrown_at_each_other_do_not_pass_up_to_the_speed_of_the_law() {
    // v h = 0.8 t, where both move with half of v.
    let speed = 0.8 * SPACING * 960.0 / 2.0;
    let mut text = format!("gravity = [0, 0, 0]\n{}{CONTACT}", rates(240, 4));
    for (height, direction) in [(0.0, 1.0), (0.3, -1.0)] {
        // Half a cell aside, where the holes are.
        for index in 0..144 {
            let aside = if direction > 0.0 { 0.0 } else { 0.5 * SPACING };
            let x = f64::from(index % 12) * SPACING + aside;
            let z = f64::from(index / 12) * SPACING + aside;
            write!(
                text,
                "[[particle]]\nposition = [{x}, {height}, {z}]\nmass = 0.001\nvelocity = [0, {}, 0]\n",
                direction * speed
            )
            .unwrap();
        }
    }
    for first in [0, 144] {
        for index in 0..144 {
            let mut join = |other: u32| {
                write!(
                    text,
                    "[[constraint]]\nparticles = [{}, {}]\n",
                    first + index,
                    first + other
                )
                .unwrap();
            };
            if index % 12 < 11 {
                join(index + 1);
            }
            if index / 12 < 11 {
                join(index + 12);
            }
        }
    }
    let mut sheets = solver(&text);
    step(&mut sheets, 60);
    let middle = |particles: &[sim_solver::Particle]| {
        particles.iter().map(|one| f64::from(one.position[1])).sum::<f64>() / 144.0
    };
    let (below, above) = sheets.particles().split_at(144);
    assert_at_most("the lower sheet is below", middle(above), middle(below));
}

#[test]
fn particles_in_one_point_stay_finite_and_disturb_nobody() {
    let mut text =
        "gravity = [0, 0, 0]\n".to_owned() + &rates(60, 4) + CONTACT + "thickness = 0.1\n";
    for _ in 0..2000 {
        text += "[[particle]]\nposition = [0, 0, 0]\n";
    }
    text += "[[particle]]\nposition = [1e6, 0, 0]\nvelocity = [1, 2, 3]\n";
    let mut pile = solver(&text);
    let healthy = pile.particle(2000);
    step(&mut pile, 3);
    assert!(pile.particles().iter().all(|one| one.position.iter().all(|axis| axis.is_finite())));
    assert_eq!(pile.particle(2000).velocity, healthy.velocity);
    assert!(pile.contact_overflow_count() > 0, "all pairs fit");
    assert_eq!(pile.frozen_count(), 0);
}

#[test]
fn a_particle_that_freezes_does_not_spread() {
    // The first two repel each other beyond all numbers. The third is on the way of one of them.
    let text = format!(
        "gravity = [0, 0, 0]\n[solver]\nmax_speed = 3e38\n{CONTACT}thickness = 0.1\n\
         [[particle]]\nposition = [0, 0, 0]\n[[particle]]\nposition = [1, 0, 0]\n\
         [[particle]]\nposition = [5, 0, 0]\nvelocity = [0, 1, 0]\n\
         [[constraint]]\nparticles = [0, 1]\nrest_length = 1e30\n"
    );
    let mut solver = stepped(&text, 20);
    assert!(solver.frozen_count() > 0, "nothing has frozen");
    step(&mut solver, 4);
    assert_near("the healthy one", 0.1, f64::from(solver.particle(2).position[1]), 1e-6);
}

#[test]
fn a_block_without_contact_passes_through() {
    let falling = |contact: &str| {
        let sheet = sheet(8, [0.0, 0.2, 0.0], ["[1, 0, 0]", "[0, 0, 1]"]);
        let held = format!(
            "[[generate]]\nshape = \"cloth\"\ncolumns = 14\nrows = 14\nspacing = {SPACING}\n\
             origin = [-0.06, 0.1, -0.06]\ndown = [0, 0, 1]\npinned = {:?}\n{contact}",
            (0..196).collect::<Vec<_>>()
        );
        let done = stepped(&(rates(240, 4) + CONTACT + &sheet + &held), 120);
        f64::from(done.particle(27).position[1])
    };
    assert_near("on the held sheet", 0.1, falling(""), SPACING);
    assert_at_most("through it", 0.0, falling("contact = false\n"));
}

#[test]
fn contacts_can_be_switched_off_and_on_while_the_scene_runs() {
    let mut heap = solver(&(rates(240, 4) + CONTACT + &heap(16)));
    let set = |solver: &mut Solver, parameter: &str, value| {
        solver.set(parameter, value, None).unwrap();
    };
    let started = heap.state_hash();
    step(&mut heap, 100);
    let touching = heap.state_hash();
    heap.reset();
    step(&mut heap, 1);
    assert_eq!(heap.state_hash(), started);
    set(&mut heap, "contact", ParameterValue::Off);
    step(&mut heap, 100);
    assert_ne!(heap.state_hash(), touching);
    let passing = stepped(&(rates(240, 4) + &self::heap(16)), 100);
    assert_eq!(heap.state_hash(), passing.state_hash());
    heap.reset();
    step(&mut heap, 1);
    let thickness = heap.parameter_values().contact.unwrap();
    set(&mut heap, "contact", ParameterValue::Off);
    set(&mut heap, "contact", ParameterValue::Number(thickness));
    step(&mut heap, 100);
    assert_eq!(heap.state_hash(), touching);
    set(&mut heap, "contact_friction", ParameterValue::Number(0.0));
    assert_eq!(heap.parameter_values().contact_friction, 0.0);
}

#[test]
fn a_keyframe_at_any_step_continues_bit_for_bit() {
    let text = format!("version = 1\n{}{CONTACT}{}", rates(240, 4), heap(16));
    let scene = Scene::from_toml(&text, "test").unwrap();
    let mut solver = Solver::new(&scene);
    for _ in 0..12 {
        step(&mut solver, 17);
        let (states, keyframe) = (solver.particles().to_vec(), solver.keyframe());
        let mut copy = Solver::new(&scene);
        copy.restore(&states, &keyframe).unwrap();
        let mut original = solver.clone();
        step(&mut original, 20);
        step(&mut copy, 20);
        assert_eq!(copy.state_hash(), original.state_hash());
    }
}
