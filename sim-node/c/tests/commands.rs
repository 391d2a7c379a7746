//! Each function that makes a command makes the one of its name, and a bad argument makes the empty command,
//! which no node receives.

use std::ptr::null;

use catenary::*;
use sim_contract::{
    Action, Command, KindFilter, MovedObject, ParameterValue, Part, PathPart, PathPoint, Text,
};

const A: [f32; 3] = [1.0, -2.0, 3.0];
const B: [f32; 3] = [0.5, 0.25, 0.0];
const C: [f32; 3] = [0.0, 0.0, 1.0];
const QUARTER: [f32; 4] = [0.0, 0.6, 0.0, 0.8];
const UNTURNED: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

fn short(text: &str) -> Text {
    Text::new(text).unwrap()
}

fn set(parameter: &str, value: ParameterValue) -> Action {
    Action::set(parameter, value)
}

const ZERO: [f32; 3] = [0.0; 3];

#[test]
#[allow(clippy::too_many_lines, reason = "a row for each function")]
fn each_function_makes_the_command_of_its_name() {
    let (a, b, c) = (A.as_ptr(), B.as_ptr(), C.as_ptr());
    let push = |limit| Action::Push { center: A, radius: 0.1, delta: B, limit };
    let moved =
        |rotation| Action::MoveCollider { collider: 2, translation: A, rotation, over_s: 0.0 };
    let anchor = |rotation| Action::MoveAnchor { anchor: 1, translation: A, rotation, over_s: 0.0 };
    let number = catenary_command_set(c"compliance".as_ptr(), 0.5);
    let for_kind = Action::Set {
        parameter: short("compliance"),
        value: ParameterValue::Number(0.5),
        constraint_kind: Some(KindFilter::from_number(2)),
        block: None,
        collider: None,
    };
    let bending = catenary_command_set(c"bending".as_ptr(), 0.5);
    let point = |time, rotation| PathPoint { time, translation: A, rotation };
    let follow = Action::Follow {
        object: MovedObject::Collider,
        object_index: 2,
        path: PathPart::new(&[point(0.5, UNTURNED), point(1.0, QUARTER)]).unwrap(),
        append: true,
    };
    let empty = catenary_command_follow(MovedObject::Collider as u32, 2);
    let straight = catenary_command_with_point(empty, 0.5, a, null());
    let turned = catenary_command_with_point(straight, 1.0, a, QUARTER.as_ptr());
    let full = (0..4).fold(empty, |command, time| {
        catenary_command_with_point(command, f64::from(time), a, null())
    });
    assert_eq!(catenary_command_with_point(full, 4.0, a, null()), Command::default());
    assert_eq!(catenary_command_follow(3, 2), Command::default());
    let friction = catenary_command_set(c"friction".as_ptr(), 0.5);
    let for_collider = Action::set("friction", 0.5).for_part(Part::Collider(2));
    let for_block = Action::set("bending", 0.5).for_part(Part::Block(3));
    let cases = [
        (catenary_command_pin(7), Action::Pin { particle: 7 }),
        (catenary_command_unpin(7), Action::Unpin { particle: 7 }),
        (catenary_command_grab(7, a, 0.1), Action::Grab { particle: 7, target: A, over_s: 0.1 }),
        (catenary_command_move(7, a, 0.1), Action::Move { particle: 7, target: A, over_s: 0.1 }),
        (catenary_command_release(7), Action::Release { particle: 7, force: false }),
        (catenary_command_release_forced(7), Action::Release { particle: 7, force: true }),
        (catenary_command_pause(), Action::Pause),
        (catenary_command_resume(), Action::Resume),
        (catenary_command_step(9), Action::Step { count: 9 }),
        (catenary_command_reset(), Action::Reset),
        (catenary_command_push(a, 0.1, b), push(None)),
        (catenary_command_push_limited(a, 0.1, b, 0.2), push(Some(0.2))),
        (catenary_command_cut(5), Action::Cut { constraint: 5 }),
        (catenary_command_cut_radius(a, 0.3), Action::CutRadius { center: A, radius: 0.3 }),
        (
            catenary_command_cut_segment(a, b, c),
            Action::CutSegment { from: A, to: B, direction: C },
        ),
        (catenary_command_move_anchor(1, a, QUARTER.as_ptr()), anchor(QUARTER)),
        (catenary_command_move_anchor(1, a, null()), anchor(UNTURNED)),
        (catenary_command_move_collider(2, a, QUARTER.as_ptr()), moved(QUARTER)),
        (catenary_command_move_collider(2, a, null()), moved(UNTURNED)),
        (number, set("compliance", ParameterValue::Number(0.5))),
        (
            catenary_command_set_vector(c"gravity".as_ptr(), a),
            set("gravity", ParameterValue::Vector(A)),
        ),
        (catenary_command_set_off(c"tear_force".as_ptr()), set("tear_force", ParameterValue::Off)),
        (catenary_command_for_kind(number, 2), for_kind),
        (catenary_command_for_kind(catenary_command_pin(7), 2), Action::Pin { particle: 7 }),
        (catenary_command_for_block(bending, 3), for_block),
        (catenary_command_for_block(catenary_command_pin(7), 3), Action::Pin { particle: 7 }),
        (catenary_command_for_collider(friction, 2), for_collider),
        (
            catenary_command_with_over(catenary_command_move_collider(2, a, null()), 1.5),
            Action::MoveCollider { collider: 2, translation: A, rotation: UNTURNED, over_s: 1.5 },
        ),
        (
            catenary_command_with_over(catenary_command_move_anchor(1, a, null()), 1.5),
            Action::MoveAnchor { anchor: 1, translation: A, rotation: UNTURNED, over_s: 1.5 },
        ),
        (catenary_command_appended(turned), follow),
        (catenary_command_for_collider(catenary_command_pin(7), 2), Action::Pin { particle: 7 }),
        (catenary_command_load(c"flag".as_ptr()), Action::Load { scene: short("flag") }),
        (
            catenary_command_rewind_to(1 << 40),
            Action::Rewind { to_step: Some(1 << 40), back_steps: None },
        ),
        (
            catenary_command_rewind_back(240),
            Action::Rewind { to_step: None, back_steps: Some(240) },
        ),
        (catenary_command_mark(c"a note".as_ptr()), Action::Mark { text: short("a note") }),
    ];
    for (made, action) in cases {
        assert_eq!(made, Command::new(0, 0, action), "{action:?}");
        assert_eq!(made.action(), action);
    }
}

#[test]
fn a_body_is_driven_with_or_without_velocities_and_a_wrench() {
    let (a, b, c) = (A.as_ptr(), B.as_ptr(), C.as_ptr());
    let body = |rotation, angular_velocity, force, torque| Action::DriveBody {
        collider: 2,
        translation: A,
        rotation,
        velocity: B,
        angular_velocity,
        force,
        torque,
    };
    let cases = [
        (catenary_command_drive_body(2, a, null(), b, null()), body(UNTURNED, ZERO, ZERO, ZERO)),
        (
            catenary_command_with_wrench(
                catenary_command_drive_body(2, a, QUARTER.as_ptr(), b, c),
                c,
                a,
            ),
            body(QUARTER, C, C, A),
        ),
        (catenary_command_with_wrench(catenary_command_pin(7), a, b), Action::Pin { particle: 7 }),
    ];
    for (made, action) in cases {
        assert_eq!(made, Command::new(0, 0, action), "{action:?}");
    }
}

#[test]
fn a_bad_argument_makes_the_empty_command() {
    let (a, none) = (A.as_ptr(), null());
    let long = [b'x'; 161].iter().chain(&[0]).copied().collect::<Vec<_>>();
    let cases = [
        catenary_command_grab(0, none, 0.1),
        catenary_command_move(0, none, 0.1),
        catenary_command_push(none, 0.1, a),
        catenary_command_push(a, 0.1, none),
        catenary_command_push_limited(a, 0.1, none, 1.0),
        catenary_command_cut_radius(none, 0.1),
        catenary_command_cut_segment(a, a, none),
        catenary_command_move_anchor(0, none, null()),
        catenary_command_move_collider(0, none, null()),
        catenary_command_drive_body(0, none, null(), a, a),
        catenary_command_set(null(), 1.0),
        catenary_command_set_vector(c"gravity".as_ptr(), none),
        catenary_command_set_off(c"\xff".as_ptr()),
        catenary_command_load(long.as_ptr().cast()),
        catenary_command_mark(null()),
    ];
    for (index, made) in cases.into_iter().enumerate() {
        assert_eq!(made, Command::default(), "case {index}");
    }
}
