//! The energy of states against closed forms.

use sim_solver::{Energy, EnergyMeter, ParameterValue, Scene, Solver};

use super::{assert_near, rates, solver, step};

const G: f64 = 9.81;

fn energy(solver: &Solver) -> Energy {
    EnergyMeter::of(solver).measure_solver(solver)
}

#[test]
fn a_fall_turns_potential_into_kinetic_energy() {
    // Two free particles and a pinned one, which does not count.
    let mut falling = solver(
        "[[particle]]\nposition = [0, 2, 0]\nmass = 3\nvelocity = [4, 0, 0]\n\
         [[particle]]\nposition = [1, -1, 0]\nmass = 0.5\n\
         [[particle]]\nposition = [0, 50, 0]\npinned = true\n",
    );
    let start = energy(&falling);
    assert_near("kinetic", 0.5 * 3.0 * 16.0, start.kinetic, 1e-5);
    assert_near("potential", G * (3.0 * 2.0 - 0.5), start.potential, 1e-5);
    step(&mut falling, 60);
    let end = energy(&falling);
    let fall = f64::from(falling.particle(0).position[1]) - 2.0;
    assert_near("potential after a fall", start.potential + 3.5 * G * fall, end.potential, 1e-4);
    let speed = f64::from(falling.particle(1).velocity[1]);
    assert_near(
        "kinetic after a fall",
        start.kinetic + 0.5 * 3.5 * speed * speed,
        end.kinetic,
        1e-3,
    );
    assert_eq!((start.elastic, end.elastic), (0.0, 0.0));
    assert_near("total", start.kinetic + start.potential + start.elastic, start.total(), 0.0);
}

/// A particle of 2 kg on a spring of 1 m and 500 N/m.
const SPRING: &str = "[[particle]]\nposition = [0, 0, 0]\npinned = true\n\
    [[particle]]\nposition = [0, -1, 0]\nmass = 2\n\
    [[constraint]]\nparticles = [0, 1]\ncompliance = 0.002\n";

#[test]
fn a_spring_stores_half_of_its_stiffness_times_the_square_of_its_stretch() {
    let mut hanging = solver(&(rates(240, 8) + "damping = 5\n" + SPRING));
    step(&mut hanging, 20 * 240);
    // At rest it is longer by m g / k.
    let stretch = 2.0 * G / 500.0;
    assert_near("at rest", 0.5 * 500.0 * stretch * stretch, energy(&hanging).elastic, 5e-5);
    hanging.set("compliance", ParameterValue::Number(0.001), None).unwrap();
    assert_near("twice as stiff", 500.0 * stretch * stretch, energy(&hanging).elastic, 1e-4);
    hanging.set("compliance", ParameterValue::Number(0.0), None).unwrap();
    assert_near("rigid", 0.0, energy(&hanging).elastic, 0.0);
    hanging.reset();
    hanging.cut(0).unwrap();
    step(&mut hanging, 10);
    assert_near("torn", 0.0, energy(&hanging).elastic, 0.0);
}

#[test]
fn an_oscillation_keeps_its_energy_while_each_part_of_it_changes() {
    let mut swinging = solver(&(rates(240, 64) + SPRING));
    let start = energy(&swinging).total();
    let (mut kinetic, mut elastic) = (0.0_f64, 0.0_f64);
    for _ in 0..240 {
        step(&mut swinging, 1);
        let now = energy(&swinging);
        (kinetic, elastic) = (kinetic.max(now.kinetic), elastic.max(now.elastic));
        // The amplitude is m g / k: the energy of the oscillation is (m g)^2 / (2 k).
        assert_near("total", start, now.total(), 0.02 * (2.0 * G).powi(2) / 1000.0);
    }
    assert_near("kinetic at the middle", (2.0 * G).powi(2) / 1000.0, kinetic, 0.01);
    assert_near("elastic at the bottom", 4.0 * (2.0 * G).powi(2) / 1000.0, elastic, 0.03);
}

#[test]
fn a_tether_stores_nothing_while_it_is_slack() {
    let text = "gravity = [0, 0, 0]\n[[particle]]\nposition = [0, 0, 0]\npinned = true\n\
        [[particle]]\nposition = [0.7, 0, 0]\n\
        [[constraint]]\nparticles = [0, 1]\nrest_length = 1\nkind = \"tether\"\ncompliance = 0.01\n";
    assert_near("slack", 0.0, energy(&solver(text)).elastic, 0.0);
    let taut = text.replace("0.7", "1.2");
    assert_near("taut", 0.5 * 100.0 * 0.04, energy(&solver(&taut)).elastic, 1e-5);
}

#[test]
fn a_bend_stores_its_rigidity_times_the_square_of_its_curvature() {
    // A rope of 0.1 m between particles, bent by 90 degrees at its middle one, and torn there.
    let text = "gravity = [0, 0, 0]\n[[particle]]\nposition = [0, 0, 0]\n\
        [[particle]]\nposition = [0.1, 0, 0]\n[[particle]]\nposition = [0.1, 0.1, 0]\n\
        [[constraint]]\nparticles = [0, 1]\n[[constraint]]\nparticles = [1, 2]\n\
        [[bend]]\nparticles = [0, 1, 2]\nrigidity = 0.02\n";
    let mut bent = solver(text);
    // The second difference has the size 0.1 sqrt(2), and alpha is s^3 / EI.
    let stored = |rigidity: f64| 0.01 * 2.0 * rigidity / (2.0 * 0.001);
    assert_near("bent", stored(0.02), energy(&bent).elastic, 1e-6);
    bent.set("bending", ParameterValue::Number(0.05), None).unwrap();
    assert_near("stiffer", stored(0.05), energy(&bent).elastic, 1e-6);
    bent.cut(1).unwrap();
    step(&mut bent, 1);
    assert_near("torn", 0.0, energy(&bent).elastic, 0.0);
}

#[test]
fn a_hinge_that_is_folded_at_rest_stores_nothing() {
    let points = ["[0, 1, 0.3]", "[0, 0, 0]", "[1, 0, 0]", "[0.5, -1, 0.2]"];
    let folded = |rest: &str| {
        let vertices = points.join(", ");
        let text = format!(
            "gravity = [0, 0, 0]\n[[generate]]\nshape = \"obj\"\nvertices = [{vertices}]\n\
             faces = [[0, 1, 2], [1, 3, 2]]\nbending = 0.1\nrest = \"{rest}\"\n"
        );
        energy(&solver(&text)).elastic
    };
    assert_near("at rest as loaded", 0.0, folded("loaded"), 1e-12);
    assert!(folded("flat") > 0.01);
}

#[test]
fn the_unit_of_energy_follows_from_that_of_length() {
    let unit = |text: &str| {
        Scene::from_toml(&format!("version = 1\n{text}"), "test").unwrap().energy_unit()
    };
    assert_eq!((unit("").as_str(), unit("unit = \"cm\"").as_str()), ("J", "kg cm²/s²"));
}

#[test]
fn a_meter_measures_the_states_of_its_scene_only() {
    let scene = |count: usize| {
        let text =
            "version = 1\n".to_owned() + &"[[particle]]\nposition = [0, 1, 0]\n".repeat(count);
        Scene::from_toml(&text, "test").unwrap()
    };
    let (own, other) = (Solver::new(&scene(2)), Solver::new(&scene(3)));
    let mut meter = EnergyMeter::new(&scene(2));
    let measured = meter.measure_solver(&own);
    assert_near("two particles", 2.0 * G, measured.potential, 1e-5);
    let parameters = own.parameter_values();
    assert_eq!(meter.measure(other.particles(), [].into_iter(), parameters), None);
    assert_eq!(meter.measure(own.particles(), [0].into_iter(), parameters), None);
}
