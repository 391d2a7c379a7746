//! Parameters that change while a scene runs: they cause no jump, and wrong values are refused.

use sim_solver::{ConstraintKind, PARAMETERS, ParameterValue, Reason, Solver};

use super::{assert_close, assert_near, bits, distance, position, solver, step, velocity};

use ParameterValue::{Number, Off, Vector};

const HANGING: &str = "[solver]\nrate_hz = 240\nsubsteps = 4\ndamping = 4\n\
     [[particle]]\nposition = [0, 0, 0]\npinned = true\n[[particle]]\nposition = [0, -1, 0]\nmass = 2\n\
     [[constraint]]\nparticles = [0, 1]\ncompliance = 1e-3\n";

fn settled() -> Solver {
    let mut solver = solver(HANGING);
    step(&mut solver, 240 * 10);
    solver
}

fn elongation(solver: &Solver) -> f64 {
    distance(solver, 0, 1) - 1.0
}

#[test]
fn setting_a_parameter_moves_nothing_by_itself() {
    for (name, setting) in [
        ("gravity", Vector([1.0, -1.0, 0.0])),
        ("damping", Number(0.1)),
        ("wind.velocity", Vector([9.0, 0.0, 0.0])),
        ("wind.drag", Number(1.0)),
        ("substeps", Number(17.0)),
        ("iterations", Number(3.0)),
        ("relaxation", Number(1.2)),
        ("max_stretch", Number(1.5)),
        ("tear_stretch", Number(1.5)),
        ("tear_distance", Number(1.0)),
        ("tear_force", Number(100.0)),
        ("max_speed", Number(50.0)),
        ("time_scale", Number(0.5)),
        ("compliance", Number(2e-3)),
    ] {
        let mut solver = settled();
        let before = bits(&solver);
        solver.set(name, setting, None).unwrap();
        assert_eq!(bits(&solver), before, "{name}");
        // The next step adds at most the effect of the new force.
        step(&mut solver, 1);
        let speed = velocity(&solver, 1).iter().map(|axis| axis.abs()).fold(0.0, f64::max);
        assert!(speed < 0.1, "{name}: {speed} m/s after one step");
    }
}

#[test]
fn a_new_gravity_or_compliance_settles_at_its_own_elongation() {
    let mut solver = settled();
    assert_close("before", 2.0 * 9.81e-3, elongation(&solver), 1e-3);
    solver.set("gravity", Vector([0.0, -1.62, 0.0]), None).unwrap();
    step(&mut solver, 240 * 10);
    assert_close("on the moon", 2.0 * 1.62e-3, elongation(&solver), 2e-3);
    solver.set("compliance", Number(5e-3), Some(ConstraintKind::Structural)).unwrap();
    step(&mut solver, 240 * 10);
    assert_close("softer", 2.0 * 5.0 * 1.62e-3, elongation(&solver), 2e-3);
    solver.set("compliance", Number(1e-4), Some(ConstraintKind::Bend)).unwrap();
    step(&mut solver, 240 * 2);
    assert_close("another kind", 2.0 * 5.0 * 1.62e-3, elongation(&solver), 2e-3);
}

#[test]
fn more_substeps_or_iterations_leave_a_hanging_mass_where_it_is() {
    for (name, value) in [("substeps", 20.0), ("substeps", 1.0), ("iterations", 8.0)] {
        let mut solver = settled();
        let before = position(&solver, 1)[1];
        solver.set(name, Number(value), None).unwrap();
        for _ in 0..240 {
            step(&mut solver, 1);
            assert_near(name, before, position(&solver, 1)[1], 1e-5);
        }
    }
}

#[test]
fn a_tear_limit_acts_from_the_next_step_until_it_is_off() {
    let mut solver = settled();
    solver.set("tear_force", Number(19.0), None).unwrap();
    solver.set("tear_force", Off, None).unwrap();
    step(&mut solver, 10);
    assert_eq!(solver.torn(), []);
    solver.set("tear_force", Number(19.0), None).unwrap();
    step(&mut solver, 1);
    assert_eq!(solver.torn(), [0]);
}

#[test]
fn stiffness_belongs_to_pbd_and_compliance_to_xpbd() {
    let mut pbd = solver(
        &HANGING
            .replace("[solver]", "[solver]\nmethod = \"pbd\"")
            .replace("compliance = 1e-3\n", ""),
    );
    pbd.set("stiffness", Number(0.5), None).unwrap();
    assert_eq!(pbd.set("compliance", Number(0.5), None), Err(Reason::NoEffectHere));
    assert_eq!(pbd.set("stiffness", Number(1.5), None), Err(Reason::OutOfRange));
    assert_eq!(settled().set("stiffness", Number(0.5), None), Err(Reason::NoEffectHere));
}

#[test]
fn a_reset_restores_the_parameters_of_the_scene() {
    let mut solver = settled();
    solver.set("gravity", Vector([0.0, 0.0, 0.0]), None).unwrap();
    solver.set("substeps", Number(9.0), None).unwrap();
    solver.reset();
    step(&mut solver, 240 * 10 + 1);
    assert_eq!(bits(&solver), bits(&settled()));
}

#[test]
fn a_wrong_value_changes_no_bit_of_the_future() {
    let mut wrong = vec![
        ("colour", Number(1.0), None, Reason::UnknownParameter),
        ("gravity", Number(1.0), None, Reason::OutOfRange),
        ("gravity", Vector([0.0, 2e7, 0.0]), None, Reason::OutOfRange),
        ("gravity", Vector([0.0, f32::NAN, 0.0]), None, Reason::NonFinite),
        ("damping", Vector([1.0; 3]), None, Reason::OutOfRange),
        ("damping", Number(-1.0), None, Reason::OutOfRange),
        ("substeps", Number(0.0), None, Reason::OutOfRange),
        ("substeps", Number(1001.0), None, Reason::OutOfRange),
        ("substeps", Number(2.5), None, Reason::OutOfRange),
        ("iterations", Off, None, Reason::OutOfRange),
        ("relaxation", Number(2.0), None, Reason::OutOfRange),
        ("relaxation", Number(0.0), None, Reason::OutOfRange),
        ("max_stretch", Number(1.0), None, Reason::OutOfRange),
        ("tear_stretch", Number(0.5), None, Reason::OutOfRange),
        ("tear_distance", Number(-0.1), None, Reason::OutOfRange),
        ("tear_force", Number(0.0), None, Reason::OutOfRange),
        ("max_speed", Number(0.0), None, Reason::OutOfRange),
        ("time_scale", Number(0.0), None, Reason::OutOfRange),
        ("time_scale", Number(1e4), None, Reason::OutOfRange),
        ("compliance", Number(-1e-3), None, Reason::OutOfRange),
        ("compliance", Off, None, Reason::OutOfRange),
        ("damping", Number(1.0), Some(ConstraintKind::Shear), Reason::OutOfRange),
    ];
    wrong
        .extend(PARAMETERS.map(|info| (info.name, Number(f32::INFINITY), None, Reason::NonFinite)));
    let (mut with, mut without) = (settled(), settled());
    for (name, setting, kind, reason) in wrong {
        assert_eq!(with.set(name, setting, kind), Err(reason), "{name} {setting:?}");
        step(&mut with, 1);
        step(&mut without, 1);
        assert_eq!(bits(&with), bits(&without), "{name} {setting:?}");
        assert_eq!(with.keyframe(), without.keyframe(), "{name} {setting:?}");
    }
}
