//! The tables `[[particle]]` and `[[constraint]]`.

use serde::Deserialize;
use sim_types::{ConstraintKind, NumberRange};

use super::limits::FileLimits;
use super::reader::Reader;
use super::value::{Number, Spanned, Table, TableKeys, Tuple, Vector, Whole, Word};
use crate::scene::definition::element::{SceneConstraint, SceneParticle};
use crate::scene::definition::softness::Softness;
use crate::scene::error::SceneError;
use crate::scene::model::Positions;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileParticle {
    position: Option<Vector>,
    mass: Option<Number>,
    #[serde(default)]
    pinned: bool,
    velocity: Option<Vector>,
}

impl TableKeys for FileParticle {}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileConstraint {
    particles: Option<Spanned<Tuple<Whole, 2>>>,
    rest_length: Option<Number>,
    kind: Option<Word>,
    compliance: Option<Number>,
    stiffness: Option<Number>,
    max_stretch: Option<Number>,
    tear_stretch: Option<Number>,
    tear_distance: Option<Number>,
    tear_force: Option<Number>,
}

impl TableKeys for FileConstraint {}

impl Reader<'_> {
    /// Checks a table `[[particle]]`.
    pub(super) fn particle(
        &self,
        index: usize,
        table: &Spanned<Table<FileParticle>>,
    ) -> Result<SceneParticle, SceneError> {
        let field = |key: &str| format!("particle[{index}].{key}");
        let file = table.get_ref();
        let position = file.position.as_ref();
        let position =
            self.required(position, table.span(), &field("position"), "three numbers")?;
        let velocity = self.vector_or(&field("velocity"), file.velocity.as_ref(), [0.0; 3])?;
        if let Some(given) = file.velocity.as_ref().filter(|_| file.pinned && velocity != [0.0; 3])
        {
            let problem = "a pinned particle has a velocity (allowed: [0, 0, 0])";
            return self.error(given.span(), &field("velocity"), problem);
        }
        Ok(SceneParticle {
            position: self.vector(&field("position"), position)?,
            mass: self.mass(&field("mass"), file.mass.as_ref())?,
            pinned: file.pinned,
            velocity,
        })
    }

    /// Checks a table `[[constraint]]`.
    pub(super) fn constraint(
        &self,
        index: usize,
        table: &Spanned<Table<FileConstraint>>,
        positions: &Positions,
    ) -> Result<SceneConstraint, SceneError> {
        let field = |key: &str| format!("constraint[{index}].{key}");
        let file = table.get_ref();
        let pair = file.particles.as_ref();
        let pair = self.required(pair, table.span(), &field("particles"), "two indices")?;
        let [a, b] = &**pair.get_ref();
        let a = self.particle_index(&field("particles"), a, positions)?;
        let b = self.particle_index(&field("particles"), b, positions)?;
        if a == b {
            let problem =
                format!("joins particle {a} to itself (allowed: two different particles)");
            return self.error(pair.span(), &field("particles"), problem);
        }
        let rest_length = match &file.rest_length {
            Some(number) => {
                self.ranged(&field("rest_length"), number, NumberRange::AT_LEAST_ZERO)?
            }
            None => positions.distance(a, b),
        };
        let kinds = ConstraintKind::ALL.map(|kind| (kind.name(), kind));
        let kind = file.kind.as_ref().map(|word| self.word(&field("kind"), word, &kinds));
        let limits = FileLimits {
            max_stretch: file.max_stretch.as_ref(),
            tear_stretch: file.tear_stretch.as_ref(),
            tear_distance: file.tear_distance.as_ref(),
            tear_force: file.tear_force.as_ref(),
        };
        Ok(SceneConstraint {
            particles: [a, b],
            rest_length,
            kind: kind.transpose()?.unwrap_or_default(),
            softness: self.constraint_softness(field, file)?,
            limits: self.limits(field, &limits)?,
        })
    }

    fn constraint_softness(
        &self,
        field: impl Fn(&str) -> String,
        file: &FileConstraint,
    ) -> Result<Softness, SceneError> {
        let (compliance, stiffness) = (file.compliance.as_ref(), file.stiffness.as_ref());
        Ok(match self.softness_key(&field, compliance, stiffness)? {
            Some((key, number)) => Softness::new(self.method, self.softness(&field(key), number)?),
            None => Softness::rigid(self.method),
        })
    }
}
