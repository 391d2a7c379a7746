//! Particles that touch triangles: the laws of friction, cloths that fold, and torn cloths.

use sim_solver::{Parameter, ParameterValue, Particle, Scene, Solver, builtin};

use super::super::{assert_at_most, assert_near, rates, solver, step, stepped};
use super::cloths::{
    GROUND, SPACING, assert_continues_from_keyframes, crossings, energy, heap, on_a_ball,
    rms_speed, sheet,
};

const CONTACT: &str = "[contact]\nmode = \"surfaces\"\n";

/// A fixed sheet in the plane y = 0, and a free one above, turned by an angle, in contact from the start. Gravity is
/// inclined instead of the sheets.
fn sheets_on_a_slope(slope: f64, friction: f64, turn: f64) -> String {
    let (sin, cos) = (turn.sin(), turn.cos());
    let half = 5.5 * SPACING;
    let origin = [-half * (cos - sin), SPACING, -half * (sin + cos)];
    let fixed: Vec<_> = (0..40 * 40).collect();
    format!(
        "gravity = [{}, {}, 0]\n[contact]\nmode = \"surfaces\"\nfriction = {friction}\n\
         [[generate]]\nshape = \"cloth\"\ncolumns = 40\nrows = 40\nspacing = {SPACING}\npinned = {fixed:?}\n\
         origin = [-0.4, 0, -0.4]\nright = [1, 0, 0]\ndown = [0, 0, 1]\n\
         [[generate]]\nshape = \"mesh\"\ncolumns = 12\nrows = 12\nspacing = {SPACING}\nmass = 0.001\n\
         origin = {origin:?}\nright = [{cos}, 0, {sin}]\ndown = [{}, 0, {cos}]\n",
        9.81 * slope.sin(),
        -9.81 * slope.cos(),
        -sin
    ) + &rates(240, 4)
}

fn mean(solver: &Solver, axis: usize) -> f64 {
    let free = solver.particles()[40 * 40..].iter().map(|one| f64::from(one.position[axis]));
    free.sum::<f64>() / 144.0
}

#[test]
fn a_sheet_slides_on_a_sheet_by_the_law_of_friction_in_every_direction() {
    for turn in [0.0, 30_f64.to_radians()] {
        for (degrees, friction) in [(10.0, 0.0), (30.0, 0.0), (35.0, 0.5), (20.0, 0.5)] {
            let slope = f64::to_radians(degrees);
            let mut sheets = solver(&sheets_on_a_slope(slope, friction, turn));
            let start = mean(&sheets, 0);
            step(&mut sheets, 48);
            let acceleration = 9.81 * (slope.sin() - friction * slope.cos()).max(0.0);
            let name = format!("slope {degrees}, friction {friction}, turned by {turn}");
            // From rest in small steps: a t (t + h) / 2.
            let expected = acceleration * 0.2 * (0.2 + 1.0 / 960.0) / 2.0;
            let tolerance = if expected > 0.0 { 0.01 * expected } else { 1e-4 };
            assert_near(&name, start + expected, mean(&sheets, 0), tolerance);
            assert_near(&name, SPACING, mean(&sheets, 1), 0.01 * SPACING);
        }
    }
}

/// Steps a falling body for two seconds. Checks ten times a second that it does not cross itself and has
/// not gained energy.
fn assert_holds(name: &str, [rate_hz, substeps]: [u32; 2], thickness: f64, body: &str) {
    let contact = format!("{CONTACT}thickness = {}\n", thickness * SPACING);
    let mut falling = solver(&(rates(rate_hz, substeps) + &contact + body));
    let start = energy(&falling);
    for _ in 0..20 {
        step(&mut falling, rate_hz / 10);
        assert_eq!(crossings(&falling), 0, "{name}");
        assert_at_most(&format!("{name}: energy"), start, energy(&falling));
    }
}

#[test]
fn folding_cloths_do_not_pass_through_themselves() {
    for (name, body) in [("heap", heap(32)), ("ball", on_a_ball(32))] {
        assert_holds(name, [240, 4], 1.0, &body);
        // In these steps, particles leave their paths many times.
        assert_holds(&format!("{name}, long steps"), [60, 16], 1.0, &body);
    }
    // As particles, the heap crosses itself hundreds of times in each of these.
    assert_holds("heap, one substep", [240, 1], 1.0, &heap(40));
    assert_holds("heap, half of the spacing", [240, 4], 0.5, &heap(40));
    assert_holds("heap, long steps, half of the spacing", [60, 16], 0.5, &heap(40));
}

#[test]
fn a_sharp_fold_does_not_pass_through_the_triangles_that_its_particles_never_touch() {
    let particles = builtin::text("covered-bust").unwrap();
    let surfaces = particles.replace("mode = \"particles\"", "mode = \"surfaces\"");
    let text = surfaces.replace("substeps = 6", "substeps = 16");
    assert_ne!(text, surfaces);
    let mut cloth = Solver::new(&Scene::from_toml(&text, "test").unwrap());
    for _ in 0..20 {
        step(&mut cloth, 6);
        assert_eq!(crossings(&cloth), 0, "{}", cloth.scene_step());
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

/// Mean height of particles.
fn height(particles: &[Particle]) -> f64 {
    particles.iter().map(|one| f64::from(one.position[1])).sum::<f64>() / particles.len() as f64
}

/// Two sheets that fly at each other.
fn thrown(speed: f32) -> Solver {
    let sheets = sheet(12, [0.0, 0.0, 0.0], ["[1, 0, 0]", "[0, 0, 1]"])
        + &sheet(12, [0.005, 0.3, 0.007], ["[1, 0, 0]", "[0, 0, 1]"]);
    let mut solver = solver(&format!("gravity = [0, 0, 0]\n{}{CONTACT}{sheets}", rates(240, 4)));
    let (mut particles, keyframe) = (solver.particles().to_vec(), solver.keyframe());
    for (index, particle) in particles.iter_mut().enumerate() {
        particle.velocity[1] = if index < 144 { speed } else { -speed };
    }
    solver.restore(&particles, &keyframe).unwrap();
    solver
}

#[test]
fn sheets_thrown_at_each_other_do_not_pass_up_to_the_speed_of_the_law() {
    // v h = 0.8 t, where both move with half of v.
    let mut sheets = thrown(0.8 * 0.02 * 960.0 / 2.0);
    let momentum = |solver: &Solver| {
        solver.particles().iter().map(|one| f64::from(one.velocity[1])).sum::<f64>() / 288.0
    };
    for _ in 0..12 {
        step(&mut sheets, 5);
        assert_eq!(crossings(&sheets), 0);
        assert_near("momentum", 0.0, momentum(&sheets), 1e-5);
    }
    let (below, above) = sheets.particles().split_at(144);
    assert_at_most("the lower sheet is below", height(above), height(below));
}

#[test]
fn a_stack_of_sheets_lies_at_the_contact_distance() {
    let sheets = (0..5).map(|layer| {
        let [x, z] = [0.003 * f64::from(layer), 0.007 * f64::from(layer % 2)];
        sheet(12, [x, 0.01 + 0.0201 * f64::from(layer), z], ["[1, 0, 0]", "[0, 0, 1]"])
    });
    let mut stack = solver(&(rates(240, 4) + CONTACT + &sheets.collect::<String>() + GROUND));
    step(&mut stack, 3 * 240);
    // The upper sheets creep along the lower ones, by a micrometre in a substep.
    assert_at_most("rms speed", 0.003, rms_speed(&stack));
    assert_eq!(crossings(&stack), 0);
    for (layer, particles) in stack.particles().chunks(144).enumerate() {
        let expected = 0.01 + SPACING * layer as f64;
        assert_near(&format!("layer {layer}"), expected, height(particles), 0.05 * SPACING);
    }
}

#[test]
fn a_rope_lies_on_a_held_sheet_and_falls_through_a_torn_one() {
    let scene = format!(
        "{}{CONTACT}[[generate]]\nshape = \"cloth\"\ncolumns = 14\nrows = 14\nspacing = {SPACING}\n\
         origin = [-0.13, 0.1, -0.13]\ndown = [0, 0, 1]\npinned = {:?}\n\
         [[generate]]\nshape = \"rope\"\ncount = 6\nfrom = [-0.05, 0.15, 0.003]\nto = [0.05, 0.15, 0.007]\n\
         mass = 0.001\npinned = \"none\"\n",
        rates(240, 4),
        (0..196).collect::<Vec<_>>()
    );
    let mut held = solver(&scene);
    step(&mut held, 120);
    for particle in &held.particles()[196..] {
        assert_near("height", 0.1 + SPACING, f64::from(particle.position[1]), 0.01 * SPACING);
    }
    let mut torn = solver(&scene);
    let constraints: Vec<_> = (0_u32..).zip(torn.constraints()).collect();
    for (index, _) in constraints.into_iter().filter(|(_, one)| one.a < 196) {
        torn.cut(index).unwrap();
    }
    step(&mut torn, 120);
    assert_at_most("through it", -0.5, height(&torn.particles()[196..]));
}

#[test]
fn ropes_touch_each_other_as_particles() {
    let rope = |from: [f64; 3], to: [f64; 3], pinned: &str| {
        format!(
            "[[generate]]\nshape = \"rope\"\ncount = 11\nfrom = {from:?}\nto = {to:?}\nmass = 0.001\n\
             pinned = {pinned}\n"
        )
    };
    let ropes = rope([-0.1, 0.0, 0.0], [0.1, 0.0, 0.0], "[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10]")
        + &rope([-0.1, 0.05, 0.001], [0.1, 0.05, 0.001], "\"none\"");
    // A cloth far away gives the scene a surface.
    let cloth = sheet(4, [5.0, 0.0, 0.0], ["[1, 0, 0]", "[0, 0, 1]"]);
    let ropes = stepped(&(rates(240, 4) + CONTACT + &ropes + &cloth), 30);
    assert_at_most("above the held one", height(&ropes.particles()[11..22]), 0.0);
}

#[test]
fn cloths_that_overlap_at_load_are_not_thrown_apart() {
    let sheets = sheet(12, [0.0, 0.0, 0.0], ["[1, 0, 0]", "[0, 0, 1]"])
        + &sheet(12, [0.005, 0.008, 0.007], ["[1, 0, 0]", "[0, 0, 1]"]);
    let text = format!("gravity = [0, 0, 0]\n{}{CONTACT}{sheets}", rates(240, 4));
    let sheets = stepped(&text, 120);
    assert_at_most("rms speed", 1e-3, rms_speed(&sheets));
    let (below, above) = sheets.particles().split_at(144);
    assert_near("distance", 0.008, height(above) - height(below), 1e-4);
}

#[test]
fn a_keyframe_at_any_step_continues_bit_for_bit() {
    assert_continues_from_keyframes(&(rates(240, 4) + CONTACT + &heap(16)));
}

#[test]
fn contacts_can_be_switched_off_and_on_while_the_scene_runs() {
    let scene = |contact: &str| rates(240, 4) + contact + &heap(16);
    let [touching, passing] =
        [CONTACT, ""].map(|contact| stepped(&scene(contact), 100).state_hash());
    assert_ne!(touching, passing);
    let mut heap = solver(&scene(CONTACT));
    let thickness = heap.parameter_values().optional(Parameter::ContactThickness).unwrap();
    heap.set("contact.thickness", ParameterValue::Off, None).unwrap();
    step(&mut heap, 100);
    assert_eq!(heap.state_hash(), passing);
    heap.reset();
    heap.set("contact.thickness", ParameterValue::Off, None).unwrap();
    heap.set("contact.thickness", ParameterValue::Number(thickness), None).unwrap();
    // The first of them publishes the initial state.
    step(&mut heap, 101);
    assert_eq!(heap.state_hash(), touching);
}

#[test]
fn other_cuts_after_a_restore_take_out_their_own_triangles() {
    let scene = rates(240, 4) + CONTACT + &heap(16);
    let cut = |solver: &mut Solver, first: u32| {
        for constraint in first..first + 200 {
            solver.cut(constraint).unwrap();
        }
        step(solver, 1);
        solver.state_hash()
    };
    // It folds.
    let mut restored = stepped(&scene, 150);
    let (particles, keyframe) = (restored.particles().to_vec(), restored.keyframe());
    cut(&mut restored, 0);
    restored.restore(&particles, &keyframe).unwrap();
    let mut fresh = solver(&scene);
    fresh.restore(&particles, &keyframe).unwrap();
    assert_eq!(cut(&mut restored, 250), cut(&mut fresh, 250));
}

#[test]
fn a_keyframe_continues_bit_for_bit_where_particles_meet_in_too_many_pairs() {
    // A sheet lies on a held one.
    let mut text = format!(
        "{}{CONTACT}[[generate]]\nshape = \"cloth\"\ncolumns = 12\nrows = 12\nspacing = {SPACING}\n\
         pinned = {:?}\ndown = [0, 0, 1]\n{}",
        rates(240, 4),
        (0..144).collect::<Vec<_>>(),
        sheet(8, [0.045, 0.02, 0.047], ["[1, 0, 0]", "[0, 0, 1]"])
    );
    for index in 0..600 {
        let place = |step: i32| f64::from((index * step) % 97) / 48.0 - 1.0;
        let aside = [place(7), place(13), place(29)];
        // All of them come to one point in 0.3 s.
        let [x, y, z] = aside.map(|axis| 6.0 * axis);
        let velocity = aside.map(|axis| -20.0 * axis);
        text += &format!(
            "[[particle]]\nposition = [{}, {y}, {z}]\nvelocity = {velocity:?}\n",
            50.0 + x
        );
    }
    let scene = Scene::from_toml(&format!("version = 1\n{text}"), "test").unwrap();
    let mut solver = Solver::new(&scene);
    step(&mut solver, 62);
    for _ in 0..16 {
        step(&mut solver, 1);
        let mut copy = Solver::new(&scene);
        copy.restore(solver.particles(), &solver.keyframe()).unwrap();
        let mut original = solver.clone();
        step(&mut original, 1);
        step(&mut copy, 1);
        assert_eq!(copy.state_hash(), original.state_hash());
    }
    assert!(solver.contact_overflow_count() > 0, "all pairs fit");
}

#[test]
fn particles_in_one_point_and_triangles_without_an_area_stay_finite() {
    let mut done = solver(&(rates(240, 4) + CONTACT + &heap(12)));
    let (mut particles, keyframe) = (done.particles().to_vec(), done.keyframe());
    for (index, particle) in particles.iter_mut().enumerate() {
        // The upper rows in one point, the others on a line.
        let place = if index < 72 { 0.0 } else { 0.02 * index as f32 };
        particle.position = [place, 0.5, 0.0];
    }
    done.restore(&particles, &keyframe).unwrap();
    step(&mut done, 240);
    assert!(done.particles().iter().all(|one| one.position.iter().all(|axis| axis.is_finite())));
    assert_eq!(done.frozen_count(), 0);
}
