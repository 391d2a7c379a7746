//! Warnings about particles.

use crate::contacts::obstacle::SolidsAtLoad;
use crate::scene::definition::Scene;
use crate::scene::generate::Shape;
use crate::scene::model::Model;

/// Distance from the scene's origin, in m, beyond which f32 positions make a scene at rest jitter.
const NEAR_ORIGIN: f32 = 100.0;
/// Standard gravity in m/s^2. A scene in a smaller unit has a greater one.
const GRAVITY: f32 = 9.81;
/// Ratio of masses beyond which small steps converge visibly slower.
const MASS_RATIO_LARGE: f32 = 1e3;

pub(super) fn none(model: &Model) -> Option<String> {
    model.particles.is_empty().then(|| "the scene has no particles".to_owned())
}

pub(super) fn far_from_origin(scene: &Scene, model: &Model) -> Option<String> {
    let coordinates = model.particles.iter().flat_map(|one| one.position);
    let farthest =
        coordinates.fold(0.0, |most: f32, one| if one.abs() > most { one.abs() } else { most });
    let [x, y, z] = scene.gravity;
    let unit_scale = (x * x + y * y + z * z).sqrt() / GRAVITY;
    let near = NEAR_ORIGIN * if unit_scale > 1.0 { unit_scale } else { 1.0 };
    let has_mesh = scene.generators.iter().any(|one| matches!(one.shape, Shape::Obj(_)));
    let cure = if has_mesh {
        "give a mesh in another unit a `scale`, such as 0.01 for centimetres, and put the distance of a mesh in \
         the scene's unit into `origin`"
    } else {
        "put the distance into `origin`"
    };
    (farthest > near).then(|| {
        format!(
            "a coordinate reaches {farthest} {unit} from the origin: beyond {near:.0} {unit} a \
             scene at rest jitters; {cure}",
            unit = scene.unit
        )
    })
}

pub(super) fn unequal_masses(model: &Model) -> Option<String> {
    let masses = || model.particles.iter().map(|one| one.mass);
    let heaviest = masses().fold(0.0, |most: f32, one| if one > most { one } else { most });
    let lightest = masses().fold(f32::INFINITY, |least, one| if one < least { one } else { least });
    (heaviest / lightest > MASS_RATIO_LARGE).then(|| {
        format!(
            "masses range from {lightest} to {heaviest} kg: constraints between light and heavy \
             particles converge slowly; use more substeps"
        )
    })
}

pub(super) fn pinned_and_anchored(scene: &Scene, model: &Model) -> Option<String> {
    let anchored = scene.anchors.iter().flat_map(|anchor| &anchor.particles);
    let mut both = anchored.filter(|particle| model.particles[**particle as usize].pinned);
    let particle = both.next()?;
    Some(format!("particle {particle} is pinned and follows an anchor: the pin has no effect"))
}

/// A free particle inside a collider at load.
struct Inside {
    particle: usize,
    collider: usize,
    depth: f32,
}

/// Names the deepest particle, because it is pushed farthest.
pub(super) fn inside_collider(scene: &Scene, model: &Model) -> Option<String> {
    let mut is_fixed: Vec<_> = model.particles.iter().map(|particle| particle.pinned).collect();
    for particle in scene.anchors.iter().flat_map(|anchor| &anchor.particles) {
        is_fixed[*particle as usize] = true;
    }
    let free = (0..is_fixed.len()).filter(|particle| !is_fixed[*particle]);
    let is_planar = scene.dimensions == 2;
    let colliders: Vec<_> =
        scene.colliders.iter().map(|one| SolidsAtLoad::new(one, is_planar)).collect();
    let inside: Vec<_> = free.filter_map(|one| deepest_collider(&colliders, model, one)).collect();
    let Inside { particle, collider, depth } =
        inside.iter().rev().max_by(|a, b| a.depth.total_cmp(&b.depth))?;
    let count = match inside.len() {
        1 => "1 particle starts".to_owned(),
        count => format!("{count} particles start"),
    };
    Some(format!(
        "{count} inside a collider; the deepest is particle {particle}, {depth} {unit} inside \
         collider {collider}: the first step pushes it out at once",
        unit = scene.unit
    ))
}

/// Returns the collider that a particle is deepest inside of; the first of several.
fn deepest_collider(colliders: &[SolidsAtLoad], model: &Model, particle: usize) -> Option<Inside> {
    let position = model.particles[particle].position;
    let depths = colliders.iter().enumerate().filter_map(|(collider, one)| {
        Some(Inside { particle, collider, depth: one.depth(position)? })
    });
    depths.reduce(|deepest, one| if one.depth > deepest.depth { one } else { deepest })
}
