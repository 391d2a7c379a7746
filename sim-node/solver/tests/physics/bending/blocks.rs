//! A rigidity for one generated block: the bends of the block have it, and no others.

use sim_solver::{
    Action, BlockValue, ConstraintKind, Keyframe, ParameterValue, Part, Particle, Reason, Scene,
    Solver,
};
use sim_types::{KindFilter, Text};

use crate::physics::{bits, particles, step};

/// Five blocks with bends, and explicit bends between them.
const SCENE: &str = include_str!("../../scenes/bends.toml");
/// By block: its line in the scene.
const LINES: [&str; 5] = [
    "\nbending = 0.02\n",
    "\nbending = [0.01, 0.03]\n",
    "\nbending = 0.002\n",
    "\nbending = 0.05\n",
    "\nbending = 0.001\n",
];
const NEW: f32 = 0.004;
const NEW_LINE: &str = "\nbending = 0.004\n";

fn solver(text: &str) -> Solver {
    Solver::new(&Scene::from_toml(text, "bends").unwrap())
}

fn set_block(solver: &mut Solver, block: u32, value: f32) -> Result<(), Reason> {
    solver.set_for("bending", ParameterValue::Number(value), Part::Block(block))
}

fn stepped(mut solver: Solver) -> Vec<u8> {
    step(&mut solver, 60);
    bits(&solver)
}

#[test]
fn a_block_with_a_new_rigidity_has_the_bits_of_a_scene_with_it() {
    let unchanged = stepped(solver(SCENE));
    for (block, line) in (0..).zip(LINES) {
        assert_eq!(SCENE.matches(line).count(), 1, "{line}");
        let expected = stepped(solver(&SCENE.replace(line, NEW_LINE)));
        assert!(expected != unchanged, "block {block} bends");
        let mut changed = solver(SCENE);
        set_block(&mut changed, block, NEW).unwrap();
        let values = changed.parameter_values();
        assert_eq!(values.bending_by_block, [BlockValue { block, value: NEW }]);
        assert_eq!(values.bending(None), None);
        assert!(stepped(changed) == expected, "block {block}");
    }
}

#[test]
fn the_last_setting_of_a_block_counts_and_one_of_all_bends_replaces_it() {
    let mut both = solver(SCENE);
    for (block, value) in [(3, 0.5), (0, NEW), (3, NEW)] {
        set_block(&mut both, block, value).unwrap();
    }
    let text = SCENE.replace(LINES[0], NEW_LINE).replace(LINES[3], NEW_LINE);
    assert!(stepped(both) == stepped(solver(&text)));

    let all = |solver: &mut Solver| solver.set("bending", ParameterValue::Number(0.01), None);
    let (mut of_all, mut replaced) = (solver(SCENE), solver(SCENE));
    all(&mut of_all).unwrap();
    set_block(&mut replaced, 1, NEW).unwrap();
    all(&mut replaced).unwrap();
    assert_eq!(replaced.parameter_values(), of_all.parameter_values());
    assert!(stepped(replaced) == stepped(of_all));

    let mut after = solver(SCENE);
    all(&mut after).unwrap();
    set_block(&mut after, 1, NEW).unwrap();
    let values = after.parameter_values();
    assert_eq!(values.bending(None), Some(0.01));
    assert_eq!(values.bending_by_block, [BlockValue { block: 1, value: NEW }]);
}

#[test]
fn a_keyframe_has_the_rigidities_of_blocks_and_a_reset_ends_them() {
    let scene = Scene::from_toml(SCENE, "bends").unwrap();
    let mut original = Solver::new(&scene);
    step(&mut original, 5);
    set_block(&mut original, 2, NEW).unwrap();
    step(&mut original, 5);
    let encoded = original.keyframe().encode();
    assert!(encoded.len() <= original.keyframe_size_bytes_max());
    let keyframe = Keyframe::decode(&encoded).unwrap();
    let state: Vec<Particle> = particles(&original).collect();
    let mut copy = Solver::new(&scene);
    copy.restore(&state, &keyframe).unwrap();
    assert_eq!(copy.parameter_values(), original.parameter_values());
    step(&mut copy, 20);
    step(&mut original, 20);
    assert!(bits(&copy) == bits(&original));

    // A copy of the initial state forgets the block.
    let initial = Solver::new(&scene);
    copy.restore(&particles(&initial).collect::<Vec<_>>(), &initial.keyframe()).unwrap();
    assert_eq!(copy.keyframe(), initial.keyframe());
    set_block(&mut copy, 4, NEW).unwrap();
    for wrong in [&encoded[..encoded.len() - 1], &[&encoded[..], &[0]].concat()] {
        assert!(Keyframe::decode(wrong).is_err());
    }

    // A scene with other blocks refuses the state.
    let text = SCENE.replace(LINES[2], "\n");
    let mut other = solver(&text);
    assert!(other.restore(&state, &keyframe).is_err());

    original.reset();
    assert_eq!(original.parameter_values().bending_by_block, []);
    // The step of a reset shows the initial state.
    step(&mut original, 1);
    assert!(stepped(original) == stepped(Solver::new(&scene)));
}

#[test]
fn a_wrong_block_is_refused() {
    let mut refusing = solver(&SCENE.replace(LINES[2], "\n"));
    assert_eq!(set_block(&mut refusing, 2, NEW), Err(Reason::NoEffectHere));
    assert_eq!(set_block(&mut refusing, 5, NEW), Err(Reason::OutOfRange));
    assert_eq!(set_block(&mut refusing, 0, -1.0), Err(Reason::OutOfRange));
    assert_eq!(set_block(&mut refusing, 0, f32::NAN), Err(Reason::NonFinite));
    let mut apply = |name: &str, value, constraint_kind| {
        let parameter = Text::new(name).unwrap();
        refusing.apply(
            1,
            &Action::Set { parameter, value, constraint_kind, block: Some(0), collider: None },
        )
    };
    let number = ParameterValue::Number(1.0);
    assert_eq!(apply("bending", ParameterValue::Off, None), Err(Reason::OutOfRange));
    assert_eq!(apply("damping", number, None), Err(Reason::OutOfRange));
    let kind = Some(KindFilter::Known(ConstraintKind::Bend));
    assert_eq!(apply("bending", number, kind), Err(Reason::OutOfRange));
    assert_eq!(refusing.parameter_values(), solver(SCENE).parameter_values());
}
