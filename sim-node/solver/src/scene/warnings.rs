//! What works, but probably not as meant.

use std::collections::BTreeSet;

use super::{ConstraintOrder, Model, Scene};
use crate::constraints::Constraint;
use crate::contacts::obstacle::depth_at_load;

/// Distance from the scene's origin, in m, beyond which f32 positions make a scene at rest tremble.
const NEAR_ORIGIN: f32 = 100.0;
/// In m/s^2. A scene in another unit is told by its gravity.
const GRAVITY: f32 = 9.81;
/// Ratio of masses beyond which small steps converge visibly slower.
const MASS_RATIO_LARGE: f32 = 1e3;

/// What works, but probably not as meant: a sentence each.
pub(super) fn warnings(scene: &Scene) -> Vec<String> {
    let model = scene.model();
    let all = [
        far_from_origin(scene, &model),
        unequal_masses(&model),
        listed_order(scene),
        tear_of_rigid(scene, &model),
        tear_beyond_limit(scene, &model),
        pinned_and_anchored(scene, &model),
        nothing_to_tie_to(scene, &model),
        tear_by_noise(scene, &model),
        upside_down(scene),
        wind_on_nothing(scene, &model),
        inside_collider(scene, &model),
        no_length(&model),
        duplicates(&model),
    ];
    all.into_iter().flatten().chain(scene.findings.iter().cloned()).collect()
}

fn far_from_origin(scene: &Scene, model: &Model) -> Option<String> {
    let coordinates = model.particles.iter().flat_map(|one| one.position);
    let farthest =
        coordinates.fold(0.0, |most: f32, one| if one.abs() > most { one.abs() } else { most });
    let [x, y, z] = scene.gravity;
    let unit_scale = (x * x + y * y + z * z).sqrt() / GRAVITY;
    let near = NEAR_ORIGIN * if unit_scale > 1.0 { unit_scale } else { 1.0 };
    (farthest > near).then(|| {
        format!(
            "a coordinate reaches {farthest} {unit} from the origin: beyond {near:.0} {unit} a \
             scene at rest trembles; put the distance into `origin`",
            unit = scene.unit
        )
    })
}

fn unequal_masses(model: &Model) -> Option<String> {
    let masses = || model.particles.iter().map(|one| one.mass);
    let heaviest = masses().fold(0.0, |most: f32, one| if one > most { one } else { most });
    let lightest = masses().fold(f32::INFINITY, |least, one| if one < least { one } else { least });
    (heaviest / lightest > MASS_RATIO_LARGE).then(|| {
        format!(
            "masses from {lightest} to {heaviest} kg: constraints between light and heavy particles \
             converge slowly; use more substeps"
        )
    })
}

fn listed_order(scene: &Scene) -> Option<String> {
    let is_listed = scene.solver.order == ConstraintOrder::Listed && scene.solver.iterations == 1;
    is_listed
        .then(|| "order = \"listed\" with one iteration gains energy; use \"grouped\"".to_owned())
}

/// The constraints with the limits that hold for them.
fn limited<'a>(
    scene: &'a Scene,
    model: &'a Model,
) -> impl Iterator<Item = (u32, Constraint, super::Limits)> + 'a {
    let all = (0_u32..).zip(&model.constraints);
    all.map(|(index, one)| (index, *one, model.limits(index).or(scene.solver.limits)))
}

fn is_on(limit: Option<f32>) -> bool {
    limit.is_some_and(f32::is_finite)
}

fn tear_of_rigid(scene: &Scene, model: &Model) -> Option<String> {
    let rigid = super::Softness::rigid(scene.solver.method).value();
    let (index, ..) = limited(scene, model)
        .find(|(_, one, limits)| is_on(limits.tear_stretch) && one.compliance == rigid)?;
    Some(format!(
        "constraint {index} is rigid and tears by stretch: what it measures there is the error of \
         the solver, not the load; use tear_force"
    ))
}

fn tear_beyond_limit(scene: &Scene, model: &Model) -> Option<String> {
    let (index, ..) = limited(scene, model).find(|(_, _, limits)| {
        is_on(limits.tear_stretch)
            && is_on(limits.max_stretch)
            && limits.tear_stretch >= limits.max_stretch
    })?;
    Some(format!(
        "constraint {index} is kept within max_stretch, which is not above its tear_stretch: it \
         hardly ever tears; use a smaller tear_stretch, or tear_force"
    ))
}

/// The force that the rounding of coordinates alone makes in a rigid constraint.
fn tear_by_noise(scene: &Scene, model: &Model) -> Option<String> {
    let h = scene.solver.h();
    let rigid = super::Softness::rigid(scene.solver.method).value();
    let noise = |one: &Constraint| {
        let ends = [one.a, one.b].map(|index| model.particles[index as usize]);
        let size = ends
            .iter()
            .flat_map(|end| end.position)
            .fold(0.0, |most: f32, axis| if axis.abs() > most { axis.abs() } else { most });
        let heavier = if ends[0].mass > ends[1].mass { ends[0].mass } else { ends[1].mass };
        size * (f32::EPSILON / 2.0) * heavier / (h * h)
    };
    let (index, one, limits) = limited(scene, model).find(|(_, one, limits)| {
        let limit = limits.tear_force.unwrap_or(f32::INFINITY);
        one.compliance == rigid && limit.is_finite() && 3.0 * noise(one) > limit
    })?;
    Some(format!(
        "constraint {index} is rigid and tears at {} N, but the rounding of its coordinates alone \
         makes forces of about {:.2} N at {} substeps a second: use fewer substeps, or a compliance",
        limits.tear_force.unwrap_or_default(),
        noise(&one),
        scene.solver.rate_hz * scene.solver.substeps
    ))
}

fn upside_down(scene: &Scene) -> Option<String> {
    let [_, y, z] = scene.gravity;
    let (name, along) = match scene.up {
        super::Up::Y => ("y", y),
        super::Up::MinusY => ("-y", -y),
        super::Up::Z => ("z", z),
    };
    (along > 0.0).then(|| format!("up is \"{name}\", and gravity pulls that way: things fall up"))
}

fn wind_on_nothing(scene: &Scene, model: &Model) -> Option<String> {
    let is_felt = !model.triangles.is_empty();
    (scene.wind.is_some() && !is_felt)
        .then(|| "there is wind, but no surface that feels it: only triangles do".to_owned())
}

fn inside_collider(scene: &Scene, model: &Model) -> Option<String> {
    let mut is_held: Vec<_> = model.particles.iter().map(|particle| particle.pinned).collect();
    for particle in scene.anchors.iter().flat_map(|anchor| &anchor.particles) {
        is_held[*particle as usize] = true;
    }
    let is_planar = scene.dimensions == 2;
    let depth_of = |index: usize| {
        let position = model.particles[index].position;
        let mut colliders = scene.colliders.iter().enumerate();
        colliders.find_map(|(place, one)| Some((place, depth_at_load(one, position, is_planar)?)))
    };
    let free = (0..is_held.len()).filter(|index| !is_held[*index]);
    let mut inside = free.filter_map(|index| Some((index, depth_of(index)?)));
    let (index, (collider, depth)) = inside.next()?;
    let who = match inside.count() {
        0 => format!("particle {index} begins"),
        more => format!("particle {index} and {more} more begin"),
    };
    Some(format!(
        "{who} inside of a collider (collider {collider}, {depth} deep): the first step pushes them \
         out at once"
    ))
}

fn pinned_and_anchored(scene: &Scene, model: &Model) -> Option<String> {
    let anchored = scene.anchors.iter().flat_map(|anchor| &anchor.particles);
    let mut both = anchored.filter(|particle| model.particles[**particle as usize].pinned);
    let particle = both.next()?;
    Some(format!("particle {particle} is pinned and follows an anchor: the anchor holds it"))
}

fn nothing_to_tie_to(scene: &Scene, model: &Model) -> Option<String> {
    let has_root = scene.anchors.iter().any(|anchor| !anchor.particles.is_empty())
        || model.particles.iter().any(|particle| particle.pinned);
    (scene.solver.tethers && !has_root)
        .then(|| "tethers = true does nothing: no particle is pinned or anchored".to_owned())
}

fn no_length(model: &Model) -> Option<String> {
    let is_stuck = |one: &&Constraint| one.rest_length > 0.0 && model.distance(one.a, one.b) == 0.0;
    let one = model.constraints.iter().find(is_stuck)?;
    Some(format!(
        "particles {} and {} coincide, so the constraint between them has no direction to push in",
        one.a, one.b
    ))
}

fn duplicates(model: &Model) -> Option<String> {
    let mut seen = BTreeSet::new();
    let again = |one: &&Constraint| !seen.insert([one.a.min(one.b), one.a.max(one.b)]);
    let one = model.constraints.iter().find(again)?;
    Some(format!(
        "two constraints join particles {} and {}: together they are stiffer",
        one.a, one.b
    ))
}
