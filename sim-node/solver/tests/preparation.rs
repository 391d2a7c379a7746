//! Constraints and contacts that are prepared beside a solver: the same bits as without, whatever happens between the
//! plan and the command, and whatever the spare was used for before.

use sim_solver::{
    Action, Keyframe, Parameter, ParameterValue, Particle, Prepared, Scene, Solver, Spare,
};
use sim_types::{KindFilter, Text};

/// A cloth with soft shear and tethers, which tears, in the wind, above a ball.
const SCENE: &str = "version = 1\n[solver]\ntethers = true\nsubsteps = 2\n\
    [wind]\nvelocity = [1.0, 0.0, 2.0]\ndrag = 0.1\n\
    [[generate]]\nshape = \"cloth\"\ncolumns = 28\nrows = 30\nspacing = 0.05\n\
    pinned = [0, 27]\ncompliance = { shear = 1e-5 }\n\
    [[generate]]\nshape = \"rope\"\ncount = 40\nfrom = [0, 1, 1]\nto = [1, 1, 1]\n\
    [[collider]]\nshape = \"sphere\"\ncenter = [0.5, -1.0, 0.2]\nradius = 0.4\n";

fn solver(text: &str) -> Solver {
    Solver::new(&Scene::from_toml(text, "test").unwrap())
}

fn set(parameter: Parameter, value: f32) -> Action {
    let value = ParameterValue::Number(value);
    Action::set(parameter.name(), value)
}

/// A state to return to.
struct Past {
    particles: Vec<Particle>,
    keyframe: Keyframe,
}

impl Past {
    fn of(solver: &Solver) -> Self {
        Self { particles: solver.particles().to_vec(), keyframe: solver.keyframe() }
    }
}

/// A solver whose commands take prepared constraints over.
struct Assisted {
    solver: Solver,
    spare: Option<Spare>,
    /// Number of plans.
    plan_count: usize,
}

impl Assisted {
    fn prepare(&mut self, plan: Option<sim_solver::Plan>) -> Option<Prepared> {
        let plan = plan?;
        self.plan_count += 1;
        Some(plan.prepare(self.spare.take()))
    }

    fn finish(&mut self, prepared: Option<Prepared>, command: impl FnOnce(&mut Solver)) {
        if let Some(prepared) = prepared {
            self.solver.offer(prepared);
        }
        command(&mut self.solver);
        self.solver.finish_boundary();
        self.spare = self.solver.withdraw().or(self.spare.take());
    }
}

/// Puts a state in place in both solvers and in a new one, and compares their steps.
fn return_to(past: &Past, plain: &mut Solver, assisted: &mut Assisted) {
    let Past { particles, keyframe } = past;
    let plan = assisted.solver.plan_state(keyframe);
    let prepared = assisted.prepare(plan);
    plain.step();
    assisted.solver.step();
    plain.put_in_place(particles, keyframe).unwrap();
    assisted.finish(prepared, |solver| solver.put_in_place(particles, keyframe).unwrap());
    let mut fresh = solver(SCENE);
    fresh.put_in_place(particles, keyframe).unwrap();
    for _ in 0..9 {
        for solver in [&mut *plain, &mut assisted.solver, &mut fresh] {
            solver.step();
        }
        assert_eq!(plain.state_hash(), fresh.state_hash());
        assert_eq!(plain.state_hash(), assisted.solver.state_hash());
    }
}

#[test]
fn prepared_constraints_change_no_bit() {
    let mut plain = solver(SCENE);
    let mut assisted = Assisted { solver: plain.clone(), spare: None, plan_count: 0 };
    let mut past = vec![Past::of(&plain)];
    let actions = [
        set(Parameter::Compliance, 1e-4),
        set(Parameter::TearStretch, 1.05),
        set(Parameter::Substeps, 3.0),
        set(Parameter::WindDrag, 0.0),
        set(Parameter::Compliance, 0.0),
        Action::Reset,
        set(Parameter::Iterations, 2.0),
        set(Parameter::TearForce, 4.0),
        Action::Set {
            parameter: Text::cut("compliance"),
            value: ParameterValue::Off,
            constraint_kind: Some(KindFilter::Known(sim_solver::ConstraintKind::Shear)),
            block: None,
            collider: None,
        },
        set(Parameter::TearStretch, 1.1),
        set(Parameter::MaxStretch, 1.2),
        Action::Reset,
        set(Parameter::WindDrag, 0.3),
        Action::Pin { particle: 400 },
        Action::Unpin { particle: 27 },
    ];
    let mut torn_counts = Vec::new();
    for (round, action) in actions.iter().cycle().take(60).enumerate() {
        let plan = assisted.solver.plan([*action]);
        let prepared = assisted.prepare(plan);
        // The scene goes on between the plan and the command, and sometimes changes what it was made
        // from.
        for step in 0..round % 5 {
            if round % 3 == 1 && step == 1 {
                let (constraint, particle) = (11 * round, 7 * round);
                for solver in [&mut plain, &mut assisted.solver] {
                    // It may be torn already.
                    let _is_cut = solver.cut(u32::try_from(constraint).unwrap());
                    solver.pin(u32::try_from(particle).unwrap()).unwrap();
                }
            }
            plain.step();
            assisted.solver.step();
            assert_eq!(plain.state_hash(), assisted.solver.state_hash(), "before {round}");
        }
        let (expected, found) = (plain.apply(7, action), &mut None);
        plain.finish_boundary();
        assisted.finish(prepared, |solver| *found = Some(solver.apply(7, action)));
        assert_eq!(Some(expected), *found);
        for _ in 0..12 {
            plain.step();
            assisted.solver.step();
            assert_eq!(plain.state_hash(), assisted.solver.state_hash(), "{round}: {action:?}");
        }
        torn_counts.push(plain.torn().len());
        if round % 4 == 2 {
            past.push(Past::of(&plain));
        }
        if round % 5 == 4 {
            return_to(&past[(7 * round) % past.len()], &mut plain, &mut assisted);
        }
        assert_eq!(plain.keyframe(), assisted.solver.keyframe());
    }
    assert!(assisted.plan_count > 40, "{}", assisted.plan_count);
    assert!(torn_counts.iter().any(|count| *count > 0), "nothing tore");
}

/// Cloths that touch as surfaces and loose particles between them.
const TOUCHING: &str = "version = 1\n[contact]\nmode = \"surfaces\"\nthickness = 0.02\n\
    [[generate]]\nshape = \"cloth\"\ncolumns = 24\nrows = 24\nspacing = 0.05\n\
    right = [1, 0, 0]\ndown = [0, 0, 1]\npinned = \"corners\"\n\
    [[generate]]\nshape = \"mesh\"\ncolumns = 12\nrows = 12\nspacing = 0.05\norigin = [0.2, 0.05, 0.2]\n\
    right = [1, 0, 0]\ndown = [0, 0, 1]\n\
    [[particle]]\nposition = [0.4, 0.1, 0.4]\n[[particle]]\nposition = [0.41, 0.13, 0.4]\n";

#[test]
fn prepared_contacts_change_no_bit() {
    let mut plain = solver(TOUCHING);
    let mut assisted = Assisted { solver: plain.clone(), spare: None, plan_count: 0 };
    let off = Action::set(Parameter::ContactThickness.name(), ParameterValue::Off);
    let actions = [
        set(Parameter::ContactThickness, 0.03),
        set(Parameter::ContactThickness, 0.01),
        Action::Reset,
        off,
        set(Parameter::ContactThickness, 0.025),
        set(Parameter::Substeps, 3.0),
        Action::Reset,
    ];
    for (round, action) in actions.iter().cycle().take(14).enumerate() {
        let plan = assisted.solver.plan([*action]);
        let prepared = assisted.prepare(plan);
        let overtaking = set(Parameter::ContactThickness, 0.015);
        for step in 0..10 {
            if step == 5 && round == 8 {
                // What was prepared does not fit, once another command has come first.
                plain.apply(7, &overtaking).unwrap();
                assisted.finish(None, |solver| _ = solver.apply(7, &overtaking).unwrap());
            }
            plain.step();
            assisted.solver.step();
        }
        plain.apply(7, action).unwrap();
        plain.finish_boundary();
        assisted.finish(prepared, |solver| _ = solver.apply(7, action).unwrap());
        for _ in 0..20 {
            plain.step();
            assisted.solver.step();
            assert_eq!(plain.state_hash(), assisted.solver.state_hash(), "{round}: {action:?}");
        }
        assert_eq!(plain.keyframe(), assisted.solver.keyframe());
    }
    assert_eq!(assisted.plan_count, 14, "each has work to plan");
}

/// The spare of a plan for contacts alone has the tethers that it had when it was in use.
#[test]
fn constraints_of_a_spare_come_back_without_its_tethers() {
    let text = format!("{SCENE}[contact]\nmode = \"particles\"\nthickness = 0.02\n");
    let mut plain = solver(&text);
    let mut assisted = Assisted { solver: plain.clone(), spare: None, plan_count: 0 };
    let change = |plain: &mut Solver, assisted: &mut Assisted, actions: &[Action]| {
        let plan = assisted.solver.plan([actions[0]]);
        let prepared = assisted.prepare(plan);
        for action in actions {
            plain.apply(7, action).unwrap();
        }
        let apply = |solver: &mut Solver| {
            for action in actions {
                solver.apply(7, action).unwrap();
            }
        };
        assisted.finish(prepared, apply);
    };
    let steps = |plain: &mut Solver, assisted: &mut Assisted| {
        for _ in 0..40 {
            plain.step();
            assisted.solver.step();
            assert_eq!(plain.state_hash(), assisted.solver.state_hash());
        }
    };
    change(&mut plain, &mut assisted, &[set(Parameter::Substeps, 3.0)]);
    steps(&mut plain, &mut assisted);
    // Without pins, no tether holds anything.
    for solver in [&mut plain, &mut assisted.solver] {
        solver.unpin(0).unwrap();
        solver.unpin(27).unwrap();
    }
    steps(&mut plain, &mut assisted);
    change(
        &mut plain,
        &mut assisted,
        &[set(Parameter::ContactThickness, 0.03), set(Parameter::Substeps, 2.0)],
    );
    steps(&mut plain, &mut assisted);
    assert_eq!(assisted.plan_count, 2);
}

#[test]
fn settings_that_follow_each_other_are_prepared_together() {
    let actions = [
        set(Parameter::Compliance, 1e-4),
        set(Parameter::Substeps, 3.0),
        set(Parameter::Stiffness, 0.5),
        set(Parameter::Compliance, 1e-5),
        set(Parameter::Gravity, 1.0),
        set(Parameter::MaxStretch, 1.1),
    ];
    let mut plain = solver(SCENE);
    let mut assisted = Assisted { solver: plain.clone(), spare: None, plan_count: 0 };
    for _ in 0..3 {
        let plan = assisted.solver.plan(actions);
        let prepared = assisted.prepare(plan);
        let apply = |solver: &mut Solver| {
            for action in &actions {
                // Some are rejected.
                let _applied = solver.apply(1, action);
            }
        };
        apply(&mut plain);
        assisted.finish(prepared, apply);
        for _ in 0..20 {
            plain.step();
            assisted.solver.step();
            assert_eq!(plain.state_hash(), assisted.solver.state_hash());
        }
        assert_eq!(plain.keyframe(), assisted.solver.keyframe());
    }
    // The same values need no work, and they cancel a change.
    assert!(assisted.solver.plan(actions).is_none());
    assert_eq!(assisted.plan_count, 1);
    let there_and_back = [set(Parameter::Substeps, 5.0), set(Parameter::Substeps, 3.0)];
    assert!(assisted.solver.plan(there_and_back[..1].iter().copied()).is_some());
    assert!(assisted.solver.plan(there_and_back).is_none());
}

#[test]
fn a_state_from_before_a_tear_has_its_tethers_again() {
    let mut torn = solver(SCENE);
    torn.step();
    let past = Past::of(&torn);
    // Every path from a root begins with one of these.
    for constraint in (0..torn.constraint_count()).map(|index| u32::try_from(index).unwrap()) {
        let ends = torn.constraints().nth(constraint as usize).unwrap();
        if [ends.a, ends.b].iter().any(|end| [0, 27].contains(end)) {
            torn.cut(constraint).unwrap();
        }
    }
    torn.step();
    torn.restore(&past.particles, &past.keyframe).unwrap();
    let mut fresh = solver(SCENE);
    fresh.restore(&past.particles, &past.keyframe).unwrap();
    for _ in 0..60 {
        torn.step();
        fresh.step();
    }
    assert_eq!(torn.state_hash(), fresh.state_hash());
}

#[test]
fn the_commands_of_a_boundary_have_the_same_effect_together_and_one_by_one() {
    let pin = Action::Pin { particle: 41 };
    let cut = Action::Cut { constraint: 1 };
    let across = Action::CutRadius { center: [0.4, -0.4, 0.0], radius: 0.1 };
    let soft = set(Parameter::Compliance, 1e-4);
    for actions in [
        [pin, cut, across],
        [cut, pin, across],
        [Action::Reset, cut, pin],
        [soft, cut, Action::Unpin { particle: 0 }],
        [cut, Action::Reset, across],
    ] {
        let (mut together, mut one_by_one) = (solver(SCENE), solver(SCENE));
        for solver in [&mut together, &mut one_by_one] {
            solver.step();
        }
        for action in &actions {
            together.apply(1, action).unwrap();
            one_by_one.apply(1, action).unwrap();
            one_by_one.finish_boundary();
        }
        for _ in 0..30 {
            together.step();
            one_by_one.step();
            assert_eq!(together.keyframe(), one_by_one.keyframe(), "{actions:?}");
            assert_eq!(together.state_hash(), one_by_one.state_hash(), "{actions:?}");
        }
    }
}

#[test]
fn nothing_is_planned_for_commands_that_are_cheap_or_wrong() {
    let solver = solver(SCENE);
    let action = |name: &str, value: f32| Action::set(name, value);
    assert!(solver.plan([action("compliance", 1e-3)]).is_some());
    // The tethers of another pin.
    assert!(solver.plan([Action::Pin { particle: 1 }]).is_some());
    let without_tethers = self::solver(&SCENE.replace("tethers = true", ""));
    assert!(without_tethers.plan([Action::Pin { particle: 1 }]).is_none());
    for action in [
        action("compliance", -1.0),
        action("compliance", f32::NAN),
        action("stiffness", 0.5),
        action("unknown", 0.5),
        action("damping", 0.5),
        Action::Pin { particle: 0 },
        Action::Pin { particle: u32::MAX },
        Action::Unpin { particle: 1 },
        Action::Reset,
    ] {
        assert!(solver.plan([action]).is_none(), "{action:?}");
    }
    assert!(solver.plan_state(&solver.keyframe()).is_none());
    let small = Solver::new(&Scene::from_toml("version = 1", "small").unwrap());
    assert!(small.plan([action("compliance", 1e-3)]).is_none());
}

#[test]
fn constraints_of_another_scene_are_ignored() {
    let mut first = solver(SCENE);
    let mut second = solver(&SCENE.replace("columns = 28", "columns = 29"));
    let action = set(Parameter::Compliance, 1e-4);
    first.offer(second.plan([action]).unwrap().prepare(None));
    assert!(first.withdraw().is_none());
    // A spare of another scene is of no use, either.
    second.offer(second.plan([action]).unwrap().prepare(None));
    let spare = second.withdraw();
    assert!(spare.is_some());
    let mut plain = first.clone();
    first.offer(first.plan([action]).unwrap().prepare(spare));
    for solver in [&mut plain, &mut first] {
        solver.apply(1, &action).unwrap();
        for _ in 0..5 {
            solver.step();
        }
    }
    assert_eq!(plain.state_hash(), first.state_hash());
}

#[test]
fn a_keyframe_of_another_scene_has_no_plan() {
    let large = solver(&SCENE.replace("columns = 28", "columns = 60"));
    let mut torn = large.clone();
    torn.cut(u32::try_from(large.constraint_count() - 1).unwrap()).unwrap();
    torn.set("substeps", ParameterValue::Number(3.0), None).unwrap();
    torn.step();
    assert!(large.plan_state(&torn.keyframe()).is_some());
    assert!(solver(SCENE).plan_state(&torn.keyframe()).is_none());
}
