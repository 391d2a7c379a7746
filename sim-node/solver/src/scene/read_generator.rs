//! From the keys of a generator to a checked one.

use toml::Spanned;

use super::check::{Range32, Reader};
use super::file::{FileGenerator, FilePinned, FileSoftness, Number, Vector, Whole};
use super::generate::{
    CLOTH_PINS, Cloth, Diagonals, Generator, KindSoftness, PerKind, Pinned, ROPE_PINS, Rope, Shape,
};
use super::{ELEMENTS_MAX, SceneError, Softness};
use crate::constraints::ConstraintKind;

impl Reader<'_> {
    /// Checks one `[[generate]]` block.
    pub(super) fn generator(
        &self,
        index: usize,
        file: &FileGenerator,
    ) -> Result<Generator, SceneError> {
        let fields = Fields { reader: self, index, shape: &file.shape };
        let (shape, words) = match file.shape.get_ref().as_str() {
            "cloth" => (fields.cloth(file)?, CLOTH_PINS),
            "rope" => (fields.rope(file)?, ROPE_PINS),
            other => {
                let problem = format!("there is no shape \"{other}\" (allowed: cloth, rope)");
                return self.error(file.shape.span(), &fields.name("shape"), problem);
            }
        };
        let mut generator = Generator {
            shape,
            mass: self.mass(&fields.name("mass"), file.mass.as_ref())?,
            pinned: Pinned::Word(words[0]),
            tear_stretch: match &file.tear_stretch {
                Some(number) => {
                    Some(self.limit(&fields.name("tear_stretch"), number, Range32::RATIO)?)
                }
                None => None,
            },
            softness: fields.softness(file)?,
        };
        if let Some(pinned) = &file.pinned {
            generator.pinned = fields.pinned(pinned, &words, generator.particle_count())?;
        }
        Ok(generator)
    }
}

/// The keys of one generator.
struct Fields<'r, 't> {
    reader: &'r Reader<'t>,
    index: usize,
    shape: &'r Spanned<String>,
}

impl Fields<'_, '_> {
    fn name(&self, key: &str) -> String {
        format!("generate[{}].{key}", self.index)
    }

    fn required<'f, T>(
        &self,
        key: &str,
        value: Option<&'f Spanned<T>>,
    ) -> Result<&'f Spanned<T>, SceneError> {
        let missing = || format!("is missing: a {} needs it", self.shape.get_ref());
        let error = || self.reader.place.error(self.shape.span(), &self.name(key), missing());
        value.ok_or_else(error)
    }

    /// Keys of other shapes are as unknown as any other.
    fn forbidden<T>(&self, key: &str, value: Option<&Spanned<T>>) -> Result<(), SceneError> {
        let Some(value) = value else { return Ok(()) };
        let problem = format!("unknown field of a {} (allowed: remove it)", self.shape.get_ref());
        self.reader.error(value.span(), &self.name(key), problem)
    }

    fn whole(&self, key: &str, value: Option<&Whole>, least: u32) -> Result<u32, SceneError> {
        self.reader.whole(&self.name(key), self.required(key, value)?, least..=ELEMENTS_MAX)
    }

    fn vector(&self, key: &str, value: Option<&Vector>) -> Result<[f32; 3], SceneError> {
        self.reader.vector(&self.name(key), self.required(key, value)?)
    }

    fn cloth(&self, file: &FileGenerator) -> Result<Shape, SceneError> {
        self.forbidden("count", file.count.as_ref())?;
        self.forbidden("from", file.from.as_ref())?;
        self.forbidden("to", file.to.as_ref())?;
        let spacing = self.required("spacing", file.spacing.as_ref())?;
        let vector_or = |key, value: Option<&Vector>, default| {
            self.reader.vector_or(&self.name(key), value, default)
        };
        Ok(Shape::Cloth(Cloth {
            columns: self.whole("columns", file.columns.as_ref(), 1)?,
            rows: self.whole("rows", file.rows.as_ref(), 1)?,
            spacing: self.reader.ranged(&self.name("spacing"), spacing, Range32::POSITIVE)?,
            origin: vector_or("origin", file.origin.as_ref(), [0.0; 3])?,
            right: vector_or("right", file.right.as_ref(), [1.0, 0.0, 0.0])?,
            down: vector_or("down", file.down.as_ref(), [0.0, -1.0, 0.0])?,
            links: self.links(file)?,
            diagonals: self.diagonals(file)?,
        }))
    }

    fn links(&self, file: &FileGenerator) -> Result<Vec<ConstraintKind>, SceneError> {
        let Some(links) = &file.links else {
            return Ok(vec![ConstraintKind::Structural, ConstraintKind::Shear]);
        };
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

    fn rope(&self, file: &FileGenerator) -> Result<Shape, SceneError> {
        self.forbidden("columns", file.columns.as_ref())?;
        self.forbidden("rows", file.rows.as_ref())?;
        self.forbidden("spacing", file.spacing.as_ref())?;
        self.forbidden("origin", file.origin.as_ref())?;
        self.forbidden("right", file.right.as_ref())?;
        self.forbidden("down", file.down.as_ref())?;
        self.forbidden("links", file.links.as_ref())?;
        self.forbidden("diagonals", file.diagonals.as_ref())?;
        Ok(Shape::Rope(Rope {
            count: self.whole("count", file.count.as_ref(), 2)?,
            from: self.vector("from", file.from.as_ref())?,
            to: self.vector("to", file.to.as_ref())?,
        }))
    }

    fn softness(&self, file: &FileGenerator) -> Result<KindSoftness, SceneError> {
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

    fn pinned(
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
