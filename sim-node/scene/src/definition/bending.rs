//! Bending rigidity of sheets and meshes.

use crate::constraints::bends::RestShape;
use crate::fields::{At, Fields, RIGIDITY, printed};

/// Bending of a sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SheetBending {
    /// Bending rigidity B in N m, >= 0.
    pub bending: Rigidity,
    /// Cells resist twisting, too. Then the rigidity is the same in every direction.
    pub twist: bool,
}

/// Bending rigidity, the same for all threads or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rigidity {
    /// Of threads in either direction.
    Equal(f32),
    /// Of the warp, which runs down, and of the weft, which runs across.
    Threads([f32; 2]),
}

impl Rigidity {
    /// Returns the rigidity of the warp and of the weft.
    pub fn threads(self) -> [f32; 2] {
        match self {
            Self::Equal(rigidity) => [rigidity; 2],
            Self::Threads(threads) => threads,
        }
    }

    fn read(at: At<'_>) -> Option<Self> {
        match at.as_list() {
            None if at.is_number() => return at.number(RIGIDITY).map(Self::Equal),
            None => return at.unexpected("a number or 2 numbers"),
            Some(_) => {}
        }
        let [warp, weft] = at.numbers()?.map(|number| number.number(RIGIDITY));
        Some(Self::Threads([warp?, weft?]))
    }

    fn print(&self) -> Option<String> {
        match self {
            Self::Equal(rigidity) => printed(rigidity),
            Self::Threads(threads) => printed(threads),
        }
    }
}

impl SheetBending {
    /// Walks the keys of the bending of a sheet, if it has any.
    pub(crate) fn walk(bending: &mut Option<Self>, fields: &mut Fields<'_>) {
        let mut rigidity = bending.map(|bending| bending.bending);
        let mut twist = bending.map(|bending| bending.twist);
        let read = |at: At<'_>| Rigidity::read(at).map(Some);
        fields.value("bending", &mut rigidity, read, |rigidity| rigidity.as_ref()?.print());
        fields.value(
            "twist",
            &mut twist,
            |at| at.flag().map(Some),
            |twist| printed(twist.as_ref()?),
        );
        needs_bending(fields, "twist");
        *bending = rigidity.map(|bending| {
            let is_equal = matches!(bending, Rigidity::Equal(_));
            Self { bending, twist: twist.unwrap_or(is_equal) }
        });
    }
}

/// Bending of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshBending {
    /// Bending rigidity B in N m, >= 0.
    pub bending: f32,
    /// Shape in which the hinges are at rest.
    pub rest: RestShape,
}

impl MeshBending {
    /// Walks the keys of the bending of a mesh, if it has any.
    pub(crate) fn walk(bending: &mut Option<Self>, fields: &mut Fields<'_>) {
        let words = [("flat", RestShape::Flat), ("loaded", RestShape::Loaded)];
        let mut rigidity = bending.map(|bending| bending.bending);
        let mut rest = bending.map(|bending| bending.rest);
        fields.optional_number("bending", &mut rigidity, RIGIDITY);
        let print = |rest: &Option<RestShape>| {
            let (name, _) = words.iter().find(|(_, word)| Some(*word) == *rest)?;
            printed(*name)
        };
        fields.value("rest", &mut rest, |at| at.word(&words).map(Some), print);
        needs_bending(fields, "rest");
        let rest = rest.unwrap_or(RestShape::Flat);
        *bending = rigidity.map(|bending| Self { bending, rest });
    }
}

/// Refuses a key that has no effect without the key `bending`.
fn needs_bending(fields: &Fields<'_>, key: &'static str) {
    if fields.find(key).is_some() && fields.find("bending").is_none() {
        fields.error(key, "has no effect without bending (allowed: together with bending)");
    }
}
