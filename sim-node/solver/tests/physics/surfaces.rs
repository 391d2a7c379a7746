//! Friction and restitution of colliders that change while a scene runs, against closed forms.

use sim_solver::{
    Action, Keyframe, ParameterValue, Part, Particle, Reason, Scene, Solver, builtin,
};
use sim_types::Text;

use super::{FLOOR, assert_close, assert_near, position, rates, solver, step, velocity};

/// A particle that slides along the first of two floors, which do not meet.
fn sliding() -> String {
    "[[particle]]\nposition = [0, 0, 0]\nvelocity = [3, 0, 0]\n".to_owned()
        + FLOOR
        + "friction = 0.25\n"
        + &FLOOR.replace("offset = 0", "offset = -5")
        + "friction = 0.5\nrestitution = 0.125\n"
}

fn set(solver: &mut Solver, name: &str, value: f32, collider: u32) -> Result<(), Reason> {
    solver.set_for(name, ParameterValue::Number(value), Part::Collider(collider))
}

fn particles(solver: &Solver) -> Vec<Particle> {
    solver.particles().to_vec()
}

/// Coulomb's law: v = v0 - mu g t. A change takes effect in the next step.
#[test]
fn friction_changes_how_fast_a_sliding_particle_slows_down() {
    let mut sliding = solver(&(rates(240, 4) + &sliding()));
    let slowed = |sliding: &mut Solver| {
        let before = velocity(sliding, 0)[0];
        step(sliding, 60);
        (before - velocity(sliding, 0)[0]) / 0.25
    };
    assert_close("of the scene", 0.25 * 9.81, slowed(&mut sliding), 2e-3);
    set(&mut sliding, "friction", 0.0, 0).unwrap();
    assert_near("without friction", 0.0, slowed(&mut sliding), 1e-6);
    set(&mut sliding, "friction", 0.5, 0).unwrap();
    assert_close("set", 0.5 * 9.81, slowed(&mut sliding), 2e-3);
    // That of another collider changes nothing here, and that of all does.
    set(&mut sliding, "friction", 9.0, 1).unwrap();
    sliding.set("friction", ParameterValue::Number(0.125), None).unwrap();
    assert_close("of all", 0.125 * 9.81, slowed(&mut sliding), 2e-3);
    let frictions: Vec<_> = sliding.colliders().map(|one| one.friction).collect();
    assert_eq!(frictions, [0.125, 0.125]);
}

/// A particle that falls from a height h rises to e^2 h.
#[test]
fn the_first_restitution_of_a_scene_lets_particles_bounce() {
    let text = rates(2000, 4) + "[[particle]]\nposition = [0, 1, 0]\n" + FLOOR;
    let mut falling = solver(&text);
    step(&mut falling, 200);
    set(&mut falling, "restitution", 0.5, 0).unwrap();
    let mut top = 0.0_f64;
    for step_index in 0..1400 {
        step(&mut falling, 1);
        // It lands after 0.45 s.
        top = if step_index < 800 { 0.0 } else { top.max(position(&falling, 0)[1]) };
    }
    assert_close("height of the bounce", 0.25, top, 0.02);
    falling.set("restitution", ParameterValue::Off, None).unwrap();
    step(&mut falling, 4000);
    assert_near("rest", 0.0, position(&falling, 0)[1], 1e-6);
}

#[test]
fn surfaces_are_part_of_a_keyframe_and_a_reset_restores_them() {
    let scene = Scene::from_toml(&format!("version = 1\n{}", sliding()), "test").unwrap();
    let mut original = Solver::new(&scene);
    set(&mut original, "friction", 0.75, 0).unwrap();
    set(&mut original, "restitution", 0.5, 1).unwrap();
    step(&mut original, 10);
    let encoded = original.keyframe().encode();
    assert!(encoded.len() <= original.keyframe_size_bytes_max());
    let keyframe = Keyframe::decode(&encoded).unwrap();
    let mut copy = Solver::new(&scene);
    copy.restore(&particles(&original), &keyframe).unwrap();
    let surfaces = |solver: &Solver| {
        solver.colliders().map(|one| (one.friction, one.restitution)).collect::<Vec<_>>()
    };
    assert_eq!(surfaces(&copy), [(0.75, 0.0), (0.5, 0.5)]);
    step(&mut copy, 50);
    step(&mut original, 50);
    assert_eq!(copy.state_hash(), original.state_hash());

    // The state of another scene is refused.
    let curtain = Scene::from_toml(builtin::text("curtain").unwrap(), "curtain").unwrap();
    let other = Solver::new(&curtain);
    assert!(copy.restore(&particles(&other), &original.keyframe()).is_err());
    // Five empty lists follow the surfaces.
    let mut damaged = encoded.clone();
    let last = damaged.len() - 9;
    damaged[last..last + 4].copy_from_slice(&1.5_f32.to_le_bytes());
    let damaged = Keyframe::decode(&damaged).unwrap();
    assert!(copy.restore(&particles(&original), &damaged).is_err(), "a restitution above 1");

    original.reset();
    assert_eq!(surfaces(&original), [(0.25, 0.0), (0.5, 0.125)]);
}

#[test]
fn a_wrong_surface_is_refused() {
    let mut refusing = solver(&sliding());
    assert_eq!(set(&mut refusing, "friction", 0.5, 2), Err(Reason::UnknownCollider));
    assert_eq!(set(&mut refusing, "friction", -0.5, 0), Err(Reason::OutOfRange));
    assert_eq!(set(&mut refusing, "friction", f32::NAN, 0), Err(Reason::NonFinite));
    assert_eq!(set(&mut refusing, "restitution", 1.5, 0), Err(Reason::OutOfRange));
    assert_eq!(set(&mut refusing, "damping", 0.5, 0), Err(Reason::OutOfRange));
    let mut apply = |name: &str, block, collider| {
        let (parameter, value) = (Text::new(name).unwrap(), ParameterValue::Number(0.5));
        let set = Action::Set { parameter, value, constraint_kind: None, block, collider };
        refusing.apply(1, &set)
    };
    assert_eq!(apply("friction", Some(0), None), Err(Reason::OutOfRange));
    assert_eq!(apply("friction", Some(0), Some(0)), Err(Reason::OutOfRange));
    let frictions: Vec<_> = refusing.colliders().map(|one| one.friction).collect();
    assert_eq!(frictions, [0.25, 0.5]);
    let mut without = solver("");
    let set = without.set("friction", ParameterValue::Number(0.5), None);
    assert_eq!(set, Err(Reason::NoEffectHere));
}
