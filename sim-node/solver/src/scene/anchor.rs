//! Anchors: particles that follow a moving frame.

use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::check::{Range32, Reader};
use super::file::{Number, Vector, Whole};
use super::{Model, SceneError, decimal};

/// Particles that follow a moving frame: each is driven to origin + R (start - origin) +
/// translation. An anchor holds its particles: whether they are pinned in the scene does not
/// matter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SceneAnchor {
    /// Ascending; no particle follows two anchors.
    pub particles: Vec<u32>,
    /// The point that rotations leave in place.
    #[serde(with = "decimal::vector")]
    pub origin: [f32; 3],
    /// Whether the path begins again at its end.
    pub repeat: bool,
    /// Where the frame is at which time; between two of them linear, outside of them it stands.
    pub path: Vec<Waypoint>,
}

/// Where a frame is at a time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Waypoint {
    /// Seconds since the scene's step 0, >= 0.
    pub time: f64,
    /// From where the frame was at load.
    #[serde(with = "decimal::vector")]
    pub translation: [f32; 3],
    /// Quaternion x, y, z, w; normalised where it is used.
    #[serde(with = "decimal::quaternion")]
    pub rotation: [f32; 4],
}

/// The rotation that leaves everything as it is.
pub(super) const NO_ROTATION: [f32; 4] = [0.0, 0.0, 0.0, 1.0];
/// Longest time of a waypoint, in seconds (30 years): in f64 it still has microseconds.
const TIME_MAX: f64 = 1e9;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FileAnchor {
    particles: Spanned<Vec<Whole>>,
    origin: Option<Vector>,
    #[serde(default)]
    path: Vec<FileWaypoint>,
    repeat: Option<Spanned<bool>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileWaypoint {
    time: Number,
    translation: Option<Vector>,
    rotation: Option<Spanned<[Number; 4]>>,
}

impl Reader<'_> {
    /// Checks one `[[anchor]]` block. `is_taken` tells which particles the ones before it have.
    pub(super) fn anchor(
        &self,
        index: usize,
        file: &FileAnchor,
        model: &Model,
        is_taken: &mut [bool],
    ) -> Result<SceneAnchor, SceneError> {
        let field = |name: &str| format!("anchor[{index}].{name}");
        let mut particles = Vec::with_capacity(file.particles.get_ref().len());
        for particle in file.particles.get_ref() {
            let found = self.particle_index(&field("particles"), particle, model)?;
            if std::mem::replace(&mut is_taken[found as usize], true) {
                let problem = format!("particle {found} follows an anchor already (allowed: once)");
                return self.error(particle.span(), &field("particles"), problem);
            }
            particles.push(found);
        }
        particles.sort_unstable();
        let path: Vec<_> = file
            .path
            .iter()
            .enumerate()
            .map(|(place, file)| self.waypoint(&field(&format!("path[{place}]")), file))
            .collect::<Result<_, _>>()?;
        for (place, pair) in path.windows(2).enumerate() {
            if pair[0].time < pair[1].time {
                continue;
            }
            let problem = format!(
                "{} does not come after {} (allowed: ascending)",
                pair[1].time, pair[0].time
            );
            let span = file.path[place + 1].time.span();
            return self.error(span, &field(&format!("path[{}].time", place + 1)), problem);
        }
        let repeat = file.repeat.as_ref().is_some_and(|repeat| *repeat.get_ref());
        if let Some(given) = file.repeat.as_ref().filter(|_| repeat && path.len() < 2) {
            let problem = "a path of fewer than two points does not repeat (allowed: false)";
            return self.error(given.span(), &field("repeat"), problem.to_owned());
        }
        let origin = self.vector_or(&field("origin"), file.origin.as_ref(), [0.0; 3])?;
        Ok(SceneAnchor { particles, origin, repeat, path })
    }

    fn waypoint(&self, field: &str, file: &FileWaypoint) -> Result<Waypoint, SceneError> {
        let time = *file.time.get_ref();
        if !(0.0..=TIME_MAX).contains(&time) {
            let problem = format!("{time} is out of range (allowed: 0 to {TIME_MAX:e} s)");
            return self.error(file.time.span(), &format!("{field}.time"), problem);
        }
        let translation =
            self.vector_or(&format!("{field}.translation"), file.translation.as_ref(), [0.0; 3])?;
        let rotation = self.rotation(&format!("{field}.rotation"), file.rotation.as_ref())?;
        Ok(Waypoint { time, translation, rotation })
    }

    /// A quaternion x, y, z, w; none is no rotation. In 2-D it turns about z only.
    pub(super) fn rotation(
        &self,
        field: &str,
        rotation: Option<&Spanned<[Number; 4]>>,
    ) -> Result<[f32; 4], SceneError> {
        let Some(file) = rotation else { return Ok(NO_ROTATION) };
        let mut quaternion = [0.0; 4];
        for (part, number) in quaternion.iter_mut().zip(file.get_ref()) {
            *part = self.ranged(field, number, Range32::COORDINATE)?;
        }
        if quaternion == [0.0; 4] {
            let problem = "has no direction (allowed: x, y, z, w that are not all 0)".to_owned();
            return self.error(file.span(), field, problem);
        }
        if self.is_planar && quaternion[..2] != [0.0; 2] {
            let problem = "turns out of the plane (allowed: [0, 0, z, w] in 2 dimensions)";
            return self.error(file.span(), field, problem.to_owned());
        }
        Ok(quaternion)
    }
}
