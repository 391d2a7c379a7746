//! Warnings about scenes that work, but probably not as intended.

mod bending;
mod constraints;
mod contacts;
mod particles;
mod rounded;
mod settings;
mod shapes;

use super::definition::Scene;

impl Scene {
    /// Returns warnings about anything that works, but probably not as intended: one sentence each.
    pub fn warnings(&self) -> Vec<String> {
        let model = self.model();
        let all = [
            particles::none(&model),
            particles::far_from_origin(self, &model),
            particles::unequal_masses(&model),
            particles::pinned_and_anchored(self, &model),
            particles::inside_collider(self, &model),
            settings::listed_order(self),
            settings::no_tether_root(self, &model),
            settings::excessive_damping(self),
            settings::gravity_not_down(self),
            settings::gravity_of_meters(self),
            settings::wind_without_surface(self, &model),
            settings::fast_contacts(self, &model),
            settings::contact_without_surface(self, &model),
            settings::contact_without_mode(self),
            settings::contact_of_nothing(self),
            constraints::tear_of_rigid(self, &model),
            constraints::tear_beyond_limit(self, &model),
            constraints::tear_by_rounding(self, &model),
            constraints::coincident_ends(&model),
            constraints::duplicates(&model),
        ];
        let mut warnings: Vec<_> = all.into_iter().flatten().collect();
        warnings.extend(contacts::across_mesh(self, &model));
        warnings.extend(contacts::within_distance(self, &model));
        warnings.extend(particles::coincident(self, &model));
        warnings.extend(contacts::thickness(self, &model));
        warnings.extend(contacts::overfull(self, &model));
        warnings.extend(bending::unreached(self, &model));
        warnings.extend(bending::missing_hinges(self));
        warnings.extend(shapes::without_length(self));
        warnings.extend(shapes::on_a_line(self));
        warnings.extend(shapes::without_pins(self));
        warnings.extend(shapes::loose_faces(self));
        warnings.extend(self.read_warnings.iter().cloned());
        warnings
    }
}
