//! Checks of single keys of a generator.

use std::ops::Range;

use sim_types::{ELEMENTS_MAX, NumberRange, Parameter};

use super::super::reader::{RIGIDITY, Reader, SIZE};
use super::super::value::{Number, NumberOrPair, Vector, Whole};
use super::file::{FileGenerator, FilePinned, FileSoftness};
use crate::constraints::bends::RestShape;
use crate::scene::definition::bending::{MeshBending, Rigidity, SheetBending};
use crate::scene::definition::softness::{KindSoftness, Softness, SoftnessValues};
use crate::scene::error::SceneError;
use crate::scene::generate::pinned::Pinned;

/// The keys of one generator.
pub(super) struct GeneratorFields<'r, 't> {
    pub(super) reader: &'r Reader<'t>,
    pub(super) file: &'r FileGenerator,
    pub(super) index: usize,
    /// Place of the table in the text.
    pub(super) span: Range<usize>,
}

impl GeneratorFields<'_, '_> {
    /// Returns the path of a key.
    pub(super) fn name(&self, key: &str) -> String {
        format!("generate[{}].{key}", self.index)
    }

    pub(super) fn required<'f, T>(
        &self,
        key: &str,
        value: Option<&'f T>,
        allowed: &str,
    ) -> Result<&'f T, SceneError> {
        self.reader.required(value, self.span.clone(), &self.name(key), allowed)
    }

    /// Returns a required number in a range.
    pub(super) fn number(
        &self,
        key: &str,
        value: Option<&Number>,
        range: NumberRange,
    ) -> Result<f32, SceneError> {
        self.reader.ranged(&self.name(key), self.required(key, value, range.text)?, range)
    }

    /// Returns a required size.
    pub(super) fn size(&self, key: &str, value: Option<&Number>) -> Result<f32, SceneError> {
        self.number(key, value, SIZE)
    }

    /// Returns a required count of at least `min`.
    pub(super) fn count(
        &self,
        key: &str,
        value: Option<&Whole>,
        min: u32,
    ) -> Result<u32, SceneError> {
        let value = self.required(key, value, &format!("a whole number >= {min}"))?;
        self.reader.whole(&self.name(key), value, min..=ELEMENTS_MAX)
    }

    /// Returns a required vector.
    pub(super) fn vector(&self, key: &str, value: Option<&Vector>) -> Result<[f32; 3], SceneError> {
        let value = self.required(key, value, "three numbers")?;
        self.reader.vector(&self.name(key), value)
    }

    pub(super) fn vector_or(
        &self,
        key: &str,
        value: Option<&Vector>,
        default: [f32; 3],
    ) -> Result<[f32; 3], SceneError> {
        self.reader.vector_or(&self.name(key), value, default)
    }

    pub(super) fn mass(&self) -> Result<f32, SceneError> {
        self.reader.mass(&self.name("mass"), self.file.mass.as_ref())
    }

    pub(super) fn tear_stretch(&self) -> Result<Option<f32>, SceneError> {
        let Some(number) = &self.file.tear_stretch else { return Ok(None) };
        let field = self.name("tear_stretch");
        self.reader.limit(&field, number, Parameter::TearStretch).map(Some)
    }

    pub(super) fn softness(&self) -> Result<KindSoftness, SceneError> {
        let reader = self.reader;
        let (compliance, stiffness) = (self.file.compliance.as_ref(), self.file.stiffness.as_ref());
        let key = reader.softness_key(|key| self.name(key), compliance, stiffness)?;
        let Some((name, table)) = key else { return Ok(KindSoftness::rigid(reader.method)) };
        let FileSoftness { structural, shear, bend } = &**table.get_ref();
        let value = |kind: &str, number: &Option<Number>| match number {
            Some(number) => reader.softness(&self.name(&format!("{name}.{kind}")), number),
            None => Ok(Softness::rigid(reader.method).value()),
        };
        let values = SoftnessValues {
            structural: value("structural", structural)?,
            shear: value("shear", shear)?,
            bend: value("bend", bend)?,
        };
        Ok(KindSoftness::new(reader.method, values))
    }

    /// Returns the bending rigidity of a sheet, if it has any.
    pub(super) fn sheet_bending(&self) -> Result<Option<SheetBending>, SceneError> {
        let Some(bending) = &self.file.bending else {
            let Some(twist) = &self.file.twist else { return Ok(None) };
            let problem = "has no effect without bending (allowed: together with bending)";
            return self.reader.error(twist.span(), &self.name("twist"), problem);
        };
        let rigidity = |number: &Number| self.rigidity(number);
        let rigidity = match bending.get_ref() {
            NumberOrPair::Number(number) => Rigidity::Equal(rigidity(&bending.with(*number))?),
            NumberOrPair::Pair(pair) => {
                let [warp, weft] = &**pair;
                Rigidity::Threads([rigidity(warp)?, rigidity(weft)?])
            }
        };
        let is_equal = matches!(rigidity, Rigidity::Equal(_));
        let twist = self.file.twist.as_ref().map_or(is_equal, |twist| *twist.get_ref());
        Ok(Some(SheetBending { bending: rigidity, twist }))
    }

    /// Returns the bending rigidity of a mesh, if it has any.
    pub(super) fn mesh_bending(&self) -> Result<Option<MeshBending>, SceneError> {
        let rest = self.file.rest.as_ref();
        let Some(bending) = self.single_bending()? else {
            let Some(rest) = rest else { return Ok(None) };
            let problem = "has no effect without bending (allowed: together with bending)";
            return self.reader.error(rest.span(), &self.name("rest"), problem);
        };
        let words = [("flat", RestShape::Flat), ("loaded", RestShape::Loaded)];
        let rest = rest.map(|word| self.reader.word(&self.name("rest"), word, &words));
        Ok(Some(MeshBending { bending, rest: rest.transpose()?.unwrap_or(RestShape::Flat) }))
    }

    /// Returns the bending rigidity of a shape without directions, if it has any.
    pub(super) fn single_bending(&self) -> Result<Option<f32>, SceneError> {
        let Some(bending) = &self.file.bending else { return Ok(None) };
        match bending.get_ref() {
            NumberOrPair::Number(number) => self.rigidity(&bending.with(*number)).map(Some),
            NumberOrPair::Pair(_) => {
                let problem = format!("has 2 entries (allowed: {})", RIGIDITY.text);
                self.reader.error(bending.span(), &self.name("bending"), problem)
            }
        }
    }

    fn rigidity(&self, number: &Number) -> Result<f32, SceneError> {
        self.reader.ranged(&self.name("bending"), number, RIGIDITY)
    }

    /// Returns the pinned particles of a shape of `count` particles. The first word is the default.
    pub(super) fn pinned(&self, words: &[&'static str], count: u64) -> Result<Pinned, SceneError> {
        let Some(pinned) = &self.file.pinned else { return Ok(Pinned::Word(words[0])) };
        let problem = match pinned.get_ref() {
            FilePinned::Word(word) => match words.iter().find(|known| *known == word) {
                Some(known) => return Ok(Pinned::Word(known)),
                None => format!(
                    "\"{word}\" is unknown (allowed: {} or a list of indices)",
                    words.join(", ")
                ),
            },
            FilePinned::List(list) => match indices_below(list, count) {
                Ok(list) => return Ok(Pinned::List(list)),
                Err(index) => format!("{index} is out of range (allowed: 0 to {})", count - 1),
            },
        };
        self.reader.error(pinned.span(), &self.name("pinned"), problem)
    }
}

/// Returns the indices ascending and without duplicates, or the first that is not below `count`.
fn indices_below(list: &[i64], count: u64) -> Result<Vec<u32>, i64> {
    let index = |index: &i64| match u32::try_from(*index) {
        Ok(small) if u64::from(small) < count => Ok(small),
        _ => Err(*index),
    };
    let mut list = list.iter().map(index).collect::<Result<Vec<_>, _>>()?;
    list.sort_unstable();
    list.dedup();
    Ok(list)
}
