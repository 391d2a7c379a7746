//! The copies of the scene in a recording, compared with the scene itself.

use std::io::Read;

use sim_contract::LoadHeader;
use sim_solver::{Scene, Solver};

use crate::log::{LogReader, Message, RunDescription, SurfaceRow, TopologyRow};

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
