//! Warnings about settings that do nothing, or the opposite of what they say.

use crate::scene::definition::Scene;
use crate::scene::definition::settings::{ConstraintOrder, Up};
use crate::scene::model::Model;

pub(super) fn listed_order(scene: &Scene) -> Option<String> {
    let is_listed = scene.solver.order == ConstraintOrder::Listed && scene.solver.iterations == 1;
    is_listed
        .then(|| "order = \"listed\" with one iteration gains energy; use \"grouped\"".to_owned())
}

pub(super) fn no_tether_root(scene: &Scene, model: &Model) -> Option<String> {
    let has_root = scene.anchors.iter().any(|anchor| !anchor.particles.is_empty())
        || model.particles.iter().any(|particle| particle.pinned);
    (scene.solver.tethers && !has_root)
        .then(|| "tethers = true has no effect: no particle is pinned or anchored".to_owned())
}

pub(super) fn upside_down(scene: &Scene) -> Option<String> {
    let [_, y, z] = scene.gravity;
    let (name, along) = match scene.up {
        Up::Y => ("y", y),
        Up::MinusY => ("-y", -y),
        Up::Z => ("z", z),
    };
    (along > 0.0).then(|| format!("up is \"{name}\", but gravity points up, too: things fall up"))
}

pub(super) fn wind_without_surface(scene: &Scene, model: &Model) -> Option<String> {
    (scene.wind.is_some() && model.triangles.is_empty())
        .then(|| "the wind has no effect: it acts on triangles, and the scene has none".to_owned())
}
