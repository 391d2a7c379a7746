//! Tearing: exactly above its threshold, at every rate, and for good.

mod cuts;

use sim_solver::TearCause;

use super::{assert_near, distance, solver, step, stepped};

/// Returns two particles on a stick of length 1, without gravity.
fn stick(ends: [&str; 2], at: f32, limit: &str) -> String {
    format!(
        "gravity = [0, 0, 0]\n[solver]\nsubsteps = 2\n{limit}\n\
         [[particle]]\nposition = [0, 0, 0]\n{}\n[[particle]]\nposition = [{at:?}, 0, 0]\n{}\n\
         [[constraint]]\nparticles = [0, 1]\nrest_length = 1\n",
        ends[0], ends[1]
    )
}

const PINNED: &str = "pinned = true";

#[test]
fn a_stick_tears_strictly_above_its_stretch_or_distance_with_free_and_pinned_ends() {
    let cases = [
        ("tear_stretch = 1.5", TearCause::Stretch),
        ("tear_distance = 0.5", TearCause::Distance),
        ("tear_distance = 0.7\ntear_stretch = 1.5", TearCause::Stretch),
        ("tear_distance = 0.5\ntear_stretch = 1.7", TearCause::Distance),
    ];
    for (limit, cause) in cases {
        for ends in [["", ""], [PINNED, ""], ["", PINNED], [PINNED, "mass = 7"]] {
            let whole = stepped(&stick(ends, 1.5, limit), 1);
            assert_eq!(whole.torn(), [], "{limit} {ends:?} at the threshold");
            let torn = stepped(&stick(ends, 1.5_f32.next_up(), limit), 1);
            assert_eq!(
                (torn.torn(), torn.tear_causes()),
                (&[0][..], &[cause][..]),
                "{limit} {ends:?}"
            );
            assert_eq!(torn.new_torn_count(), 1);
        }
    }
}

#[test]
fn a_stick_between_two_pins_tears_as_well() {
    // Nothing moves, but the stick is too long.
    let torn = stepped(&stick([PINNED, PINNED], 2.0, "tear_stretch = 1.5"), 1);
    assert_eq!(torn.torn(), [0]);
}

#[test]
fn a_torn_stick_acts_until_the_end_of_its_step_and_never_again() {
    let text = stick(["", ""], 1.6, "tear_stretch = 1.5");
    let mut solver = solver(&text);
    step(&mut solver, 1);
    assert_near("length after the step of the tear", 1.0, distance(&solver, 0, 1), 1e-6);
    let speed = super::velocity(&solver, 1)[0];
    step(&mut solver, 60);
    assert_eq!((solver.torn(), solver.new_torn_count()), (&[0][..], 0));
    // Both particles keep the velocity of the last correction.
    assert_near("speed", speed, super::velocity(&solver, 1)[0], 1e-3);
}

/// Returns a mass that hangs at rest on a rigid stick.
fn hanging(rate: u32, substeps: u32, mass: f64, tear_force: f64) -> String {
    format!(
        "[solver]\nrate_hz = {rate}\nsubsteps = {substeps}\ntear_force = {tear_force}\n\
         [[particle]]\nposition = [0, 0, 0]\npinned = true\n\
         [[particle]]\nposition = [0, -1, 0]\nmass = {mass}\n[[constraint]]\nparticles = [0, 1]\n"
    )
}

#[test]
fn a_hanging_mass_tears_its_stick_at_its_weight_at_every_rate() {
    for rate in [60, 120, 240, 480] {
        for substeps in [1, 2, 5, 10, 20] {
            for mass in [0.1, 2.0, 1000.0] {
                let weight = mass * 9.81;
                let above = stepped(&hanging(rate, substeps, mass, weight * 1.001), rate);
                assert_eq!(above.torn(), [], "{mass} kg at {rate} x {substeps}: holds");
                let below = stepped(&hanging(rate, substeps, mass, weight * 0.999), rate);
                assert_eq!(below.torn(), [0], "{mass} kg at {rate} x {substeps}: tears");
                assert_eq!(below.tear_causes(), [TearCause::Force]);
            }
        }
    }
}

#[test]
fn a_soft_stick_tears_at_the_force_of_its_spring() {
    // 0.1 m beyond the rest length at 1e-3 m/N is 100 N. An implicit step of 1/60 s reduces it to
    // C / (h^2 (w + compliance / h^2)).
    let tears_at = |tear_force: f64| {
        let text = format!(
            "gravity = [0, 0, 0]\n[solver]\nrate_hz = 60\nsubsteps = 20\ntear_force = {tear_force}\n\
             [[particle]]\nposition = [0, 0, 0]\npinned = true\n[[particle]]\nposition = [1.1, 0, 0]\n\
             [[constraint]]\nparticles = [0, 1]\nrest_length = 1\ncompliance = 1e-3\n"
        );
        !stepped(&text, 1).torn().is_empty()
    };
    let h = 1.0 / 1200.0_f64;
    let force = 0.1 / (h * h + 1e-3);
    assert!(tears_at(force * 0.999) && !tears_at(force * 1.001), "{force}");
}

#[test]
fn pbd_constraints_tear_by_force_as_well() {
    for (tear_force, torn) in [(9.81 * 0.999, &[0][..]), (9.81 * 1.001, &[])] {
        let text =
            hanging(60, 4, 1.0, tear_force).replace("[solver]", "[solver]\nmethod = \"pbd\"");
        assert_eq!(stepped(&text, 60).torn(), torn);
    }
}

#[test]
fn the_limit_of_a_constraint_replaces_that_of_the_scene() {
    let text = stick(["", ""], 1.6, "tear_stretch = 1.5") + "tear_stretch = inf\n";
    assert_eq!(stepped(&text, 5).torn(), []);
    let text = stick(["", ""], 1.6, "") + "tear_distance = 0.5\n";
    assert_eq!(stepped(&text, 5).torn(), [0]);
    let rope = "[solver]\nrate_hz = 60\n[[generate]]\nshape = \"rope\"\ncount = 3\nfrom = [0, 0, 0]\n\
         to = [0, -2, 0]\nmass = 50\ncompliance = { structural = 1e-3 }\ntear_stretch = 1.2\n";
    assert_eq!(stepped(rope, 60).torn(), [0]);
}

#[test]
fn ratios_have_no_effect_with_rest_length_zero() {
    let text = stick([PINNED, ""], 1.0, "tear_stretch = 1.5\nmax_stretch = 2");
    assert_eq!(stepped(&text.replace("rest_length = 1", "rest_length = 0"), 5).torn(), []);
}

#[test]
fn the_tears_of_a_step_are_sorted_by_index_regardless_of_their_cause() {
    let mut text = "gravity = [0, 0, 0]\n[solver]\nsubsteps = 1\ntear_stretch = 1.5\n".to_owned();
    for pair in 0..4 {
        text += &format!(
            "[[particle]]\nposition = [0, {pair}, 0]\n[[particle]]\nposition = [{}, {pair}, 0]\n",
            if pair == 2 { 1.0 } else { 2.0 }
        );
    }
    for pair in 0..4 {
        text += &format!(
            "[[constraint]]\nparticles = [{}, {}]\nrest_length = 1\n",
            2 * pair,
            2 * pair + 1
        );
    }
    let mut solver = solver(&text);
    solver.cut(2).unwrap();
    step(&mut solver, 1);
    assert_eq!(solver.torn(), [0, 1, 2, 3]);
    assert_eq!(
        solver.tear_causes(),
        [TearCause::Stretch, TearCause::Stretch, TearCause::Cut, TearCause::Stretch]
    );
    assert_eq!(solver.new_torn_count(), 4);
    solver.reset();
    step(&mut solver, 1);
    assert_eq!(solver.torn(), []);
}

#[test]
fn the_hash_depends_on_which_constraints_are_torn_but_not_on_when() {
    let text = stick([PINNED, PINNED], 1.0, "");
    let mut solver = solver(&text);
    let whole = solver.state_hash();
    solver.cut(0).unwrap();
    step(&mut solver, 1);
    let particles: Vec<_> = super::particles(&solver).collect();
    let seed = xxhash_rust::xxh3::xxh3_64(&0_u32.to_le_bytes());
    let bytes: &[u8] = bytemuck::cast_slice(&particles);
    assert_eq!(solver.state_hash(), xxhash_rust::xxh3::xxh3_64_with_seed(bytes, seed));
    assert_eq!(whole, xxhash_rust::xxh3::xxh3_64(bytes));
    step(&mut solver, 10);
    assert_eq!(solver.state_hash(), xxhash_rust::xxh3::xxh3_64_with_seed(bytes, seed));
}
