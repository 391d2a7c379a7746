//! The layout of a row in memory.

use crate::store::layout::Layout;

/// Numbers in a cache line.
pub(crate) const LINE_LENGTH: usize = 16;

/// Number of fields at the beginning of every row: position, inverse mass, displacement.
pub(crate) const STATE_FIELDS: usize = 7;

/// Number of fields of each tether of a particle.
pub(crate) const TETHER_FIELDS: usize = 5;

/// The layout of rows, which all are alike.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowLayout {
    /// Number of the first particle.
    pub(crate) first: usize,
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    /// Length of a field in numbers.
    pub(crate) stride: usize,
    pub(crate) fields: Layout,
    /// Number of fields before the constraints.
    pub(crate) constraints_at: usize,
    /// Length of a row in numbers.
    pub(crate) length: usize,
}

impl RowLayout {
    /// The layout of rows without fields.
    pub(crate) fn new(first: usize, [rows, columns]: [usize; 2], stride: usize) -> Self {
        let fields = Layout::default();
        Self { first, columns, rows, stride, fields, constraints_at: 0, length: 0 }
    }

    /// Sets the fields, for rows without constraints. The results are stored, because every row needs them.
    pub(crate) fn set_fields(&mut self, fields: Layout) {
        self.fields = fields;
        self.constraints_at = self.root_at(fields.scene.tethers);
        self.length = self.constraints_at * self.stride;
    }

    /// Number of fields before the velocity that the wind adds.
    pub(crate) fn wind_at(&self) -> usize {
        STATE_FIELDS + 3 * usize::from(self.fields.scene.bounces)
    }

    /// Number of fields before the root of a tether.
    pub(crate) fn root_at(&self, slot: usize) -> usize {
        self.wind_at() + 3 * usize::from(self.fields.scene.wind) + TETHER_FIELDS * slot
    }
}
