//! The keys of `[[generate]]`, before any check.

use std::ops::Range;

use serde::Deserialize;

use super::super::value::{
    Number, NumberOrPair, Quaternion, Spanned, Table, TableKeys, Tuple, Vector, Whole, Word,
    append, append_elements, element_count,
};

/// The keys of all shapes. The keys of each shape are checked later.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scene::read) struct FileGenerator {
    pub(in crate::scene::read) shape: Option<Word>,
    pub(in crate::scene::read) mass: Option<Number>,
    pub(in crate::scene::read) compliance: Option<Spanned<Table<FileSoftness>>>,
    pub(in crate::scene::read) stiffness: Option<Spanned<Table<FileSoftness>>>,
    pub(in crate::scene::read) tear_stretch: Option<Number>,
    pub(in crate::scene::read) contact: Option<bool>,
    pub(in crate::scene::read) pinned: Option<Spanned<FilePinned>>,
    pub(in crate::scene::read) columns: Option<Whole>,
    pub(in crate::scene::read) rows: Option<Whole>,
    pub(in crate::scene::read) spacing: Option<Number>,
    pub(in crate::scene::read) origin: Option<Vector>,
    pub(in crate::scene::read) right: Option<Vector>,
    pub(in crate::scene::read) down: Option<Vector>,
    pub(in crate::scene::read) folds: Option<Whole>,
    pub(in crate::scene::read) fullness: Option<Number>,
    pub(in crate::scene::read) links: Option<Spanned<Vec<Word>>>,
    pub(in crate::scene::read) diagonals: Option<Whole>,
    pub(in crate::scene::read) bending: Option<Spanned<NumberOrPair>>,
    pub(in crate::scene::read) twist: Option<Spanned<bool>>,
    pub(in crate::scene::read) rest: Option<Word>,
    pub(in crate::scene::read) count: Option<Whole>,
    pub(in crate::scene::read) from: Option<Vector>,
    pub(in crate::scene::read) to: Option<Vector>,
    pub(in crate::scene::read) center: Option<Vector>,
    pub(in crate::scene::read) radius: Option<Number>,
    pub(in crate::scene::read) spokes: Option<Whole>,
    pub(in crate::scene::read) rings: Option<Whole>,
    pub(in crate::scene::read) normal: Option<Vector>,
    pub(in crate::scene::read) planks: Option<Whole>,
    pub(in crate::scene::read) width: Option<Number>,
    pub(in crate::scene::read) height: Option<Number>,
    pub(in crate::scene::read) path: Option<Word>,
    pub(in crate::scene::read) scale: Option<Number>,
    pub(in crate::scene::read) density: Option<Number>,
    pub(in crate::scene::read) vertices: Option<Spanned<Vec<Vector>>>,
    pub(in crate::scene::read) faces: Option<Spanned<Vec<Vec<i64>>>>,
    pub(in crate::scene::read) rotation: Option<Quaternion>,
    pub(in crate::scene::read) uvs: Option<Spanned<Vec<Pair>>>,
    pub(in crate::scene::read) face_uvs: Option<Spanned<Vec<Vec<i64>>>>,
    pub(in crate::scene::read) groups: Option<Spanned<Vec<Spanned<Table<FileNameRun>>>>>,
    pub(in crate::scene::read) materials: Option<Spanned<Vec<Spanned<Table<FileNameRun>>>>>,
}

impl TableKeys for FileGenerator {}

/// Two numbers.
pub(in crate::scene::read) type Pair = Spanned<Tuple<Number, 2>>;

/// The name of the faces from one of them on.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scene::read) struct FileNameRun {
    pub(in crate::scene::read) name: Option<Word>,
    pub(in crate::scene::read) first: Option<Whole>,
}

impl TableKeys for FileNameRun {
    const FORM: &'static str = "a table { name, first }";
}

/// A softness for each kind of constraint.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scene::read) struct FileSoftness {
    pub(in crate::scene::read) structural: Option<Number>,
    pub(in crate::scene::read) shear: Option<Number>,
    pub(in crate::scene::read) bend: Option<Number>,
}

impl TableKeys for FileSoftness {
    const FORM: &'static str = "a table { structural, shear, bend }";
}

/// The pinned particles of a shape: a word, or a list of indices within the shape.
#[derive(Debug, Deserialize)]
#[serde(
    untagged,
    expecting = "is neither a word nor a list of whole numbers (allowed: a word in quotes or a \
                 list of indices)"
)]
pub(in crate::scene::read) enum FilePinned {
    Word(String),
    List(Vec<i64>),
}

impl FilePinned {
    fn list(&self) -> &[i64] {
        match self {
            Self::Word(_) => &[],
            Self::List(list) => list,
        }
    }
}

impl FileGenerator {
    /// The lists that a text can give in parts.
    pub(in crate::scene::read) const LISTS: [&str; 5] =
        ["vertices", "faces", "pinned", "uvs", "face_uvs"];

    /// Appends the lists of a part of the table.
    pub(in crate::scene::read) fn append(&mut self, part: Self) {
        append_elements(self.vertices.as_mut(), part.vertices);
        append_elements(self.faces.as_mut(), part.faces);
        append_elements(self.uvs.as_mut(), part.uvs);
        append_elements(self.face_uvs.as_mut(), part.face_uvs);
        let pinned = self.pinned.as_mut().map(Spanned::get_mut);
        if let (Some(FilePinned::List(list)), Some(FilePinned::List(more))) =
            (pinned, part.pinned.map(Spanned::into_inner))
        {
            append(list, more);
        }
    }

    /// Returns the size of the lists in memory.
    pub(in crate::scene::read) fn lists_size_bytes(&self) -> usize {
        let faces = [&self.faces, &self.face_uvs].into_iter().flatten().flat_map(Spanned::get_ref);
        let pinned = self.pinned.as_ref().map_or(&[][..], |pinned| pinned.get_ref().list());
        element_count(self.vertices.as_ref()) * size_of::<Vector>()
            + element_count(self.uvs.as_ref()) * size_of::<Pair>()
            + faces.map(|face| size_of_val(face) + size_of_val(face.as_slice())).sum::<usize>()
            + size_of_val(pinned)
    }

    /// Returns the places of the keys that belong to single shapes.
    pub(in crate::scene::read) fn shape_keys(&self) -> [(&'static str, Option<Range<usize>>); 34] {
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
            ("folds", span(self.folds.as_ref())),
            ("fullness", span(self.fullness.as_ref())),
            ("links", span(self.links.as_ref())),
            ("diagonals", span(self.diagonals.as_ref())),
            ("bending", span(self.bending.as_ref())),
            ("twist", span(self.twist.as_ref())),
            ("rest", span(self.rest.as_ref())),
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
            ("scale", span(self.scale.as_ref())),
            ("density", span(self.density.as_ref())),
            ("vertices", span(self.vertices.as_ref())),
            ("faces", span(self.faces.as_ref())),
            ("rotation", span(self.rotation.as_ref())),
            ("uvs", span(self.uvs.as_ref())),
            ("face_uvs", span(self.face_uvs.as_ref())),
            ("groups", span(self.groups.as_ref())),
            ("materials", span(self.materials.as_ref())),
        ]
    }
}
