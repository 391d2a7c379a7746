//! The tables `[[particle]]`, `[[constraint]]` and `[[bend]]`.

use serde::Deserialize;
use sim_types::{ConstraintKind, NumberRange};

use super::limits::FileLimits;
use super::reader::{RIGIDITY, Reader};
use super::value::{Number, Spanned, Table, TableKeys, ThreeOrFour, Tuple, Vector, Whole, Word};
use crate::scene::definition::bending::{BendParticles, SceneBend};
use crate::scene::definition::element::{SceneConstraint, SceneParticle};
use crate::scene::definition::softness::Softness;
use crate::scene::error::SceneError;
use crate::scene::mesh::area;
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

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileBend {
    particles: Option<Spanned<ThreeOrFour<Whole>>>,
    rigidity: Option<Number>,
}

impl TableKeys for FileBend {}

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

    /// Checks a table `[[bend]]`.
    pub(super) fn bend(
        &self,
        index: usize,
        table: &Spanned<Table<FileBend>>,
        positions: &Positions,
    ) -> Result<SceneBend, SceneError> {
        let field = |key: &str| format!("bend[{index}].{key}");
        let file = table.get_ref();
        let list = file.particles.as_ref();
        let list = self.required(list, table.span(), &field("particles"), "3 or 4 indices")?;
        let rigidity = file.rigidity.as_ref();
        let rigidity = self.required(rigidity, table.span(), &field("rigidity"), RIGIDITY.text)?;
        let particle = |one| self.particle_index(&field("particles"), one, positions);
        let ThreeOrFour { three: [a, b, c], fourth } = list.get_ref();
        let line = [particle(a)?, particle(b)?, particle(c)?];
        let particles = match fourth {
            None => BendParticles::Line(line),
            Some(fourth) => BendParticles::Cell([line[0], line[1], line[2], particle(fourth)?]),
        };
        if let Some(problem) = bend_problem(particles, positions) {
            return self.error(list.span(), &field("particles"), problem);
        }
        let rigidity = self.ranged(&field("rigidity"), rigidity, RIGIDITY)?;
        Ok(SceneBend { particles, rigidity })
    }
}

/// Returns what is wrong with the particles of a bend.
fn bend_problem(particles: BendParticles, positions: &Positions) -> Option<String> {
    let mut sorted = match particles {
        BendParticles::Line(line) => line.to_vec(),
        BendParticles::Cell(cell) => cell.to_vec(),
    };
    sorted.sort_unstable();
    if let Some([twice, ..]) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        return Some(format!("names particle {twice} twice (allowed: different particles)"));
    }
    let has_size = match particles {
        BendParticles::Line([a, b, c]) => {
            positions.distance(a, b) > 0.0 && positions.distance(b, c) > 0.0
        }
        BendParticles::Cell([a, b, c, _]) => {
            area([a, b, c].map(|index| positions.0[index as usize].map(f64::from))) > 0.0
        }
    };
    let problem = match particles {
        BendParticles::Line(_) => {
            "has neighbours that coincide (allowed: neighbours at a distance)"
        }
        BendParticles::Cell(_) => "is a cell without area (allowed: two corners above two corners)",
    };
    (!has_size).then(|| problem.to_owned())
}
