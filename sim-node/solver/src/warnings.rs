//! Warnings about scenes that work, but probably not as intended.

use sim_scene::Scene;

mod bending;
mod constraints;
mod contacts;
mod particles;
mod rounded;
mod settings;
mod shapes;

/// Returns warnings about anything that works, but probably not as intended: one sentence each.
pub fn warnings(scene: &Scene) -> Vec<String> {
    let model = scene.model();
    let all = [
        particles::none(&model),
        particles::far_from_origin(scene, &model),
        particles::unequal_masses(&model),
        particles::pinned_and_anchored(scene, &model),
        particles::inside_collider(scene, &model),
        settings::listed_order(scene),
        settings::no_tether_root(scene, &model),
        settings::excessive_damping(scene),
        settings::gravity_not_down(scene),
        settings::gravity_of_meters(scene),
        settings::wind_without_surface(scene, &model),
        settings::fast_contacts(scene, &model),
        settings::contact_without_surface(scene, &model),
        settings::contact_without_mode(scene),
        settings::contact_of_nothing(scene),
        constraints::tear_of_rigid(scene, &model),
        constraints::tear_beyond_limit(scene, &model),
        constraints::tear_by_rounding(scene, &model),
        constraints::coincident_ends(&model),
        constraints::duplicates(&model),
    ];
    let mut warnings: Vec<_> = all.into_iter().flatten().collect();
    warnings.extend(contacts::across_mesh(scene, &model));
    warnings.extend(contacts::within_distance(scene, &model));
    warnings.extend(particles::coincident(scene, &model));
    warnings.extend(contacts::thickness(scene, &model));
    warnings.extend(contacts::overfull(scene, &model));
    warnings.extend(bending::unreached(scene, &model));
    warnings.extend(bending::missing_hinges(scene));
    warnings.extend(shapes::without_length(scene));
    warnings.extend(shapes::on_a_line(scene));
    warnings.extend(shapes::without_pins(scene));
    warnings.extend(shapes::loose_faces(scene));
    warnings.extend(scene.read_warnings.iter().cloned());
    warnings
}
