//! Pointer tools: a grab, a cut, a pin and a brush stroke show in the snapshots of the node.

use integration_tests::{DEADLINE, ctl, wait_for};
use serde_json::json;
use sim_contract::{ParticleFlags, ParticleState};

use crate::browser::support::{Area, Button, Rig, State, distance, is_cloth, is_grab_mark};

/// Particle of the curtain that the tests grab: row 6, column 6.
const TARGET: usize = 90;
/// Columns and rows of the curtain.
const COLUMNS: usize = 14;
const ROWS: usize = 12;

/// A view straight at a square lattice of particles without constraints and gravity, so that every
/// motion comes from the pointer.
const LATTICE_LOOK: &str = "camera=0,0,0,3.4,0,0&show.particles=1";
const LATTICE_SIDE: usize = 7;
const LATTICE_SPACING: f64 = 0.2;
/// Initial radius of the brush, in px.
const BRUSH_RADIUS: f64 = 50.0;

fn lattice() -> String {
    let mut text = String::from("version = 1\ngravity = [0, 0, 0]\n");
    for row in 0..LATTICE_SIDE {
        for column in 0..LATTICE_SIDE {
            let [x, y] = [column, row].map(|at| (at as f64 - 3.0) * LATTICE_SPACING);
            text += &format!("[[particle]]\nposition = [{x}, {y}, 0]\nmass = 0.01\n");
        }
    }
    text
}

fn is_grabbed(particle: &ParticleState) -> bool {
    particle.flags & ParticleFlags::GRABBED != 0
}

fn is_pinned(particle: &ParticleState) -> bool {
    particle.flags & ParticleFlags::PINNED != 0
}

fn speed(particle: &ParticleState) -> f64 {
    particle.velocity.map(|one| f64::from(one).powi(2)).iter().sum::<f64>().sqrt()
}

#[test]
#[ignore = "needs Chromium"]
fn a_grabbed_particle_follows_the_mouse() {
    let mut rig = Rig::new(&["curtain"], "");
    let camera = rig.tab.camera();
    // The curtain swings. In a pause the press falls on the particle that the page shows there.
    let from = camera.project(rig.pause().particles[TARGET].position);
    let to = [from[0] + 70.0, from[1] - 50.0];
    rig.tab.press(from, Button::Left);
    rig.tab.key(' ');
    rig.wait_for_state("the grab", |state| is_grabbed(&state.particles[TARGET]));
    rig.tab.stroke(from, to, 10);
    let follows =
        |state: &State| distance(camera.project(state.particles[TARGET].position), to) < 1.0;
    let state = rig.wait_for_state("the particle under the mouse", follows);
    assert_eq!(state.particles.iter().filter(|one| is_grabbed(one)).count(), 1);

    wait_for("the mark of the grab in the picture, under the mouse", || {
        let picture = rig.tab.drawn(Area::around(to, 30.0));
        let drawn = picture.middle_of(to, 30.0, is_grab_mark)?;
        (distance(drawn, to) <= 2.0).then_some(())
    });
    assert_eq!(rig.tab.drawn(Area::around(from, 12.0)).middle_of(from, 12.0, is_grab_mark), None);
    rig.tab.release(to);
    rig.wait_for_state("the release", |state| !state.particles.iter().any(is_grabbed));
    rig.wait_for_state("the particle to swing back", |state| !follows(state));
}

#[test]
#[ignore = "needs Chromium"]
fn a_released_particle_keeps_the_velocity_of_the_pointer() {
    let mut rig = Rig::with_scene(&lattice(), &[], LATTICE_LOOK);
    let camera = rig.tab.camera();
    let corner = 0;
    let from = camera.project(rig.state().particles[corner].position);
    rig.tab.press(from, Button::Left);
    rig.wait_for_state("the grab", |state| is_grabbed(&state.particles[corner]));
    let middle = [from[0] - 12.0, from[1]];
    rig.tab.stroke(from, middle, 4);
    rig.tab.fling(middle, [from[0] - 24.0, from[1]]);
    let first = rig.wait_for_state("the release", |state| {
        let particle = &state.particles[corner];
        particle.position[0] < -0.61 && !is_grabbed(particle)
    });
    let particle = first.particles[corner];
    let [vx, vy, vz] = particle.velocity;
    assert!(vx < -0.05 && vy.abs() < 0.1 * vx.abs() && vz.abs() < 0.1 * vx.abs(), "{particle:?}");
    let later = rig.wait_for_state("later steps", |state| state.step >= first.step + 24).clone();
    let time = (later.step - first.step) as f32 / 240.0;
    let expected = particle.position[0] + vx * time;
    assert!((later.particles[corner].position[0] - expected).abs() < 1e-3 * vx.abs());
    assert!(later.particles[1..].iter().all(|one| speed(one) == 0.0), "other particles moved");
}

#[test]
#[ignore = "needs Chromium"]
fn a_stroke_with_the_right_button_cuts_the_sticks_it_crosses() {
    // The cloth sags at the cut while the stroke continues. In wind it would also move away before.
    let mut rig = Rig::new(&["curtain", "--paused"], "");
    ctl(&rig.sandbox, &["set", "wind.drag", "off"]);
    rig.tab.key(' ');
    rig.tab.wait("!viewer.paused");
    let camera = rig.tab.camera();
    let pixel = |state: &State, row: usize, column: usize| {
        camera.project(state.particles[row * COLUMNS + column].position)
    };
    let state = rig.state().clone();
    // Between rows 5 and 6, from outside the left edge to a quarter past the stick of column 6. No
    // end of the stroke is near a stick.
    let between = |column: usize| {
        let (above, below) = (pixel(&state, 5, column), pixel(&state, 6, column));
        [0, 1].map(|axis| f64::midpoint(above[axis], below[axis]))
    };
    let beyond = |column: usize, towards: usize, share: f64| {
        let (here, there) = (between(column), between(towards));
        [0, 1].map(|axis| here[axis] + share * (there[axis] - here[axis]))
    };
    let (from, last) = (beyond(0, 1, -0.4), beyond(6, 7, 0.25));
    rig.tab.press(from, Button::Right);
    rig.tab.stroke(from, last, 8);
    rig.tab.release(last);

    // Seven vertical sticks, and two diagonals in each of the six cells between them.
    let count = 7 + 12;
    let torn = wait_for("the cut in the node", || {
        let torn = rig.client().torn(DEADLINE).unwrap();
        (torn.constraints.len() >= count).then_some(torn)
    });
    let topology = rig.client().topology(DEADLINE).unwrap().unwrap();
    for one in &torn.constraints {
        let constraint = topology.constraints[one.constraint as usize];
        let rows = [constraint.a, constraint.b].map(|end| end as usize / COLUMNS);
        assert_eq!(rows.iter().min().zip(rows.iter().max()), Some((&5, &6)), "{constraint:?}");
    }
    assert_eq!(torn.constraints.len(), count);
    rig.tab.wait(&format!("viewer.torn === {count}"));
    // The severed part falls.
    let lowest = (ROWS - 1) * COLUMNS;
    let height = state.particles[lowest].position[1];
    rig.wait_for_state("the cut part to sag", |now| {
        now.particles[lowest].position[1] < height - 0.03
    });
}

#[test]
#[ignore = "needs Chromium"]
fn a_cut_is_a_line_in_the_picture_and_not_a_row_of_missing_cells() {
    let mut rig = Rig::new(&["curtain", "--paused"], "");
    let state = rig.settled();
    let camera = rig.tab.camera();
    let pixel = |particle: usize| camera.project(state.particles[particle].position);
    let cloth = |rig: &Rig| rig.tab.drawn(camera.area()).count(&camera.area(), is_cloth) as f64;
    let intact = cloth(&rig);
    // Along the middle between rows 5 and 6, from outside the left edge to outside the right one.
    let middle = |column: usize| {
        let (above, below) = (pixel(5 * COLUMNS + column), pixel(6 * COLUMNS + column));
        [0, 1].map(|axis| f64::midpoint(above[axis], below[axis]))
    };
    let (left, right) = (middle(0), middle(COLUMNS - 1));
    let (from, to) = ([left[0] - 20.0, left[1]], [right[0] + 20.0, right[1]]);
    rig.tab.press(from, Button::Right);
    for at in (0..COLUMNS).map(middle).chain([to]) {
        rig.tab.move_to(at);
    }
    rig.tab.release(to);
    rig.step(1);
    let torn = COLUMNS + 2 * (COLUMNS - 1);
    rig.tab.wait(&format!("viewer.torn === {torn}"));
    rig.settled();
    // A row of cells is an eleventh of the curtain.
    let share = cloth(&rig) / intact;
    assert!((0.99..1.01).contains(&share), "{share} of the cloth is left");
}

#[test]
#[ignore = "needs Chromium"]
fn a_double_click_and_a_key_pin_and_unpin() {
    let mut rig = Rig::new(&["curtain"], "");
    let camera = rig.tab.camera();
    let at = camera.project(rig.pause().particles[TARGET].position);
    let is_shown = format!("viewer.pins.some(([particle]) => particle === {TARGET})");
    rig.tab.move_to(at);
    rig.tab.double_click(at);
    rig.tab.wait(&is_shown);
    rig.tab.key(' ');
    rig.wait_for_state("the pin", |state| is_pinned(&state.particles[TARGET]));
    let pinned = rig.wait_for_state("the release after the double click", |state| {
        !state.particles.iter().any(is_grabbed)
    });
    assert_eq!(pinned.particles.iter().filter(|one| is_pinned(one)).count(), COLUMNS + 1);

    // It was pinned where it stood when the double click took effect. The others go on moving.
    rig.tab.move_to(camera.project(pinned.particles[TARGET].position));
    rig.tab.key('p');
    rig.wait_for_state("the unpinned particle", |state| !is_pinned(&state.particles[TARGET]));
    rig.tab.wait(&format!("!{is_shown}"));
    let at = camera.project(rig.pause().particles[TARGET].position);
    rig.tab.click("button[data-mode=pin]");
    rig.tab.press(at, Button::Left);
    rig.tab.release(at);
    rig.tab.wait(&is_shown);
    rig.tab.key(' ');
    rig.wait_for_state("the pin", |state| is_pinned(&state.particles[TARGET]));
}

#[test]
#[ignore = "needs Chromium"]
fn a_reset_reverts_cuts_and_pins_of_the_same_pause_in_the_picture() {
    let mut rig = Rig::new(&["curtain", "--paused"], "");
    let state = rig.settled();
    let intact = rig.tab.hash();
    let camera = rig.tab.camera();
    let pixel = |particle: usize| camera.project(state.particles[particle].position);
    // Down between two columns, from above the stick that joins them in one row to below that of the next.
    let [upper, lower] = [TARGET, TARGET + COLUMNS].map(|particle| {
        let (left, right) = (pixel(particle), pixel(particle + 1));
        [0, 1].map(|axis| f64::midpoint(left[axis], right[axis]))
    });
    let [from, to] =
        [-0.3, 1.3].map(|part| [0, 1].map(|axis| upper[axis] + part * (lower[axis] - upper[axis])));
    rig.tab.press(from, Button::Right);
    rig.tab.stroke(from, to, 4);
    rig.tab.release(to);
    wait_for("the cut in the picture", || (rig.tab.hash() != intact).then_some(()));
    rig.tab.move_to(pixel(TARGET));
    rig.tab.key('p');
    rig.tab.wait(&format!("viewer.pins.some(([particle]) => particle === {TARGET})"));

    rig.tab.key('r');
    wait_for("the first picture", || (rig.tab.hash() == intact).then_some(()));
    assert_eq!(rig.tab.evaluate("viewer.pins.length"), COLUMNS);
}

#[test]
#[ignore = "needs Chromium"]
fn a_brush_moves_only_the_particles_in_its_circle() {
    let mut rig = Rig::with_scene(&lattice(), &[], LATTICE_LOOK);
    let camera = rig.tab.camera();
    let pixels: Vec<_> =
        rig.state().particles.iter().map(|one| camera.project(one.position)).collect();
    let middle = pixels[LATTICE_SIDE * LATTICE_SIDE / 2];
    let radius = BRUSH_RADIUS;
    let spacing = distance(pixels[0], pixels[1]);
    rig.tab.click("button[data-mode=brush]");
    rig.tab.press(middle, Button::Left);
    // Far enough to be visible, but not far enough to move other particles into the circle.
    rig.tab.move_to([middle[0] + 6.0, middle[1]]);
    let inside: Vec<_> =
        (0..pixels.len()).filter(|one| distance(pixels[*one], middle) < radius - 1.0).collect();
    let outside = pixels.iter().filter(|one| distance(**one, middle) > radius + 1.0).count();
    assert!(inside.len() >= 5 && outside >= 16, "spacing {spacing}, radius {radius}");
    let state = rig.wait_for_state("the motion of the brushed particles", |state| {
        inside.iter().all(|one| state.particles[*one].velocity[0] > 0.0)
    });
    rig.tab.release(middle);
    for (index, particle) in state.particles.iter().enumerate() {
        let is_far = distance(pixels[index], middle) > radius + 1.0;
        assert!(!is_far || speed(particle) == 0.0, "particle {index}: {particle:?}");
        assert!(particle.velocity[0] >= 0.0 && particle.velocity[1].abs() < 1e-3);
    }
}

#[test]
#[ignore = "needs Chromium"]
fn a_finger_grabs_a_particle_and_a_long_press_pins_one() {
    let mut rig = Rig::new(&["curtain"], "");
    let touch = json!({ "enabled": true, "maxTouchPoints": 1 });
    rig.tab.call("Emulation.setTouchEmulationEnabled", touch);
    let camera = rig.tab.camera();
    // The curtain swings. In a pause the press falls on the particle that the page shows there.
    let from = camera.project(rig.pause().particles[TARGET].position);
    let to = [from[0] + 40.0, from[1] - 30.0];
    rig.tab.drag_finger(from, to);
    rig.tab.key(' ');
    rig.wait_for_state("the grab", |state| is_grabbed(&state.particles[TARGET]));
    rig.wait_for_state("the particle under the finger", |state| {
        distance(camera.project(state.particles[TARGET].position), to) < 1.0
    });
    rig.tab.finger("touchEnd", None);
    rig.wait_for_state("the release", |state| !state.particles.iter().any(is_grabbed));

    // It swings again.
    let pressed = TARGET + 1;
    let at = camera.project(rig.pause().particles[pressed].position);
    rig.tab.finger("touchStart", Some(at));
    rig.tab.wait(&format!("viewer.pins.some(([particle]) => particle === {pressed})"));
    rig.tab.finger("touchEnd", None);
    rig.tab.key(' ');
    let state = rig.wait_for_state("the pin", |state| is_pinned(&state.particles[pressed]));
    assert_eq!(state.particles.iter().filter(|one| is_pinned(one)).count(), COLUMNS + 1);
    assert!(!state.particles.iter().any(is_grabbed));
}
