//! What hands do: what they drag, cut, pin and brush is seen in the node's own snapshots.

use integration_tests::{DEADLINE, wait_for};
use serde_json::json;
use sim_contract::{ParticleFlags, ParticleState};

use crate::support::{Area, Button, Stage, State, distance, is_held};

/// Particle of the curtain that is dragged: row 6, column 6.
const DRAGGED: usize = 90;
/// Columns and rows of the curtain.
const COLUMNS: usize = 14;
const ROWS: usize = 12;

/// A square lattice of particles that nothing joins and nothing pulls, looked at straight on: what
/// they do is what hands did to them.
const LATTICE_LOOK: &str = "camera=0,0,0,3.4,0,0&show.particles=1";
const LATTICE_SIDE: usize = 7;
const LATTICE_SPACING: f64 = 0.2;
/// Of the page's brush at first, px.
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
fn the_particle_under_the_mouse_follows_a_drag() {
    let mut stage = Stage::new(&["curtain"], "");
    let camera = stage.tab.camera();
    let from = camera.project(stage.state().particles[DRAGGED].position);
    let to = [from[0] + 70.0, from[1] - 50.0];
    stage.tab.press(from, Button::Left);
    stage.wait_for_state("the particle to be held", |state| is_grabbed(&state.particles[DRAGGED]));
    stage.tab.stroke(from, to, 10);
    let follows =
        |state: &State| distance(camera.project(state.particles[DRAGGED].position), to) < 1.0;
    let state = stage.wait_for_state("the particle under the mouse", follows);
    let held: Vec<_> = state.particles.iter().filter(|one| is_grabbed(one)).collect();
    assert_eq!(held.len(), 1);

    wait_for("the held particle in the picture, under the mouse", || {
        let picture = stage.tab.drawn(Area::around(to, 30.0));
        let seen = picture.middle_of(to, 30.0, is_held)?;
        (distance(seen, to) <= 2.0).then_some(())
    });
    assert_eq!(stage.tab.drawn(Area::around(from, 12.0)).middle_of(from, 12.0, is_held), None);
    stage.tab.release(to);
    stage.wait_for_state("the particle to be let go", |state| {
        !state.particles.iter().any(is_grabbed)
    });
    stage.wait_for_state("the particle to swing back", |state| !follows(state));
}

#[test]
#[ignore = "needs Chromium"]
fn what_is_let_go_keeps_the_velocity_of_the_hand() {
    let mut stage = Stage::with_scene(&lattice(), &[], LATTICE_LOOK);
    let camera = stage.tab.camera();
    let corner = 0;
    let from = camera.project(stage.state().particles[corner].position);
    stage.tab.press(from, Button::Left);
    stage.wait_for_state("the particle to be held", |state| is_grabbed(&state.particles[corner]));
    stage.tab.stroke(from, [from[0] - 12.0, from[1]], 4);
    stage.tab.fling([from[0] - 24.0, from[1]]);
    let first = stage.wait_for_state("the particle to be let go", |state| {
        let particle = &state.particles[corner];
        particle.position[0] < -0.61 && !is_grabbed(particle)
    });
    let particle = first.particles[corner];
    let [vx, vy, vz] = particle.velocity;
    assert!(vx < -0.05 && vy.abs() < 0.1 * vx.abs() && vz.abs() < 0.1 * vx.abs(), "{particle:?}");
    let later = stage.wait_for_state("later steps", |state| state.step >= first.step + 24).clone();
    let time = (later.step - first.step) as f32 / 240.0;
    let expected = particle.position[0] + vx * time;
    assert!((later.particles[corner].position[0] - expected).abs() < 1e-3 * vx.abs());
    assert!(later.particles[1..].iter().all(|one| speed(one) == 0.0), "others moved");
}

#[test]
#[ignore = "needs Chromium"]
fn a_stroke_of_the_right_button_cuts_what_it_crosses() {
    // It sags where it is cut, while the hand goes on.
    let mut stage = Stage::new(&["curtain"], "");
    let camera = stage.tab.camera();
    let pixel = |state: &State, row: usize, column: usize| {
        camera.project(state.particles[row * COLUMNS + column].position)
    };
    let state = stage.state().clone();
    // Between the rows 5 and 6, from outside of the left edge to a quarter behind the stick of
    // column 6. No corner of the stroke is near a stick.
    let between = |column: usize| {
        let (above, below) = (pixel(&state, 5, column), pixel(&state, 6, column));
        [0, 1].map(|axis| f64::midpoint(above[axis], below[axis]))
    };
    let beyond = |column: usize, towards: usize, share: f64| {
        let (here, there) = (between(column), between(towards));
        [0, 1].map(|axis| here[axis] + share * (there[axis] - here[axis]))
    };
    let (from, last) = (beyond(0, 1, -0.4), beyond(6, 7, 0.25));
    stage.tab.press(from, Button::Right);
    stage.tab.stroke(from, last, 8);
    stage.tab.release(last);

    // Seven vertical sticks, and the crossed diagonals between them.
    let count = 7 + 12;
    let torn = wait_for("the cut in the node", || {
        let torn = stage.client().torn(DEADLINE).unwrap();
        (torn.constraints.len() >= count).then_some(torn)
    });
    let topology = stage.client().topology(DEADLINE).unwrap().unwrap();
    for one in &torn.constraints {
        let constraint = topology.constraints[one.constraint as usize];
        let rows = [constraint.a, constraint.b].map(|end| end as usize / COLUMNS);
        assert_eq!(rows.iter().min().zip(rows.iter().max()), Some((&5, &6)), "{constraint:?}");
    }
    assert_eq!(torn.constraints.len(), count);
    stage.tab.wait(&format!("viewer.torn === {count}"));
    // What hangs on nothing there falls, and the rest holds.
    let lowest = (ROWS - 1) * COLUMNS;
    let height = state.particles[lowest].position[1];
    stage.wait_for_state("the cut part to sag", |now| {
        now.particles[lowest].position[1] < height - 0.03
    });
}

#[test]
#[ignore = "needs Chromium"]
fn a_double_click_and_a_key_pin_and_free() {
    let mut stage = Stage::new(&["curtain"], "");
    let camera = stage.tab.camera();
    let at = camera.project(stage.state().particles[DRAGGED].position);
    stage.tab.move_to(at);
    stage.tab.double_click(at);
    stage.wait_for_state("the pin", |state| is_pinned(&state.particles[DRAGGED]));
    let is_shown = format!("viewer.pins.some(([particle]) => particle === {DRAGGED})");
    stage.tab.wait(&is_shown);
    let pinned =
        stage.wait_for_state("free hands", |state| !state.particles.iter().any(is_grabbed));
    assert_eq!(pinned.particles.iter().filter(|one| is_pinned(one)).count(), COLUMNS + 1);

    stage.tab.move_to(at);
    stage.tab.key('p');
    stage.wait_for_state("the particle to be freed", |state| !is_pinned(&state.particles[DRAGGED]));
    stage.tab.wait(&format!("!{is_shown}"));
    stage.tab.click("button[data-mode=pin]");
    stage.tab.press(at, Button::Left);
    stage.tab.release(at);
    stage.wait_for_state("the pin", |state| is_pinned(&state.particles[DRAGGED]));
}

#[test]
#[ignore = "needs Chromium"]
fn a_reset_undoes_in_the_picture_what_was_cut_and_pinned_in_the_same_pause() {
    let mut stage = Stage::new(&["curtain", "--paused"], "");
    let state = stage.settled();
    let whole = stage.tab.hash();
    let camera = stage.tab.camera();
    let pixel = |particle: usize| camera.project(state.particles[particle].position);
    // Beside the particle, down through what joins two columns.
    let [from, to] = [DRAGGED, DRAGGED + COLUMNS].map(|particle| {
        let (left, right) = (pixel(particle), pixel(particle + 1));
        [0, 1].map(|axis| f64::midpoint(left[axis], right[axis]))
    });
    stage.tab.press(from, Button::Right);
    stage.tab.stroke(from, to, 4);
    stage.tab.release(to);
    wait_for("the cut in the picture", || (stage.tab.hash() != whole).then_some(()));
    stage.tab.move_to(pixel(DRAGGED));
    stage.tab.key('p');
    stage.tab.wait(&format!("viewer.pins.some(([particle]) => particle === {DRAGGED})"));

    stage.tab.key('r');
    wait_for("the first picture", || (stage.tab.hash() == whole).then_some(()));
    assert_eq!(stage.tab.ask("viewer.pins.length"), COLUMNS);
}

#[test]
#[ignore = "needs Chromium"]
fn a_brush_moves_the_particles_in_its_circle_only() {
    let mut stage = Stage::with_scene(&lattice(), &[], LATTICE_LOOK);
    let camera = stage.tab.camera();
    let pixels: Vec<_> =
        stage.state().particles.iter().map(|one| camera.project(one.position)).collect();
    let middle = pixels[LATTICE_SIDE * LATTICE_SIDE / 2];
    let radius = BRUSH_RADIUS;
    let spacing = distance(pixels[0], pixels[1]);
    stage.tab.click("button[data-mode=brush]");
    stage.tab.press(middle, Button::Left);
    // Far enough to be seen, and too little to bring other particles into the circle.
    stage.tab.move_to([middle[0] + 6.0, middle[1]]);
    let inside: Vec<_> =
        (0..pixels.len()).filter(|one| distance(pixels[*one], middle) < radius - 1.0).collect();
    let outside = pixels.iter().filter(|one| distance(**one, middle) > radius + 1.0).count();
    assert!(inside.len() >= 5 && outside >= 16, "spacing {spacing}, radius {radius}");
    let state = stage.wait_for_state("the brushed particles to fly", |state| {
        inside.iter().all(|one| state.particles[*one].velocity[0] > 0.0)
    });
    stage.tab.release(middle);
    for (index, particle) in state.particles.iter().enumerate() {
        let is_far = distance(pixels[index], middle) > radius + 1.0;
        assert!(!is_far || speed(particle) == 0.0, "particle {index}: {particle:?}");
        assert!(particle.velocity[0] >= 0.0 && particle.velocity[1].abs() < 1e-3);
    }
}

#[test]
#[ignore = "needs Chromium"]
fn a_finger_drags_and_where_it_rests_it_pins() {
    let mut stage = Stage::new(&["curtain"], "");
    let touch = json!({ "enabled": true, "maxTouchPoints": 1 });
    stage.tab.call("Emulation.setTouchEmulationEnabled", touch);
    let camera = stage.tab.camera();
    let from = camera.project(stage.state().particles[DRAGGED].position);
    let to = [from[0] + 40.0, from[1] - 30.0];
    stage.tab.finger("touchStart", Some(from));
    stage.wait_for_state("the particle to be held", |state| is_grabbed(&state.particles[DRAGGED]));
    stage.tab.finger("touchMove", Some(to));
    stage.wait_for_state("the particle under the finger", |state| {
        distance(camera.project(state.particles[DRAGGED].position), to) < 1.0
    });
    stage.tab.finger("touchEnd", None);
    stage.wait_for_state("the particle to be let go", |state| {
        !state.particles.iter().any(is_grabbed)
    });

    // Away from the folds that swing: next to the upper edge.
    let still = 15;
    let at = camera.project(stage.state().particles[still].position);
    stage.tab.finger("touchStart", Some(at));
    let state = stage.wait_for_state("the pin", |state| {
        state.particles.iter().filter(|one| is_pinned(one)).count() > COLUMNS
    });
    stage.tab.finger("touchEnd", None);
    assert!(is_pinned(&state.particles[still]));
}
