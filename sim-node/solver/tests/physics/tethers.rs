//! Generated tethers: they keep ropes at their rigid length, and tears and pins change them.

use sim_solver::Solver;

use super::{assert_at_most, assert_near, distance, position, solver, step, stepped};

/// Returns a rope of `count` free particles with links of 0.05 m that hangs straight down.
fn rope(count: u32, tethers: bool) -> String {
    format!(
        "[solver]\nrate_hz = 60\nsubsteps = 4\ndamping = 1\ntethers = {tethers}\n[[generate]]\n\
         shape = \"rope\"\ncount = {}\nfrom = [0, 0, 0]\nto = [0, -{}, 0]\n",
        count + 1,
        f64::from(count) * 0.05,
    )
}

#[test]
fn a_tethered_rope_of_100_stretches_by_at_most_a_thousandth() {
    let length = |solver: &Solver| -position(solver, 100)[1];
    let plain = length(&stepped(&rope(100, false), 60 * 30));
    assert!(plain > 5.0 * 1.1, "the rope stretches without tethers: {plain}");
    let mut tethered = solver(&rope(100, true));
    for _ in 0..60 * 30 {
        step(&mut tethered, 1);
        assert_at_most("length", 5.0 * 1.001, length(&tethered));
    }
    assert_near("length at rest", 5.0, length(&tethered), 5e-3);
}

#[test]
fn one_pass_of_tethers_restores_the_rigid_length_of_a_stretched_chain() {
    // The single pass over the links leaves the middle particle at 2 m and the last at 3 m.
    let chain = |tethers: bool| {
        stepped(
            &format!(
                "gravity = [0, 0, 0]\n[solver]\nsubsteps = 1\ntethers = {tethers}\n\
                 [[particle]]\nposition = [0, 0, 0]\npinned = true\n[[particle]]\nposition = [2, 0, 0]\n\
                 [[particle]]\nposition = [4, 0, 0]\n[[constraint]]\nparticles = [0, 1]\nrest_length = 1\n\
                 [[constraint]]\nparticles = [1, 2]\nrest_length = 1\n"
            ),
            1,
        )
    };
    let (plain, tethered) = (chain(false), chain(true));
    for (index, without, with) in [(1, 2.0, 1.0), (2, 3.0, 2.0)] {
        assert_near("without tethers", without, position(&plain, index)[0], 1e-6);
        assert_near("with tethers", with, position(&tethered, index)[0], 1e-6);
    }
}

#[test]
fn every_particle_of_a_swinging_rope_stays_within_the_length_of_its_path() {
    let text = "[solver]\nrate_hz = 60\nsubsteps = 2\ntethers = true\n[[generate]]\n\
         shape = \"rope\"\ncount = 41\nfrom = [0, 0, 0]\nto = [2, 0, 0]\n";
    let mut solver = solver(text);
    for _ in 0..600 {
        step(&mut solver, 1);
        for index in 1..41_u8 {
            let path = f64::from(index) * 0.05;
            let found = distance(&solver, 0, usize::from(index));
            assert!(found <= path * (1.0 + 1e-5), "particle {index}: {found}, path {path}");
        }
    }
}

/// Two pins 1.2 m apart. A particle hangs on a rigid chain of two links from the first pin, and on
/// one long rigid link from the second.
const FORK: &str = "[solver]\nrate_hz = 60\nsubsteps = 4\ntethers = true\n\
     [[particle]]\nposition = [0, 0, 0]\npinned = true\n\
     [[particle]]\nposition = [1.2, 0, 0]\npinned = true\n\
     [[particle]]\nposition = [0, -0.3, 0]\n[[particle]]\nposition = [0, -0.6, 0]\n\
     [[constraint]]\nparticles = [0, 2]\n[[constraint]]\nparticles = [2, 3]\n\
     [[constraint]]\nparticles = [1, 3]\nrest_length = 9\nkind = \"tether\"\n";

#[test]
fn a_cut_drops_the_tethers_of_its_paths_and_a_pin_creates_new_ones() {
    let mut solver = solver(FORK);
    step(&mut solver, 10);
    assert_near("hangs from the nearest root", 0.6, distance(&solver, 0, 3), 1e-4);
    // The upper link is cut, and the pair falls freely at once.
    solver.cut(0).unwrap();
    let before = position(&solver, 3)[1];
    step(&mut solver, 6);
    let fallen = before - position(&solver, 3)[1];
    let (m, h) = (24.0, 1.0 / 240.0);
    assert_near("free fall after the cut", 9.81 * h * h * m * (m + 1.0) / 2.0, fallen, 1e-3);
    // A pin recomputes the tethers: the middle particle becomes the root of the lower one.
    solver.pin(2).unwrap();
    step(&mut solver, 60);
    assert_near("hangs from the new root", 0.3, distance(&solver, 2, 3), 1e-4);
}

#[test]
fn a_grabbed_particle_is_not_a_root_until_it_is_released() {
    let mut solver = solver(&rope(10, true));
    solver.grab(1, sim_solver::Grab { particle: 0, target: [0.0; 3], over_s: 0.0 }).unwrap();
    step(&mut solver, 60);
    let sag = distance(&solver, 0, 10) - 0.5;
    assert!(sag > 1e-3, "the end has no tether, so the rope stretches: {sag}");
    solver.release(1, 0).unwrap();
    step(&mut solver, 60);
    assert_at_most("tethered again", 0.5 + 1e-5, distance(&solver, 0, 10));
}

#[test]
fn bends_and_compliant_or_torn_constraints_form_no_path() {
    // Only a soft link leads to the root, so the particle sags as far as the spring allows.
    let text = "[solver]\nrate_hz = 60\nsubsteps = 4\ndamping = 4\ntethers = true\n\
         [[particle]]\nposition = [0, 0, 0]\npinned = true\n[[particle]]\nposition = [0, -1, 0]\n\
         [[constraint]]\nparticles = [0, 1]\ncompliance = 0.01\n";
    assert_near("sag", 1.0 + 0.0981, distance(&stepped(text, 1200), 0, 1), 1e-3);
    // A bend, or a link that is cut before a pin elsewhere recomputes the tethers.
    let falls = |kind: &str, is_cut: bool| {
        let text = format!(
            "[solver]\nrate_hz = 60\nsubsteps = 4\niterations = 1\ntethers = true\n\
             [[particle]]\nposition = [0, 0, 0]\npinned = true\n[[particle]]\nposition = [0, -1, 0]\n\
             [[particle]]\nposition = [9, 0, 0]\n[[particle]]\nposition = [0, -2, 0]\n\
             [[constraint]]\nparticles = [0, 1]\nkind = \"{kind}\"\n\
             [[constraint]]\nparticles = [1, 3]\n"
        );
        let mut solver = solver(&text);
        if is_cut {
            solver.cut(0).unwrap();
        }
        solver.pin(2).unwrap();
        step(&mut solver, 60);
        -position(&solver, 3)[1] - 2.0
    };
    assert_near("a rigid link holds", 0.0, falls("structural", false), 1e-5);
    assert!(falls("bend", false) > 1e-5, "a bend forms no path, so the chain stretches a little");
    assert!(falls("structural", true) > 4.0, "a torn link forms no path, so the particle falls");
    let mut stiff = solver(text);
    step(&mut stiff, 1200);
    stiff.set("compliance", sim_solver::ParameterValue::Number(0.0), None).unwrap();
    step(&mut stiff, 600);
    assert_near("rigid, so tethered", 1.0, distance(&stiff, 0, 1), 1e-3);
}

#[test]
fn a_tethered_state_continues_bit_for_bit_from_a_keyframe() {
    for tethers in ["true", "2"] {
        let text = rope(30, true).replace("tethers = true", &format!("tethers = {tethers}"));
        assert_continues(&format!("version = 1\n{text}"));
    }
}

fn assert_continues(text: &str) {
    let scene = sim_solver::Scene::from_toml(text, "test").unwrap();
    let mut solver = Solver::new(&scene);
    solver.cut(12).unwrap();
    step(&mut solver, 20);
    solver.pin(20).unwrap();
    step(&mut solver, 20);
    solver.cut(24).unwrap();
    step(&mut solver, 20);
    let particles: Vec<_> = super::particles(&solver).collect();
    let mut again = Solver::new(&scene);
    again.restore(&particles, &solver.keyframe()).unwrap();
    for _ in 0..200 {
        step(&mut solver, 1);
        step(&mut again, 1);
        assert_eq!(solver.state_hash(), again.state_hash());
    }
}

/// The path to the first root is cut. Half of the rope has a tether to the other end only if particles keep the
/// paths to two roots.
#[test]
fn a_rope_between_two_roots_keeps_its_length_after_a_cut_at_one_of_them() {
    let length = |tethers: u32| {
        let text = format!(
            "[solver]\nrate_hz = 60\nsubsteps = 4\ndamping = 1\ntethers = {tethers}\n[[generate]]\n\
             shape = \"rope\"\ncount = 101\nfrom = [0, 0, 0]\nto = [5, 0, 0]\npinned = [0, 100]\n"
        );
        let mut solver = solver(&text);
        solver.cut(0).unwrap();
        let mut longest: f64 = 0.0;
        for _ in 0..600 {
            step(&mut solver, 1);
            longest = longest.max(distance(&solver, 100, 1));
        }
        longest
    };
    assert_at_most("length", 4.95 * 1.001, length(2));
    assert!(length(1) > 4.95 * 1.02, "half of the rope stretches");
}

/// The whole weight hangs on two particles, and most particles pull at both.
#[test]
fn a_sheet_held_by_two_corners_stretches_little_with_tethers_to_both() {
    let stretch = |tethers: u32| {
        let text = format!(
            "[solver]\nrate_hz = 60\nsubsteps = 14\ntethers = {tethers}\n[[generate]]\nshape = \"cloth\"\n\
             columns = 50\nrows = 50\nspacing = 0.04\ndown = [0, 0, 1]\npinned = \"corners\"\n"
        );
        let mut sheet = solver(&text);
        step(&mut sheet, 60);
        let mut largest: f64 = 0.0;
        for _ in 0..40 {
            step(&mut sheet, 1);
            for one in sheet.constraints() {
                let length = distance(&sheet, one.a as usize, one.b as usize);
                largest = largest.max(length / f64::from(one.rest_length) - 1.0);
            }
        }
        largest
    };
    assert!(stretch(1) > 0.2, "half of the sheet pulls at the other root");
    assert_at_most("stretch", 0.06, stretch(2));
    // There are no more than two roots.
    assert_near("with room for four", stretch(2), stretch(4), 0.0);
}
