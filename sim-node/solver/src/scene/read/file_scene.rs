//! The scene file before any check.

use serde::Deserialize;

use super::anchor::FileAnchor;
use super::collider::FileCollider;
use super::contact::FileContact;
use super::element::{FileBend, FileConstraint, FileParticle};
use super::generator::file::FileGenerator;
use super::settings::FileSolver;
use super::value::{Spanned, Table, Tables, Vector, Whole, Word, append};
use super::wind::FileWind;

/// The scene file before any check. Every key is optional, and every value has its place in the
/// text.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileScene {
    pub(super) version: Option<Whole>,
    pub(super) name: Option<Word>,
    pub(super) origin: Option<Vector>,
    pub(super) dimensions: Option<Whole>,
    pub(super) up: Option<Word>,
    pub(super) unit: Option<String>,
    pub(super) gravity: Option<Vector>,
    pub(super) solver: Option<Table<FileSolver>>,
    pub(super) wind: Option<Table<FileWind>>,
    pub(super) contact: Option<Spanned<Table<FileContact>>>,
    #[serde(default)]
    pub(super) particle: Tables<FileParticle>,
    #[serde(default)]
    pub(super) constraint: Tables<FileConstraint>,
    #[serde(default)]
    pub(super) bend: Tables<FileBend>,
    #[serde(default)]
    pub(super) collider: Tables<FileCollider>,
    #[serde(default)]
    pub(super) anchor: Tables<FileAnchor>,
    #[serde(default)]
    pub(super) generate: Tables<FileGenerator>,
}

impl FileScene {
    /// Appends a later part of the text. Except for lists of tables, a key occurs in one part only.
    pub(super) fn append(&mut self, part: Self) {
        self.version = self.version.take().or(part.version);
        self.name = self.name.take().or(part.name);
        self.origin = self.origin.take().or(part.origin);
        self.dimensions = self.dimensions.take().or(part.dimensions);
        self.up = self.up.take().or(part.up);
        self.unit = self.unit.take().or(part.unit);
        self.gravity = self.gravity.take().or(part.gravity);
        self.solver = self.solver.take().or(part.solver);
        self.wind = self.wind.take().or(part.wind);
        self.contact = self.contact.take().or(part.contact);
        append(&mut self.particle, part.particle);
        append(&mut self.constraint, part.constraint);
        append(&mut self.bend, part.bend);
        append(&mut self.collider, part.collider);
        append(&mut self.anchor, part.anchor);
        append(&mut self.generate, part.generate);
    }

    /// Moves the elements of the first anchor of a later part to the lists of the last one.
    pub(super) fn continue_anchor(&mut self, part: &mut Self) {
        if let Some(last) = self.anchor.last_mut() {
            last.get_mut().0.append(part.anchor.remove(0).into_inner().0);
        }
    }

    /// Moves the elements of the first generator of a later part to the lists of the last one.
    pub(super) fn continue_generator(&mut self, part: &mut Self) {
        if let Some(last) = self.generate.last_mut() {
            last.get_mut().0.append(part.generate.remove(0).into_inner().0);
        }
    }

    /// Moves the elements of the first collider of a later part to the lists of the last one.
    pub(super) fn continue_collider(&mut self, part: &mut Self) {
        if let Some(last) = self.collider.last_mut() {
            last.get_mut().0.append(part.collider.remove(0).into_inner().0);
        }
    }

    /// Returns the number of tables in a list of tables.
    pub(super) fn table_count(&self, list: &str) -> usize {
        match list {
            "particle" => self.particle.len(),
            "constraint" => self.constraint.len(),
            "bend" => self.bend.len(),
            "collider" => self.collider.len(),
            "anchor" => self.anchor.len(),
            "generate" => self.generate.len(),
            _ => 0,
        }
    }

    /// Returns the number of points in the path of the last anchor.
    pub(super) fn last_point_count(&self) -> usize {
        self.anchor.last().map_or(0, |anchor| anchor.get_ref().point_count())
    }

    /// Returns the size of all tables and lists in memory.
    pub(super) fn size_bytes(&self) -> usize {
        let anchors = self.anchor.iter().map(|anchor| anchor.get_ref().lists_size_bytes());
        let colliders = self.collider.iter().map(|one| one.get_ref().lists_size_bytes());
        let generators = self.generate.iter().map(|shape| shape.get_ref().lists_size_bytes());
        size_of_val(self.particle.as_slice())
            + size_of_val(self.constraint.as_slice())
            + size_of_val(self.bend.as_slice())
            + size_of_val(self.collider.as_slice())
            + size_of_val(self.anchor.as_slice())
            + size_of_val(self.generate.as_slice())
            + anchors.sum::<usize>()
            + colliders.sum::<usize>()
            + generators.sum::<usize>()
    }
}
