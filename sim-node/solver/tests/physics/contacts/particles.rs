//! Particles that touch each other: laws of a pair, cloths that fold, stacks, and misuse.

use std::fmt::Write;

use sim_solver::{Parameter, ParameterValue, Reason, RestoreError, Solver};

use super::super::{assert_at_most, assert_near, rates, solver, step, stepped};
use super::cloths::{
    GROUND, SPACING, assert_continues_from_keyframes, crossings, energy, heap, nearest, on_a_ball,
    positions, rms_speed, sheet,
};
use super::crossings::{dot, minus};

const CONTACT: &str = "[contact]\nmode = \"particles\"\n";

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

/// Neighbours beyond the room of the list of pairs that never touch would repel each other.
#[test]
fn a_contact_distance_with_too_many_neighbours_at_load_is_refused_and_changes_no_bit() {
    for mode in ["off", "particles", "surfaces"] {
        let text = |thickness: &str| {
            format!(
                "gravity = [0, 0, 0]\n[contact]\nmode = \"{mode}\"\n{thickness}\n[[generate]]\nshape = \"cloth\"\n\
                 columns = 24\nrows = 24\nspacing = 0.05\npinned = \"none\"\n"
            )
        };
        let mut solver = solver(&text(""));
        step(&mut solver, 2);
        let before = (solver.particles().to_vec(), solver.parameter_values().clone());
        let mut set =
            |thickness| solver.set("contact.thickness", ParameterValue::Number(thickness), None);
        assert_eq!(set(0.2), Err(Reason::OutOfRange), "{mode}");
        assert_eq!(set(1e6), Err(Reason::OutOfRange), "{mode}");
        assert_eq!((solver.particles().to_vec(), solver.parameter_values().clone()), before);
        // A scene may ask for it, and only its own states have it.
        let mut overfull = self::solver(&text("thickness = 0.2"));
        let (particles, keyframe) = (overfull.particles().to_vec(), overfull.keyframe());
        overfull.restore(&particles, &keyframe).unwrap();
        let restored = solver.restore(&particles, &keyframe);
        if mode != "off" {
            assert!(matches!(restored, Err(RestoreError::Mismatch { .. })), "{restored:?}");
        }
        solver.set("contact.thickness", ParameterValue::Number(0.1), None).unwrap();
        step(&mut solver, 20);
        assert_eq!(solver.particles(), before.0, "{mode}: neighbours repel each other");
    }
}

#[test]
fn a_refused_contact_distance_leaves_the_contacts_as_they_are() {
    let mut text = "gravity = [0, 0, 0]\n".to_owned() + &rates(60, 4) + CONTACT;
    text += "thickness = 0.1\n";
    for _ in 0..2000 {
        text += "[[particle]]\nposition = [0, 0, 0]\n";
    }
    // The pile has too many neighbours at every distance. A scene may have it, but no command may set another distance.
    let mut pile = solver(&text);
    step(&mut pile, 3);
    let mut refusing = pile.clone();
    let count = refusing.contact_overflow_count();
    assert!(count > 0, "all pairs fit");
    let set = refusing.set("contact.thickness", ParameterValue::Number(0.2), None);
    assert_eq!(set, Err(Reason::OutOfRange));
    for _ in 0..3 {
        step(&mut pile, 1);
        step(&mut refusing, 1);
        assert_eq!(refusing.state_hash(), pile.state_hash());
        assert_eq!(refusing.contact_overflow_count(), pile.contact_overflow_count());
    }
    // Another distance does not forget that contacts were ignored.
    refusing.set("contact.thickness", ParameterValue::Off, None).unwrap();
    step(&mut refusing, 1);
    assert!(refusing.contact_overflow_count() > count);
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
    set(&mut heap, "contact.thickness", ParameterValue::Off);
    step(&mut heap, 100);
    assert_ne!(heap.state_hash(), touching);
    let passing = stepped(&(rates(240, 4) + &self::heap(16)), 100);
    assert_eq!(heap.state_hash(), passing.state_hash());
    heap.reset();
    step(&mut heap, 1);
    let thickness = heap.parameter_values().optional(Parameter::ContactThickness).unwrap();
    set(&mut heap, "contact.thickness", ParameterValue::Off);
    set(&mut heap, "contact.thickness", ParameterValue::Number(thickness));
    step(&mut heap, 100);
    assert_eq!(heap.state_hash(), touching);
    set(&mut heap, "contact.friction", ParameterValue::Number(0.0));
    assert_eq!(heap.parameter_values().number(Parameter::ContactFriction), 0.0);
}

#[test]
fn a_keyframe_at_any_step_continues_bit_for_bit() {
    assert_continues_from_keyframes(&(rates(240, 4) + CONTACT + &heap(16)));
}
