//! Contacts of particles with each other.

use serde::Serialize;
use sim_types::ParameterValues;

use super::decimal;

/// Which parts of cloths, ropes and other bodies touch each other.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ContactMode {
    /// None: they pass through each other.
    #[default]
    Off,
    /// Particles touch particles.
    Particles,
    /// Particles touch the triangles of cloths, and particles without triangles touch each other.
    Surfaces,
}

impl ContactMode {
    /// The names in a scene.
    pub(crate) const NAMES: [(&'static str, Self); 3] =
        [("off", Self::Off), ("particles", Self::Particles), ("surfaces", Self::Surfaces)];
}

/// Contacts of particles with each other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ContactSettings {
    /// Default off.
    pub mode: ContactMode,
    /// Smallest distance of the centres of two particles, or of a particle and a triangle, in the scene's unit, > 0; default the smallest
    /// rest length of a structural constraint. `None` while the mode is off and the scene gives none.
    #[serde(with = "decimal::optional", skip_serializing_if = "Option::is_none")]
    pub thickness: Option<f32>,
    /// Coulomb's coefficient, >= 0; default 0.3.
    #[serde(with = "decimal::number")]
    pub friction: f32,
}

impl Default for ContactSettings {
    fn default() -> Self {
        let friction = ParameterValues::DEFAULT.contact_friction;
        Self { mode: ContactMode::Off, thickness: None, friction }
    }
}

impl ContactSettings {
    /// Returns the contact distance, or `None` if particles do not touch each other.
    pub fn distance(&self) -> Option<f32> {
        self.thickness.filter(|_| self.mode != ContactMode::Off)
    }

    /// Returns `true` if particles touch each other, and the scene must give the distance.
    pub(crate) fn lacks_thickness(&self) -> bool {
        self.mode != ContactMode::Off && self.thickness.is_none()
    }
}
