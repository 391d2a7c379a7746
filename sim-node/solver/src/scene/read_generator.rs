//! From the keys of a generator to a checked one.

use std::ops::Range;

use toml::Spanned;

use super::check::{Range32, Reader};
use super::file::{FileGenerator, FilePinned, FileSoftness, Number, Vector, Whole};
use super::generate::{
    Bridge, Cloth, Diagonals, Generator, KindSoftness, PerKind, Pinned, Ragdoll, Rope, Shape, Web,
    cloth, ragdoll, rope, web,
};
use super::{ELEMENTS_MAX, SceneError, Softness};
use sim_types::ConstraintKind;

/// A shape: its keys, and the words for what of it is pinned, the default first.
struct ShapeKeys {
    name: &'static str,
    keys: &'static [&'static str],
    pins: &'static [&'static str],
}

const SHEET: &[&str] =
    &["columns", "rows", "spacing", "origin", "right", "down", "links", "diagonals"];
const SHAPES: [ShapeKeys; 7] = [
    ShapeKeys { name: "cloth", keys: SHEET, pins: &cloth::PINS },
    ShapeKeys { name: "mesh", keys: SHEET, pins: &["none", "top", "top-even", "corners"] },
    ShapeKeys { name: "rope", keys: &["count", "from", "to"], pins: &rope::PINS },
    ShapeKeys {
        name: "web",
        keys: &["center", "radius", "spokes", "rings", "normal"],
        pins: &web::PINS,
    },
    ShapeKeys {
        name: "bridge",
        keys: &["from", "to", "planks", "width"],
        pins: &["both", "first", "last", "none"],
    },
    ShapeKeys { name: "ragdoll", keys: &["origin", "height"], pins: &ragdoll::PINS },
    ShapeKeys { name: "obj", keys: &["path", "density", "vertices", "faces"], pins: &["none"] },
];

impl FileGenerator {
    /// Where each of the shapes' own keys stands, if it does.
    fn own_keys(&self) -> [(&'static str, Option<Range<usize>>); 23] {
        fn span<T>(value: Option<&Spanned<T>>) -> Option<Range<usize>> {
            value.map(Spanned::span)
        }
        [
            ("columns", span(self.columns.as_ref())),
            ("rows", span(self.rows.as_ref())),
            ("spacing", span(self.spacing.as_ref())),
            ("origin", span(self.origin.as_ref())),
            ("right", span(self.right.as_ref())),
            ("down", span(self.down.as_ref())),
            ("links", span(self.links.as_ref())),
            ("diagonals", span(self.diagonals.as_ref())),
            ("count", span(self.count.as_ref())),
            ("from", span(self.from.as_ref())),
            ("to", span(self.to.as_ref())),
            ("center", span(self.center.as_ref())),
            ("radius", span(self.radius.as_ref())),
            ("spokes", span(self.spokes.as_ref())),
            ("rings", span(self.rings.as_ref())),
            ("normal", span(self.normal.as_ref())),
            ("planks", span(self.planks.as_ref())),
            ("width", span(self.width.as_ref())),
            ("height", span(self.height.as_ref())),
            ("path", span(self.path.as_ref())),
            ("density", span(self.density.as_ref())),
            ("vertices", span(self.vertices.as_ref())),
            ("faces", span(self.faces.as_ref())),
        ]
    }
}

impl Reader<'_> {
    /// Checks one `[[generate]]` block.
    pub(super) fn generator(
        &self,
        index: usize,
        file: &FileGenerator,
    ) -> Result<Generator, SceneError> {
        let fields = Fields { reader: self, index, shape: &file.shape };
        let known = fields.known_shape(file)?;
        if known.name == "obj" {
            return fields.obj(file);
        }
        let mut generator = Generator {
            shape: fields.shape(file)?,
            mass: self.mass(&fields.name("mass"), file.mass.as_ref())?,
            pinned: Pinned::Word(known.pins[0]),
            tear_stretch: fields.tear_stretch(file)?,
            softness: fields.softness(file)?,
        };
        if let Some(pinned) = &file.pinned {
            generator.pinned = fields.pinned(pinned, known.pins, generator.particle_count())?;
        }
        Ok(generator)
    }
}

/// The keys of one generator.
pub(super) struct Fields<'r, 't> {
    pub(super) reader: &'r Reader<'t>,
    index: usize,
    pub(super) shape: &'r Spanned<String>,
}

impl Fields<'_, '_> {
    pub(super) fn name(&self, key: &str) -> String {
        format!("generate[{}].{key}", self.index)
    }

    pub(super) fn required<'f, T>(
        &self,
        key: &str,
        value: Option<&'f Spanned<T>>,
    ) -> Result<&'f Spanned<T>, SceneError> {
        let missing = || format!("is missing: a {} needs it", self.shape.get_ref());
        let error = || self.reader.place.error(self.shape.span(), &self.name(key), missing());
        value.ok_or_else(error)
    }

    /// The shape by its name. Keys of other shapes are as unknown as any other.
    fn known_shape(&self, file: &FileGenerator) -> Result<&'static ShapeKeys, SceneError> {
        static KNOWN: &[ShapeKeys] = &SHAPES;
        let name = self.shape.get_ref().as_str();
        let Some(known) = KNOWN.iter().find(|shape| shape.name == name) else {
            let names: Vec<_> = KNOWN.iter().map(|shape| shape.name).collect();
            let problem = format!("there is no shape \"{name}\" (allowed: {})", names.join(", "));
            return self.reader.error(self.shape.span(), &self.name("shape"), problem);
        };
        for (key, span) in file.own_keys() {
            let Some(span) = span.filter(|_| !known.keys.contains(&key)) else { continue };
            let problem = format!("unknown field of a {name} (allowed: {})", known.keys.join(", "));
            return self.reader.error(span, &self.name(key), problem);
        }
        Ok(known)
    }

    fn shape(&self, file: &FileGenerator) -> Result<Shape, SceneError> {
        use ConstraintKind::{Bend, Shear, Structural};
        Ok(match self.shape.get_ref().as_str() {
            "cloth" => Shape::Cloth(self.cloth(file, &[Structural, Shear])?),
            "mesh" => Shape::Mesh(self.cloth(file, &[Structural, Shear, Bend])?),
            "rope" => Shape::Rope(Rope {
                count: self.whole("count", file.count.as_ref(), 2)?,
                from: self.vector("from", file.from.as_ref())?,
                to: self.vector("to", file.to.as_ref())?,
            }),
            "web" => Shape::Web(self.web(file)?),
            "bridge" => Shape::Bridge(self.bridge(file)?),
            _ => Shape::Ragdoll(Ragdoll {
                origin: self.vector_or("origin", file.origin.as_ref(), [0.0; 3])?,
                height: self.size("height", file.height.as_ref())?,
            }),
        })
    }

    pub(super) fn tear_stretch(&self, file: &FileGenerator) -> Result<Option<f32>, SceneError> {
        let Some(number) = &file.tear_stretch else { return Ok(None) };
        self.reader.limit(&self.name("tear_stretch"), number, Range32::RATIO).map(Some)
    }

    fn size(&self, key: &str, value: Option<&Number>) -> Result<f32, SceneError> {
        self.reader.ranged(&self.name(key), self.required(key, value)?, Range32::SIZE)
    }

    fn vector_or(
        &self,
        key: &str,
        value: Option<&Vector>,
        default: [f32; 3],
    ) -> Result<[f32; 3], SceneError> {
        self.reader.vector_or(&self.name(key), value, default)
    }

    fn web(&self, file: &FileGenerator) -> Result<Web, SceneError> {
        let normal = self.vector_or("normal", file.normal.as_ref(), [0.0, 0.0, 1.0])?;
        if let Some(given) = file.normal.as_ref().filter(|_| normal == [0.0; 3]) {
            let problem = "has no direction (allowed: not all 0)".to_owned();
            return self.reader.error(given.span(), &self.name("normal"), problem);
        }
        Ok(Web {
            center: self.vector_or("center", file.center.as_ref(), [0.0; 3])?,
            radius: self.size("radius", file.radius.as_ref())?,
            spokes: self.whole("spokes", file.spokes.as_ref(), 3)?,
            rings: self.whole("rings", file.rings.as_ref(), 1)?,
            normal,
        })
    }

    fn bridge(&self, file: &FileGenerator) -> Result<Bridge, SceneError> {
        if self.reader.is_planar {
            let problem = "a bridge is as wide as long (allowed: 3 dimensions)".to_owned();
            return self.reader.error(self.shape.span(), &self.name("shape"), problem);
        }
        Ok(Bridge {
            from: self.vector("from", file.from.as_ref())?,
            to: self.vector("to", file.to.as_ref())?,
            planks: self.whole("planks", file.planks.as_ref(), 2)?,
            width: self.size("width", file.width.as_ref())?,
        })
    }

    fn whole(&self, key: &str, value: Option<&Whole>, least: u32) -> Result<u32, SceneError> {
        self.reader.whole(&self.name(key), self.required(key, value)?, least..=ELEMENTS_MAX)
    }

    fn vector(&self, key: &str, value: Option<&Vector>) -> Result<[f32; 3], SceneError> {
        self.reader.vector(&self.name(key), self.required(key, value)?)
    }

    fn cloth(
        &self,
        file: &FileGenerator,
        default_links: &[ConstraintKind],
    ) -> Result<Cloth, SceneError> {
        let spacing = self.required("spacing", file.spacing.as_ref())?;
        Ok(Cloth {
            columns: self.whole("columns", file.columns.as_ref(), 1)?,
            rows: self.whole("rows", file.rows.as_ref(), 1)?,
            spacing: self.reader.ranged(&self.name("spacing"), spacing, Range32::POSITIVE)?,
            origin: self.vector_or("origin", file.origin.as_ref(), [0.0; 3])?,
            right: self.vector_or("right", file.right.as_ref(), [1.0, 0.0, 0.0])?,
            down: self.vector_or("down", file.down.as_ref(), [0.0, -1.0, 0.0])?,
            links: self.links(file, default_links)?,
            diagonals: self.diagonals(file)?,
        })
    }

    fn links(
        &self,
        file: &FileGenerator,
        default: &[ConstraintKind],
    ) -> Result<Vec<ConstraintKind>, SceneError> {
        let Some(links) = &file.links else { return Ok(default.to_vec()) };
        if links.get_ref().contains(&ConstraintKind::Tether) {
            let problem = "a cloth makes no tethers (allowed: structural, shear, bend)".to_owned();
            return self.reader.error(links.span(), &self.name("links"), problem);
        }
        let mut kinds = links.get_ref().clone();
        kinds.sort_unstable_by_key(|kind| *kind as u32);
        kinds.dedup();
        Ok(kinds)
    }

    fn diagonals(&self, file: &FileGenerator) -> Result<Diagonals, SceneError> {
        let Some(diagonals) = &file.diagonals else { return Ok(Diagonals::Two) };
        let one = self.reader.whole(&self.name("diagonals"), diagonals, 1..=2)? == 1;
        Ok(if one { Diagonals::One } else { Diagonals::Two })
    }

    pub(super) fn softness(&self, file: &FileGenerator) -> Result<KindSoftness, SceneError> {
        let reader = self.reader;
        let key = reader.softness_key(
            |key| self.name(key),
            file.compliance.as_ref(),
            file.stiffness.as_ref(),
        )?;
        let Some((name, table)) = key else { return Ok(KindSoftness::rigid(reader.method)) };
        let FileSoftness { structural, shear, bend } = table.get_ref();
        let value = |kind: &str, number: &Option<Number>| match number {
            Some(number) => reader.softness(&self.name(&format!("{name}.{kind}")), number),
            None => Ok(Softness::rigid(reader.method).value()),
        };
        let per_kind = PerKind {
            structural: value("structural", structural)?,
            shear: value("shear", shear)?,
            bend: value("bend", bend)?,
        };
        Ok(KindSoftness::new(reader.method, per_kind))
    }

    pub(super) fn pinned(
        &self,
        pinned: &Spanned<FilePinned>,
        words: &[&'static str],
        count: u64,
    ) -> Result<Pinned, SceneError> {
        let problem = match pinned.get_ref() {
            FilePinned::Word(word) => match words.iter().find(|known| *known == word) {
                Some(known) => return Ok(Pinned::Word(known)),
                None => format!(
                    "\"{word}\" is no choice (allowed: {} or a list of indices)",
                    words.join(", ")
                ),
            },
            FilePinned::List(list) => match list.iter().find(|index| u64::from(**index) >= count) {
                None => {
                    let mut list = list.clone();
                    list.sort_unstable();
                    list.dedup();
                    return Ok(Pinned::List(list));
                }
                Some(index) => {
                    format!("the shape has no particle {index} (allowed: 0 to {})", count - 1)
                }
            },
        };
        self.reader.error(pinned.span(), &self.name("pinned"), problem)
    }
}
