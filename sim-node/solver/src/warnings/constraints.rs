//! Warnings about constraints.

use std::collections::BTreeSet;

use sim_scene::constraints::Constraint;
use sim_scene::model::Model;
use sim_scene::scene::{Limits, Scene, Softness};

/// Returns all constraints with their effective limits.
fn limited<'a>(
    scene: &'a Scene,
    model: &'a Model,
) -> impl Iterator<Item = (u32, Constraint, Limits)> + 'a {
    let all = (0_u32..).zip(&model.constraints);
    all.map(|(index, one)| (index, *one, model.limits(index).or(scene.solver.limits)))
}

fn is_on(limit: Option<f32>) -> bool {
    limit.is_some_and(f32::is_finite)
}

pub(super) fn tear_of_rigid(scene: &Scene, model: &Model) -> Option<String> {
    let rigid = Softness::rigid(scene.solver.method).value();
    let (index, ..) = limited(scene, model)
        .find(|(_, one, limits)| is_on(limits.tear_stretch) && one.compliance == rigid)?;
    Some(format!(
        "constraint {index} is rigid and tears by stretch: its stretch measures the error of the \
         solver, not the load; use tear_force"
    ))
}

pub(super) fn tear_beyond_limit(scene: &Scene, model: &Model) -> Option<String> {
    let (index, ..) = limited(scene, model).find(|(_, _, limits)| {
        is_on(limits.tear_stretch)
            && is_on(limits.max_stretch)
            && limits.tear_stretch >= limits.max_stretch
    })?;
    Some(format!(
        "constraint {index} is kept within a max_stretch that is not above its tear_stretch, so it \
         hardly ever tears; use a smaller tear_stretch, or tear_force"
    ))
}

/// Warns of a tear force that is below the rounding errors of a rigid constraint's force.
pub(super) fn tear_by_rounding(scene: &Scene, model: &Model) -> Option<String> {
    let rigid = Softness::rigid(scene.solver.method).value();
    let limits = limited(scene, model).filter(|(_, one, _)| one.compliance == rigid);
    let mut forces = limits.filter_map(|(index, one, limits)| {
        let limit = limits.tear_force.filter(|limit| limit.is_finite())?;
        Some((index, limit, rounding_force(scene, model, one)))
    });
    let (index, limit, force) = forces.find(|(_, limit, force)| 3.0 * force > *limit)?;
    Some(format!(
        "constraint {index} is rigid and tears at {limit} N, but the rounding of its coordinates \
         alone causes forces of about {force:.2} N at {} substeps per second: use fewer substeps, \
         or a compliance",
        scene.solver.rate_hz * scene.solver.substeps
    ))
}

/// Returns the force that the rounding of coordinates causes in a rigid constraint, in N.
fn rounding_force(scene: &Scene, model: &Model, constraint: Constraint) -> f32 {
    let h = scene.solver.h();
    let ends = [constraint.a, constraint.b].map(|index| model.particles[index as usize]);
    let size = ends
        .iter()
        .flat_map(|end| end.position)
        .fold(0.0, |most: f32, axis| if axis.abs() > most { axis.abs() } else { most });
    let heavier = if ends[0].mass > ends[1].mass { ends[0].mass } else { ends[1].mass };
    size * (f32::EPSILON / 2.0) * heavier / (h * h)
}

pub(super) fn coincident_ends(model: &Model) -> Option<String> {
    let is_stuck = |one: &&Constraint| one.rest_length > 0.0 && model.distance(one.a, one.b) == 0.0;
    let one = model.constraints.iter().find(is_stuck)?;
    Some(format!(
        "particles {} and {} coincide, so the constraint between them has no direction to push in",
        one.a, one.b
    ))
}

pub(super) fn duplicates(model: &Model) -> Option<String> {
    let mut pairs = BTreeSet::new();
    let is_duplicate = |one: &&Constraint| !pairs.insert([one.a.min(one.b), one.a.max(one.b)]);
    let one = model.constraints.iter().find(is_duplicate)?;
    Some(format!(
        "two constraints join particles {} and {}: together they are stiffer",
        one.a, one.b
    ))
}
