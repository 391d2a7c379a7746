//! Golden files with every message of the protocol: `messages.json` has the bytes and fields of
//! the binary messages, `texts.json` the texts. The decoder of the page is tested on them too.
//!
//! `UPDATE_GOLDEN=1` rewrites the files; review the difference.

mod protocol_page;
mod tables;
mod texts;

use std::fmt::Write;
use std::fs;
use std::path::Path;

use serde_json::{Value, json};
use sim_contract::{
    ColliderShape, ColliderState, ConstraintState, ForceKind, ForceRow, ParticleFlags,
    ParticleState, TearCause, TornConstraint, Triangle,
};
use sim_solver::scene::ColliderMesh;
use viewer_bridge::wire::{
    Bounds, Colliders, Forces, Format, FrameHead, FrameLimits, Ghost, Inspected, Part, Past,
    Percentiles, Pins, Scene, SceneText, ShapeText, Speeds, Stamp, Statistics, Tear, encode_frame,
    frame_flag, scene_flag,
};

use crate::wire_decoder::{Message, decode};

const STAMP: Stamp = Stamp { epoch: 3, step: 1200 };

/// Three particles, the last beyond the range of u16, and one that is not finite.
fn particles() -> Vec<ParticleState> {
    let at = |position, flags| ParticleState { position, flags, ..ParticleState::default() };
    vec![
        at([0.0, 1.0, -0.5], ParticleFlags::PINNED),
        ParticleState { velocity: [3.0, 0.0, -4.0], inverse_mass: 2.0, ..at([0.25, 0.5, 0.5], 0) },
        at([1.0, 0.0, 0.125], ParticleFlags::GRABBED),
        at([f32::NAN, 0.0, 0.0], ParticleFlags::FROZEN),
    ]
}

fn scene() -> Scene {
    let mut scene = Scene {
        stamp: STAMP,
        flags: scene_flag::PLANAR,
        rate_hz: 240,
        origin: [0.0, 100.5, -2.0],
        text: SceneText {
            anchors: vec![vec![0, 2], vec![1]],
            name: "gemütlich".to_owned(),
            unit: "m".to_owned(),
            up: "y".to_owned(),
            run_id: "0123456789abcdef".to_owned(),
            shapes: vec![ShapeText {
                shape: "rope".to_owned(),
                first: 1,
                count: 3,
                has_bends: true,
            }],
            has_explicit_bends: true,
        },
        collider_meshes: [(2, triangle_mesh())].into(),
        ..Scene::default()
    };
    let joins =
        |a, b, kind, compliance| ConstraintState { a, b, rest_length: 0.5, kind, compliance };
    let triangles = [Triangle { corners: [0, 1, 2] }, Triangle { corners: [1, 3, 2] }];
    let constraints = [joins(0, 1, 0, 0.0), joins(1, 2, 1, 0.25), joins(2, 3, 2, 1e-3)];
    scene.set_geometry(&particles(), &constraints, &triangles);
    scene
}

fn triangle_mesh() -> ColliderMesh {
    let vertices = vec![[0.0; 3], [0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.25]];
    ColliderMesh { vertices, triangles: vec![[0, 1, 2], [0, 2, 3]], is_solid: false }
}

fn head() -> FrameHead {
    FrameHead {
        stamp: STAMP,
        sim_time_s: 5.0,
        flags: frame_flag::PAUSED,
        torn_count: 2,
        solve_us: 12.5,
        wake_late_us: 3.25,
        number: 77,
        publish_monotonic_ns: 123_456_789_012,
    }
}

fn statistics() -> Statistics {
    Statistics {
        stamp: STAMP,
        solve_us: Percentiles { p50: 10.0, p99: 20.0 },
        wake_late_us: Percentiles { p50: 50.0, p99: 900.0 },
        period_us: 4166.5,
        real_time_factor: 0.5,
        time_scale: 1.0,
        stretch_mean: 0.25,
        stretch_max: 0.5,
        stretch_max_constraint: 2,
        kinetic_j: 1.5,
        potential_j: -2.25,
        late_steps: 1,
        skipped_periods: 2,
        outcome_count: 3,
        rejected_count: 4,
        frozen_count: 5,
        torn_count: 6,
        reader_count: 7,
        client_count: 8,
        encode_us: 9.5,
        frames_per_second: 60.0,
        flags: 1,
    }
}

fn colliders() -> Colliders {
    let ball = ColliderState {
        shape: ColliderShape::Sphere as u32,
        restitution: 0.5,
        friction: 0.25,
        radius: 2.0,
        center: [1.0, 2.0, 3.0],
        rotation: [0.0, 0.0, 0.0, 1.0],
        velocity: [0.0, -1.0, 0.0],
        ..ColliderState::default()
    };
    let floor = ColliderState {
        shape: ColliderShape::Plane as u32,
        offset: -1.0,
        normal: [0.0, 1.0, 0.0],
        ..ColliderState::default()
    };
    let mesh = ColliderState {
        shape: ColliderShape::Mesh as u32,
        radius: 0.125,
        center: [3.0, 2.0, 1.0],
        rotation: [0.0, 1.0, 0.0, 0.0],
        angular_velocity: [0.0, 0.5, 0.0],
        ..ColliderState::default()
    };
    Colliders { stamp: STAMP, colliders: vec![ball, floor, mesh] }
}

fn forces() -> Forces {
    let collider = ForceRow {
        kind: ForceKind::Collider as u32,
        impulse: [0.0, -0.25, 0.5],
        angular_impulse: [1.0, 2.0, 3.0],
        contacts: 4,
        ..ForceRow::default()
    };
    let other = |kind, index, impulse| ForceRow {
        kind: kind as u32,
        index,
        impulse,
        ..ForceRow::default()
    };
    let anchor = other(ForceKind::Anchor, 1, [0.5, 0.0, 0.0]);
    let pin = other(ForceKind::Particle, 2, [0.0, -0.125, 0.0]);
    Forces { stamp: STAMP, rate_hz: 240, rows: vec![collider, anchor, pin] }
}

/// The second particle. The third is not one of the scene.
fn inspected() -> Inspected {
    Inspected::from_particles(STAMP, &particles()[..2], &[1, 2])
}

/// A state of another recording, one step earlier.
fn ghost() -> Ghost {
    let positions = vec![[0.5, 0.25, 0.125], [0.0; 3], [1.0, 2.0, 3.0]];
    let stamp = Stamp { step: STAMP.step - 1, ..STAMP };
    Ghost { stamp, farthest: 2, distance: 0.75, positions, hidden: vec![4, 1] }
}

/// All binary messages, by name.
fn messages() -> Vec<(&'static str, Vec<u8>)> {
    let finite = &particles()[..3];
    let limits = FrameLimits::around(Bounds { min: [0.0; 3], max: [0.1; 3] });
    let mut far = particles();
    far[2].position[0] = 1000.0;
    let frame = |format, particles: &[ParticleState]| {
        encode_frame(&head(), particles, format, &limits).to_vec()
    };
    let torn = |constraint, cause| TornConstraint { constraint, cause };
    let torn =
        vec![torn(7, TearCause::Cut as u32), torn(3, TearCause::Force as u32), torn(9, u32::MAX)];
    let tear = Tear { stamp: STAMP, first: 1, torn };
    let nothing = Tear { stamp: STAMP, ..Tear::default() };
    let pins = Pins::from_particles(STAMP, &particles());
    vec![
        ("scene", scene().encode().to_vec()),
        ("scene_without_particles", Scene { stamp: STAMP, ..Scene::default() }.encode().to_vec()),
        ("frame_f32", frame(Format::F32, finite)),
        ("frame_f32_not_finite", frame(Format::F32, &particles())),
        ("frame_u16", frame(Format::U16, finite)),
        ("frame_u16_saturated_and_not_finite", frame(Format::U16, &far)),
        ("frame_u16_without_particles", frame(Format::U16, &[])),
        ("tear", tear.encode().to_vec()),
        ("tear_reset", nothing.encode().to_vec()),
        ("pins", pins.encode().to_vec()),
        ("statistics", statistics().encode().to_vec()),
        ("colliders", colliders().encode().to_vec()),
        ("forces", forces().encode().to_vec()),
        ("speeds", Speeds::from_particles(STAMP, &particles()).encode().to_vec()),
        ("inspected", inspected().encode().to_vec()),
        ("ghost", ghost().encode().to_vec()),
        ("past", Past { stamp: STAMP, count: 4 }.encode().to_vec()),
        ("part", part().encode().to_vec()),
    ]
}

/// The last piece of a compressed scene.
fn part() -> Part {
    let bytes = vec![1, 2, 3].into();
    Part { stamp: STAMP, kind: 1, offset: 65_536, size: 65_539, unpacked_size: 200_000, bytes }
}

/// The fields that a decoder must find.
#[allow(clippy::too_many_lines, reason = "an arm for each message")]
fn fields(message: &Message) -> Value {
    match message {
        Message::Scene(scene) => json!({
            "kind": 1, "epoch": scene.stamp.epoch, "step": scene.stamp.step,
            "flags": scene.flags, "rate_hz": scene.rate_hz, "origin": scene.origin,
            "min": scene.bounds().min, "max": scene.bounds().max,
            "positions": scene.positions, "ends": scene.ends,
            "rest_lengths": scene.rest_lengths, "triangles": scene.triangles,
            "kinds": scene.kinds, "compliances": scene.compliances, "text": scene.text,
            "meshes": scene.collider_meshes.iter().map(|(collider, mesh)| json!({
                "collider": collider, "vertices": mesh.vertices, "triangles": mesh.triangles,
            })).collect::<Vec<_>>(),
        }),
        Message::Frame(frame) => json!({
            "kind": if frame.format == Format::F32 { 2 } else { 3 },
            "epoch": frame.head.stamp.epoch, "step": frame.head.stamp.step,
            "sim_time_s": frame.head.sim_time_s, "flags": frame.head.flags,
            "lo": frame.lo, "scale": frame.scale, "torn_count": frame.head.torn_count,
            "solve_us": frame.head.solve_us, "wake_late_us": frame.head.wake_late_us,
            "number": frame.head.number,
            "publish_monotonic_ns": frame.head.publish_monotonic_ns,
            "positions": frame.positions, "not_finite": frame.not_finite,
        }),
        Message::Tear(tear) => json!({
            "kind": 4, "epoch": tear.stamp.epoch, "step": tear.stamp.step,
            "first": tear.first,
            "constraints": tear.constraints(),
            "causes": tear.torn.iter().map(|torn| torn.cause).collect::<Vec<_>>(),
        }),
        Message::Pins(pins) => json!({
            "kind": 5, "epoch": pins.stamp.epoch, "step": pins.stamp.step,
            "held": pins.particles.iter().map(|one| [one.particle, one.flags]).collect::<Vec<_>>(),
        }),
        Message::Statistics(one) => json!({
            "kind": 6, "epoch": one.stamp.epoch, "step": one.stamp.step,
            "solve_us": [one.solve_us.p50, one.solve_us.p99],
            "wake_late_us": [one.wake_late_us.p50, one.wake_late_us.p99],
            "period_us": one.period_us, "real_time_factor": one.real_time_factor,
            "time_scale": one.time_scale, "stretch_mean": one.stretch_mean,
            "stretch_max": one.stretch_max,
            "stretch_max_constraint": one.stretch_max_constraint,
            "kinetic_j": one.kinetic_j, "potential_j": one.potential_j,
            "late_steps": one.late_steps, "skipped_periods": one.skipped_periods,
            "outcome_count": one.outcome_count, "rejected_count": one.rejected_count,
            "frozen_count": one.frozen_count, "torn_count": one.torn_count,
            "reader_count": one.reader_count, "client_count": one.client_count,
            "encode_us": one.encode_us, "frames_per_second": one.frames_per_second,
            "flags": one.flags,
        }),
        Message::Colliders(all) => json!({
            "kind": 7, "epoch": all.stamp.epoch, "step": all.stamp.step,
            "colliders": all.colliders.iter().map(|one| json!({
                "shape": one.shape, "restitution": one.restitution, "friction": one.friction,
                "radius": one.radius, "offset": one.offset, "normal": one.normal,
                "center": one.center, "half_extents": one.half_extents,
                "rotation": one.rotation, "a": one.a, "b": one.b,
                "velocity": one.velocity, "angular_velocity": one.angular_velocity,
            })).collect::<Vec<_>>(),
        }),
        Message::Past(past) => json!({
            "kind": 11, "epoch": past.stamp.epoch, "step": past.stamp.step, "count": past.count,
        }),
        Message::Part(part) => json!({
            "kind": 13, "epoch": part.stamp.epoch, "step": part.stamp.step, "of_kind": part.kind,
            "offset": part.offset, "size": part.size, "unpacked_size": part.unpacked_size,
            "bytes": part.bytes.to_vec(),
        }),
        Message::Ghost(ghost) => json!({
            "kind": 12, "epoch": ghost.stamp.epoch, "step": ghost.stamp.step,
            "farthest": ghost.farthest, "distance": ghost.distance,
            "positions": ghost.positions, "hidden": ghost.hidden,
        }),
        subscribed => subscribed_fields(subscribed),
    }
}

/// The fields of a message that a page asks for.
fn subscribed_fields(message: &Message) -> Value {
    match message {
        Message::Forces(all) => json!({
            "kind": 8, "epoch": all.stamp.epoch, "step": all.stamp.step, "rate_hz": all.rate_hz,
            "rows": all.rows.iter().map(|row| json!({
                "kind": row.kind, "index": row.index, "impulse": row.impulse,
                "angular_impulse": row.angular_impulse, "contacts": row.contacts,
            })).collect::<Vec<_>>(),
        }),
        Message::Speeds(all) => json!({
            "kind": 9, "epoch": all.stamp.epoch, "step": all.stamp.step, "speeds": all.speeds,
        }),
        Message::Inspected(all) => json!({
            "kind": 10, "epoch": all.stamp.epoch, "step": all.stamp.step,
            "particles": all.particles.iter().map(|one| json!({
                "particle": one.particle, "position": one.position, "velocity": one.velocity,
                "inverse_mass": one.inverse_mass,
            })).collect::<Vec<_>>(),
        }),
        other => panic!("{other:?}"),
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02x}").unwrap();
        text
    })
}

/// Compares content with a file of `golden/`, or writes the file.
fn check(file: &str, content: &Value) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(file);
    let text = serde_json::to_string_pretty(content).unwrap() + "\n";
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        fs::write(&path, text).unwrap();
        return;
    }
    let known = fs::read_to_string(&path).unwrap_or_default();
    assert!(known == text, "{file} differs; UPDATE_GOLDEN=1 rewrites it");
}

#[test]
fn the_bytes_of_every_message_are_frozen() {
    let all = messages().into_iter().map(|(name, bytes)| {
        let fields = fields(&decode(&bytes).unwrap());
        json!({ "name": name, "hex": hex(&bytes), "fields": fields })
    });
    check("messages.json", &all.collect());
}

#[test]
fn every_message_decodes_to_what_was_encoded() {
    assert_eq!(decode(&scene().encode()), Ok(Message::Scene(Box::new(scene()))));
    assert_eq!(decode(&colliders().encode()), Ok(Message::Colliders(colliders())));
    assert_eq!(decode(&forces().encode()), Ok(Message::Forces(forces())));
    assert_eq!(decode(&inspected().encode()), Ok(Message::Inspected(inspected())));
    let decoded = decode(&statistics().encode());
    assert_eq!(decoded, Ok(Message::Statistics(Box::new(statistics()))));
    for (name, bytes) in messages() {
        assert!(bytes.len().is_multiple_of(4), "{name}");
        for end in 0..bytes.len() {
            assert!(decode(&bytes[..end]).is_err(), "{name} truncated to {end} bytes");
        }
        assert!(decode(&[&bytes[..], &[0]].concat()).is_err(), "{name} with an extra byte");
    }
}

#[test]
fn u16_positions_are_within_half_a_quantum_and_f32_positions_are_exact() {
    let limits = FrameLimits::around(Bounds { min: [0.0; 3], max: [1.0; 3] });
    let particles: Vec<_> = (0..1000_u16)
        .map(|index| {
            let x = f32::from(index);
            let position = [x.sin() * 3.0, (x * 0.37).cos() - 1.0, 0.25];
            ParticleState { position, ..ParticleState::default() }
        })
        .collect();
    for format in [Format::F32, Format::U16] {
        let bytes = encode_frame(&head(), &particles, format, &limits);
        let Ok(Message::Frame(frame)) = decode(&bytes) else { panic!("not a frame") };
        assert_eq!(frame.head, head());
        for (position, particle) in frame.positions.iter().zip(&particles) {
            for ((axis, exact), scale) in position.iter().zip(particle.position).zip(frame.scale) {
                let error = (axis - exact).abs();
                let allowed = if format == Format::F32 { 0.0 } else { scale * 0.51 };
                assert!(error <= allowed, "{format:?}: {error} > {allowed}");
            }
        }
    }
}

#[test]
fn a_particle_far_away_does_not_reduce_the_resolution_of_the_others() {
    let limits = FrameLimits::around(Bounds { min: [0.0; 3], max: [1.0; 3] });
    let mut all = particles();
    all[1].position = [1e30, 0.0, 0.0];
    let Ok(Message::Frame(frame)) = decode(&encode_frame(&head(), &all, Format::U16, &limits))
    else {
        panic!("not a frame")
    };
    assert_eq!(frame.head.flags & frame_flag::SATURATED, frame_flag::SATURATED);
    assert_eq!(frame.not_finite, [3]);
    assert!(frame.scale[0] < 1e-3, "{:?}", frame.scale);
    assert!((frame.positions[2][0] - 1.0).abs() <= frame.scale[0]);
}
