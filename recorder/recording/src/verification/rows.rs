//! The content of a recording, compared with the scene and with the re-simulation: the description of the run, the load, and
//! the tears, colliders, parameters, forces and keyframe of a step.

use std::io::Read;

use sim_messages::{ForceKind, ForceRow, LoadHeader, Parameter, Part, Setting};
use sim_solver::{Keyframe, Scene, Solver};

use crate::log::{
    ColliderDetails, ColliderRow, CollidersRow, ForcesRow, Frame, LogReader, Message,
    ParametersRow, RunDescription, SurfaceRow, TearsRow, Topic, TopologyRow,
};
use crate::simulation::state_writer::{colliders_row, forces_row, newest_tears_row};

/// Compares a row with the solver after its step. Returns a description of the first difference.
pub(super) fn compare_row(row: &Message, solver: &Solver) -> Option<String> {
    match row {
        Message::Tears(row) => compare_tears(row, solver),
        Message::Colliders(row) => compare_colliders(row, solver),
        Message::Parameters(row) => compare_parameters(row, solver),
        Message::Forces(row) => compare_forces(row, solver),
        Message::Keyframe { bytes, .. } => compare_keyframe(bytes, solver),
        Message::Outcome(row) => {
            Some(format!("/outcomes: outcome {} is misplaced, or there twice", row.index))
        }
        _ => None,
    }
}

/// Returns the newest rows up to the first snapshot, which describe it. Its tears are part of the state, and its forces
/// depend on the step that led to it.
pub(super) fn newest_rows(first: &Frame) -> Vec<Message> {
    let newest = |topic| first.updates.iter().rfind(|update| update.topic() == topic);
    let is_own = |keyframe: &&Message| keyframe.step() == first.row.step;
    let keyframe = newest(Topic::Keyframe).filter(is_own);
    let rows = [Topic::Colliders, Topic::Parameters].map(newest);
    rows.into_iter().chain([keyframe]).flatten().cloned().collect()
}

/// Replaces the recorded velocities of colliders by the velocities in a restored solver, which does not
/// know the motion that led to its state.
pub(super) fn ignore_collider_velocities(rows: &mut [Message], solver: &Solver) {
    for row in rows {
        let Message::Colliders(row) = row else { continue };
        let simulated = colliders_row(solver, row.step).colliders;
        for (recorded, simulated) in row.colliders.iter_mut().zip(simulated) {
            recorded.velocity = simulated.velocity;
            recorded.angular_velocity = simulated.angular_velocity;
        }
    }
}

fn compare_keyframe(bytes: &[u8], solver: &Solver) -> Option<String> {
    let recorded = match Keyframe::decode(bytes) {
        Ok(recorded) => recorded,
        Err(error) => return Some(format!("its message on /keyframe is damaged: {error}")),
    };
    if recorded.encode() != bytes {
        return Some("its message on /keyframe has bytes that a solver does not write".to_owned());
    }
    let mut simulated = solver.keyframe();
    // The solver does not know whether the node was paused.
    simulated.paused = recorded.paused;
    // Their bytes, because a number that is not finite differs from itself.
    (simulated.encode() != bytes).then(|| {
        "its message on /keyframe has another state: the masses, grabs, parameters, torn constraints, or moved \
         anchors or colliders differ"
            .to_owned()
    })
}

/// Compares the newest tears. A recorder that missed a list writes all tears since the previous one
/// in one row: the tears of this step, and the newest tears of the steps before.
fn compare_tears(recorded: &TearsRow, solver: &Solver) -> Option<String> {
    let count = recorded.constraints.len().max(solver.new_torn_count());
    let simulated = newest_tears_row(solver, recorded.step, count);
    let place = (0..count).find(|place| is_different(recorded, &simulated, *place))?;
    let [recorded, simulated] = [recorded, &simulated].map(|row| tear_text(row, place));
    Some(format!("its tears in /tears: recorded {recorded}, simulated {simulated}"))
}

/// Compares one tear. An unknown recorded cause equals any cause.
fn is_different(recorded: &TearsRow, simulated: &TearsRow, place: usize) -> bool {
    let cause = |row: &TearsRow| row.causes.get(place).filter(|name| *name != "unknown").cloned();
    recorded.constraints.get(place) != simulated.constraints.get(place)
        || cause(recorded).is_some_and(|name| Some(name) != cause(simulated))
}

/// Returns text such as "constraint 7 (cut)".
fn tear_text(row: &TearsRow, place: usize) -> String {
    let Some(constraint) = row.constraints.get(place) else { return "none".to_owned() };
    let cause = row.causes.get(place).map_or("unknown", String::as_str);
    format!("constraint {constraint} ({cause})")
}

/// Compares all parameters except the time scale, which belongs to the node.
fn compare_parameters(recorded: &ParametersRow, solver: &Solver) -> Option<String> {
    let time_scale = recorded.values.number(Parameter::TimeScale);
    let simulated = solver.parameter_values().clone().with(Parameter::TimeScale, time_scale);
    let (old, new) = (recorded.values.settings(), simulated.settings());
    let is_same = |place: usize| match (old.get(place), new.get(place)) {
        (Some(old), Some(new)) => {
            (old.parameter, old.part) == (new.parameter, new.part)
                && old.value.has_bits_of(&new.value)
        }
        _ => false,
    };
    let place = (0..old.len().max(new.len())).find(|place| !is_same(*place))?;
    let setting = old.get(place).or_else(|| new.get(place))?;
    let of_part = match setting.part {
        Part::All => String::new(),
        part => format!(" of {part}"),
    };
    let value = |settings: &[Setting]| {
        settings.get(place).map_or_else(|| "none".to_owned(), |one| one.value.to_string())
    };
    let (name, old, new) = (setting.parameter.name(), value(&old), value(&new));
    Some(format!("/parameters: parameter {name}{of_part}: recorded {old}, simulated {new}"))
}

/// Compares the impulses of a step.
fn compare_forces(recorded: &ForcesRow, solver: &Solver) -> Option<String> {
    if let Some(problem) = recorded.problem() {
        return Some(format!("its message on /forces: {problem}"));
    }
    let simulated = forces_row(solver, recorded.step)?;
    let (old, new) = (recorded.rows(), simulated.rows());
    let differs = |place: &usize| {
        let [old, new] = [old.get(*place), new.get(*place)];
        old.map(bytemuck::bytes_of) != new.map(bytemuck::bytes_of)
    };
    let place = (0..old.len().max(new.len())).find(differs)?;
    let [recorded, simulated] = [old.get(place), new.get(place)].map(force_text);
    Some(format!("its forces in /forces: recorded {recorded}, simulated {simulated}"))
}

/// Returns text such as "particle 13 [0.0, -0.5, 0.0] N s".
fn force_text(row: Option<&ForceRow>) -> String {
    let Some(row) = row else { return "none".to_owned() };
    let kind = row.kind().map_or("unknown", ForceKind::name);
    let ForceRow { index, impulse, angular_impulse, contacts, .. } = *row;
    match row.kind() {
        Some(ForceKind::Collider) => {
            format!(
                "{kind} {index} {impulse:?} N s, {angular_impulse:?} N m s, {contacts} contacts"
            )
        }
        Some(ForceKind::Anchor) => {
            format!("{kind} {index} {impulse:?} N s, {angular_impulse:?} N m s")
        }
        _ => format!("{kind} {index} {impulse:?} N s"),
    }
}

fn compare_colliders(recorded: &CollidersRow, solver: &Solver) -> Option<String> {
    let simulated = colliders_row(solver, recorded.step);
    let (old, new) = (&recorded.colliders, &simulated.colliders);
    if old.len() != new.len() {
        return Some(format!(
            "/colliders: recorded {} colliders, simulated {}",
            old.len(),
            new.len()
        ));
    }
    let place = old.iter().zip(new).position(|(old, new)| without_details(old) != *new)?;
    Some(format!(
        "/colliders: collider {place}: recorded {:?}, simulated {:?}",
        without_details(&old[place]),
        new[place]
    ))
}

/// Returns the properties that a solver has. The others are compared with the scene.
fn without_details(recorded: &ColliderRow) -> ColliderRow {
    ColliderRow { details: ColliderDetails::default(), ..recorded.clone() }
}

/// Compares the metadata of the run with the scene. Returns a description of the first difference.
pub(super) fn compare_run<R: Read>(log: &LogReader<R>, scene: &Scene) -> Option<String> {
    let run = log.run();
    if log.scene() != scene.to_toml().as_bytes() {
        return Some(
            "the attachment scene.toml is not the complete scene of a recorder".to_owned(),
        );
    }
    let is_same_origin = run.origin.map(f64::to_bits) == scene.origin.map(f64::to_bits);
    let fields = [
        ("scene", run.scene_name == scene.name),
        ("origin", is_same_origin),
        ("up", run.up == scene.up),
        ("rate_hz", run.rate_hz == scene.solver.rate_hz),
        ("method", run.method == scene.solver.method as u32),
    ];
    let (name, _) = fields.into_iter().find(|(_, is_same)| !is_same)?;
    Some(format!("the metadata 'run': its '{name}' is not that of the scene"))
}

/// Compares the metadata of the run with the elements of the scene.
pub(super) fn compare_counts(run: &RunDescription, solver: &Solver) -> Option<String> {
    let counts = [
        ("particle_count", run.particle_count, solver.particle_count()),
        ("constraint_count", run.constraint_count, solver.constraint_count()),
        ("bend_count", run.bend_count, solver.bend_count()),
    ];
    let is_other = |(_, recorded, expected): &(_, u32, usize)| *recorded as usize != *expected;
    let (name, recorded, expected) = counts.into_iter().find(is_other)?;
    Some(format!("the metadata 'run': its {name} is {recorded}, but the scene has {expected}"))
}

/// Compares `/topology` and `/surface` with the elements of the scene.
pub(super) fn compare_load(
    message: &Message,
    run: &RunDescription,
    solver: &Solver,
) -> Option<String> {
    match message {
        Message::Topology(row) => compare_topology(row, run, solver),
        Message::Surface(row) => {
            let expected = SurfaceRow::of_solver(&LoadHeader::default(), solver).triangles;
            let place = first_difference(&row.triangles, &expected)?;
            Some(format!("/surface: triangle {} is not that of the scene", place / 3))
        }
        _ => None,
    }
}

fn compare_topology(row: &TopologyRow, run: &RunDescription, solver: &Solver) -> Option<String> {
    let header = LoadHeader {
        step: row.step,
        topology_revision: row.revision,
        method: run.method,
        ..LoadHeader::default()
    };
    let mut expected = TopologyRow::of_solver(&header, solver);
    expected.torn.clone_from(&row.torn);
    if *row == expected {
        return None;
    }
    let (found, constraints) = (row.constraints(), expected.constraints());
    let (Some(found), Some(constraints)) = (found, constraints) else {
        return Some("/topology: its columns differ in length".to_owned());
    };
    if let Some(place) = first_difference(&found, &constraints) {
        return Some(format!("/topology: constraint {place} is not that of the scene"));
    }
    let (Some(found), Some(bends)) = (row.bends(), expected.bends()) else {
        return Some("/topology: the columns of its bends differ in length".to_owned());
    };
    Some(match first_difference(&found, &bends) {
        Some(place) => format!("/topology: bend {place} is not that of the scene"),
        None => "/topology: it has another column of softness than the scene".to_owned(),
    })
}

/// Returns the first place where two lists differ.
fn first_difference<T: PartialEq>(one: &[T], other: &[T]) -> Option<usize> {
    let place = one.iter().zip(other).position(|(one, other)| one != other);
    place.or_else(|| (one.len() != other.len()).then_some(one.len().min(other.len())))
}
