//! A change of a record.

/// Channel, sequence and two times.
pub(super) const MESSAGE_HEADER_SIZE_BYTES: usize = 22;

/// A change of one record.
pub(super) struct Edit {
    /// The topic, or the kind of record.
    pub(super) place: String,
    /// The value that was changed.
    pub(super) what: String,
    pub(super) original: Vec<u8>,
    pub(super) bytes: Vec<u8>,
}

/// A change within a record.
pub(super) struct Change {
    pub(super) what: String,
    pub(super) bytes: Vec<u8>,
}

impl Change {
    pub(super) fn new(what: &str, bytes: Vec<u8>) -> Self {
        Self { what: what.to_owned(), bytes }
    }
}
