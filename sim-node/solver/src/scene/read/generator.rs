//! The table `[[generate]]`.

mod fields;
pub(super) mod file;
mod mesh;

use sim_types::{ConstraintKind, ELEMENTS_MAX, NumberRange};

use super::reader::Reader;
use super::value::{Spanned, Table};
use crate::scene::error::SceneError;
use crate::scene::generate::bridge::Bridge;
use crate::scene::generate::cloth::{self, Cloth, Diagonals};
use crate::scene::generate::folds::Folds;
use crate::scene::generate::pinned::END_WORDS;
use crate::scene::generate::ragdoll::{self, Ragdoll};
use crate::scene::generate::rope::Rope;
use crate::scene::generate::web::{self, Web};
use crate::scene::generate::{Generator, Shape};
use fields::GeneratorFields;
use file::FileGenerator;

/// Keys and words of a shape.
struct ShapeKeys {
    name: &'static str,
    /// Keys beside those of all shapes.
    keys: &'static [&'static str],
    /// Words for the pinned particles, the default first.
    pins: &'static [&'static str],
}

/// Fullness of gathered sheets: three layers are more than any curtain has.
const FULLNESS: NumberRange =
    NumberRange { min: 1.0, max: 3.0, text: "1 to 3", ..NumberRange::SHARE };
const FULLNESS_DEFAULT: f32 = 2.0;

const SHEET: &[&str] = &[
    "columns",
    "rows",
    "spacing",
    "origin",
    "right",
    "down",
    "folds",
    "fullness",
    "links",
    "diagonals",
    "bending",
    "twist",
];
static SHAPES: [ShapeKeys; 7] = [
    ShapeKeys { name: "cloth", keys: SHEET, pins: &cloth::PIN_WORDS },
    ShapeKeys { name: "mesh", keys: SHEET, pins: &["none", "top", "top-even", "corners"] },
    ShapeKeys { name: "rope", keys: &["count", "from", "to", "bending"], pins: &END_WORDS },
    ShapeKeys {
        name: "web",
        keys: &["center", "radius", "spokes", "rings", "normal"],
        pins: &web::PIN_WORDS,
    },
    ShapeKeys {
        name: "bridge",
        keys: &["from", "to", "planks", "width"],
        pins: &["both", "first", "last", "none"],
    },
    ShapeKeys { name: "ragdoll", keys: &["origin", "height"], pins: &ragdoll::PIN_WORDS },
    ShapeKeys {
        name: "obj",
        keys: &[
            "path",
            "vertices",
            "faces",
            "scale",
            "rotation",
            "origin",
            "density",
            "bending",
            "rest",
            "uvs",
            "face_uvs",
            "groups",
            "materials",
        ],
        pins: &["none"],
    },
];

impl Reader<'_> {
    /// Checks a table `[[generate]]`.
    pub(super) fn generator(
        &self,
        index: usize,
        table: &Spanned<Table<FileGenerator>>,
    ) -> Result<Generator, SceneError> {
        let fields =
            GeneratorFields { reader: self, file: table.get_ref(), index, span: table.span() };
        let known = fields.known_shape()?;
        if known.name == "obj" {
            return fields.obj();
        }
        let shape = fields.shape(known.name)?;
        Ok(Generator {
            mass: fields.mass()?,
            pinned: fields.pinned(known.pins, shape.particle_count())?,
            tear_stretch: fields.tear_stretch()?,
            contact: fields.file.contact.unwrap_or(true),
            softness: fields.softness()?,
            shape,
        })
    }
}

impl GeneratorFields<'_, '_> {
    /// Returns the shape with this name. Keys of other shapes are errors.
    fn known_shape(&self) -> Result<&'static ShapeKeys, SceneError> {
        let names = SHAPES.each_ref().map(|shape| (shape.name, shape));
        let allowed = names.map(|(name, _)| name).join(", ");
        let name = self.required("shape", self.file.shape.as_ref(), &allowed)?;
        let known = self.reader.word(&self.name("shape"), name, &names)?;
        for (key, span) in self.file.shape_keys() {
            let Some(span) = span.filter(|_| !known.keys.contains(&key)) else { continue };
            let owners = SHAPES.iter().filter(|shape| shape.keys.contains(&key));
            let owners: Vec<_> = owners.map(|shape| shape.name).collect();
            let problem = format!(
                "unknown key of the shape {}, a key of {} (allowed: {} and the keys of every shape)",
                known.name,
                owners.join(", "),
                known.keys.join(", ")
            );
            return self.reader.error(span, &self.name(key), problem);
        }
        Ok(known)
    }

    fn shape(&self, name: &str) -> Result<Shape, SceneError> {
        use ConstraintKind::{Bend, Shear, Structural};
        let file = self.file;
        Ok(match name {
            "cloth" => Shape::Cloth(self.cloth(&[Structural, Shear])?),
            "mesh" => Shape::Mesh(self.cloth(&[Structural, Shear, Bend])?),
            "rope" => Shape::Rope(Rope {
                count: self.count("count", file.count.as_ref(), 2)?,
                from: self.vector("from", file.from.as_ref())?,
                to: self.vector("to", file.to.as_ref())?,
                bending: self.single_bending()?,
            }),
            "web" => Shape::Web(self.web()?),
            "bridge" => Shape::Bridge(self.bridge()?),
            _ => Shape::Ragdoll(Ragdoll {
                origin: self.vector_or("origin", file.origin.as_ref(), [0.0; 3])?,
                height: self.size("height", file.height.as_ref())?,
            }),
        })
    }

    fn web(&self) -> Result<Web, SceneError> {
        let file = self.file;
        let normal = file.normal.as_ref();
        let normal = normal.map(|normal| self.reader.normal(&self.name("normal"), normal));
        Ok(Web {
            center: self.vector_or("center", file.center.as_ref(), [0.0; 3])?,
            radius: self.size("radius", file.radius.as_ref())?,
            spokes: self.count("spokes", file.spokes.as_ref(), 3)?,
            rings: self.count("rings", file.rings.as_ref(), 1)?,
            normal: normal.transpose()?.unwrap_or([0.0, 0.0, 1.0]),
        })
    }

    fn bridge(&self) -> Result<Bridge, SceneError> {
        let file = self.file;
        if self.reader.is_planar {
            let problem = "a bridge needs 3 dimensions (allowed: all other shapes)";
            return self.reader.error(self.span.clone(), &self.name("shape"), problem);
        }
        Ok(Bridge {
            from: self.vector("from", file.from.as_ref())?,
            to: self.vector("to", file.to.as_ref())?,
            planks: self.count("planks", file.planks.as_ref(), 2)?,
            width: self.size("width", file.width.as_ref())?,
        })
    }

    fn cloth(&self, default_links: &[ConstraintKind]) -> Result<Cloth, SceneError> {
        let file = self.file;
        Ok(Cloth {
            columns: self.count("columns", file.columns.as_ref(), 1)?,
            rows: self.count("rows", file.rows.as_ref(), 1)?,
            spacing: self.number("spacing", file.spacing.as_ref(), NumberRange::POSITIVE)?,
            origin: self.vector_or("origin", file.origin.as_ref(), [0.0; 3])?,
            right: self.vector_or("right", file.right.as_ref(), [1.0, 0.0, 0.0])?,
            down: self.vector_or("down", file.down.as_ref(), [0.0, -1.0, 0.0])?,
            folds: self.folds()?,
            links: self.links(default_links)?,
            diagonals: self.diagonals()?,
            bending: self.sheet_bending()?,
        })
    }

    /// Returns the folds of a sheet, if it has any.
    fn folds(&self) -> Result<Option<Folds>, SceneError> {
        let Self { file, reader, .. } = self;
        let Some(folds) = &file.folds else {
            let Some(fullness) = &file.fullness else { return Ok(None) };
            let problem = "fullness needs folds (allowed: both or neither)";
            return reader.error(fullness.span(), &self.name("fullness"), problem);
        };
        if reader.is_planar {
            let problem = "folds need 3 dimensions (allowed: no folds)";
            return reader.error(folds.span(), &self.name("folds"), problem);
        }
        let count = reader.whole(&self.name("folds"), folds, 1..=ELEMENTS_MAX)?;
        let fullness = match &file.fullness {
            Some(fullness) => reader.ranged(&self.name("fullness"), fullness, FULLNESS)?,
            None => FULLNESS_DEFAULT,
        };
        Ok(Some(Folds { count, fullness }))
    }

    /// Returns the kinds of constraints in a sheet, ascending and without duplicates.
    fn links(&self, default: &[ConstraintKind]) -> Result<Vec<ConstraintKind>, SceneError> {
        use ConstraintKind::{Bend, Shear, Structural};
        let Some(links) = &self.file.links else { return Ok(default.to_vec()) };
        let known = [Structural, Shear, Bend].map(|kind| (kind.name(), kind));
        let kind = |word| self.reader.word(&self.name("links"), word, &known);
        let mut kinds = links.get_ref().iter().map(kind).collect::<Result<Vec<_>, _>>()?;
        kinds.sort_unstable_by_key(|kind| *kind as u32);
        kinds.dedup();
        Ok(kinds)
    }

    fn diagonals(&self) -> Result<Diagonals, SceneError> {
        let Some(diagonals) = &self.file.diagonals else { return Ok(Diagonals::Two) };
        let is_one = self.reader.whole(&self.name("diagonals"), diagonals, 1..=2)? == 1;
        Ok(if is_one { Diagonals::One } else { Diagonals::Two })
    }
}
