//! Warnings about settings that do nothing, or the opposite of what they say.

use sim_scene::model::Model;
use sim_scene::scene::{ConstraintOrder, ContactMode, Scene, Up};

use super::rounded::three_digits;

pub(super) fn listed_order(scene: &Scene) -> Option<String> {
    let is_listed = scene.solver.order == ConstraintOrder::Listed && scene.solver.iterations == 1;
    is_listed
        .then(|| "order = \"listed\" with one iteration gains energy; use \"grouped\"".to_owned())
}

pub(super) fn no_tether_root(scene: &Scene, model: &Model) -> Option<String> {
    let has_root = scene.anchors.iter().any(|anchor| !anchor.particles.is_empty())
        || model.particles.iter().any(|particle| particle.pinned);
    (scene.solver.has_tethers() && !has_root)
        .then(|| "tethers have no effect: no particle is pinned or anchored".to_owned())
}

/// Damping that leaves nothing of a velocity.
pub(super) fn excessive_damping(scene: &Scene) -> Option<String> {
    let (damping, h) = (scene.solver.damping, scene.solver.h());
    (damping * h >= 1.0).then(|| {
        format!(
            "damping = {damping} 1/s leaves nothing of a velocity: from {} 1/s on, one divided by the length of a substep, \
             particles only creep",
            three_digits(1.0 / f64::from(h))
        )
    })
}

/// Part of gravity along `up` below which things do not fall down, but sideways: within 5.7 degrees of it.
const DOWN_MIN: f64 = 0.1;

/// Gravity that points up or sideways, such as the default in a scene with z up.
pub(super) fn gravity_not_down(scene: &Scene) -> Option<String> {
    let [x, y, z] = scene.gravity.map(f64::from);
    let size = (x * x + y * y + z * z).sqrt();
    let (name, along) = match scene.up {
        Up::Y => ("y", y),
        Up::MinusY => ("-y", -y),
        Up::Z => ("z", z),
    };
    if along > DOWN_MIN * size {
        return Some(format!("up is \"{name}\", but gravity points up, too: things fall up"));
    }
    // Without gravity, nothing falls.
    (along > -DOWN_MIN * size).then(|| {
        #[allow(clippy::cast_possible_truncation, reason = "no component of gravity exceeds f32")]
        let size = size as f32;
        let down = match scene.up {
            Up::Y => [0.0, -size, 0.0],
            Up::MinusY => [0.0, size, 0.0],
            Up::Z => [0.0, 0.0, -size],
        };
        format!(
            "up is \"{name}\", but gravity = {:?} points sideways: for things to fall down, use gravity = {down:?}",
            scene.gravity
        )
    })
}

/// Gravity in m/s² in a scene with another unit of length.
pub(super) fn gravity_of_meters(scene: &Scene) -> Option<String> {
    let unit = scene.unit.as_str();
    let on_earth = match unit {
        "cm" => 981,
        "mm" => 9810,
        _ => return None,
    };
    let [x, y, z] = scene.gravity;
    let gravity = (x * x + y * y + z * z).sqrt();
    let is_of_meters = (9.7..9.9).contains(&gravity);
    is_of_meters
        .then(|| format!("gravity is {gravity} {unit}/s², but on Earth it is {on_earth} {unit}/s²"))
}

pub(super) fn wind_without_surface(scene: &Scene, model: &Model) -> Option<String> {
    (scene.wind.is_some() && model.triangles.is_empty())
        .then(|| "the wind has no effect: it acts on triangles, and the scene has none".to_owned())
}

pub(super) fn contact_without_surface(scene: &Scene, model: &Model) -> Option<String> {
    (scene.contact.mode == ContactMode::Surfaces && model.triangles.is_empty()).then(|| {
        "contact.mode = \"surfaces\" acts as \"particles\": the scene has no triangles".to_owned()
    })
}

pub(super) fn contact_without_mode(scene: &Scene) -> Option<String> {
    (scene.contact.mode == ContactMode::Off && scene.contact.thickness.is_some()).then(|| {
        "contact.thickness has no effect: contact.mode is \"off\"; add mode = \"particles\" or \"surfaces\"".to_owned()
    })
}

pub(super) fn contact_of_nothing(scene: &Scene) -> Option<String> {
    let touches = !scene.particles.is_empty() || scene.generators.iter().any(|one| one.contact);
    (scene.contact.mode != ContactMode::Off && !touches).then(|| {
        "contact.mode has no effect: every [[generate]] has contact = false; remove it from those that shall touch"
            .to_owned()
    })
}

/// Returns the largest fall in a substep, in contact distances, at which cloth does not pass through itself.
fn fall_max(mode: ContactMode) -> f32 {
    match mode {
        ContactMode::Off | ContactMode::Particles => 0.25,
        // The heap in `tests/physics/contacts/surfaces.rs`.
        ContactMode::Surfaces => 0.8,
    }
}

/// Particles that fall through the height of the scene move too far in a substep to touch each other
/// reliably.
pub(super) fn fast_contacts(scene: &Scene, model: &Model) -> Option<String> {
    let thickness = scene.contact.distance()?;
    let [x, y, z] = scene.gravity;
    let gravity = (x * x + y * y + z * z).sqrt();
    let heights = model.particles.iter().map(|particle| {
        let [px, py, pz] = particle.position;
        (px * x + py * y + pz * z) / gravity
    });
    let (min, max) = heights.fold((f32::INFINITY, f32::NEG_INFINITY), |(min, max), height| {
        (min.min(height), max.max(height))
    });
    let speed = (2.0 * gravity * (max - min)).sqrt();
    let distance = speed * scene.solver.h();
    let fall_max = fall_max(scene.contact.mode);
    // NaN without gravity.
    if distance > fall_max * thickness {
        let substeps = distance / (fall_max * thickness) * scene.solver.substeps as f32;
        return Some(format!(
            "particles that fall through the height of the scene, at {speed:.1} {unit}/s, move {share:.2} \
             of the contact thickness in a substep, and can pass through each other beyond \
             {fall_max}; {} substeps suffice",
            substeps.ceil(),
            unit = scene.unit,
            share = distance / thickness,
        ));
    }
    None
}
