//! Distance constraints: single sticks, stiffness and compliance, ropes, the catenary.

use proptest::prelude::*;

use super::{assert_at_most, assert_close, assert_near, distance, position, solver, step, stepped};

/// Returns two particles at distance 2 on a stick of length 1, without gravity.
fn stick(mass_a: f64, mass_b: f64, extra: &str) -> String {
    format!(
        "gravity = [0, 0, 0]\n[solver]\nrate_hz = 60\nsubsteps = 1\n{extra}\n\
         [[particle]]\nposition = [0, 0, 0]\nmass = {mass_a}\n\
         [[particle]]\nposition = [2, 0, 0]\nmass = {mass_b}\n\
         [[constraint]]\nparticles = [0, 1]\nrest_length = 1\n"
    )
}

#[test]
fn a_stick_moves_its_ends_in_proportion_to_their_inverse_masses() {
    for (mass_a, mass_b) in [(1.0, 1.0), (1.0, 3.0), (1.0, 1e6), (1e6, 1.0)] {
        let solver = stepped(&stick(mass_a, mass_b, ""), 1);
        let expected = mass_b / (mass_a + mass_b);
        let moved = position(&solver, 0)[0];
        assert_near(&format!("masses {mass_a}:{mass_b}"), expected, moved, 1e-6);
        assert_near("length", 1.0, distance(&solver, 0, 1), 1e-6);
    }
}

#[test]
fn a_pinned_end_stays_bit_for_bit_and_the_other_end_takes_the_whole_correction() {
    let text = "gravity = [0, 0, 0]\n[solver]\nsubsteps = 1\n[[particle]]\nposition = [0.1, 0.2, 0.3]\npinned = true\n\
         [[particle]]\nposition = [2.1, 0.2, 0.3]\n[[constraint]]\nparticles = [0, 1]\nrest_length = 1\n";
    let solver = stepped(text, 1);
    assert_eq!(solver.particle(0).position, [0.1, 0.2, 0.3]);
    assert_eq!(solver.particle(0).velocity, [0.0; 3]);
    assert_near("free end", 1.1, position(&solver, 1)[0], 1e-6);
}

#[test]
fn two_pinned_ends_and_coincident_ends_change_nothing() {
    let pinned = "gravity = [0, 0, 0]\n[solver]\nsubsteps = 1\n[[particle]]\nposition = [0, 0, 0]\npinned = true\n\
         [[particle]]\nposition = [2, 0, 0]\npinned = true\n[[constraint]]\nparticles = [0, 1]\nrest_length = 1\n";
    assert_eq!(stepped(pinned, 5).state_hash(), solver(pinned).state_hash());
    let coincident = "gravity = [0, 0, 0]\n[[particle]]\nposition = [1, 1, 1]\n\
         [[particle]]\nposition = [1, 1, 1]\n[[constraint]]\nparticles = [0, 1]\nrest_length = 1\n";
    assert_eq!(stepped(coincident, 5).state_hash(), solver(coincident).state_hash());
}

#[test]
fn a_stick_of_rest_length_zero_pulls_its_ends_together() {
    let text = "gravity = [0, 0, 0]\n[solver]\nsubsteps = 1\niterations = 3\n[[particle]]\nposition = [0, 0, 0]\n\
         [[particle]]\nposition = [2, 0, 0.7]\n[[constraint]]\nparticles = [0, 1]\nrest_length = 0\n";
    let solver = stepped(text, 3);
    assert_at_most("distance", 1e-6, distance(&solver, 0, 1));
}

#[test]
fn pbd_leaves_one_minus_stiffness_of_the_error_with_1_to_64_passes() {
    for stiffness in [0.0, 0.1, 0.3, 0.6, 0.9, 1.0] {
        for iterations in 1..=64 {
            let extra = format!("method = \"pbd\"\niterations = {iterations}");
            let text = stick(1.0, 3.0, &extra) + &format!("stiffness = {stiffness}\n");
            let residual = distance(&stepped(&text, 1), 0, 1) - 1.0;
            let what = format!("stiffness {stiffness}, {iterations} passes");
            assert_near(&what, 1.0 - stiffness, residual, 1e-5);
        }
    }
}

/// Returns a mass on a compliant stick, with strong damping.
fn hanging_mass(mass: f64, compliance: f64, extra: &str) -> String {
    format!(
        "[solver]\n{extra}\ndamping = 4\n\
         [[particle]]\nposition = [0, 0, 0]\npinned = true\n\
         [[particle]]\nposition = [0, -1, 0]\nmass = {mass}\n\
         [[constraint]]\nparticles = [0, 1]\nrest_length = 1\ncompliance = {compliance}\n"
    )
}

#[test]
fn a_compliant_stick_settles_at_weight_times_compliance_at_every_rate() {
    for rate in [30, 60, 120, 240] {
        for substeps in [1, 2, 4, 10, 20] {
            for iterations in [1, 3, 10] {
                let extra =
                    format!("rate_hz = {rate}\nsubsteps = {substeps}\niterations = {iterations}");
                let solver = stepped(&hanging_mass(2.0, 1e-3, &extra), rate * 12);
                let what = format!("elongation at {rate} x {substeps} x {iterations}");
                assert_close(&what, 2.0 * 9.81 * 1e-3, distance(&solver, 0, 1) - 1.0, 1e-3);
            }
        }
    }
}

#[test]
fn an_undamped_spring_oscillates_as_in_implicit_euler() {
    // A free particle on a compliant stick with a pinned end: (1 + w^2 h^2) x' = 2 x - x_previous.
    let text = "gravity = [0, 0, 0]\n[solver]\nrate_hz = 60\nsubsteps = 1\n\
         [[particle]]\nposition = [0, 0, 0]\npinned = true\n[[particle]]\nposition = [1.5, 0, 0]\n\
         [[constraint]]\nparticles = [0, 1]\nrest_length = 1\ncompliance = 0.001\n";
    let mut solver = solver(text);
    let (mut previous, mut x) = (0.5_f64, 0.5_f64);
    let w2h2 = 1.0 / 0.001 / (60.0 * 60.0);
    for step in 1..=120 {
        solver.step();
        (previous, x) = (x, (2.0 * x - previous) / (1.0 + w2h2));
        let found = position(&solver, 1)[0] - 1.0;
        assert_near(&format!("position, step {step}"), x, found, 1e-5);
    }
}

#[test]
fn a_tether_pulls_but_never_pushes() {
    let with_kind = |position: f64| {
        format!(
            "gravity = [0, 0, 0]\n[solver]\nsubsteps = 1\n[[particle]]\nposition = [0, 0, 0]\npinned = true\n\
             [[particle]]\nposition = [{position}, 0, 0]\n\
             [[constraint]]\nparticles = [0, 1]\nrest_length = 1\nkind = \"tether\"\n"
        )
    };
    assert_near("slack", 0.4, distance(&stepped(&with_kind(0.4), 3), 0, 1), 1e-6);
    assert_near("taut", 1.0, distance(&stepped(&with_kind(1.6), 1), 0, 1), 1e-6);
}

#[test]
fn a_pass_applies_the_relaxation_factor_to_each_correction() {
    // One pass over a rigid stick leaves 1 - w of the error, with both methods.
    for method in ["xpbd", "pbd"] {
        for relaxation in [0.25, 0.5, 1.0, 1.5, 1.9] {
            let extra = format!("method = \"{method}\"\nrelaxation = {relaxation}");
            let residual = distance(&stepped(&stick(1.0, 3.0, &extra), 1), 0, 1) - 1.0;
            assert_near(&format!("{method}, w {relaxation}"), 1.0 - relaxation, residual, 1e-6);
        }
    }
}

#[test]
fn over_relaxation_converges_faster_with_many_passes() {
    // A chain of 20 links, stretched to 1.5 times its length, in one substep of many passes.
    let residual = |relaxation: f64, passes: u32| {
        let text = format!(
            "gravity = [0, 0, 0]\n[solver]\nrate_hz = 60\nsubsteps = 1\niterations = {passes}\n\
             relaxation = {relaxation}\norder = \"listed\"\n[[particle]]\nposition = [0, 0, 0]\npinned = true\n"
        );
        let particles = (1..=20)
            .map(|index| format!("[[particle]]\nposition = [{}, 0, 0]\n", 1.5 * f64::from(index)));
        let links = (0..20).map(|index| {
            format!("[[constraint]]\nparticles = [{index}, {}]\nrest_length = 1\n", index + 1)
        });
        let text = text + &particles.collect::<String>() + &links.collect::<String>();
        let solver = stepped(&text, 1);
        (0..20).map(|link| (distance(&solver, link, link + 1) - 1.0).abs()).fold(0.0, f64::max)
    };
    let [plain, faster, fastest] = [1.0, 1.5, 1.8].map(|relaxation| residual(relaxation, 256));
    println!("residual after 256 passes: {plain} (w 1), {faster} (w 1.5), {fastest} (w 1.8)");
    assert!(fastest < faster / 10.0 && faster < plain / 2.0, "{plain} {faster} {fastest}");
    assert_at_most("w 1.95 converges", residual(1.95, 16), residual(1.95, 1000));
}

/// Returns a rope of `count` free particles that hangs straight down from a pinned one.
fn hanging_rope(count: u32, settings: &str) -> String {
    format!(
        "[solver]\n{settings}\n[[generate]]\nshape = \"rope\"\ncount = {}\nfrom = [0, 0, 0]\n\
         to = [0, -{}, 0]\n",
        count + 1,
        f64::from(count) * 0.05,
    )
}

#[test]
fn a_plain_rope_stretches_by_g_h2_n2_over_2_p() {
    // At rest, in any order of projection. The law is exact to O(1/N).
    for (substeps, passes) in [(20, 1), (10, 2), (5, 4)] {
        let settings =
            format!("rate_hz = 60\nsubsteps = {substeps}\niterations = {passes}\ndamping = 2");
        let solver = stepped(&hanging_rope(50, &settings), 60 * 40);
        let h = 1.0 / 60.0 / f64::from(substeps);
        let expected = 9.81 * h * h * 50.0 * 50.0 / (2.0 * f64::from(passes));
        let found = -position(&solver, 50)[1] - 2.5;
        assert_close(&format!("stretch of a rope at {substeps} x {passes}"), expected, found, 0.05);
    }
}

#[test]
fn a_hanging_chain_is_the_discrete_catenary() {
    // tan(theta_i) = (i - (n - 1) / 2) / H for link i of n; H in units of m g from the span.
    let (links, length, span) = (20_u32, 0.05, 0.7);
    let slope = |link: u32, pull: f64| (f64::from(link) - (f64::from(links) - 1.0) / 2.0) / pull;
    let span_of = |pull: f64| {
        (0..links).map(|link| length / (1.0 + slope(link, pull).powi(2)).sqrt()).sum::<f64>()
    };
    let (mut low, mut high) = (0.1, 100.0);
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        if span_of(middle) < span { low = middle } else { high = middle }
    }
    // The chain starts as a tent with two straight sides.
    let half: f64 = 0.5;
    let rise = (half * half - (span / 2.0) * (span / 2.0)).sqrt();
    let mut text = "[solver]\nrate_hz = 240\nsubsteps = 20\ndamping = 3\n".to_owned();
    for index in 0..=links {
        let share = f64::from(index) / f64::from(links);
        let height = -rise * (1.0 - (2.0 * share - 1.0).abs());
        let pinned = index == 0 || index == links;
        text += &format!(
            "[[particle]]\nposition = [{}, {height}, 0]\npinned = {pinned}\n",
            share * span
        );
    }
    for index in 0..links {
        text += &format!(
            "[[constraint]]\nparticles = [{index}, {}]\nrest_length = {length}\n",
            index + 1
        );
    }
    let solver = stepped(&text, 240 * 12);
    let (mut x, mut y) = (0.0, 0.0);
    for link in 0..links {
        let tangent = slope(link, low);
        let run = length / (1.0 + tangent * tangent).sqrt();
        (x, y) = (x + run, y + run * tangent);
        let found = position(&solver, link as usize + 1);
        assert_near(&format!("catenary x of {}", link + 1), x, found[0], 5e-3);
        assert_near(&format!("catenary y of {}", link + 1), y, found[1], 5e-3);
    }
}

#[test]
fn max_stretch_holds_from_the_first_step() {
    // A soft spring that would stretch by 0.49 m at rest is limited to 1.1 times its length.
    let text = "[solver]\nrate_hz = 60\nsubsteps = 4\nmax_stretch = 1.1\n\
         [[particle]]\nposition = [0, 0, 0]\npinned = true\n[[particle]]\nposition = [0, -1, 0]\n\
         [[constraint]]\nparticles = [0, 1]\ncompliance = 0.05\n";
    let mut solver = solver(text);
    for _ in 0..600 {
        step(&mut solver, 1);
        assert_at_most("length", 1.1 + 1e-5, distance(&solver, 0, 1));
    }
    assert_near("length at rest", 1.1, distance(&solver, 0, 1), 1e-5);
}

#[test]
fn a_constraint_can_turn_off_the_limit_of_the_scene() {
    let text = "[solver]\nrate_hz = 60\nsubsteps = 4\ndamping = 3\nmax_stretch = 1.1\n\
         [[particle]]\nposition = [0, 0, 0]\npinned = true\n[[particle]]\nposition = [0, -1, 0]\n\
         [[constraint]]\nparticles = [0, 1]\ncompliance = 0.05\nmax_stretch = inf\n";
    assert_close("length", 1.0 + 0.05 * 9.81, distance(&stepped(text, 1200), 0, 1), 1e-3);
}

#[test]
fn max_stretch_is_consistent_with_the_velocity() {
    // The limit removes the speed along the stick that would exceed it, without a rebound.
    let text = "gravity = [0, 0, 0]\n[solver]\nrate_hz = 60\nsubsteps = 1\nmax_stretch = 1.1\nmethod = \"pbd\"\n\
         [[particle]]\nposition = [0, 0, 0]\npinned = true\n\
         [[particle]]\nposition = [1, 0, 0]\nvelocity = [60, 0, 0]\n\
         [[constraint]]\nparticles = [0, 1]\nstiffness = 0\n";
    let mut solver = solver(text);
    step(&mut solver, 1);
    assert_near("position", 1.1, position(&solver, 1)[0], 1e-6);
    assert_near("speed = displacement / h", 6.0, super::velocity(&solver, 1)[0], 1e-4);
    step(&mut solver, 1);
    assert_near("position", 1.1, position(&solver, 1)[0], 1e-6);
    assert_near("speed", 0.0, super::velocity(&solver, 1)[0], 1e-4);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn a_free_stick_is_exact_after_one_pass_wherever_it_is(
        at in prop::array::uniform3(-10.0_f64..10.0),
        to in prop::array::uniform3(-10.0_f64..10.0),
        masses in (0.1_f64..10.0, 0.1_f64..10.0),
        rest in 0.01_f64..5.0,
    ) {
        prop_assume!((0..3).map(|axis| (at[axis] - to[axis]).powi(2)).sum::<f64>() > 1e-2);
        let text = format!(
            "gravity = [0, 0, 0]\n[solver]\nsubsteps = 1\n[[particle]]\nposition = {at:?}\nmass = {}\n\
             [[particle]]\nposition = {to:?}\nmass = {}\n\
             [[constraint]]\nparticles = [0, 1]\nrest_length = {rest}\n",
            masses.0, masses.1,
        );
        let found = distance(&stepped(&text, 1), 0, 1);
        prop_assert!((found - rest).abs() < 1e-5, "{found}, not {rest}");
    }

    #[test]
    fn settled_elongation_knows_no_rate_substeps_or_iterations(
        rate in 30_u32..=240,
        substeps in 1_u32..=20,
        iterations in 1_u32..=10,
        mass in 0.1_f64..10.0,
    ) {
        let extra = format!("rate_hz = {rate}\nsubsteps = {substeps}\niterations = {iterations}");
        let solver = stepped(&hanging_mass(mass, 1e-3, &extra), rate * 12);
        let (expected, found) = (mass * 9.81 * 1e-3, distance(&solver, 0, 1) - 1.0);
        prop_assert!((found / expected - 1.0).abs() < 1e-3, "{found}, not {expected}");
    }
}
